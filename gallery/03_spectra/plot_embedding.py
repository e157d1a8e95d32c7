"""
Points that are near along the surface
======================================

Two fingers may touch and still be far from each other along the skin. In the space of the lowest
eigenfunctions such points are apart, and k-means finds the fingers.
"""

import numpy as np

import eigenshape as es

hand = es.make_creature("hand", 2, n_vertices=2000)
spectrum = es.solve_spectrum(es.cotangent_laplacian(hand), 100)
tip = int(hand.vertices[:, 1].argmax())
fields = {
    method: (hand, distances / distances.max())
    for method, distances in {
        "straight": np.linalg.norm(hand.vertices - hand.vertices[tip], axis=1),
        "biharmonic": es.spectral.spectral_distances(spectrum, [tip])[:, 0],
        "diffusion": es.spectral.spectral_distances(
            spectrum, [tip], method="diffusion", t=0.02 * es.geometry.surface_area(hand)
        )[:, 0],
    }.items()
}
es.plot.figure_fields(
    fields, "distance from a fingertip / largest", view="front", up="y", color_map="turbo"
)

# %%
# Groups of points in that space. `es.find_parts` cuts surfaces where people would; this works for
# any spectrum, also that of a table of data.

labels = es.spectral.spectral_clusters(spectrum, 7)
es.figure_segments(hand, labels[hand.faces[:, 0]], view="front", up="y")
