"""
How many modes does a brain map need?
=====================================

A map of myelin, built up from the lowest modes of the surface on which it lies.
"""

from importlib.resources import files

import matplotlib.pyplot as plt
import numpy as np

import eigenshape as es

folder = files("neuromodes") / "data"
start = "sp-human_tpl-fsLR_den-4k_hemi-L_"
surface = es.read_mesh(folder / f"{start}midthickness.surf.gii")
mask = es.io.read_fields(folder / f"{start}medmask.label.gii")["values"].astype(bool)
myelin = es.io.read_fields(folder / f"{start}myelinmap.func.gii")["values"]
part = es.geometry.mask_surface(surface, mask)
values = myelin[part.source_vertices]

spectrum = es.solve_spectrum(es.cotangent_laplacian(part.mesh), 200)
accuracy = es.modes.accuracy_curve(values, spectrum)
figure, axes = plt.subplots(figsize=(7, 3.5), layout="constrained")
axes.plot(np.arange(1, 201), accuracy)
axes.set(xlabel="number of modes", ylabel="correlation with the map", ylim=(0, 1))
axes.grid(alpha=0.3)

# %%
# The map, and what ten and two hundred modes have of it.

coefficients = es.spectral.project(values, spectrum)
fields = {"map": (part.mesh, values)}
for count in (10, 50, 200):
    rebuilt = es.spectral.reconstruct(coefficients[:count], spectrum)
    fields[f"{count} modes"] = (part.mesh, rebuilt)
limits = tuple(np.quantile(values, [0.02, 0.98]))
es.plot.figure_fields(fields, "myelin", view=[-1, 0, 0], up="z", color_map="magma", limits=limits)
# sphinx_gallery_thumbnail_number = 2
