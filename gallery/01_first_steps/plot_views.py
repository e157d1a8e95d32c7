"""
Pictures from any side
======================

Figures find out how a shape stands and where its front is. Each figure takes `view` and `up`
instead, by name or as a direction.
"""

import matplotlib.pyplot as plt

import eigenshape as es

lizard = es.make_creature("lizard", 2, n_vertices=2000)
views = ["auto", "front", "left", "top", "back-right", (0, -1, 0.5)]

figure, grid = plt.subplots(2, 3, figsize=(9, 6), layout="constrained")
for axes, view in zip(grid.flat, views, strict=True):
    camera = es.plot.aim_camera(lizard, view=view, size=300)
    axes.imshow(es.plot.draw(lizard, camera).image)
    axes.set_title(f"view={view!r}")
    axes.set_axis_off()

# %%
# Eigenfunctions, fields, parts and poses are drawn by one function each; `es.save_figure` writes
# PNG, SVG or PDF files.

es.figure_field(lizard, lizard.vertices[:, 2], "z, length", view="top", color_map="turbo")
