"""
Curvature
=========

Two numbers for each vertex say how a surface bends: most, and least. Their mean is positive on bumps
and negative in creases, their product is negative on saddles.
"""

import numpy as np

import eigenshape as es

horse = es.make_creature("quadruped", n_vertices=3000)
curvature = es.geometry.principal_curvatures(horse)
size = es.geometry.surface_area(horse) ** 0.5
fields = {
    "mean × √area": (horse, np.clip(curvature.mean * size, -15, 15) / 15),
    "Gaussian × area": (horse, np.clip(curvature.gaussian * size**2, -100, 100) / 100),
}
es.plot.figure_fields(fields, "over 15 and over 100", color_map="coolwarm", limits=(-1, 1))

# %%
# The curvature of a closed surface sums to 2π times its Euler characteristic, whatever its form.

total = es.geometry.gaussian_curvature(horse) @ es.geometry.dual_volumes(horse)
print(f"{total / (2 * np.pi):.6f} = {es.geometry.euler_characteristic(horse)}")
