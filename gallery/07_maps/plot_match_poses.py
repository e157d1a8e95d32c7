"""
Where does each point lie in another pose?
==========================================

`es.match_shapes` finds for each vertex of one shape its point on another. The meshes need not share a
triangle; nothing is trained and nothing clicked.
"""

import numpy as np

import eigenshape as es

standing = es.make_creature("quadruped", 0, n_vertices=1500)
walking = es.make_creature("quadruped", 4, n_vertices=1500)
match = es.match_shapes(standing, walking)
es.plot.figure_match(standing, walking, match)

# %%
# Both meshes come from one rest pose, so the true partner of vertex i is vertex i.

size = es.geometry.surface_area(walking) ** 0.5
errors = np.linalg.norm(match.pull(walking.vertices) - walking.vertices, axis=1) / size
print(f"median error {np.median(errors):.4f} √area; {np.mean(errors < 0.05):.1%} are below 0.05")

# %%
# Any function is carried over by the same map.

height = match.pull(walking.vertices[:, 1])
es.plot.figure_fields(
    {"walking": (walking, walking.vertices[:, 1]), "standing": (standing, height)},
    "height in the walking pose",
)
