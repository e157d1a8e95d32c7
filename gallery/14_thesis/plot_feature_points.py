"""
Chapter 5: feature points of a part
===================================

The maxima of heat that persist are found again on a part of the shape, which is why parts of shapes can
be searched for.
"""

import eigenshape as es

whole = es.make_creature("octopus", 2, n_vertices=2000)
scan = es.partial_scan(whole, [0.4, 0.5, 0.8]).mesh
features = {
    name: es.retrieval.find_heat_features(mesh)
    for name, mesh in {"whole": whole, "scan": scan}.items()
}
found = features["whole"]
es.figure_segments(whole, found.parts.labels, found.parts.features.vertices)

# %%
# On what one side shows.

found = features["scan"]
es.figure_segments(scan, found.parts.labels, found.parts.features.vertices)
