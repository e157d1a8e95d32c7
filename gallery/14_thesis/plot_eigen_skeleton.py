"""
Chapter 6: the eigen-skeleton
=============================

The lowest modes of a shape are its skeleton. The thesis bends the skeleton and puts the details back;
the method of this library moves edges less.
"""

import numpy as np

import eigenshape as es

giraffe = es.make_creature("giraffe", n_vertices=1500)
rig = es.rig_shape(giraffe)
skeletons = {
    f"{k} modes": es.TriangleMesh(es.deformation.eigen_skeleton(rig, k), giraffe.faces)
    for k in (30, 100)
}
es.plot.figure_poses({**skeletons, "shape": giraffe})

# %%
# A neck that is turned by 60 degrees, by both.

low, high = giraffe.vertices[:, 1].min(), giraffe.vertices[:, 1].max()
neck = es.deformation.BoxRegion([-np.inf, low + 0.62 * (high - low), -np.inf], [np.inf] * 3)
rim = es.deformation.region_boundary(giraffe, es.deformation.region_mask(giraffe, neck))
turn = es.Rotation(giraffe.vertices[rim].mean(axis=0), [1, 0, 0], np.deg2rad(60))
poses = {mode: es.deform(rig, neck, turn, mode=mode) for mode in ("thesis", "graded")}
for mode, bent in poses.items():
    error = es.deformation.measure_distortion(giraffe, bent).edge_error
    print(f"{mode}: edges change by {error:.1%} (root mean square)")
es.plot.figure_poses({"before": giraffe, **poses})
