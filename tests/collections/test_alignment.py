"""Similarities that place surfaces on each other."""

import numpy as np
import pytest
from specimens import half, make_specimen, mirror, move

import eigenshape as es


def error(found, mesh, moved):
    """Return the mean distance of moved vertices from their places, in units of the mesh's size."""
    return np.linalg.norm(found.move(moved.vertices) - mesh.vertices, axis=1).mean()


def test_a_turned_specimen_in_another_unit_comes_back():
    mesh = make_specimen(0)
    moved = move(mesh, 1000.0)
    found = es.collections.align_surfaces(moved, mesh)
    assert found.side == "same"
    assert found.scale == pytest.approx(0.001, rel=0.02)
    assert error(found, mesh, moved) < 0.03
    back = found.inverse().move(found.move(moved.vertices))
    assert np.allclose(back, moved.vertices)


def test_a_mirror_image_of_a_form_without_symmetry_is_noticed():
    mesh = make_specimen(0)
    moved = move(mirror(make_specimen(1)))
    found = es.collections.align_surfaces(moved, mesh)
    assert found.reflected
    assert found.inverse().reflected
    assert error(found, mesh, moved) < 0.2


@pytest.mark.long
def test_of_a_symmetric_form_it_cannot_be_told_whether_it_is_reflected_unless_it_is_known():
    fish, other = (es.make_creature("fish", individual=i, n_vertices=500) for i in (0, 1))
    found = es.collections.align_surfaces(mirror(other), fish)
    assert (found.side, found.reflected) == ("cannot be told", False)
    known = es.collections.align_surfaces(mirror(other), fish, mirrored=True)
    assert (known.side, known.reflected) == ("mirrored", True)
    assert known.gap < found.gap / 0.85


def test_half_of_a_specimen_and_a_crumb_far_away_are_placed():
    mesh = make_specimen(0)
    part = half(mesh)
    crumb = es.icosphere(1)
    crumb = es.TriangleMesh(0.1 * crumb.vertices + 20, crumb.faces)
    both = es.geometry.disjoint_union(part, crumb)
    found = es.collections.align_surfaces(both, mesh)
    assert found.scale == pytest.approx(1.0, rel=0.1)
    moved = found.move(part.vertices)
    assert np.linalg.norm(moved - part.vertices, axis=1).mean() < 0.1


def test_a_surface_without_area_is_refused():
    flat = es.TriangleMesh(np.zeros((3, 3)), [[0, 1, 2]])
    with pytest.raises(es.InvalidShapeError, match="A surface must have area"):
        es.collections.align_surfaces(flat, es.icosphere(1))


@pytest.mark.long
def test_turns_of_a_form_into_itself_are_counted():
    ball = es.icosphere(3)
    forms = {
        np.inf: ball.vertices,
        4.0: ball.vertices * [1, 1.3, 0.8],
        1.0: es.make_creature("hand", n_vertices=600),
    }
    for n_ways, form in forms.items():
        mesh = form if n_ways == 1 else es.TriangleMesh(form, ball.faces)
        turned = es.TriangleMesh(2 * mesh.vertices[:, [1, 2, 0]] + 1, mesh.faces)
        found = es.collections.align_surfaces(turned, mesh)
        assert found.n_ways == found.inverse().n_ways == n_ways
