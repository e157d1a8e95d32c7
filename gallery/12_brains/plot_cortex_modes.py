"""
Modes of a cortex
=================

The eigenfunctions of the cortical surface, without the medial wall. Surfaces and maps are those of the
package neuromodes, which the tests of eigenshape install.
"""

from importlib.resources import files

import numpy as np

import eigenshape as es

folder = files("neuromodes") / "data"
surfaces, modes = {}, {}
for side, letter in (("left", "L"), ("right", "R")):
    start = f"sp-human_tpl-fsLR_den-4k_hemi-{letter}_"
    surface = es.read_mesh(folder / f"{start}midthickness.surf.gii")
    mask = es.io.read_fields(folder / f"{start}medmask.label.gii")["values"]
    part = es.geometry.mask_surface(surface, mask)
    spectrum = es.solve_spectrum(es.cotangent_laplacian(part.mesh), 10)
    mode = spectrum.eigenvectors[:, 4] / np.abs(spectrum.eigenvectors[:, 4]).max()
    mode *= np.sign(mode[np.argmax(part.mesh.vertices[:, 2])])  # positive at the top
    surfaces[side] = surface
    modes[side] = es.geometry.unmask(mode, part.source_vertices, surface.n_vertices)
    print(side, spectrum.eigenvalues[:5])  # in 1/mm²

# %%
# The fourth mode that is not constant, from outside and from inside.

es.plot.figure_cortex(surfaces, modes, "mode 4", color_map="RdBu_r", limits=(-1, 1))

# %%
# The left half in the window of the studio. The hole is the medial wall.
#
# .. turning:: cortex
