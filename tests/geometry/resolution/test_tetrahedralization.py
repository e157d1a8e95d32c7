"""Tetrahedra inside surfaces, whose triangles stay as they are."""

import os
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import eigenshape as es
from eigenshape import InvalidParameterError, InvalidShapeError, MissingExtraError
from eigenshape.geometry import tetrahedralize

BALL, FINE_BALL = es.icosphere(1), es.icosphere(2)  # Netgen adds points inside the fine one


@cache
def fine_solid():
    return tetrahedralize(FINE_BALL)


@pytest.fixture
def netgen():
    return pytest.importorskip("netgen.meshing", reason="the extra tetrahedralize is missing")


def inverted(mesh):
    return es.TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


@pytest.mark.usefixtures("netgen")
def test_the_surface_stays_as_it_is():
    surface = es.TriangleMesh(3e5 * FINE_BALL.vertices + [1e6, 0, 0], FINE_BALL.faces)
    solid = tetrahedralize(surface)
    assert np.array_equal(solid.points[: surface.n_vertices], surface.vertices)
    outside = np.sort(es.geometry.boundary_surface(solid).faces, axis=1)
    assert {*map(tuple, outside)} == {*map(tuple, np.sort(surface.faces, axis=1))}
    assert np.isclose(
        es.geometry.simplex_volumes(solid).sum(), es.geometry.enclosed_volume(surface), rtol=1e-12
    )


@pytest.mark.usefixtures("netgen")
def test_the_same_surface_gives_the_same_tetrahedra():
    one, two = fine_solid(), tetrahedralize(inverted(FINE_BALL))
    assert np.array_equal(one.points, two.points)
    assert np.array_equal(one.simplices, two.simplices)


@pytest.mark.long
@pytest.mark.usefixtures("netgen")
def test_a_side_length_makes_more():
    whole, fine = fine_solid(), tetrahedralize(FINE_BALL, 0.15)
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


def ball_at(radius, x):
    return es.TriangleMesh(radius * BALL.vertices + np.array([x, 0, 0]), BALL.faces)


@pytest.mark.usefixtures("netgen")
@pytest.mark.long
def test_a_cavity_that_faces_out_is_turned_by_the_remedy():
    # One cavity faces in and one out, so that their signed volumes cancel.
    cavities = ball_at(1, 1.5), inverted(ball_at(1, -1.5))
    mesh = es.geometry.disjoint_union(ball_at(3, 0), *cavities, ball_at(0.5, 1.5), ball_at(2, 9))
    with pytest.raises(
        InvalidShapeError,
        match=r"must look out of the solid, .*; face 80 does not \(80 such\).*\[\"orient\"\]",
    ):
        tetrahedralize(mesh)
    solid = tetrahedralize(es.repair(mesh, ["orient"]).mesh)
    one = es.geometry.enclosed_volume(BALL)
    volume = (27 - 1 - 1 + 1 / 8 + 8) * one
    assert es.geometry.simplex_volumes(solid).sum() == pytest.approx(volume)
    assert es.geometry.betti_numbers(solid) == (3, 0, 2, 0)
    middles = solid.points[solid.simplices].mean(axis=1)
    assert np.linalg.norm(middles - np.array([-1.5, 0, 0]), axis=1).min() > 0.95
    for number in (0, 2):  # all faces inverted are as good
        part = [ball_at(3, 0), *cavities][number]
        assert np.array_equal(
            tetrahedralize(part).simplices, tetrahedralize(inverted(part)).simplices
        )


