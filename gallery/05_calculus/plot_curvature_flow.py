"""
Mean curvature flow
===================

A surface that shrinks as fast as it can loses its limbs first. The conformal flow does not tear, and
would make any shape without handles round.
"""

import eigenshape as es

horse = es.make_creature("quadruped", n_vertices=2500)
area = es.geometry.surface_area(horse)
poses = {"t = 0": horse}
for share in (0.0003, 0.001):
    moved = es.calculus.mean_curvature_flow(horse, share * area, conformal=True)
    center = moved.vertices.mean(axis=0)
    factor = (area / es.geometry.surface_area(moved)) ** 0.5
    scaled = center + factor * (moved.vertices - center)
    poses[f"t = {share:g} area"] = es.TriangleMesh(scaled, horse.faces)

# %%
# Each is scaled to the first area.

es.plot.figure_poses(poses)
