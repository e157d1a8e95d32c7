"""
Landmarks and groups
====================

Landmarks of eight hands, four of them broad: fitted on each other, as principal components, and with a
test of the difference.
"""

import numpy as np

import eigenshape as es

rest = es.make_creature("hand", n_vertices=1000)
places = es.geometry.farthest_points(rest, 9)[0]
rng = np.random.default_rng(1)
hands, groups = {}, []
for number in range(8):
    kind = "broad" if number >= 4 else "slim"
    width = 1.15 if kind == "broad" else 1.0
    points = rest.vertices[places] * [width, 1, 1] + 0.02 * rng.standard_normal((9, 3))
    hands[f"{kind} {number}"] = es.morphometrics.Landmarks([f"point {i}" for i in range(9)], points)
    groups.append(kind)

fit = es.morphometrics.fit_procrustes(hands)
es.plot.figure_landmarks(fit.shapes)

# %%
# The first component parts the groups.

components = es.morphometrics.principal_components(fit.shapes)
es.plot.figure_ordination(components.scores, groups, shares=components.shares)

# %%
# Is the difference more than chance?

found = es.morphometrics.compare_groups(fit.shapes, groups)
print(found.names, "p =", found.p_values)
