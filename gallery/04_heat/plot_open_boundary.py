"""
Heat near a cut
===============

A cut reflects heat, so that a scan seems hot along its edge. The average of an insulated and of a cold
boundary cancels the reflection.
"""

import numpy as np

import eigenshape as es

whole = es.make_creature("biped", n_vertices=2500)
low, high = whole.vertices[:, 1].min(), whole.vertices[:, 1].max()
waist = low + 0.55 * (high - low)
upper = es.scans.cut_by_planes(whole, [[0.0, -1.0, 0.0, -waist]])
part = upper.mesh

# %%
# Two spectra: the cut free, and the cut fixed.

time = 0.004 * es.geometry.surface_area(whole)
laplacian = es.cotangent_laplacian(part)
rim = es.geometry.boundary_vertices(part)
free = es.solve_spectrum(laplacian, 120)
fixed = es.solve_spectrum(laplacian, 120, fixed=rim)
true = es.heat_kernel_signature(es.solve_spectrum(es.cotangent_laplacian(whole), 200), [time])[:, 0]
fields = {
    "of the whole": (part, true[upper.source_vertices]),
    "cut, insulated": (part, es.heat_kernel_signature(free, [time])[:, 0]),
    "cut, no reflections": (
        part,
        es.spectral.reflection_free_signature(free, fixed, [time])[:, 0],
    ),
}
fields = {name: (mesh, np.log(values)) for name, (mesh, values) in fields.items()}
es.plot.figure_fields(fields, "log heat", color_map="inferno", view="front")
