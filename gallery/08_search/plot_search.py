"""
Find a scan
===========

An index keeps descriptions of shapes. A query may be noisy, partial, and in a pose that the index has
not seen.
"""

import numpy as np

import eigenshape as es

index = es.ShapeIndex.create(None)  # in memory; a path keeps it on disk
stored = {}
for kind in ("biped", "octopus", "fish", "hand"):
    for pose in range(2):
        stored[f"{kind} {pose}"] = es.make_creature(kind, pose, n_vertices=1000)
        index.add(f"{kind} {pose}", stored[f"{kind} {pose}"], label=kind)

# %%
# One side of an octopus in a third pose, with noise.

seen = es.partial_scan(es.make_creature("octopus", 7, n_vertices=1000), [0.5, 0.3, 0.8]).mesh
rng = np.random.default_rng(0)
noise = 0.1 * es.geometry.edge_lengths(seen).mean() * rng.standard_normal(seen.vertices.shape)
scan = es.TriangleMesh(seen.vertices + noise, seen.faces)
matches = index.query(scan, n_matches=3)
for match in matches:
    print(
        f"{match.name:10} score {match.score:.3f}, {len(match.correspondences)} points correspond"
    )

# %%
# The scan beside its matches. What corresponds has one color.

es.plot.figure_matches(scan, matches, meshes=stored, title="scan")

# %%
# The surest pairs of points of the best match, each with its surroundings.

es.plot.figure_matches(scan, matches[0], meshes=stored, title="scan")
