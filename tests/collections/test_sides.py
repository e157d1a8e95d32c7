"""Which specimens are mirror images: their landmarks tell, where both sides of the form are alike."""

import numpy as np
import pytest
from specimens import mirror

import eigenshape as es
from eigenshape.collections.sides import sides_of_landmarks

FORM = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0], [0, 0, 1.0], [1, 1, 1]])
NAMES = list("abcde")


def landmarks(points):
    return es.morphometrics.Landmarks(NAMES, points)


def turned(points):
    return 3 * points[:, [1, 2, 0]] + 5


def test_landmarks_in_a_mirror_are_told_from_turned_ones():
    given = {
        "one": landmarks(FORM),
        "turned": landmarks(turned(FORM)),
        "mirrored": landmarks(turned(FORM) * [1, 1, -1]),
    }
    assert sides_of_landmarks(given, "one") == {"one": False, "turned": False, "mirrored": True}
    # Beside the template the side of the others counts, and without it that of most.
    assert sides_of_landmarks(given, "mirrored") == {
        "one": True, "turned": True, "mirrored": False,
    }  # fmt: skip
    given["mirrored too"] = landmarks(FORM * [-1, 1, 1])
    del given["turned"]
    assert sides_of_landmarks(given, "no landmarks") == {
        "one": True, "mirrored": False, "mirrored too": False,
    }  # fmt: skip


def test_flat_and_few_landmarks_tell_nothing():
    flat, few = FORM * [1, 1, 0], FORM.copy()
    few[3:] = np.nan
    for other in (flat, few):
        assert sides_of_landmarks({"one": landmarks(other), "two": landmarks(other)}, "one") == {}
    assert sides_of_landmarks({"one": landmarks(FORM)}, "one") == {}
    assert sides_of_landmarks({}, "one") == {}


@pytest.mark.long
def test_a_mirrored_specimen_with_two_equal_sides_is_found_by_its_landmarks(tmp_path):
    fish = es.make_creature("fish", n_vertices=500)
    other = mirror(es.TriangleMesh(fish.vertices * [1.1, 1, 0.95], fish.faces))
    rows = np.arange(0, fish.n_vertices, 40)
    given = {
        name: es.morphometrics.Landmarks([str(row) for row in rows], mesh.vertices[rows])
        for name, mesh in (("fish", fish), ("mirrored", other))
    }
    built = es.collections.build_collection(
        {"fish": fish, "mirrored": other}, tmp_path, template="fish", mirrored=given
    )
    assert built.sides == ("same", "mirrored")
    away = np.linalg.norm(built.points[1] - other.vertices, axis=1)
    assert np.median(away) < 0.03
    carried = es.collections.carry_landmarks(built, {"fish": given["fish"]})
    assert np.median(np.linalg.norm(carried.points[1] - other.vertices[rows], axis=1)) < 0.03


def test_landmarks_of_no_specimen_are_refused(tmp_path):
    ball = es.icosphere(1)
    with pytest.raises(es.InvalidParameterError, match="Landmarks must be of specimens; 'three'"):
        es.collections.build_collection(
            {"one": ball, "two": ball}, tmp_path, mirrored={"three": landmarks(FORM)}
        )
