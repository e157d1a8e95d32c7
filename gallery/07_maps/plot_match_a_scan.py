"""
Place a scan on the whole
=========================

What a scanner sees from one side is matched to the whole animal in another pose. Each point has a
probability that it is right.
"""

import numpy as np

import eigenshape as es

animal = es.make_creature("quadruped", 0, n_vertices=1200)
posed = es.make_creature("quadruped", 4, n_vertices=1200)
scan = es.partial_scan(posed, [0.7, 0.3, 0.7]).mesh
match = es.match_shapes(scan, animal)
es.plot.figure_match(scan, animal, match)

# %%
# Where the map is sure.

print(f"{np.mean(match.confidence > 0.8):.0%} of the vertices are right with a probability of 0.8")
es.figure_field(scan, match.confidence, "probability that the point is right", limits=(0, 1))
