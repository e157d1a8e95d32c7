"""
Compare every shape with every other
====================================

Descriptions can be compared without an index. The table of scores shows the kinds as dark squares.
"""

import matplotlib.pyplot as plt
import numpy as np

import eigenshape as es

names = [f"{kind} {pose}" for kind in ("biped", "octopus", "fish", "hand") for pose in range(2)]
descriptors = []
for name in names:
    kind, pose = name.split()
    descriptors.append(es.describe(es.make_creature(kind, int(pose), n_vertices=1000)))
scores = np.array([es.retrieval.patch_scores(each, descriptors) for each in descriptors])

figure, axes = plt.subplots(figsize=(6, 5), layout="constrained")
image = axes.imshow(scores, cmap="viridis")
axes.set_xticks(range(len(names)), names, rotation=60, ha="right")
axes.set_yticks(range(len(names)), names)
figure.colorbar(image, label="score (lower: more alike)")