@pytest.mark.usefixtures("netgen")
def test_pieces_may_touch_where_they_share_vertices():
    cube = es.geometry.boundary_surface(es.shapes.box(2, 2, 2))
    points = [
        [1, 0.5, 0.5],
        [0, 0.5, 0.5],
        [0.5, 1, 0.5],
        [0.5, 0, 0.5],
        [0.5, 0.5, 1],
        [0.5, 0.5, 0],
    ]
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    beside = es.TriangleMesh(cube.vertices + np.array([1.0, 1, 0]), cube.faces)
    cases = {5 / 6: es.TriangleMesh(points, np.array(faces)[:, ::-1]), 2: beside}
    for volume, part in cases.items():
        mesh = es.geometry.disjoint_union(cube, part)
        with pytest.raises(
            InvalidShapeError,
            match=r"Vertices .* must differ; \d+ and \d+ are both at .*\[\"weld\"\]",
        ):
            tetrahedralize(mesh)
        solid = tetrahedralize(es.repair(mesh, ["weld"]).mesh)
        assert es.geometry.simplex_volumes(solid).sum() == pytest.approx(volume)


def test_tetrahedra_that_do_not_fill_the_surface_are_refused(monkeypatch, netgen):
    # Netgen is made to mesh another surface: the ball without its cavity, and the cavity twice.
    shell = es.geometry.disjoint_union(
        BALL, inverted(es.TriangleMesh(BALL.vertices / 2, BALL.faces))
    )
    module = sys.modules["eigenshape.geometry.resolution.tetrahedralization"]

    class Filled(netgen.Mesh):
        def AddElements(self, *, data, **options):  # noqa: N802
            super().AddElements(data=data[: BALL.n_faces], **options)

    monkeypatch.setattr(netgen, "Mesh", Filled)
    with pytest.raises(
        InvalidShapeError,
        match=r"must fill what the surface encloses, .*, and nothing else; Netgen",
    ):
        tetrahedralize(shell)
    solid = tetrahedralize(BALL)
    assert module._is_bounded_by(solid, BALL)
    assert not module._is_bounded_by(solid, shell)


def test_nothing_comes_out_of_standard_output(monkeypatch, netgen, capfd):
    class Talkative(netgen.Mesh):
        def GenerateVolumeMesh(self, **options):  # noqa: N802
            netgen.SetMessageImportance(5)
            try:
                super().GenerateVolumeMesh(**options)
            finally:
                netgen.SetMessageImportance(0)

    monkeypatch.setattr(netgen, "Mesh", Talkative)
    n_files = len(list(Path("/dev/fd").iterdir()))
    tetrahedralize(BALL)
    os.write(1, b"ours")
    found = capfd.readouterr()
    assert found.out == "ours"
    assert "Delaunay meshing" in found.err
    assert len(list(Path("/dev/fd").iterdir())) == n_files


@pytest.mark.usefixtures("netgen")
def test_modes_of_a_ball_are_those_of_the_ball():
    spectrum = es.solve_spectrum(es.cotangent_laplacian(fine_solid()), 4)
    exact = es.shapes.ball_eigenvalues(4)
    assert np.allclose(spectrum.eigenvalues[1:], exact[1:], rtol=0.1)


def test_bad_surfaces_are_refused(monkeypatch):
    opened = es.TriangleMesh(BALL.vertices, BALL.faces[1:])
    with pytest.raises(InvalidShapeError, match=r"edge \[\d+, \d+\] has 1 \(3 such\)"):
        tetrahedralize(opened)
    assert es.geometry.is_closed(es.repair(opened, ["auto", "fill_holes"]).mesh)
    fin = es.TriangleMesh(
        [*BALL.vertices, [0, 0, 3]], [*BALL.faces, [*BALL.faces[0][:2], BALL.n_vertices]]
    )
    with pytest.raises(
        InvalidShapeError, match=r"has 3 \(3 such\)\. No repair here tells which of them to remove"
    ):
        tetrahedralize(fin)
    crossing = es.geometry.disjoint_union(BALL, es.TriangleMesh(BALL.vertices + 0.5, BALL.faces))
    with pytest.raises(InvalidShapeError, match=r"must not cross; faces \d+ and \d+ do"):
        tetrahedralize(crossing)
    with pytest.raises(InvalidParameterError, match="side_length must be positive"):
        tetrahedralize(BALL, 0)
    monkeypatch.setitem(sys.modules, "netgen.meshing", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'eigenshape\[tetrahedralize\]'"):
        tetrahedralize(BALL)
