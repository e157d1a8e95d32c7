"""
When a map is wrong
===================

`es.match_shapes` always returns a map. Five maps, right and wrong, with what `confidence` and `n_equally_good` say of
each.
"""

from functools import partial

import numpy as np

import eigenshape as es

creature = partial(es.make_creature, n_vertices=1000)
animal, walking = creature("quadruped", 0), creature("quadruped", 1)
leg = es.scans.cut_by_planes(animal, [[0, 1, 0, -0.4], [1, 0, 0, 0], [0, 0, 1, 0]])
hand, bent, fish = creature("hand", 0), creature("hand", 2), creature("fish", 0)
other_hand = es.TriangleMesh(hand.vertices * [-1, 1, 1], hand.faces[:, ::-1])
ball = es.icosphere(3)
rod = es.TriangleMesh(ball.vertices * [1.0, 0.8, 4.0], ball.faces)
coarse = es.geometry.decimate(rod, 800).mesh

# the part, the whole, and where each vertex of the part belongs: a fish on no place of a hand
pairs = {
    "an animal that walks": (animal, walking, walking.vertices),
    "one leg alone": (leg.mesh, walking, walking.vertices[leg.source_vertices]),
    "a fish, on a hand": (fish, hand, np.inf),
    "a rod, on itself": (coarse, rod, coarse.vertices),
    "a left hand, on a right one": (other_hand, bent, bent.vertices),
}
said, true = {}, {}
for name, (part, whole, places) in pairs.items():
    match = es.match_shapes(part, whole)
    errors = np.linalg.norm(match.pull(whole.vertices) - places, axis=1)
    right = errors < 0.05 * es.geometry.surface_area(whole) ** 0.5
    sure = f"confidence {match.confidence.mean():.2f}\nplaces {match.n_equally_good}"
    said[f"{name}\n{sure}"] = part, match.confidence
    true[f"{name}\n{right.mean():.0%} right"] = part, right.astype(float)

es.plot.figure_fields(said, "confidence", limits=(0, 1))

# %%
# The same parts, with a color that says where the map is right (1) and where it is wrong (0).
#
# - **The leg** lies on a wrong place, and the fish has no place at all: confidence is low.
# - **The rod** fits itself in four places. The map is one of them, so that confidence is 1/4; here it is the right one.
# - **The left hand** is wrong, and the map is sure. This hand has no nails: turned over, a left hand has the shape of
#   a right one, and palm and back are exchanged. A confidence knows shapes, not what they mean.

es.plot.figure_fields(true, "right", limits=(0, 1))

# %%
# If you know that one shape is the mirror image of the other, say so.

match = es.match_shapes(other_hand, bent, mirrored=True)
errors = np.linalg.norm(match.pull(bent.vertices) - bent.vertices, axis=1)
print(f"{np.mean(errors < 0.05 * es.geometry.surface_area(bent) ** 0.5):.0%} right")
