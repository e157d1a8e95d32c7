"""Kernels of matching beside plain NumPy."""

import numpy as np

from eigenshape.matching.match_loops import (
    couple_pairs,
    nearest_face_points,
    nearest_rows,
    place_by_distances,
    support_extensions,
)


def test_nearest_rows_are_those_of_a_sort():
    rows = np.random.default_rng(0).random((9, 30)).astype(np.float32)
    found = nearest_rows(rows, 4)
    assert np.array_equal(found, np.argsort(rows, axis=0, kind="stable")[:4].T)


def test_rows_that_are_missing_are_minus_one():
    found = nearest_rows(np.array([[2.0], [1.0]], dtype=np.float32), 3)
    assert found.tolist() == [[1, 0, -1]]


def test_pairs_support_each_other_by_distance_and_turn():
    lengths = np.array([[0.0, 1.0], [1.0, 0.0]], dtype=np.float32)
    longer = np.array([[0.0, 1.1], [1.1, 0.0]], dtype=np.float32)
    ways = np.array([[0, 1], [1, 0]], dtype=np.complex64)
    part, whole = (lengths, lengths, ways), (longer, longer, 1j * ways)
    numbers = np.arange(2)
    found = np.empty((2, 2), dtype=np.complex64)
    couple_pairs(numbers, numbers, part, whole, 0.2, 0.05, 0.5, found)
    error = (0.1 / 1.1) / 0.2
    assert np.allclose(found, (1 - error**2) * np.array([[0, 1j], [1j, 0]]), atol=1e-6)
    # A longer distance on the part counts half.
    couple_pairs(numbers, numbers, whole, part, 0.2, 0.05, 0.5, found)
    assert np.isclose(abs(found[0, 1]), 1 - (error / 2) ** 2)


def test_the_distance_of_two_pairs_is_that_from_the_later_one():
    """Distances along a mesh differ a little between the two directions."""
    lengths = np.array([[0.0, 9.0], [1.0, 0.0]], dtype=np.float32)
    back = np.ascontiguousarray(lengths.T)
    ways = np.ones((2, 2), dtype=np.complex64)
    numbers = np.arange(2)
    found = np.empty((2, 2), dtype=np.complex64)
    same = np.array([[0.0, 1.0], [1.0, 0.0]], dtype=np.float32)
    whole = same, same, ways
    couple_pairs(numbers, numbers, (lengths, back, ways), whole, 0.2, 0.05, 0.5, found)
    assert np.allclose(found, 1 - np.eye(2))


def test_far_distances_do_not_support():
    lengths = np.array([[0.0, 1.0], [1.0, 0.0]], dtype=np.float32)
    infinite = np.array([[0.0, np.inf], [np.inf, 0.0]], dtype=np.float32)
    ways = np.ones((2, 2), dtype=np.complex64)
    numbers = np.arange(2)
    part = lengths, lengths, ways
    found = np.empty((2, 2), dtype=np.complex64)
    for other in (infinite, 2 * lengths):
        couple_pairs(numbers, numbers, part, (other, other, ways), 0.2, 0.05, 0.5, found)
        assert not found.any()


def test_a_point_is_placed_where_its_distances_fit():
    """Points of a line: the distances to two of them determine the third."""
    line = np.linspace(0, 1, 11)
    columns = np.abs(line[:, None] - line[[0, 10]]).astype(np.float32)
    places = np.array([3, 7])
    rows = np.ascontiguousarray(columns[places].T)
    near = nearest_rows(rows, 2)
    misfits = np.empty(2)
    partners = np.arange(2)
    starts = np.zeros(2, dtype=np.int64)
    theirs = np.ascontiguousarray(columns.T)
    found = place_by_distances(rows, partners, theirs, near, starts, 0.03, 1.0, 0.5, misfits)
    assert found.tolist() == [3, 7]
    assert np.allclose(misfits, 0, atol=1e-12)


def test_the_nearest_point_of_a_fan_is_that_of_many_samples():
    rng = np.random.default_rng(1)
    corners = rng.standard_normal((4, 5))
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    points = 0.7 * rng.standard_normal((40, 5))
    around, starts = np.array([0, 1]), np.array([0, 2, 2, 2, 2])
    found, weights = nearest_face_points(
        points, corners, faces, starts, around, np.zeros(40, dtype=np.int64)
    )
    assert (weights >= 0).all()
    assert np.allclose(weights.sum(axis=1), 1)
    placed = np.einsum("nc,ncd->nd", weights, corners[faces[found]])
    steps = np.linspace(0, 1, 41)
    s, t = (axis.ravel() for axis in np.meshgrid(steps, steps))
    inside = s + t <= 1 + 1e-12
    shares = np.column_stack([1 - s - t, s, t])[inside]
    samples = np.concatenate([shares @ corners[face] for face in faces])
    best = np.linalg.norm(points[:, None] - samples, axis=2).min(axis=1)
    gaps = np.linalg.norm(points - placed, axis=1)
    assert (gaps <= best + 1e-9).all()
    assert (gaps >= best - 0.15).all()


def test_the_nearest_point_may_lie_on_each_side_and_each_corner():
    """Around a triangle in its plane, where the nearest point is known."""
    corners = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]])
    places = {
        (1.0, -2.0): (1.0, 0.0),
        (-2.0, 1.0): (0.0, 1.0),
        (2.0 + 3.0, 1.5 + 4.0): (2.0, 1.5),
        (-1.0, -2.0): (0.0, 0.0),
        (6.0, -1.0): (4.0, 0.0),
        (-1.0, 7.0): (0.0, 3.0),
        (1.0, 1.0): (1.0, 1.0),
    }
    points = np.array([[*point, 0.7] for point in places])
    for turn in range(3):
        faces = np.roll([[0, 1, 2]], turn, axis=1)
        found, weights = nearest_face_points(
            points, corners, faces, np.array([0, 1]), np.array([0]), np.zeros(len(points), int)
        )
        assert (found == 0).all()
        nearest = weights @ corners[faces[0]]
        np.testing.assert_allclose(nearest[:, :2], list(places.values()), atol=1e-12)


def test_support_of_extensions_is_that_of_all_pairs_of_the_longer_set():
    rng = np.random.default_rng(0)
    coupling = (rng.normal(size=(330, 330)) + 1j * rng.normal(size=(330, 330))).astype(np.complex64)
    chosen, count = np.array([[0, 4], [3, 7], [1, 8]]), 300  # more than a block
    sums = np.array([coupling[np.ix_(each, each)].sum(axis=1) for each in chosen])
    found = np.empty((3, count), dtype=np.float32)
    support_extensions(chosen, sums, coupling, np.ascontiguousarray(coupling.T), 20, found)
    for each, row in zip(chosen, found, strict=True):
        longer = [coupling[np.ix_([*each, new], [*each, new])] for new in range(20, 320)]
        for matrix in longer:
            matrix[2, 2] = 0  # a pair does not support itself
        wanted = [np.abs(matrix.sum(axis=1)).sum() for matrix in longer]
        np.testing.assert_allclose(row, wanted, rtol=1e-5)
