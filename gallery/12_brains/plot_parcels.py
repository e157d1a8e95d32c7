"""
Parcels from the shape alone
============================

A cortex is halved along the line where its first mode is zero, the halves are halved, and so on: a
parcellation at every scale, without an atlas.
"""

from importlib.resources import files

import eigenshape as es

folder = files("neuromodes") / "data"
surfaces, parcels = {}, {}
for side, letter in (("left", "L"), ("right", "R")):
    start = f"sp-human_tpl-fsLR_den-4k_hemi-{letter}_"
    surface = es.read_mesh(folder / f"{start}midthickness.surf.gii")
    tree = es.modes.nodal_parcels(es.cotangent_laplacian(surface), 32)
    surfaces[side] = surface
    parcels[side] = es.features.Parcellation(tree.cut(16))
    print(
        side, f"{len(tree.sizes)} parcels of {tree.sizes.min():.0f} to {tree.sizes.max():.0f} mm²"
    )

# %%
# Sixteen of each side. The tree can be cut at any number up to 32.

es.plot.figure_cortex(surfaces, parcels)
