"""
Proof that no eigenvalue is missing
===================================

The number of eigenvalues below a value can be counted without computing one (Sylvester's law of
inertia). Each spectrum carries such a count.
"""

import eigenshape as es

octopus = es.make_creature("octopus", 1, n_vertices=2000)
laplacian = es.cotangent_laplacian(octopus)
spectrum = es.solve_spectrum(laplacian, 60)
print(spectrum.certificate.explain())

# %%
# Eight arms that are nearly alike give groups of eigenvalues that are nearly equal: where iterative
# solvers lose one most easily. In the white gaps there is none, by proof.

area = es.geometry.surface_area(octopus)
es.plot.figure_spectrum(spectrum, area=area)

# %%
# The middle of a spectrum can be asked for alone.

window = es.solve_spectrum(laplacian, above=100.0, below=150.0)
print(
    window.eigenvalues.round(1),
    "are all between 100 and 150; the first is number",
    window.certificate.first,
)
