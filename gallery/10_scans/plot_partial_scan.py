"""
What a scanner sees
===================

From one side only part of a shape is seen. `es.partial_scan` keeps the faces that are visible, and
`es.scans.simulate_scan` makes what a depth camera measures, with noise, dropouts and holes.
"""

import numpy as np

import eigenshape as es

lizard = es.make_creature("lizard", 1, n_vertices=3000)
view = [0.3, 0.7, 0.6]
part = es.partial_scan(lizard, view)
rng = np.random.default_rng(1)
frame = es.scans.simulate_scan(lizard, rng, view=view, camera=es.scans.DepthCamera(resolution=120))
es.plot.figure_poses(
    {"whole": lizard, "seen from one side": part.mesh, "depth camera": frame.mesh},
    view=view,
    up="y",
)

# %%
# The same from the other side, where most is missing.

es.plot.figure_poses(
    {"whole": lizard, "seen from one side": part.mesh, "depth camera": frame.mesh},
    view=[-0.6, 0.3, -0.6],
    up="y",
)

# %%
# What one side has seen: turn it, and its back is missing.
#
# .. turning:: scan
