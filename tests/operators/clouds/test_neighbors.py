import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.operators.clouds.neighbors import neighbor_graph
from eigenshape.operators.graph import graph_laplacian
from eigenshape.shapes.surfaces import grid
from eigenshape.spectral.solve import solve_spectrum

few = settings(deadline=None, max_examples=15)
seeds = st.integers(0, 2**32 - 1)


def test_neighbors_on_a_line_by_hand():
    # 0 1 . 3 ... 7: the nearest of 3 is 1, the nearest of 7 is 3; 1 is joined to 3 because 3 chose it.
    joined = neighbor_graph([[0.0], [1], [3], [7]], 1).toarray()
    np.testing.assert_array_equal(joined, [[0, 1, 0, 0], [1, 0, 1, 0], [0, 1, 0, 1], [0, 0, 1, 0]])
    weighted = neighbor_graph([[0.0], [1], [3], [7]], 1, t=2.0).toarray()
    np.testing.assert_allclose(
        weighted[[0, 1, 2], [1, 2, 3]], np.exp([-1 / 8, -4 / 8, -16 / 8]), rtol=1e-15
    )


def by_brute_force(points, k):
    squares = ((points[:, None] - points[None]) ** 2).sum(axis=2)
    np.fill_diagonal(squares, -1)
    nearest = np.lexsort((np.broadcast_to(np.arange(len(points)), squares.shape), squares), axis=1)[
        :, 1 : k + 1
    ]
    chosen = np.zeros(squares.shape)
    np.put_along_axis(chosen, nearest, 1, axis=1)
    return np.maximum(chosen, chosen.T)


@few
@given(seeds)
def test_neighbors_are_those_of_brute_force_ties_too(seed):
    rng = np.random.default_rng(seed)
    points = rng.integers(0, 3, size=(40, 2)).astype(
        float
    )  # nine places for forty points: ties and equals abound
    k = int(rng.integers(1, 39))
    np.testing.assert_array_equal(neighbor_graph(points, k).toarray(), by_brute_force(points, k))


def test_neighbors_of_a_grid_make_its_own_graph():
    points = grid(6, 6).vertices
    inside = ((points > 0.01) & (points < 0.99))[:, :2].all(axis=1)
    degrees = neighbor_graph(points, 4).sum(axis=1)
    assert (degrees[inside] >= 4).all()
    assert degrees.max() <= 8


@pytest.mark.parametrize("power", [-400, -100, 100, 400])
def test_neighbor_weights_do_not_depend_on_the_unit(power):
    points = np.random.default_rng(3).standard_normal((50, 3))
    near = neighbor_graph(points, 5, t=0.1)
    far = neighbor_graph(points * 2.0**power, 5, t=0.1 * 2.0 ** (2 * power))
    np.testing.assert_array_equal(far.toarray(), near.toarray())


@pytest.mark.parametrize(
    ("k", "t", "message"),
    [
        (0, None, r"n_neighbors must lie in 1\.\.2; it is 0"),
        (3, None, r"n_neighbors must lie in 1\.\.2; it is 3"),
        (1, -1.0, r"t must be positive and finite; entry 0 is -1\.0"),
        (
            1,
            1e-9,
            r"t must let every edge have weight; at t = 1e-09 edge \(0, 1\) of length 1 has .* \(2 such\)",
        ),
        (1, 1e-320, r"t must let every edge have weight"),
    ],
)
def test_neighbors_that_cannot_be_are_refused(k, t, message):
    with pytest.raises(InvalidParameterError, match=message):
        neighbor_graph([[0.0], [1], [3]], k, t=t)


def test_points_that_are_not_finite_are_refused():
    with pytest.raises(InvalidShapeError, match=r"points must be finite; point 1 is \[nan\]"):
        neighbor_graph([[0.0], [np.nan]], 1)


def test_points_on_a_circle_hear_the_circle():
    # Weights on an even circle make a circulant matrix: λ_k = Σ_j w_j (2 - 2 cos kjθ), each twice but the first.
    n, t = 60, 0.02
    angles = 2 * np.pi * np.arange(n) / n
    weights = np.exp(-((2 * np.sin(angles[1:5] / 2)) ** 2) / (4 * t))
    exact = np.array([weights @ (2 - 2 * np.cos(k * angles[1:5])) for k in (0, 1, 1, 2, 2, 3, 3)])
    graph = neighbor_graph(np.column_stack([np.cos(angles), np.sin(angles)]), 8, t=t)
    np.testing.assert_allclose(
        solve_spectrum(graph_laplacian(graph, "weighted"), 7).eigenvalues, exact, atol=1e-12
    )
