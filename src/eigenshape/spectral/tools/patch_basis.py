"""Patches of a mesh and the eigenbasis of each, the same on every machine."""

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.sparse.csgraph import breadth_first_order, connected_components

from certeig.kit.errors import ConvergenceError
from eigenshape._arrays import adjacency_matrix
from eigenshape._corners import unique_edges

# Most vertices of a patch. A dense basis of 400 takes 0.04 s; with 800 files are 2 % smaller and
# take four times as long (experiment ch1_compression).
PATCH_SIZE = 400
# Size of the potential that is added to the graph Laplacian, whose eigenvalues lie in 0..2 ×
# degree. It splits the multiple eigenvalues of symmetric patches.
POTENTIAL = 1e-2
# Least gap of two eigenvalues of a patch. LAPACK's kernels differ by some 1e-14 in the matrix, so
# by 1e-8 in eigenvectors at most.
LEAST_GAP = 1e-6
# Least component of an eigenvector along the direction that decides its sign; far above 1e-8.
LEAST_COMPONENT = 1e-5
# Potentials to try for a patch; one byte in the file names the one that is used. Nearly always it
# is the first.
N_SEEDS = 256
# Multipliers of the finalizer of MurmurHash3 as in splitmix64 (Steele, Lea and Flood 2014).
GOLDEN, MIX_1, MIX_2 = 0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB


def find_patches(faces: Int[np.ndarray, "f 3"], n: int) -> tuple[sp.csr_array, list[np.ndarray]]:
    """Return the graph of a mesh and its points in patches of at most `PATCH_SIZE`.

    A piece is cut in two in the breadth-first order from a point at one end. All of it is done with
    whole numbers, so every machine finds the same patches.
    """
    edges = unique_edges(faces, np.roll(faces, -1, axis=1), n)
    edges = edges[edges[:, 0] != edges[:, 1]]
    graph = adjacency_matrix(edges, np.ones(len(edges)), n)
    patches, waiting = [], [np.arange(n)]
    while waiting:
        piece = waiting.pop()
        if len(piece) <= PATCH_SIZE:
            patches.append(piece)
            continue
        ordered = piece[_order_from_one_end(graph[piece][:, piece])]
        n_patches = -(-len(piece) // PATCH_SIZE)
        half = len(piece) * (n_patches // 2) // n_patches
        waiting += [np.sort(ordered[half:]), np.sort(ordered[:half])]
    return graph, patches


def _order_from_one_end(graph: sp.csr_array) -> Int[np.ndarray, " n"]:
    """Return the points of a graph, component by component, by edges from a point at one end."""
    n_components, labels = connected_components(graph, directed=False)
    if n_components == len(labels):
        return np.arange(len(labels))
    _, firsts = np.unique(labels, return_index=True)
    orders = []
    for first in firsts:
        last = breadth_first_order(graph, first, return_predecessors=False)[-1]
        orders.append(breadth_first_order(graph, last, return_predecessors=False))
    return np.concatenate(orders)


def patch_laplacians(
    graph: sp.csr_array, patches: list[np.ndarray]
) -> Iterator[tuple[np.ndarray, Float[np.ndarray, "p p"]]]:
    """Yield each patch and its combinatorial Laplacian, without the edges that leave it."""
    for patch in patches:
        adjacency = graph[patch][:, patch].toarray()
        yield patch, np.diag(adjacency.sum(axis=1)) - adjacency


def patch_basis(
    laplacian: Float[np.ndarray, "p p"], seed: int
) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, "p p"], Float[np.ndarray, " p"]]:
    """Return eigenvalues and eigenvectors of a patch with a potential, and what decides the signs.

    The potential consists of hashed numbers. Each column is turned so that its component along a
    vector of hashed numbers, the third result, is positive.
    """
    p = len(laplacian)
    places = np.arange(p, dtype=np.uint64) + np.uint64(seed * PATCH_SIZE * 2)
    values, vectors = np.linalg.eigh(laplacian + np.diag(POTENTIAL * hashed(places)))
    direction = 2 * hashed(places + np.uint64(PATCH_SIZE)) - 1
    components = direction @ vectors
    return values, vectors * np.where(components < 0, -1.0, 1.0), np.abs(components)


def find_seed(laplacian: Float[np.ndarray, "p p"]) -> tuple[int, Float[np.ndarray, "p p"]]:
    """Return the first seed whose basis every machine computes alike, and the basis.

    Only the writer chooses, so two machines never choose differently.

    Raise ConvergenceError if no seed gives eigenvalues and signs that are far enough from a tie.
    """
    for seed in range(N_SEEDS):
        values, vectors, components = patch_basis(laplacian, seed)
        gap = np.diff(values).min(initial=np.inf)
        if gap >= LEAST_GAP and components.min() >= LEAST_COMPONENT:
            return seed, vectors
    raise ConvergenceError(
        f"Each patch must have eigenvalues {LEAST_GAP:g} apart; a patch of {len(laplacian)} vertices "
        f"has a gap of {gap:.3g} with each of {N_SEEDS} potentials."
    )


def hashed(places: np.ndarray) -> Float[np.ndarray, " p"]:
    """Return a number in 0..1 for each whole number, the same on every machine (splitmix64)."""
    with np.errstate(over="ignore"):
        z = (places + np.uint64(1)) * np.uint64(GOLDEN)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(MIX_1)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(MIX_2)
    return ((z ^ (z >> np.uint64(31))) >> np.uint64(11)) / 2.0**53
