"""Graph Laplacians, and the graphs of meshes (thesis 1.1.2)."""

from typing import Literal

import numpy as np
import scipy.sparse as sp

from certeig.kit.arguments import require_choice
from certeig.kit.errors import InvalidParameterError
from certeig.kit.matrices import require_square
from eigenshape._arrays import adjacency_matrix
from eigenshape._errors import InvalidShapeError, try_auto
from eigenshape._vectors import size_one
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.homology import edges_of
from eigenshape.geometry.simplices import in_length
from eigenshape.geometry.simplicial import Mesh
from eigenshape.operators.laplacian import Laplacian

Kind = Literal["combinatorial", "weighted", "normalized"]
EdgeWeights = Literal["unit", "inverse_length"]

# Relative difference of the weights (i, j) and (j, i) that counts as rounding.
WEIGHT_ASYMMETRY = 1e-12


def graph_laplacian(
    graph: sp.sparray | sp.spmatrix | MeshLike, kind: Kind = "combinatorial"
) -> Laplacian:
    """Build the Laplacian of a graph: W = D - A, with D the row sums of A (thesis 1.1.2).

    Parameters
    ----------
    graph : (n, n) sparse, or MeshLike
        Symmetric adjacency matrix whose entry (i, j) is the weight of the edge, > 0. Or a mesh of
        any dimension, whose graph consists of the sides of all its simplices.
    kind : {"combinatorial", "weighted", "normalized"}
        "combinatorial": every edge has weight 1, B = I (the Kirchhoff operator). "weighted": the
        weights of the matrix, or 1 / length on a mesh, and B = I. "normalized": the weights of the
        matrix, or 1 on a mesh, and B = D; the eigenvalues are those of I - D^{-1/2} A D^{-1/2}, in
        [0, 2].

    Returns
    -------
    Laplacian
        W in the unit of the weights. B without unit, or in that of the weights if normalized.

    Raises
    ------
    InvalidParameterError
        If the matrix is not sparse, square and symmetric; a weight is negative or not finite; a
        point is its own neighbor; `kind` is not one of the three; or a point has no edge and `kind`
        is "normalized".
    InvalidShapeError
        If a simplex has a corner twice, or an edge of a mesh has no length and `kind` is
        "weighted".

    Examples
    --------
    A path of three points has the eigenvalues 0, 1 and 3:

    >>> import eigenshape as es
    >>> from scipy.sparse import csr_array
    >>> path = csr_array([[0, 1, 0], [1, 0, 1], [0, 1, 0]])
    >>> laplacian = es.operators.graph_laplacian(path)
    >>> es.solve_spectrum(laplacian, 3).eigenvalues.round(9).tolist()
    [0.0, 1.0, 3.0]
    """
    require_choice(kind, Kind, "kind")
    if sp.issparse(graph) or isinstance(graph, np.ndarray):
        adjacency = _as_adjacency(graph)
    else:
        adjacency = edge_graph(
            as_simplicial(graph, "graph"), "inverse_length" if kind == "weighted" else "unit"
        )
    if kind == "combinatorial":
        adjacency.data[:] = 1.0
    degrees = sp.diags_array(adjacency.sum(axis=1)).tocsr()
    mass = sp.eye_array(adjacency.shape[0], format="csr")
    if kind == "normalized":
        alone = np.flatnonzero(np.diff(adjacency.indptr) == 0)
        if alone.size:
            raise InvalidParameterError(
                f"For a normalized Laplacian every point must have an edge; point {alone[0]} has none "
                f"({alone.size} such). Choose combinatorial or weighted, or drop such points."
            )
        mass = degrees
    return Laplacian((degrees - adjacency).tocsr(), mass)


