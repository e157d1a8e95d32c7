"""
Is the correlation of two brain maps chance?
============================================

Two smooth maps are often correlated by chance. Random maps with the same power in each group of modes
say how often.
"""

from importlib.resources import files

import matplotlib.pyplot as plt
import numpy as np

import eigenshape as es

folder = files("neuromodes") / "data"
start = "sp-human_tpl-fsLR_den-4k_hemi-L_"
surface = es.read_mesh(folder / f"{start}midthickness.surf.gii")
mask = es.io.read_fields(folder / f"{start}medmask.label.gii")["values"].astype(bool)
part = es.geometry.mask_surface(surface, mask)
myelin = es.io.read_fields(folder / f"{start}myelinmap.func.gii")["values"][part.source_vertices]
to_the_back = -part.mesh.vertices[:, 1]

spectrum = es.solve_spectrum(es.cotangent_laplacian(part.mesh), 100)
nulls = es.modes.rotation_nulls(myelin, spectrum, 499, rng=np.random.default_rng(0))
measured = np.corrcoef(myelin, to_the_back)[0, 1]
by_chance = np.array([np.corrcoef(null, to_the_back)[0, 1] for null in nulls.T])
p_value = (1 + np.count_nonzero(np.abs(by_chance) >= abs(measured))) / (1 + len(by_chance))

figure, axes = plt.subplots(figsize=(7, 3.5), layout="constrained")
axes.hist(by_chance, bins=40, color="0.7")
axes.axvline(measured, color="tab:red")
axes.set(xlabel="correlation with the position from front to back", ylabel="random maps")
axes.set_title(f"measured {measured:.2f}, p = {p_value:.3f}")

# %%
# The map and two random ones.

fields = {"myelin": (part.mesh, myelin)}
for i in range(2):
    fields[f"random map {i + 1}"] = (part.mesh, nulls[:, i])
limits = tuple(np.quantile(myelin, [0.02, 0.98]))
es.plot.figure_fields(fields, view=[-1, 0, 0], up="z", color_map="magma", limits=limits)
# sphinx_gallery_thumbnail_number = 2
