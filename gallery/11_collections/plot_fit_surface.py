"""
Bend one specimen onto another
==============================

`es.collections.fit_surface` places one hand on another, in any position and size, and bends it until
each of its points has a place there. `es.collections.build_collection` does so for a folder of
specimens, around their mean.
"""

import numpy as np

import eigenshape as es

first, second = (es.make_creature("hand", individual=i, n_vertices=500) for i in (0, 3))
turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
turn *= np.linalg.det(turn)  # a rotation
turned = es.TriangleMesh(second.vertices @ turn, second.faces)

fit = es.collections.fit_surface(first, turned)
print(f"gap {fit.gap:.4f}, strain {fit.strain:.2f}, missing {fit.missing:.0%}")

# %%
# The bent hand has the triangles of the first one and the form of the second. Here it is turned back.

bent = es.TriangleMesh(fit.vertices @ turn.T, first.faces)
es.plot.figure_poses({"first": first, "second": second, "first, bent": bent}, view="front")

# %%
# How far each point moved, after the best rigid motion and change of size.

superimposed = es.morphometrics.fit_procrustes(np.stack([first.vertices, bent.vertices]))
moved = np.linalg.norm(superimposed.shapes[1] - superimposed.shapes[0], axis=1)
es.figure_field(first, moved / moved.max(), "difference / largest", view="front", color_map="magma")
