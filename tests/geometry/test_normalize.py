import tracemalloc
from inspect import unwrap

import numpy as np
import pytest
from scipy.spatial.distance import pdist

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.normalize import normalize_mesh
from eigenshape.shapes.surfaces import grid, icosphere, torus

ALL = ["box", "area", "diameter"]
MOVED = torus(9, 7, outer=5.0, inner=2.0)
MOVED = TriangleMesh(MOVED.vertices + np.array([300.0, -20.0, 1.0]), MOVED.faces)
POINT = TriangleMesh(np.full((3, 3), 4.0), [[0, 1, 2]])
LINE = TriangleMesh([[0, 0, 0], [1, 0, 0], [4, 0, 0]], [[0, 1, 2]])


@pytest.mark.parametrize("mesh", [MOVED, icosphere(1), grid(3, 2)])
def test_the_size_asked_for_is_one(mesh):
    sides = np.ptp(normalize_mesh(mesh, "box").vertices, axis=0)
    assert sides.max() == pytest.approx(1, rel=1e-14)
    assert surface_area(normalize_mesh(mesh, "area")) == pytest.approx(1, rel=1e-14)
    assert pdist(normalize_mesh(mesh, "diameter").vertices).max() == pytest.approx(1, rel=1e-14)


@pytest.mark.parametrize("measure", ALL)
def test_mean_goes_to_the_origin_and_orientation_stays(measure):
    done = normalize_mesh(MOVED, measure)
    np.testing.assert_allclose(done.vertices.mean(axis=0), 0, atol=1e-14)
    np.testing.assert_array_equal(done.faces, MOVED.faces)
    centered = MOVED.vertices - MOVED.vertices.mean(axis=0)
    ratio = np.linalg.norm(centered) / np.linalg.norm(done.vertices)
    np.testing.assert_allclose(done.vertices * ratio, centered, atol=1e-12)


@pytest.mark.parametrize("measure", ALL)
@pytest.mark.parametrize("scale", [1e-100, 1e100])
def test_scale_does_not_matter(measure, scale):
    far = normalize_mesh(TriangleMesh(MOVED.vertices * scale, MOVED.faces), measure)
    np.testing.assert_allclose(far.vertices, normalize_mesh(MOVED, measure).vertices, atol=1e-13)


@pytest.mark.parametrize("measure", ALL)
def test_powers_of_two_do_not_change_a_bit(measure):
    far = normalize_mesh(TriangleMesh(MOVED.vertices * 2.0**-200, MOVED.faces), measure)
    np.testing.assert_array_equal(far.vertices, normalize_mesh(MOVED, measure).vertices)


@pytest.mark.parametrize("measure", ALL)
def test_a_point_has_no_size(measure):
    with pytest.raises(
        InvalidShapeError,
        match=r"must have a size above zero to be normalized; its 3 vertices give size 0\.0",
    ):
        normalize_mesh(POINT, measure)


def test_a_line_has_length_and_no_area():
    assert np.ptp(normalize_mesh(LINE, "box").vertices[:, 0]) == 1
    assert np.ptp(normalize_mesh(LINE, "diameter").vertices[:, 0]) == 1
    with pytest.raises(InvalidShapeError, match="a size above zero to be normalized"):
        normalize_mesh(LINE, "area")


def test_a_slanted_line_has_no_area():
    along = np.cumsum(np.random.default_rng(1).random(30))
    slanted = TriangleMesh(
        np.outer(along, [0.345, 0.822, 0.331]), [[i, i + 1, i + 2] for i in range(28)]
    )
    with pytest.raises(InvalidShapeError, match=r"its 30 vertices give size 0\.0"):
        normalize_mesh(slanted, "area")
    assert pdist(normalize_mesh(slanted, "diameter").vertices).max() == pytest.approx(1, rel=1e-14)


def test_the_diameter_of_a_slanted_sheet():
    axes = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]
    sheet = grid(9, 7, width=3.0)
    slanted = TriangleMesh(sheet.vertices @ axes + 5, sheet.faces)
    assert pdist(normalize_mesh(slanted, "diameter").vertices).max() == pytest.approx(1, rel=1e-14)


@pytest.mark.parametrize("mesh", [icosphere(5), grid(200, 200)])  # 10k on the hull, 40k in a plane
def test_the_diameter_of_many_points_needs_little_memory(mesh):
    tracemalloc.start()
    size = np.ptp(normalize_mesh(mesh, "diameter").vertices, axis=0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert size.max() <= 1
    assert peak < 200e6


def test_an_unknown_measure_is_named():
    with pytest.raises(InvalidParameterError, match="measure must be 'box', 'area' or 'diameter'"):
        unwrap(normalize_mesh)(MOVED, "volume")
