"""
The heat kernel signature
=========================

How much heat stays at a point after a time t? After a short time this tells curvature, after a longer
one whether the point lies at the tip of a limb. It does not change when the shape bends.
"""

import matplotlib.pyplot as plt
import numpy as np

import eigenshape as es

horse = es.make_creature("quadruped", n_vertices=2000)
spectrum = es.solve_spectrum(es.cotangent_laplacian(horse), 200)
area = es.geometry.surface_area(horse)
times = area * np.array([0.0005, 0.004, 0.05])
heat = es.heat_kernel_signature(spectrum, times)
fields = {
    f"t = {time / area:g} area": (horse, np.log(column / column.mean()))
    for time, column in zip(times, heat.T, strict=True)
}
es.plot.figure_fields(fields, "log (heat / its mean)", color_map="inferno")

# %%
# As curves over time: a hoof, an ear, and the middle of the trunk.

points = {
    "hoof": int(horse.vertices[:, 1].argmin()),
    "ear": int(horse.vertices[:, 1].argmax()),
    "trunk": int(np.linalg.norm(horse.vertices - horse.vertices.mean(axis=0), axis=1).argmin()),
}
all_times = es.spectral.default_times(spectrum, 60)
curves = es.heat_kernel_signature(spectrum, all_times)
figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
for name, vertex in points.items():
    axes.loglog(all_times / area, curves[vertex] * area, label=name)
axes.axhline(1, color="0.6", lw=1)
axes.set(xlabel="time / area", ylabel="heat × area (1: the same everywhere)")
axes.legend()
