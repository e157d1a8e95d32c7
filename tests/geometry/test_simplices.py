from math import factorial, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.requirements import require_volumes
from eigenshape.geometry.simplices import (
    degenerate_simplices,
    dual_volumes,
    in_length,
    mean_side_length,
    simplex_volumes,
)
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import (
    boundary_vertices,
    require_simplices_everywhere,
    vertex_components,
)


def corner_simplex(dim, ambient=None):
    """Return the simplex of the origin and the unit vectors."""
    points = np.zeros((dim + 1, ambient or dim))
    points[np.arange(1, dim + 1), np.arange(dim)] = 1
    return SimplicialMesh(points, [np.arange(dim + 1)])


@pytest.mark.parametrize("dim", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("more", [0, 3])
def test_the_corner_of_a_cube(dim, more):
    mesh = corner_simplex(dim, dim + more)
    assert simplex_volumes(mesh) == pytest.approx([1 / factorial(dim)], rel=1e-14)
    assert dual_volumes(mesh) == pytest.approx(np.full(dim + 1, 1 / factorial(dim + 1)), rel=1e-14)
    sides = dim + dim * (dim - 1) / 2
    assert mean_side_length(mesh) == pytest.approx((dim + (sides - dim) * sqrt(2)) / sides)


@settings(max_examples=25, deadline=None)
@given(
    st.integers(1, 4), st.integers(0, 3), st.integers(0, 2**31), st.sampled_from([1e-60, 1.0, 1e60])
)
def test_volumes_are_gram_determinants(dim, more, seed, size):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(dim + 1, dim + more))
    sides = points[1:] - points[0]
    expected = sqrt(np.linalg.det(sides @ sides.T)) / factorial(dim)
    found = simplex_volumes(SimplicialMesh(size * points, [np.arange(dim + 1)]))[0]
    assert found / size**dim == pytest.approx(expected, rel=1e-9)


def test_lengths_beyond_floats_are_refused_with_their_powers():
    with pytest.raises(
        InvalidShapeError, match=r"measure 4-volumes the largest .* within 1e-75\.\.1e75"
    ):
        simplex_volumes(SimplicialMesh(1e80 * corner_simplex(4).points, [np.arange(5)]))
    with pytest.raises(
        InvalidShapeError, match=r"To measure gradients the largest .* 1e-301\.\.1e301"
    ):
        in_length(np.ones(1), 2.0**1010, -1)


@pytest.mark.parametrize(
    ("dim", "match"),
    [
        (1, r"Segments must have length; segment 1 is \[1, 1\]"),
        (2, r"Faces must have area; face 1 is \[1, 1, 1\]"),
        (3, r"Tetrahedra must have volume; tetrahedron 1 is \[1, 1, 1, 1\]"),
        (4, r"Simplices must have volume; simplex 1 is \[1, 1, 1, 1, 1\]"),
    ],
)
def test_flat_simplices_are_named(dim, match):
    sound = corner_simplex(dim)
    mesh = SimplicialMesh(sound.points, [np.arange(dim + 1), np.ones(dim + 1, dtype=int)])
    assert degenerate_simplices(mesh).tolist() == [1]
    with pytest.raises(InvalidShapeError, match=match):
        require_volumes(mesh)


@pytest.mark.parametrize(("dim", "where"), [(2, "on a line"), (3, "in a flat of lower dimension")])
def test_a_mesh_without_any_volume_is_refused(dim, where):
    points = np.arange(dim + 1.0)[:, None] * np.ones(3)
    with pytest.raises(
        InvalidShapeError, match=f"all 1 have none: their points are equal or {where}"
    ):
        require_volumes(SimplicialMesh(points, [np.arange(dim + 1)]))


def test_two_tetrahedra_and_a_loose_point():
    points = np.vstack([corner_simplex(3).points, [[1.0, 1, 1], [5, 5, 5]]])
    mesh = SimplicialMesh(points, [[0, 1, 2, 3], [4, 1, 2, 3]])
    count, labels = vertex_components(mesh)
    assert (count, labels.tolist()) == (2, [0, 0, 0, 0, 0, 1])
    assert boundary_vertices(mesh).tolist() == [0, 1, 2, 3, 4]
    with pytest.raises(
        InvalidShapeError,
        match=r"Every point must belong to a simplex; point 5 at \[5.0, 5.0, 5.0\]",
    ):
        require_simplices_everywhere(mesh)


def test_the_boundary_of_a_curve_is_its_ends():
    mesh = SimplicialMesh(np.arange(4.0)[:, None], [[0, 2], [2, 1], [1, 3]])
    assert boundary_vertices(mesh).tolist() == [0, 3]
