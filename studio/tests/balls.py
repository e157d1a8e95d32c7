"""A collection of three balls, which needs no fit."""

import numpy as np

import eigenshape as es
from eigenshape.collections.collection import Collection

SIDES = np.array([[1.0, 1.7, 0.8], [1.2, 1.5, 0.8], [1.0, 1.4, 1.1]])


def collection_of_balls(folder, names, *, level, note):
    """Return it, with a note on the second ball and one specimen that failed; its surfaces are in the folder."""
    ball = es.icosphere(level)
    points = ball.vertices * SIDES[:, None]
    sources = tuple(folder / f"{letter}.ply" for letter in "abc")
    for source, own in zip(sources, points, strict=True):
        es.write_mesh(es.TriangleMesh(own, ball.faces), source)
    return Collection(
        folder=folder,
        names=names,
        mean=es.TriangleMesh(points.mean(axis=0), ball.faces),
        points=points,
        gaps=np.zeros(points.shape[:2]),
        confidence=np.ones(points.shape[:2]),
        sides=("same",) * 3,
        methods=("position",) * 3,
        sources=sources,
        template=names[0],
        notes={names[0]: (), names[1]: (note,), names[2]: ()},
        failures={"d": "it could not be read"},
    )
