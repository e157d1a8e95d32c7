"""
Standing waves from one point
=============================

The Helmholtz equation has the waves of one frequency that a point sends out. On a closed surface they
meet on the other side.
"""

import numpy as np

import eigenshape as es

fish = es.make_creature("fish", n_vertices=5000)
laplacian = es.cotangent_laplacian(fish)
nose = int(fish.vertices[:, 2].argmax())
load = np.zeros(fish.n_vertices)
load[nose] = 1.0

fields = {}
area = es.geometry.surface_area(fish)
for factor in (100.0, 400.0, 1600.0):
    waves = es.calculus.solve_helmholtz(laplacian, factor / area, load=load)
    fields[f"κ = {factor:g} / area"] = (fish, waves / np.quantile(np.abs(waves), 0.98))

# %%
# κ is the squared wave number. Nothing is lost, so these are resonances: near an eigenvalue they grow.

es.plot.figure_fields(fields, "wave", color_map="RdBu_r", limits=(-1, 1), view="left", up="y")
