"""What a z-buffer owes to exact arithmetic, slivers and memory; what scans and cuts owe to the shape they are from."""

import tracemalloc
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import binary_fill_holes

from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union, unreferenced_vertices
from eigenshape.scans.partial import cut_by_planes, partial_scan, random_planes, rotation_towards
from eigenshape.scans.raster import Raster
from eigenshape.shapes.surfaces import grid, icosphere, torus

SPHERE = icosphere(3)
seeds = st.integers(0, 2**32 - 1)


def sphere_in_pixels(size, *, stretch=(1, 1, 1), rotation=None):
    points = SPHERE.vertices * stretch @ (np.eye(3) if rotation is None else rotation)
    low, high = points.min(axis=0), points.max(axis=0)
    return (points - low) * (0.9 * size / (high - low)[:2].max()) + [
        0.05 * size,
        0.05 * size,
        0,
    ], SPHERE.faces


def holes(seen):
    return int((binary_fill_holes(seen) & ~seen).sum())


@pytest.mark.parametrize("stretch", [(1, 1, 1e-3), (1, 1e-3, 1), (1e-2, 1, 1), (1, 1e-5, 1e-2)])
def test_slivers_leave_no_pinhole(stretch):
    for seed in range(4):
        rotation = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]
        points, faces = sphere_in_pixels(151, stretch=stretch, rotation=rotation)
        assert holes(Raster.of(points, faces, 151, 151).face >= 0) == 0


@settings(deadline=None, max_examples=20)
@given(seeds)
def test_edges_through_pixel_middles_leave_no_gap(seed):
    rng = np.random.default_rng(seed)
    lines = np.sort(
        np.concatenate(
            [[2.5, 40.5], rng.integers(3, 40, 8) + rng.choice([0.5, 0.0, 1e-7, 1e-3], 8)]
        )
    )
    across, down = np.meshgrid(lines, lines)
    points = np.column_stack([across.ravel(), down.ravel(), rng.standard_normal(100)])
    corner = (np.arange(9)[:, None] * 10 + np.arange(9)).ravel()
    a, b, c, d = corner, corner + 1, corner + 10, corner + 11
    faces = np.concatenate([np.column_stack([a, b, d]), np.column_stack([a, d, c])])
    wanted = np.zeros((44, 44), dtype=bool)
    wanted[2:41, 2:41] = True
    assert np.array_equal(Raster.of(points, faces, 44, 44).face >= 0, wanted)


def nearest_by_hand(points, faces, column, row):
    """Height of the surface over the middle of one pixel in exact arithmetic, None where there is none."""
    here = [Fraction(2 * column + 1, 2), Fraction(2 * row + 1, 2)]
    heights = []
    for face in faces.tolist():
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = (
            [Fraction(x) for x in points[i].tolist()] for i in face
        )
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area:
            v = ((here[0] - ax) * (cy - ay) - (here[1] - ay) * (cx - ax)) / area
            w = ((bx - ax) * (here[1] - ay) - (by - ay) * (here[0] - ax)) / area
            if v >= 0 and w >= 0 and v + w <= 1:
                heights.append(az + v * (bz - az) + w * (cz - az))
    return max(heights) if heights else None


@settings(deadline=None, max_examples=25)
@given(seeds)
def test_equal_to_exact_arithmetic_pixel_by_pixel(seed):
    rng = np.random.default_rng(seed)
    points = rng.integers(-8, 40, (9, 3)) / 4.0
    faces = rng.integers(0, 9, (6, 3))
    seen = Raster.of(points, faces, 8, 7)
    for row in range(7):
        for column in range(8):
            height = nearest_by_hand(points, faces, column, row)
            assert (seen.face[row, column] >= 0) == (height is not None)
            if height is not None:
                assert seen.depth[row, column] == pytest.approx(float(height), abs=1e-9)
                corners = points[faces[seen.face[row, column]]]
                middle = [column + 0.5, row + 0.5, float(height)]
                assert seen.weights[row, column] @ corners == pytest.approx(middle, abs=1e-7)


def test_memory_is_that_of_the_picture_also_for_one_huge_face():
    huge = np.array([[-1e4, -1e4, 0.0], [1e4, -1e4, 1], [0, 1e4, 2]]), np.array([[0, 1, 2]])
    Raster.of(*huge, 7, 7)  # loads the kernel before memory is counted
    tracemalloc.start()
    try:
        seen = Raster.of(*huge, 700, 700)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert (seen.face == 0).all()
    answer = seen.face.nbytes + seen.weights.nbytes + seen.depth.nbytes
    assert peak < 1.1 * answer


def is_part_of(part, mesh):
    """Whether every vertex, face and corner of the part is where its source index says."""
    same_points = np.array_equal(part.mesh.vertices, mesh.vertices[part.source_vertices])
    same_faces = np.array_equal(
        part.source_vertices[part.mesh.faces], mesh.faces[part.source_faces]
    )
    return same_points and same_faces and not len(unreferenced_vertices(part.mesh))


@settings(deadline=None, max_examples=10)
@given(seeds)
def test_parts_know_where_they_are_from(seed):
    rng = np.random.default_rng(seed)
    for part in (
        partial_scan(torus(), rng),
        cut_by_planes(torus(), random_planes(torus(), rng, n_planes=2)),
    ):
        assert is_part_of(part, torus())


def test_turning_shape_and_view_together_changes_next_to_nothing():
    turn = rotation_towards(np.array([2.0, 3.0, 6.0]) / 7)
    view = np.array([0.3, -0.5, 0.8])
    here = partial_scan(torus(), view)
    there = partial_scan(TriangleMesh(torus().vertices @ turn.T, torus().faces), turn @ view)
    shared = np.intersect1d(here.source_faces, there.source_faces).size
    assert shared > 0.97 * max(here.mesh.n_faces, there.mesh.n_faces)


def test_what_stands_in_front_hides_no_more_than_its_shadow():
    near = TriangleMesh(SPHERE.vertices + np.array([0, 0, 5.0]), SPHERE.faces)
    far = TriangleMesh(2 * SPHERE.vertices, SPHERE.faces)
    seen = partial_scan(disjoint_union(near, far), [0.0, 0, 1], all_pieces=True).source_faces
    x, y, z = far.vertices[far.faces].mean(axis=1).T
    off_axis = np.where(z > 0.5, np.hypot(x, y), np.inf)
    hidden, in_sight = (
        np.flatnonzero(mask) + near.n_faces for mask in (off_axis < 0.85, abs(off_axis - 1.5) < 0.3)
    )
    assert hidden.size
    assert not np.isin(hidden, seen).any()
    assert np.isin(in_sight, seen).all()


def test_both_sides_of_a_sheet_can_be_seen():
    for side in (1.0, -1.0):
        assert partial_scan(grid(6, 6), [0.0, 0.0, side]).mesh.n_faces == grid(6, 6).n_faces


@settings(deadline=None, max_examples=15)
@given(seeds)
def test_planes_cut_one_after_the_other_as_at_once(seed):
    planes = random_planes(SPHERE, np.random.default_rng(seed), n_planes=2, share=0.3)
    at_once, first = cut_by_planes(SPHERE, planes), cut_by_planes(SPHERE, planes[0])
    second = cut_by_planes(first.mesh, planes[1])
    assert np.array_equal(at_once.source_faces, first.source_faces[second.source_faces])
    assert np.array_equal(at_once.source_vertices, first.source_vertices[second.source_vertices])
    assert (at_once.mesh.vertices @ planes[:, :3].T <= planes[:, 3]).all()
