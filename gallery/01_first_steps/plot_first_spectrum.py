"""
The spectrum of a hand
======================

Eigenvalues are the pitches at which a shape would sound, eigenfunctions the patterns in which it
would swing. Both depend on the shape alone, not on where it stands or how it is cut into triangles.
"""

import eigenshape as es

hand = es.make_creature("hand", n_vertices=2000)  # or es.read_mesh("scan.ply")
laplacian = es.cotangent_laplacian(hand)
spectrum = es.solve_spectrum(laplacian, k=10)
print(spectrum.eigenvalues.round(2))  # in 1/length²

# %%
# Each eigenfunction is drawn with the line where it is zero. The higher the eigenvalue, the more
# often the function changes its sign.

es.plot.figure_eigenfunctions(hand, spectrum, [1, 4, 9])

# %%
# A solver that iterates can miss an eigenvalue. This one counts them in another way and proves that
# none is missing.

print(spectrum.certificate.explain())

# %%
# The same in the window of the studio, without a server: choose an eigenfunction, let it swing, turn
# the hand.
#
# .. turning:: hand
#    :panel: spectrum
