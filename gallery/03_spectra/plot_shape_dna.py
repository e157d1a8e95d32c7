"""
Kinds of shapes from eigenvalues alone
======================================

The lowest eigenvalues, divided by what Weyl's law expects, are a short description of a shape:
ShapeDNA. Bent limbs change it little.
"""

import matplotlib.pyplot as plt
import numpy as np

import eigenshape as es

kinds = ("biped", "giraffe", "hand", "octopus", "snake")
figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
rows, names = [], []
for kind, color in zip(kinds, plt.cm.tab10.colors, strict=False):
    for pose in range(3):
        dna = es.spectral.shape_dna(es.make_creature(kind, pose, n_vertices=1000), 20)
        axes.plot(range(1, 21), dna, color=color, label=kind if pose == 0 else None)
        rows.append(dna)
        names.append(kind)
axes.set(xlabel="number of the eigenvalue", ylabel="area × eigenvalue / number")
axes.legend()

# %%
# The nearest neighbor of each of the fifteen shapes is another pose of its kind.

distances = np.linalg.norm(np.array(rows)[:, None] - np.array(rows)[None], axis=2)
np.fill_diagonal(distances, np.inf)
nearest = np.array(names)[distances.argmin(axis=1)]
print(f"{np.mean(nearest == np.array(names)):.0%} of the nearest neighbors are of the same kind")
