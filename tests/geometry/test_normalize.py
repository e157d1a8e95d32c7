import tracemalloc

import numpy as np
import pytest
from scipy.spatial.distance import pdist

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.measure import bounding_box, surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.normalize import normalize_area, normalize_box, normalize_diameter
from eigenshape.shapes.surfaces import grid, icosphere, torus

ALL = [normalize_box, normalize_area, normalize_diameter]
MOVED = torus(9, 7, outer=5.0, inner=2.0)
MOVED = TriangleMesh(MOVED.vertices + np.array([300.0, -20.0, 1.0]), MOVED.faces)
POINT = TriangleMesh(np.full((3, 3), 4.0), [[0, 1, 2]])
LINE = TriangleMesh([[0, 0, 0], [1, 0, 0], [4, 0, 0]], [[0, 1, 2]])


@pytest.mark.parametrize("mesh", [MOVED, icosphere(1), grid(3, 2)])
def test_the_size_asked_for_is_one(mesh):
    low, high = bounding_box(normalize_box(mesh))
    assert (high - low).max() == pytest.approx(1, rel=1e-14)
    assert surface_area(normalize_area(mesh)) == pytest.approx(1, rel=1e-14)
    assert pdist(normalize_diameter(mesh).vertices).max() == pytest.approx(1, rel=1e-14)


@pytest.mark.parametrize("normalize", ALL)
def test_mean_goes_to_the_origin_and_orientation_stays(normalize):
    done = normalize(MOVED)
    np.testing.assert_allclose(done.vertices.mean(axis=0), 0, atol=1e-14)
    np.testing.assert_array_equal(done.faces, MOVED.faces)
    centered = MOVED.vertices - MOVED.vertices.mean(axis=0)
    ratio = np.linalg.norm(centered) / np.linalg.norm(done.vertices)
    np.testing.assert_allclose(done.vertices * ratio, centered, atol=1e-12)


@pytest.mark.parametrize("normalize", ALL)
@pytest.mark.parametrize("scale", [1e-100, 1e100])
def test_scale_does_not_matter(normalize, scale):
    far = normalize(TriangleMesh(MOVED.vertices * scale, MOVED.faces))
    np.testing.assert_allclose(far.vertices, normalize(MOVED).vertices, atol=1e-13)


@pytest.mark.parametrize("normalize", ALL)
def test_powers_of_two_do_not_change_a_bit(normalize):
    far = normalize(TriangleMesh(MOVED.vertices * 2.0**-200, MOVED.faces))
    np.testing.assert_array_equal(far.vertices, normalize(MOVED).vertices)


@pytest.mark.parametrize("normalize", ALL)
def test_a_point_has_no_size(normalize):
    with pytest.raises(
        InvalidShapeError,
        match=r"must have a size above zero to be normalized; its 3 vertices give size 0\.0",
    ):
        normalize(POINT)


def test_a_line_has_length_and_no_area():
    assert np.ptp(normalize_box(LINE).vertices[:, 0]) == 1
    assert np.ptp(normalize_diameter(LINE).vertices[:, 0]) == 1
    with pytest.raises(InvalidShapeError, match="a size above zero to be normalized"):
        normalize_area(LINE)


def test_a_slanted_line_has_no_area():
    along = np.cumsum(np.random.default_rng(1).random(30))
    slanted = TriangleMesh(
        np.outer(along, [0.345, 0.822, 0.331]), [[i, i + 1, i + 2] for i in range(28)]
    )
    with pytest.raises(InvalidShapeError, match=r"its 30 vertices give size 0\.0"):
        normalize_area(slanted)
    assert pdist(normalize_diameter(slanted).vertices).max() == pytest.approx(1, rel=1e-14)


def test_the_diameter_of_a_slanted_sheet():
    axes = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]
    sheet = grid(9, 7, width=3.0)
    slanted = TriangleMesh(sheet.vertices @ axes + 5, sheet.faces)
    assert pdist(normalize_diameter(slanted).vertices).max() == pytest.approx(1, rel=1e-14)


@pytest.mark.parametrize("mesh", [icosphere(5), grid(200, 200)])  # 10k on the hull, 40k in a plane
def test_the_diameter_of_many_points_needs_little_memory(mesh):
    tracemalloc.start()
    size = np.ptp(normalize_diameter(mesh).vertices, axis=0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert size.max() <= 1
    assert peak < 200e6
