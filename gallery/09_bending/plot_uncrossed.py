"""
Twist a bar half around
=======================

Where a bar is turned by 180 degrees in a short piece, faces cross. `mode="uncrossed"` makes the bar
stiffer there, until none do.
"""

import numpy as np

import eigenshape as es

box = es.geometry.boundary_surface(es.shapes.box(6, 24, 6, sides=(0.25, 1.0, 0.25)))
bar = es.as_mesh(box)
rig = es.rig_shape(bar)
top = es.deformation.BoxRegion([-np.inf, 0.7, -np.inf], [np.inf] * 3)
bottom = es.deformation.BoxRegion([-np.inf] * 3, [np.inf, 0.3, np.inf])
turn = es.Rotation([0.125, 0.7, 0.125], axis=[0, 1, 0], angle=np.pi)

poses = {"before": bar}
for mode in ("graded", "uncrossed"):
    poses[mode] = es.deform(rig, top, turn, fixed=bottom, mode=mode)
    crossing = es.geometry.self_intersections(poses[mode])
    distortion = es.deformation.measure_distortion(bar, poses[mode])
    print(
        f"{mode}: {len(crossing)} pairs of faces cross, edges change by {distortion.edge_error:.1%}"
    )

# %%
# The same motion of the top, twice.

es.plot.figure_poses(poses, view=[1, 0.3, 0.6], up="y")
