"""
The pose of another animal
==========================

A giraffe takes the pose of a horse: what corresponds is found, and the turns of the limbs are carried
over in few modes, so that proportions and details stay.
"""

import eigenshape as es

giraffe = es.make_creature("giraffe", 0, n_vertices=1200)
horse = es.make_creature("quadruped", 4, n_vertices=1200)
bent = es.matching.take_pose(giraffe, horse)
es.plot.figure_poses({"giraffe": giraffe, "a horse": horse, "in its pose": bent})

# %%
# How much edges were stretched.

distortion = es.deformation.measure_distortion(giraffe, bent)
print(f"edges change by {distortion.edge_error:.1%} (root mean square)")
