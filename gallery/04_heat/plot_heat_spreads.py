"""
Heat spreads from a fingertip
=============================

`es.spectral.apply_heat` lets heat flow for any time in one step. It takes the operator itself, or a
spectrum where long times are enough.
"""

import numpy as np

import eigenshape as es

hand = es.make_creature("hand", n_vertices=3000)
laplacian = es.cotangent_laplacian(hand)
area = es.geometry.surface_area(hand)
shares = [0.002, 0.02, 0.2, 2.0]  # of the area: times are in length²

tip = np.zeros(hand.n_vertices)
tip[hand.vertices[:, 1].argmax()] = 1.0
heat = es.spectral.apply_heat(laplacian, tip, area * np.array(shares))

# %%
# No heat is lost. In the end it is the same everywhere: 0 on this scale of powers of ten.

even = laplacian.mass.diagonal() @ tip / area
fields = {
    f"t = {share:g} area": (hand, np.log10(np.maximum(heat[:, i] / even, 1e-3)))
    for i, share in enumerate(shares)
}
es.plot.figure_fields(fields, "heat over its mean, log10", color_map="inferno", view="front")

# %%
# In the window of the studio heat can be followed through time.
#
# .. turning:: hand
#    :panel: heat
