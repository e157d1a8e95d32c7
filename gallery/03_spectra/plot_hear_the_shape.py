"""
Hear the area of a drum, and its holes
======================================

The eigenvalues of a surface tell its area, the length of its boundary and its number of handles (Kac
1966). From a few hundred of them these numbers can be computed, with an estimate of the error.
"""

import matplotlib.pyplot as plt
import numpy as np

import eigenshape as es

torus = es.shapes.torus(36, 18)
spectrum = es.solve_spectrum(es.operators.fem_laplacian(torus, 3), 200)
found = es.spectral.recover_geometry(spectrum)
print(found.explain())
print(f"measured on the mesh: {es.geometry.surface_area(torus):.3f}")

# %%
# The sum of exp(-tλ) over all eigenvalues grows like area / 4πt for small t; what is left is the
# Euler characteristic over 6, which is 0 for a torus and 2 for a sphere.

times = np.geomspace(0.03, 2.0, 60)
figure, axes = plt.subplots(figsize=(7, 4.2), layout="constrained")
for name, mesh in {"torus": torus, "sphere": es.icosphere(3)}.items():
    modes = es.solve_spectrum(es.operators.fem_laplacian(mesh, 3), 200)
    trace = es.spectral.heat_trace(modes, times)
    area = es.geometry.surface_area(mesh)
    rest = 6 * (trace.values - area / (4 * np.pi * times))
    axes.semilogx(times, rest, label=name)
axes.axhline(0, color="0.7", lw=1)
axes.axhline(2, color="0.7", lw=1)
axes.set(xlabel="time, length²", ylabel="6 × (heat trace - area / 4πt)", ylim=(-2, 6))
axes.legend()
