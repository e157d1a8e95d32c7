import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.operators.graph import edge_graph, graph_laplacian
from eigenshape.shapes.surfaces import icosphere
from eigenshape.spectral.solve import solve_spectrum

few = settings(deadline=None, max_examples=15)
seeds = st.integers(0, 2**32 - 1)
PATH = np.array([[0, 2, 0], [2, 0, 3], [0, 3, 0.0]])
TRIANGLE = TriangleMesh([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]])


def random_graph(seed: int) -> sp.csr_array:
    """A path through all points, so that none is alone, and random edges beside it."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 12))
    upper = np.triu(rng.random((n, n)) * (rng.random((n, n)) < 0.3), 1) + np.diag(
        rng.random(n - 1) + 0.1, 1
    )
    return sp.csr_array(upper + upper.T)


def test_a_path_by_hand():
    combinatorial = graph_laplacian(sp.csr_array(PATH))
    np.testing.assert_array_equal(
        combinatorial.stiffness.toarray(), [[1, -1, 0], [-1, 2, -1], [0, -1, 1]]
    )
    np.testing.assert_array_equal(combinatorial.mass.toarray(), np.eye(3))
    weighted = graph_laplacian(sp.csr_array(PATH), "weighted")
    np.testing.assert_array_equal(
        weighted.stiffness.toarray(), [[2, -2, 0], [-2, 5, -3], [0, -3, 3]]
    )
    np.testing.assert_array_equal(weighted.mass.toarray(), np.eye(3))
    normalized = graph_laplacian(sp.csr_array(PATH), "normalized")
    np.testing.assert_array_equal(normalized.stiffness.toarray(), weighted.stiffness.toarray())
    np.testing.assert_array_equal(normalized.mass.toarray(), np.diag([2, 5, 3]))


def test_a_mesh_weighs_its_edges_by_inverse_length():
    weighted = graph_laplacian(TRIANGLE, "weighted").stiffness.toarray()
    np.testing.assert_allclose(
        -weighted,
        [
            [-1 / 3 - 1 / 4, 1 / 3, 1 / 4],
            [1 / 3, -1 / 3 - 1 / 5, 1 / 5],
            [1 / 4, 1 / 5, -1 / 4 - 1 / 5],
        ],
    )
    for kind in ("combinatorial", "normalized"):
        stiffness = graph_laplacian(TRIANGLE, kind).stiffness.toarray()
        np.testing.assert_array_equal(stiffness, 3 * np.eye(3) - 1)


@pytest.mark.parametrize("dim", [1, 2, 3, 4])
def test_one_simplex_is_a_complete_graph(dim):
    simplex = SimplicialMesh(np.eye(dim + 1), [np.arange(dim + 1)])
    np.testing.assert_array_equal(edge_graph(simplex).toarray(), 1 - np.eye(dim + 1))
    np.testing.assert_allclose(
        edge_graph(simplex, "inverse_length").toarray(), (1 - np.eye(dim + 1)) / 2**0.5
    )
    found = solve_spectrum(graph_laplacian(simplex), dim + 1).eigenvalues
    np.testing.assert_allclose(found, [0] + [dim + 1] * dim, atol=1e-12)


def test_an_edge_of_many_simplices_counts_once():
    np.testing.assert_array_equal(edge_graph(icosphere(1)).sum(axis=1), [5] * 12 + [6] * 30)


@pytest.mark.parametrize("n", [7, 12])
def test_the_normalized_cycle(n):
    steps = np.arange(n)
    cycle = sp.coo_array((np.ones(n), (steps, (steps + 1) % n)), shape=(n, n)).tocsr()
    found = solve_spectrum(graph_laplacian(cycle + cycle.T, "normalized"), n).eigenvalues
    np.testing.assert_allclose(found, np.sort(1 - np.cos(2 * np.pi * steps / n)), atol=1e-13)


@few
@given(seeds, st.sampled_from(["combinatorial", "weighted", "normalized"]))
def test_laws(seed, kind):
    adjacency = random_graph(seed)
    laplacian = graph_laplacian(adjacency, kind)
    stiffness = laplacian.stiffness.toarray()
    np.testing.assert_array_equal(stiffness, stiffness.T)
    np.testing.assert_allclose(stiffness.sum(axis=1), 0, atol=1e-13)
    assert np.linalg.eigvalsh(stiffness)[0] > -1e-13
    rename = np.random.default_rng(seed).permutation(len(stiffness))
    renamed = graph_laplacian(adjacency[rename][:, rename], kind).stiffness.toarray()
    np.testing.assert_allclose(renamed, stiffness[np.ix_(rename, rename)], rtol=1e-14, atol=1e-15)


@few
@given(seeds)
def test_normalized_eigenvalues_are_those_of_the_symmetric_form(seed):
    adjacency = random_graph(seed).toarray()
    roots = np.sqrt(adjacency.sum(axis=1))
    expected = np.linalg.eigvalsh(np.eye(len(roots)) - adjacency / np.outer(roots, roots))
    found = solve_spectrum(
        graph_laplacian(sp.csr_array(adjacency), "normalized"), len(roots)
    ).eigenvalues
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert found[-1] <= 2 + 1e-12


def test_explicit_zeros_are_no_edges():
    zeros = sp.coo_array((np.array([1, 1, 0, 0.0]), ([0, 1, 1, 2], [1, 0, 2, 1])), shape=(3, 3))
    assert graph_laplacian(zeros).stiffness.nnz == 4
    assert zeros.nnz == 4  # the caller's matrix is left alone


def test_whole_numbers_and_truths_are_weights():
    for dtype in (bool, int):
        adjacency = sp.csr_array(np.array([[0, 1], [1, 0]], dtype=dtype))
        np.testing.assert_array_equal(
            graph_laplacian(adjacency, "weighted").stiffness.toarray(), [[1, -1], [-1, 1]]
        )


def test_a_point_without_edge_is_no_harm_unless_degrees_divide():
    lonely = sp.csr_array(np.array([[0, 1, 0], [1, 0, 0], [0, 0, 0.0]]))
    np.testing.assert_allclose(
        solve_spectrum(graph_laplacian(lonely), 3).eigenvalues, [0, 0, 2], atol=1e-15
    )
    with pytest.raises(
        InvalidParameterError, match=r"every point must have an edge; point 2 has none \(1 such\)"
    ):
        graph_laplacian(lonely, "normalized")


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        (
            [[0, 1, 0], [1, 0, 0.0]],
            r"a mesh or a square sparse matrix; it is a csr_array of shape \(2, 3\)",
        ),
        (
            [[0, 1], [2, 0.0]],
            r"A graph must be symmetric; entry \(0, 1\) is 1\.0 and entry \(1, 0\) is 2\.0",
        ),
        (
            [[0, -1], [-1, 0.0]],
            r"must be finite and not negative; entry \(0, 1\) is -1\.0 \(2 such\)",
        ),
        ([[0, np.nan], [np.nan, 0]], r"must be finite and not negative; entry \(0, 1\) is nan"),
        ([[0, np.inf], [np.inf, 0]], r"must be finite and not negative; entry \(0, 1\) is inf"),
        ([[0, 1], [1, 4.0]], r"must not be its own neighbor; entry \(1, 1\) is 4\.0 \(1 such\)"),
        ([[0, 1j], [1j, 0]], r"Weights of edges must be real numbers; the type is complex128"),
    ],
)
def test_bad_matrices_are_refused(entries, message):
    with pytest.raises(InvalidParameterError, match=message):
        graph_laplacian(sp.csr_array(np.array(entries)), "weighted")


def test_unknown_words_are_refused():
    with pytest.raises(
        InvalidParameterError, match=r"kind must be 'combinatorial', .* it is 'signless'"
    ):
        graph_laplacian.__wrapped__(
            TRIANGLE, "signless"
        )  # past the check of types, which only tests have
    with pytest.raises(
        InvalidParameterError, match=r"weights must be 'unit' or 'inverse_length'; it is 'length'"
    ):
        edge_graph.__wrapped__(TRIANGLE, "length")


def test_edges_without_length_are_refused_where_length_matters():
    equal = TriangleMesh([[0, 0, 0], [1, 2, 3], [1, 2, 3]], [[0, 1, 2]])
    assert edge_graph(equal).nnz == 6
    with pytest.raises(
        InvalidShapeError,
        match=r"Edges must have length; edge \(1, 2\) is from \[1\.0, 2\.0, 3\.0\]",
    ):
        graph_laplacian(equal, "weighted")


def test_a_simplex_with_a_corner_twice_is_refused():
    with pytest.raises(
        InvalidShapeError,
        match=r"Faces must have distinct corners; face 1 is \[2, 1, 2\] \(1 such\)",
    ):
        edge_graph(TriangleMesh(TRIANGLE.vertices, [[0, 1, 2], [2, 1, 2]]))
    with pytest.raises(
        InvalidShapeError, match=r"Simplices must have distinct corners; simplex 0 is \[1, 1\]"
    ):
        edge_graph(SimplicialMesh([[0.0], [1.0]], [[1, 1]]))


@pytest.mark.parametrize("power", [-900, -300, 300, 900])
def test_inverse_lengths_scale_bit_for_bit(power):
    mesh = icosphere(1)
    near, far = (
        edge_graph(TriangleMesh(mesh.vertices * s, mesh.faces), "inverse_length")
        for s in (1, 2.0**power)
    )
    np.testing.assert_array_equal(far.data * 2.0**power, near.data)
