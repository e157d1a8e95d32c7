"""Positional encodings of graphs by projectors: free of signs, bases and the order of nodes."""

from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Int

from certeig.kit.arguments import describe_value
from certeig.kit.arrays import whole_number
from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.kit.threads import map_in_threads
from certeig.kit.typing import Integer
from certeig.solver.certify import RESOLUTION
from eigenshape._errors import MissingExtraError

try:
    from torch_geometric.transforms import BaseTransform
except ImportError as err:
    raise MissingExtraError(
        "torch_geometric must be installed for encodings of its graphs; it is not. "
        "Run pip install 'eigenshape[torch]'."
    ) from err


# Graphs of one size that are solved together: 3 MB of eigenvectors of 60 nodes, which stay in the cache.
GRAPHS_AT_ONCE = 100
# Largest error of an eigenvalue: those of normalized Laplacians are at most 2.
LARGEST_ERROR = 1e-10


class ProjectorEncoding(BaseTransform):  # type: ignore[misc]
    """Positional encodings of a graph by the projectors of its Laplacian, as a transform of PyG.

    The normalized Laplacian I - D^-½ A D^-½ is solved completely, so no eigenvalue is missing, and
    residuals are checked. Eigenvalues that are closer than 1e-6 of the largest form a group with the projector
    P = Σ φφᵀ. Unlike eigenvectors, projectors have no signs and no choice of a basis. A graph whose
    nodes are numbered otherwise has the same encodings, to rounding.

    Sets ``projector_nodes`` (n, g), the diagonals P_ii of the first g groups; ``projector_edges``
    (e, g), the entries P_ij of each edge; and ``projector_eigenvalues`` (1, g). A graph with fewer
    groups has zeros. A batch of graphs is encoded at once, with one row of eigenvalues a graph.

    Parameters
    ----------
    n_groups : int
        g, beginning with eigenvalue 0.

    Raises
    ------
    InvalidParameterError
        If a graph is directed, a node has an edge to itself, or there is no `edge_index`.
    ConvergenceError
        If a residual is too large.

    Examples
    --------
    A ring of four nodes has the eigenvalues 0, 1, 1, 2:

    >>> import torch, eigenshape.torch as et
    >>> from torch_geometric.data import Data
    >>> ring = torch.tensor([[0, 1, 2, 3, 1, 2, 3, 0], [1, 2, 3, 0, 0, 1, 2, 3]])
    >>> graph = et.ProjectorEncoding(3)(Data(edge_index=ring, num_nodes=4))
    >>> graph.projector_eigenvalues.numpy().round(6).tolist()
    [[0.0, 1.0, 2.0]]
    >>> graph.projector_nodes[0].numpy().round(6).tolist()
    [0.25, 0.5, 0.25]
    """

    def __init__(self, n_groups: Integer = 8) -> None:
        self.n_groups = whole_number(n_groups, "n_groups", 1)

    def forward(self, data: Any) -> Any:
        """Return the graph or batch with its encodings."""
        if getattr(data, "edge_index", None) is None:
            raise InvalidParameterError(
                "A graph must have an edge_index, as torch_geometric.data.Data holds it; the value is "
                f"{describe_value(data)}, which has none."
            )
        n = int(data.num_nodes)
        ends = [0, n] if getattr(data, "ptr", None) is None else data.ptr.tolist()
        edges = data.edge_index.cpu().numpy()
        nodes, pairs, values = _encode(np.diff(ends), edges, self.n_groups)
        device = data.edge_index.device
        for name, part in (("nodes", nodes), ("edges", pairs), ("eigenvalues", values)):
            data[f"projector_{name}"] = torch.from_numpy(part).to(device, torch.get_default_dtype())
        return data


