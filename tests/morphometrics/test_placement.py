"""Landmarks that do not lie on their surface are refused, with what would bring them there."""

import re

import numpy as np
import pytest

import eigenshape as es
from eigenshape.morphometrics.placement import require_on_surfaces

CHOSEN = [3, 40, 90, 120, 150]
LPS = np.array([-1, -1, 1])


def body():
    """Return an ellipsoid without any symmetry about the origin, 4 mm long."""
    ball = es.icosphere(3)
    return es.TriangleMesh(ball.vertices * [2, 1, 0.6] + [0.7, 0.4, 0.2], ball.faces)


def landmarks(points):
    return es.morphometrics.Landmarks([f"p{row}" for row in range(len(points))], points)


def message(**changed):
    """Return the error for landmarks of specimens that are changed so."""
    mesh = body()
    specimens = [
        (name, mesh, landmarks(change(mesh.vertices[CHOSEN]))) for name, change in changed.items()
    ]
    with pytest.raises(
        es.InvalidParameterError, match="Landmarks must lie on the surface"
    ) as error:
        require_on_surfaces(specimens)
    return str(error.value)


def test_landmarks_on_the_surface_are_accepted_with_their_distances():
    mesh = body()
    points = mesh.vertices[CHOSEN].copy()
    points[1] = np.nan
    found = require_on_surfaces([("a", mesh, landmarks(points))])["a"]
    assert found.distances[[0, 2, 3, 4]].max() < 1e-12
    assert np.isnan(found.distances[1])
    assert not found.is_beside
    nothing = landmarks(np.full((2, 3), np.nan))
    assert not require_on_surfaces([("a", mesh, nothing)])["a"].is_beside


@pytest.mark.parametrize(("factor", "unit"), [(0.001, "1000"), (10, "0.1"), (1 / 25.4, "25.4")])
def test_another_unit_is_named_and_the_remedy_works(factor, unit):
    text = message(a=lambda points: factor * points)
    assert "5 of 5 landmarks of 'a' lie farther from it than" in text
    assert f"{unit} times as large they would lie on it; change them so; if their file" in text
    points = float(unit) * factor * body().vertices[CHOSEN]
    assert require_on_surfaces([("a", body(), landmarks(points))])


def test_the_other_system_of_slicer_is_named():
    text = message(a=lambda points: points * LPS)
    assert "as -x, -y, z they would lie on it; change them so." in text
    text = message(a=lambda points: points[:, [1, 2, 0]])
    assert "in another frame or of another specimen; save them as they lie on this mesh." in text


def test_one_landmark_far_off_and_another_frame_are_named():
    def one_off(points):
        points = points.copy()
        points[2] *= 3
        return points

    text = message(a=one_off)
    assert re.search(
        r"1 of 5 landmarks of 'a' lie farther .* and 'p2' [\d.]+: place them anew", text
    )
    assert "in another frame or of another specimen" in message(a=lambda points: points + 4)


def test_every_bad_specimen_is_named():
    text = message(
        a=lambda points: points / 1000,
        good=lambda points: points,
        b=lambda points: points * LPS,
        c=lambda points: points / 10,
    )
    assert [name for name in ("a", "good", "b", "c") if f"'{name}'" in text] == ["a", "b", "c"]


def test_the_answer_does_not_depend_on_the_unit_of_both():
    mesh = body()
    for scale in (1e-100, 1e100):
        large = es.TriangleMesh(scale * mesh.vertices, mesh.faces)
        with pytest.raises(es.InvalidParameterError, match="as -x, -y, z they would"):
            require_on_surfaces([("a", large, landmarks(large.vertices[CHOSEN] * LPS))])


def test_points_that_shrink_into_one_spot_name_no_unit():
    mesh = es.TriangleMesh(body().vertices - body().vertices[7], body().faces)  # through the origin
    with pytest.raises(es.InvalidParameterError, match="in another frame or of another specimen"):
        require_on_surfaces([("a", mesh, landmarks(mesh.vertices[CHOSEN] + 9))])


def test_landmarks_a_little_beside_the_surface_may_be_of_another_specimen():
    mesh = body()
    found = require_on_surfaces([("a", mesh, landmarks(1.04 * mesh.vertices[CHOSEN]))])["a"]
    assert found.is_beside


def test_a_coarse_surface_may_be_an_edge_away():
    coarse, fine = es.icosphere(0), es.icosphere(3)
    assert require_on_surfaces([("a", coarse, landmarks(fine.vertices[CHOSEN]))])


@pytest.mark.data
def test_landmarks_of_an_expert_are_accepted(data):
    names = ("AKR_J", "B6129PF1")
    if not (data / "mice" / "AKR_J.ply").is_file():
        pytest.skip(f"no skulls in {data / 'mice'}")
    skulls = {name: es.read_mesh(data / "mice" / f"{name}.ply") for name in names}
    known = {
        name: es.morphometrics.read_landmarks(data / "mice" / f"{name}.mrk.json") for name in names
    }
    found = require_on_surfaces((name, skulls[name], known[name]) for name in names)
    assert not any(each.is_beside for each in found.values())
    others = [
        (name, skulls[name], known[other]) for name, other in zip(names, names[::-1], strict=True)
    ]
    with pytest.raises(es.InvalidParameterError, match="B6129PF1"):
        require_on_surfaces(
            [(name, skulls[name], landmarks(known[name].points / 10)) for name in names]
        )
    assert any(each.is_beside for each in require_on_surfaces(others[:1]).values())
