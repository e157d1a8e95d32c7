"""
Which points are alike?
=======================

The wave kernel signature describes a point by frequency instead of time. Points with the same
signature look alike to the surface, in any pose: one fingertip finds the others.
"""

import numpy as np

import eigenshape as es

first = es.make_creature("octopus", 0, n_vertices=2000)
second = es.make_creature("octopus", 5, n_vertices=2000)
signatures = {}
for name, mesh in {"first": first, "second": second}.items():
    spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 100)
    waves = es.wave_kernel_signature(spectrum)
    signatures[name] = np.log(waves / waves.sum(axis=1, keepdims=True))

# %%
# Distance from the tip of one arm, in signatures, on this octopus and on another pose of it. All
# eight tips are dark.

tip = int(np.linalg.norm(first.vertices, axis=1).argmax())
fields = {
    f"{name} pose": (mesh, np.linalg.norm(signatures[name] - signatures["first"][tip], axis=1))
    for name, mesh in {"first": first, "second": second}.items()
}
es.plot.figure_fields(fields, "distance of signatures to one tip")
