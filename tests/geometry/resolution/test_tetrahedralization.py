"""Tetrahedra inside surfaces, whose triangles stay as they are."""

import sys

import numpy as np
import pytest

import eigenshape as es
from eigenshape import InvalidParameterError, InvalidShapeError, MissingExtraError
from eigenshape.geometry import tetrahedralize

BALL = es.icosphere(2)


@pytest.fixture
def netgen():
    return pytest.importorskip("netgen.meshing", reason="the extra tetrahedralize is missing")


def inverted(mesh):
    return es.TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


@pytest.mark.usefixtures("netgen")
def test_the_surface_stays_as_it_is():
    surface = es.TriangleMesh(3e5 * BALL.vertices + [1e6, 0, 0], BALL.faces)
    solid = tetrahedralize(surface)
    assert np.array_equal(solid.points[: BALL.n_vertices], surface.vertices)
    outside = np.sort(es.geometry.boundary_surface(solid).faces, axis=1)
    assert {*map(tuple, outside)} == {*map(tuple, np.sort(BALL.faces, axis=1))}
    assert np.isclose(
        es.geometry.simplex_volumes(solid).sum(), es.geometry.enclosed_volume(surface), rtol=1e-12
    )


@pytest.mark.usefixtures("netgen")
def test_the_same_surface_gives_the_same_tetrahedra():
    one, two = tetrahedralize(BALL), tetrahedralize(inverted(BALL))
    assert np.array_equal(one.points, two.points)
    assert np.array_equal(one.simplices, two.simplices)


@pytest.mark.usefixtures("netgen")
def test_a_side_length_makes_more():
    whole, fine = tetrahedralize(BALL), tetrahedralize(BALL, 0.15)
    assert es.geometry.mean_side_length(fine) < 0.8 * es.geometry.mean_side_length(whole)
    assert fine.n_simplices > 2 * whole.n_simplices


@pytest.mark.usefixtures("netgen")
def test_a_cavity_stays_empty():
    small = es.TriangleMesh(BALL.vertices / 2, BALL.faces)
    shell = es.geometry.disjoint_union(BALL, inverted(small))
    solid = tetrahedralize(shell)
    radii = np.linalg.norm(solid.points[solid.simplices].mean(axis=1), axis=1)
    assert radii.min() > 0.45
    assert es.geometry.betti_numbers(solid) == (1, 0, 1, 0)
    twice = es.geometry.disjoint_union(BALL, small)
    with pytest.raises(InvalidShapeError, match="Tetrahedra must fill what the surface encloses"):
        tetrahedralize(twice)
    assert tetrahedralize(es.repair(twice, ["largest_component"]).mesh).n_simplices > 400


@pytest.mark.usefixtures("netgen")
def test_modes_of_a_ball_are_those_of_the_ball():
    spectrum = es.solve_spectrum(es.cotangent_laplacian(tetrahedralize(BALL)), 4)
    exact = es.shapes.ball_eigenvalues(4)
    assert np.allclose(spectrum.eigenvalues[1:], exact[1:], rtol=0.1)


def test_bad_surfaces_are_refused(monkeypatch):
    opened = es.TriangleMesh(BALL.vertices, BALL.faces[1:])
    with pytest.raises(InvalidShapeError, match=r"has one face \(0 edges with more, 3 with one\)"):
        tetrahedralize(opened)
    assert es.geometry.is_closed(es.repair(opened, ["auto", "fill_holes"]).mesh)
    fin = es.TriangleMesh([*BALL.vertices, [0, 0, 3]], [*BALL.faces, [*BALL.faces[0][:2], 162]])
    with pytest.raises(InvalidShapeError, match="has more than two faces"):
        tetrahedralize(fin)
    crossing = es.geometry.disjoint_union(BALL, es.TriangleMesh(BALL.vertices + 0.5, BALL.faces))
    with pytest.raises(InvalidShapeError, match=r"must not cross; faces \d+ and \d+ do"):
        tetrahedralize(crossing)
    with pytest.raises(InvalidParameterError, match="side_length must be positive"):
        tetrahedralize(BALL, 0)
    monkeypatch.setitem(sys.modules, "netgen.meshing", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'eigenshape\[tetrahedralize\]'"):
        tetrahedralize(BALL)
