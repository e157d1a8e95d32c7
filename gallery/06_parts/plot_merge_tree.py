"""
Maxima that persist
===================

A function on a surface has many small maxima. Persistence says how far a maximum stands above the
saddle at which it merges with a higher one, and orders them.
"""

import eigenshape as es

hand = es.make_creature("hand", n_vertices=2000)
spectrum = es.solve_spectrum(es.cotangent_laplacian(hand), 120)
heat = es.heat_kernel_signature(spectrum, [0.004 * es.geometry.surface_area(hand)])[:, 0]
tree = es.merge_tree(hand, heat)
es.plot.figure_merge_tree(tree, label="heat, 1/length²")

# %%
# Cut to six maxima: five fingertips and the wrist, and the region of each.

regions = es.segment(tree, n_regions=6)
es.figure_segments(hand, regions.labels, regions.features.vertices, view="front")

# %%
# The persistence diagram of the same function: the farther from the diagonal, the longer it lasts.

es.plot.figure_diagram(es.features.persistence_diagram(hand, heat), label="heat")
# sphinx_gallery_thumbnail_number = 2
