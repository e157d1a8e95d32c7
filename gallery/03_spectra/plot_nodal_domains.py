"""
Chladni figures on a fish
=========================

Sand on a swinging plate gathers where nothing moves. The lines where an eigenfunction is zero part the
surface into nodal domains; there are at most as many as Courant's theorem allows.
"""

import eigenshape as es

fish = es.make_creature("fish", n_vertices=3000)
spectrum = es.solve_spectrum(es.cotangent_laplacian(fish), 40)
es.plot.figure_eigenfunctions(fish, spectrum, [3, 8, 39], view="left", up="y")

# %%
# How many regions, how long the lines, and how many regions there may be.

bounds = es.spectral.courant_bounds(spectrum)
for index in (3, 8, 39):
    mode = spectrum.eigenvectors[:, index]
    domains = es.spectral.nodal_domains(fish, mode)
    lines = es.spectral.nodal_set(fish, mode)
    print(
        f"mode {index}: {domains.n_domains} domains of at most {bounds[index]}, "
        f"{len(lines.polylines())} lines of total length {lines.size:.2f}"
    )