def _encode(
    sizes: Int[np.ndarray, " b"], edges: Int[np.ndarray, "2 e"], n_groups: int
) -> tuple[Float[np.ndarray, "n g"], Float[np.ndarray, "e g"], Float[np.ndarray, "b g"]]:
    """Encode graphs of some sizes, whose nodes are numbered one after the other."""
    starts = np.append(0, np.cumsum(sizes))
    owner = np.searchsorted(starts, edges[0], side="right") - 1
    order = np.argsort(owner, kind="stable")
    first_edges = np.searchsorted(owner[order], np.arange(len(sizes) + 1))
    loops = np.flatnonzero(edges[0] == edges[1])
    if loops.size:
        raise InvalidParameterError(
            f"A node must have no edge to itself; node {edges[0, loops[0]]} has one "
            f"({loops.size} such). Apply torch_geometric.transforms.RemoveSelfLoops first."
        )
    nodes = np.zeros((starts[-1], n_groups))
    pairs = np.zeros((edges.shape[1], n_groups))
    values = np.zeros((len(sizes), n_groups))

    def encode(graphs: Int[np.ndarray, " c"]) -> None:
        """Encode some graphs of one size; each writes rows of its own."""
        n = int(sizes[graphs[0]])
        own = np.concatenate([order[first_edges[g] : first_edges[g + 1]] for g in graphs])
        place = np.repeat(np.arange(len(graphs)), first_edges[graphs + 1] - first_edges[graphs])
        rows, columns = edges[:, own] - starts[graphs][place]
        adjacency = np.zeros((len(graphs), n, n))
        adjacency[place, rows, columns] = 1.0
        one_way = own[adjacency[place, columns, rows] == 0]
        if one_way.size:
            start, end = edges[:, one_way[0]]
            raise InvalidParameterError(
                f"Every edge of a graph must be there in both directions; ({start}, {end}) is there "
                f"without ({end}, {start}). Apply torch_geometric.transforms.ToUndirected first."
            )
        found, vectors, members = _solve_graphs(adjacency)
        rows_of = (starts[graphs][:, None] + np.arange(n)).ravel()
        counts = np.zeros((len(graphs), n_groups))
        every = np.arange(len(graphs))
        # Vector by vector, each added to its group: few are in the first groups, of n.
        for number in range(n):
            member = members[:, number]
            wanted = member < n_groups
            if not wanted.any():
                break
            # A graph whose groups are complete adds zeros to its last one.
            group = np.minimum(member, n_groups - 1)
            vector = np.where(wanted[:, None], vectors[:, :, number], 0.0)
            nodes[rows_of, np.repeat(group, n)] += (vector**2).ravel()
            pairs[own, group[place]] += vector[place, rows] * vector[place, columns]
            values[graphs, group] += np.where(wanted, found[:, number], 0.0)
            counts[every, group] += wanted
        values[graphs] /= np.maximum(counts, 1)

    by_size = np.argsort(sizes, kind="stable")
    cuts = np.flatnonzero(np.diff(sizes[by_size])) + 1
    parts = [
        part[start : start + GRAPHS_AT_ONCE]
        for part in np.split(by_size, cuts)
        for start in range(0, len(part), GRAPHS_AT_ONCE)
        if len(part) and sizes[part[0]]
    ]
    map_in_threads(encode, parts)
    return nodes, pairs, values


def _solve_graphs(
    adjacency: Float[np.ndarray, "b n n"],
) -> tuple[Float[np.ndarray, "b n"], Float[np.ndarray, "b n n"], Int[np.ndarray, "b n"]]:
    """Return all eigenpairs of the normalized Laplacians, and the group of each.

    Raise ConvergenceError if a residual is too large.
    """
    degrees = adjacency.sum(axis=2)
    # A node without edges has the eigenvalue 0.
    roots = 1 / np.sqrt(np.maximum(degrees, 1.0))
    laplacian = -adjacency * roots[:, :, None] * roots[:, None]
    diagonal = np.arange(adjacency.shape[1])
    laplacian[:, diagonal, diagonal] = degrees > 0
    values, vectors = np.linalg.eigh(laplacian)
    # All n pairs: with orthonormal vectors and small residuals none is missing, each is right.
    residual = np.abs(laplacian @ vectors - vectors * values[:, None]).max()
    gram = vectors.transpose(0, 2, 1) @ vectors
    error = max(residual, np.abs(gram - np.eye(len(diagonal))).max()) * len(diagonal)
    if error > LARGEST_ERROR:
        raise ConvergenceError(
            f"Eigenpairs of graphs must have errors below {LARGEST_ERROR:.0e}; one has {error:.1e}."
        )
    steps = np.diff(values, axis=1) > RESOLUTION * values[:, -1:]
    members = np.concatenate([np.zeros((len(values), 1)), np.cumsum(steps, axis=1)], axis=1)
    return values, vectors, members.astype(np.int64)
