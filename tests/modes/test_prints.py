"""Prints of brains: spectra of structures, distances and asymmetry."""

import numpy as np
import pytest

import eigenshape as es
from eigenshape import InvalidParameterError, InvalidShapeError
from eigenshape.modes import brain_print

BALL = es.icosphere(2)
EGG = es.TriangleMesh(BALL.vertices * [1, 1, 1.3], BALL.faces)
STRUCTURES = {
    "lh.white": BALL,
    "rh.white": EGG,
    "Left-Caudate": EGG,
    "Right-Caudate": EGG,
    "Brain-Stem": BALL,
}


def test_values_are_those_of_shape_dna_and_sides_are_compared():
    found = brain_print(STRUCTURES, 9)
    ball, egg = es.spectral.shape_dna(BALL, 9), es.spectral.shape_dna(EGG, 9)
    assert found.names == tuple(STRUCTURES)
    assert np.array_equal(found.values[[0, 1]], [ball, egg])
    assert found.asymmetry() == {
        "lh.white": pytest.approx(np.linalg.norm(ball - egg)),
        "Left-Caudate": 0,
    }
    other = brain_print({"Brain-Stem": EGG, "left": BALL}, 9)
    assert found.distances(other) == {"Brain-Stem": pytest.approx(np.linalg.norm(ball - egg))}


def test_what_is_wrong_is_named():
    with pytest.raises(InvalidParameterError, match="must hold a structure; there is none"):
        brain_print({})
    twice = es.TriangleMesh(BALL.vertices, [*BALL.faces, BALL.faces[0]])
    with pytest.raises(InvalidShapeError, match=r"^Structure rh.pial: Faces must differ"):
        brain_print({"lh.pial": BALL, "rh.pial": twice}, 9)
    one = brain_print({"lh.pial": BALL, "rh.white": BALL}, 9)
    with pytest.raises(
        InvalidParameterError, match=r"on both sides, .* there are lh.pial, rh.white"
    ):
        one.asymmetry()
    with pytest.raises(
        InvalidParameterError, match=r"9 values of lh.pial, rh.white and 8 of lh.pial"
    ):
        one.distances(brain_print({"lh.pial": BALL}, 8))