def _as_adjacency(graph: sp.sparray | sp.spmatrix) -> sp.csr_array:
    """Return a copy of a graph without explicit zeros, or raise an error if it is none."""
    require_square(graph, "A graph", "a mesh or a square sparse matrix")
    if graph.dtype.kind not in "biuf":
        raise InvalidParameterError(
            f"Weights of edges must be real numbers; the type is {graph.dtype}."
        )
    adjacency = sp.csr_array(graph, dtype=np.float64, copy=True)
    adjacency.sum_duplicates()
    bad = np.flatnonzero(~(np.isfinite(adjacency.data) & (adjacency.data >= 0)))
    if bad.size:
        entries = adjacency.tocoo()
        raise InvalidParameterError(
            f"Weights of edges must be finite and not negative; entry ({entries.row[bad[0]]}, {entries.col[bad[0]]}) "
            f"is {entries.data[bad[0]]} ({bad.size} such)."
        )
    adjacency.eliminate_zeros()
    loops = np.flatnonzero(adjacency.diagonal())
    if loops.size:
        raise InvalidParameterError(
            f"A point must not be its own neighbor; entry ({loops[0]}, {loops[0]}) is "
            f"{adjacency.diagonal()[loops[0]]} ({loops.size} such). Loops cancel in D - A: set the diagonal to zero."
        )
    off = (abs(adjacency - adjacency.T) - WEIGHT_ASYMMETRY * adjacency.maximum(adjacency.T)).tocoo()
    bad = np.flatnonzero(off.data > 0)
    if bad.size:
        row, column = off.row[bad[0]], off.col[bad[0]]
        raise InvalidParameterError(
            f"A graph must be symmetric; entry ({row}, {column}) is {adjacency[row, column]} and entry "
            f"({column}, {row}) is {adjacency[column, row]}."
        )
    return adjacency


def edge_graph(mesh: MeshLike, weights: EdgeWeights = "unit") -> sp.csr_array:
    """Build the adjacency matrix of the edges of a mesh: the sides of all its simplices.

    Parameters
    ----------
    mesh : MeshLike
        Of any dimension.
    weights : {"unit", "inverse_length"}
        1, or 1 / length of the edge, in 1/length.

    Returns
    -------
    (n, n) sparse
        Symmetric, with zero diagonal. A point that belongs to no simplex has an empty row.

    Raises
    ------
    InvalidShapeError
        If a simplex has a corner twice, or an edge has no length and `weights` is "inverse_length".
    InvalidParameterError
        If `weights` is not one of the two.

    Examples
    --------
    >>> import eigenshape as es
    >>> triangle = es.TriangleMesh([[0, 0, 0], [2, 0, 0], [0, 2, 0]], [[0, 1, 2]])
    >>> es.operators.edge_graph(triangle).toarray().tolist()
    [[0.0, 1.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 0.0]]
    """
    mesh = as_simplicial(mesh)
    require_choice(weights, EdgeWeights, "weights")
    require_distinct_corners(mesh)
    edges = edges_of(mesh)
    values = np.ones(len(edges))
    if weights == "inverse_length":
        ends, scale = size_one(mesh.points[edges])
        lengths = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
        bad = np.flatnonzero(lengths == 0)
        if bad.size:
            one, two = edges[bad[0]]
            raise InvalidShapeError(
                f"Edges must have length; edge ({one}, {two}) is from {mesh.points[one].tolist()} to "
                f"{mesh.points[two].tolist()} ({bad.size} such). {try_auto()}"
            )
        values = 1 / in_length(lengths, scale, 1)
    return adjacency_matrix(edges, values, mesh.n_points)


def require_distinct_corners(mesh: Mesh) -> None:
    """Refuse a mesh with a simplex that has a corner twice, naming the first."""
    ordered = np.sort(mesh.simplices, axis=1)
    bad = np.flatnonzero((ordered[:, 1:] == ordered[:, :-1]).any(axis=1))
    if bad.size:
        plural, singular = ("Faces", "face") if mesh.dim == 2 else ("Simplices", "simplex")
        raise InvalidShapeError(
            f"{plural} must have distinct corners; {singular} {bad[0]} is {mesh.simplices[bad[0]].tolist()} "
            f"({bad.size} such). {try_auto()}"
        )
