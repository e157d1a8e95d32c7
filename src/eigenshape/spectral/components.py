"""Operators that fall into many small parts: each is solved densely, all of one size at once."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.sparse.csgraph import connected_components

from eigenshape.spectral.pairs import Pairs
from eigenshape.spectral.pencil import Pencil, residual_norms

AT_ONCE = 2**22  # numbers in the blocks that are solved together


@dataclass(frozen=True, eq=False)
class Parts:
    """The connected parts of a pencil.

    Attributes
    ----------
    labels : (n,) int
        The part of each point.
    places : (n,) int
        Its place within that part.
    sizes : (c,) int
        Points of each part.
    """

    labels: Int[np.ndarray, " n"]
    places: Int[np.ndarray, " n"]
    sizes: Int[np.ndarray, " c"]


def connected_parts(pencil: Pencil) -> Parts:
    """Find what W and B hold together."""
    pattern = abs(pencil.stiffness) if pencil.mass_floor == 1.0 else abs(pencil.stiffness) + abs(pencil.mass)
    labels = connected_components(pattern, directed=False)[1].astype(np.int64)
    sizes, order = np.bincount(labels), np.argsort(labels, kind="stable")
    places = np.empty_like(labels)
    places[order] = np.arange(len(labels)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    return Parts(labels, places, sizes)


def pairs_of_parts(pencil: Pencil, parts: Parts, k: int) -> Pairs:
    """Return the k lowest of all eigenpairs of all parts; each vector is zero outside its part."""
    groups = [
        part for size in np.unique(parts.sizes).tolist() for part in _chunks(np.flatnonzero(parts.sizes == size), size)
    ]
    stiffness, mass = pencil.stiffness.tocoo(), pencil.mass.tocoo()
    solved = [_solved(_blocks(stiffness, parts, group), _blocks(mass, parts, group)) for group in groups]
    values = np.concatenate([found.ravel() for found, _ in solved])
    lowest = np.argsort(values, kind="stable")[:k]
    column = np.full(len(values), -1)
    column[lowest] = np.arange(k)
    vectors, start = np.zeros((pencil.n, k)), 0
    for group, (found, coefficients) in zip(groups, solved, strict=True):
        mine = column[start : start + found.size].reshape(found.shape)
        part, place = np.nonzero(mine >= 0)
        vectors[_points(parts, group)[part], mine[part, place][:, None]] = coefficients[part, :, place]
        start += found.size
    return Pairs(values[lowest], vectors, residual_norms(pencil, values[lowest], vectors))


def _chunks(group: Int[np.ndarray, " c"], size: int) -> list[Int[np.ndarray, " d"]]:
    return np.array_split(group, -(-len(group) * size**2 // AT_ONCE))


def _blocks(matrix: sp.coo_array, parts: Parts, group: Int[np.ndarray, " c"]) -> Float[np.ndarray, "c s s"]:
    size = int(parts.sizes[group[0]])
    blocks, index = np.zeros((len(group), size, size)), np.full(len(parts.sizes), -1)
    index[group] = np.arange(len(group))
    within = index[parts.labels[matrix.row]]
    kept = within >= 0
    blocks[within[kept], parts.places[matrix.row[kept]], parts.places[matrix.col[kept]]] = matrix.data[kept]
    return blocks


def _points(parts: Parts, group: Int[np.ndarray, " c"]) -> Int[np.ndarray, "c s"]:
    index = np.full(len(parts.sizes), -1)
    index[group] = np.arange(len(group))
    within = index[parts.labels]
    points = np.empty((len(group), int(parts.sizes[group[0]])), dtype=np.int64)
    kept = np.flatnonzero(within >= 0)
    points[within[kept], parts.places[kept]] = kept
    return points


def _solved(
    stiffness: Float[np.ndarray, "c s s"], mass: Float[np.ndarray, "c s s"]
) -> tuple[Float[np.ndarray, "c s"], Float[np.ndarray, "c s s"]]:
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    values, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.transpose(0, 2, 1))
    return values, inverse.transpose(0, 2, 1) @ vectors
