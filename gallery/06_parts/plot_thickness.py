"""
Feature points of other functions
=================================

Feature points are maxima of a function, of any. The mean distance to all other points is largest at
the ends of limbs, too.
"""

import numpy as np

import eigenshape as es

ant = es.make_creature("ant", n_vertices=2000)
distance = es.geometry.average_geodesic_distance(ant)
curvature = es.geometry.gaussian_curvature(ant)
size = es.geometry.surface_area(ant)
fields = {
    "mean distance": (ant, distance / distance.max()),
    "curvature": (ant, np.clip(curvature * size, -300, 300) / 300),
}
es.plot.figure_fields(fields, "over the largest", color_map="magma", limits=(0, 1))

# %%
# The eight most persistent maxima of the distance: six feet and two ends of the body.

regions = es.segment(es.merge_tree(ant, distance), n_regions=8)
es.figure_segments(ant, regions.labels, regions.features.vertices)
