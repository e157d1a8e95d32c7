"""
Find duplicates in a collection
===============================

A copy that was scaled, turned and cut into other triangles is still the same shape. Scores of
duplicates are near 0 whatever else is in the index.
"""

import numpy as np

import eigenshape as es

fish = es.make_creature("fish", n_vertices=1500)
turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
turn *= np.linalg.det(turn)  # a rotation, not a mirror image
coarse = es.geometry.decimate(fish, ratio=0.5).mesh
shapes = {
    "fish": fish,
    "copy": es.TriangleMesh(9 * coarse.vertices @ turn, coarse.faces),
    "bird": es.make_creature("bird", n_vertices=1000),
    "snake": es.make_creature("snake", n_vertices=1000),
}
index = es.ShapeIndex.create(None)
for name, mesh in shapes.items():
    index.add(name, mesh, n_views=0)
for one, two, score, kind in es.retrieval.find_duplicates(index):
    print(f"{one} and {two}: {kind}, score {score:.3f}")

# %%
# All four, as their files have them.

panels = [
    es.plot.Panel(mesh, name, np.zeros(mesh.n_faces, dtype=int), np.empty(0, dtype=int))
    for name, mesh in shapes.items()
]
es.plot.figure_contact_sheet(panels[0], panels[1:])
