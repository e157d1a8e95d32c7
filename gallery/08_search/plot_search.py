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
# The scan beside its matches.

panels = [
    es.plot.Panel(mesh, title, np.zeros(mesh.n_faces, dtype=int), np.empty(0, dtype=int))
    for title, mesh in [
        ("scan", scan),
        *((f"{match.name}\nscore {match.score:.3f}", stored[match.name]) for match in matches),
    ]
]
es.plot.figure_contact_sheet(panels[0], panels[1:], caption="a lower score is more alike")
