"""Arrays that belong to a shape: checks of coordinates, indices, sources and values; equal rows, keys, and links."""

from typing import Any

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int
from numpy.typing import NDArray

from certeig.kit.arrays import (
    all_finite,
    as_array,
    real_numbers,
    require_no_mask,
    whole_number,
    whole_numbers,
)
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._component_loops import number_groups
from eigenshape._errors import InvalidShapeError

# Names of rows in messages, and what rows of indices refer to.
SINGULAR = {"vertices": "vertex", "faces": "face", "points": "point", "simplices": "simplex"}
INDEXED = {"faces": "vertices", "simplices": "points"}

# Steps of a loop at most. One takes 0.1 ms or more, so that a number mistyped would run for days.
MOST_STEPS = 1_000_000
NO_SOURCE = "There must be at least one source; there is none."
MOST_COORDINATES = 3  # of a row that messages show as a vector: those of a point in space


def finite_rows(value: ArrayLike, name: str, columns: int | None = None) -> NDArray[np.float64]:
    """Return `value` as an (n, columns) float64 array; raise an error if an entry is not finite.

    Without `columns` any number of columns is accepted.
    """
    rows = _table(value, name, columns)
    if rows.dtype.kind not in "iuf":
        raise InvalidShapeError(f"{name} must be real numbers; the type is {rows.dtype}.")
    # Long doubles that overflow become infinite, which raises the error below.
    with np.errstate(over="ignore"):
        rows = rows.astype(np.float64, order="C")  # as kernels take them
    bad = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if bad.size:
        remedy = " read_mesh(path, drop_missing=True) leaves out those of a file."
        raise InvalidShapeError(
            f"{name} must be finite; {SINGULAR.get(name, 'row')} {bad[0]} is {rows[bad[0]].tolist()} "
            f"({bad.size} such).{remedy if name == 'vertices' else ''}"
        )
    return rows


def index_rows(
    value: ArrayLike, name: str, columns: int | None, n_vertices: int
) -> NDArray[np.int64]:
    """Return `value` as (f, columns) int64 indices from 0 to `n_vertices` - 1."""
    rows = _table(value, name, columns)
    # Integers beyond 64 bits come as objects; they are out of range, and the message shows them.
    huge = rows.dtype.kind == "O" and all(
        isinstance(entry, int | np.integer) for entry in rows.flat
    )
    if rows.dtype.kind not in "iuf" and not huge:
        raise InvalidShapeError(f"{name} must be integers; the type is {rows.dtype}.")
    if rows.dtype.kind == "f" and (rows != np.floor(rows)).any():
        fact = _first(name, rows, rows != np.floor(rows))
        raise InvalidShapeError(f"{name} must be whole numbers; {fact}.")
    outside = (rows < 0) | (rows >= n_vertices)
    if outside.any():
        indexed = INDEXED[name]
        raise InvalidShapeError(
            f"{name} must index {indexed} 0..{n_vertices - 1}; {_first(name, rows, outside)}."
        )
    return rows.astype(np.int64, order="C")


def _table(value: ArrayLike, name: str, columns: int | None) -> NDArray[Any]:
    wanted = f"(n, {columns or 'd'})"
    try:
        rows = as_array(value, name, InvalidShapeError)
    except InvalidShapeError:
        raise
    except ValueError as err:
        raise InvalidShapeError(
            f"{name} must have shape {wanted}; the rows differ in length."
        ) from err
    if rows.size == 0:
        return np.empty((0, columns or 0), dtype=np.int64)
    if rows.ndim != 2 or columns not in (None, rows.shape[1]):
        hint = " Transpose it." if rows.ndim == 2 and rows.shape[0] == columns else ""
        raise InvalidShapeError(
            f"{name} must have shape {wanted}; the shape is {rows.shape}.{hint}"
        )
    if len(rows) > 1 and rows.strides[0] == 0:
        raise InvalidShapeError(
            f"{name} must not be one broadcast row; all {len(rows)} rows are {rows[0].tolist()} "
            "at one place in memory. Copy the array if this is intended."
        )
    return rows


def _first(name: str, rows: NDArray[Any], bad: NDArray[np.bool_]) -> str:
    row = int(np.flatnonzero(bad.any(axis=1))[0])
    return f"{SINGULAR[name]} {row} is {rows[row].tolist()}"


def vertex_values(value: ArrayLike, name: str, n_vertices: int) -> NDArray[np.float64]:
    """Return `value` as a float64 array with one finite number per vertex."""
    values = real_numbers(value, name)
    if values.shape != (n_vertices,):
        raise InvalidParameterError(
            f"{name} must hold one number per vertex, shape ({n_vertices},); "
            f"the shape is {values.shape}."
        )
    return all_finite(values, name)


def point_functions(value: ArrayLike, name: str, n_points: int) -> NDArray[np.float64]:
    """Return `value` as finite float64 numbers: one per point, or a column for each function."""
    values = real_numbers(value, name)
    if values.ndim not in (1, 2) or len(values) != n_points:
        hint = " Transpose it." if values.ndim == 2 and values.shape[1] == n_points else ""
        raise InvalidParameterError(
            f"{name} must hold one number per point, shape ({n_points},) or ({n_points}, k) for k "
            f"functions; the shape is {values.shape}.{hint}"
        )
    return all_finite(values, name)


def simplex_vectors(value: ArrayLike, n_simplices: int, ambient: int) -> NDArray[np.float64]:
    """Return `vectors` as finite float64 numbers: one per simplex, or k of them, (s, d, k)."""
    vectors = real_numbers(value, "vectors")
    if vectors.ndim not in (2, 3) or vectors.shape[:2] != (n_simplices, ambient):
        raise InvalidParameterError(
            f"vectors must hold one vector per simplex, shape ({n_simplices}, {ambient}) or "
            f"({n_simplices}, {ambient}, k) for k fields; the shape is {vectors.shape}."
        )
    return all_finite(vectors, "vectors")


def face_labels(value: ArrayLike, name: str, mesh: Any) -> NDArray[Any]:
    """Return `value` as an array with one whole number per face, of any integer type."""
    labels, n_faces = as_array(value, name), len(mesh.simplices)
    if labels.shape != (n_faces,) or labels.dtype.kind not in "iu":
        remedy = (
            " Labels of vertices become those of faces by labels[mesh.simplices[:, 0]]; "
            "es.figure_field draws them as they are."
            if labels.shape == (len(mesh.points),)
            else ""
        )
        raise InvalidParameterError(
            f"{name} must hold one whole number per face, shape ({n_faces},); "
            f"the shape is {labels.shape} and the type {labels.dtype}.{remedy}"
        )
    return labels


def require_finite_rows(rows: NDArray[np.float64], name: str, noun: str) -> None:
    """Raise an error if a number is not finite; `noun` says what each row belongs to."""
    bad = np.argwhere(~np.isfinite(rows))
    if len(bad):
        row = bad[0][0]
        # A vector is shown as a whole; of many functions, the value of the first bad one.
        is_vector = rows[row].size <= MOST_COORDINATES
        value = rows[row].tolist() if is_vector else rows[tuple(bad[0])]
        raise InvalidParameterError(f"{name} must be finite; that of {noun} {row} is {value}.")


def step_number(n_steps: Integer) -> int:
    """Return `n_steps`, the number of steps of a loop, as an int from 1 to a million."""
    return whole_number(n_steps, "n_steps", 1, MOST_STEPS, "no shape needs more steps")


def label_components(
    n: int, one: Int[np.ndarray, " k"], two: Int[np.ndarray, " k"]
) -> tuple[int, Int[np.ndarray, " n"]]:
    """Count the groups of n things of which k pairs are linked, and return the group of each.

    Groups are in the order of their first things.
    """
    first, second = (np.ascontiguousarray(end, dtype=np.int64) for end in (one, two))
    labels = np.empty(n, dtype=np.int64)
    return number_groups(first, second, labels), labels


def find_keys(keys: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the place of each value among the keys, or -1."""
    if not len(keys):
        return np.full(len(values), -1)
    order = np.argsort(keys, kind="stable")
    found = order[np.searchsorted(keys[order], values).clip(0, len(keys) - 1)]
    return np.where(keys[found] == values, found, -1)


def sorted_rows(
    rows: Int[np.ndarray, "r c"],
) -> tuple[Int[np.ndarray, " r"], Int[np.ndarray, "r c"], Bool[np.ndarray, " r"]]:
    """Sort rows: return the stable order, the sorted rows, and which repeat the row before."""
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    repeats = np.zeros(len(rows), dtype=bool)
    repeats[1:] = (ordered[1:] == ordered[:-1]).all(axis=1)
    return order, ordered, repeats


def number_places(points: Float[np.ndarray, "n d"]) -> Int[np.ndarray, " n"]:
    """Return for each point the number of its place; equal points have the same place."""
    # np.unique compares bytes; adding 0.0 turns -0.0 into 0.0.
    _, place = np.unique(points + 0.0, axis=0, return_inverse=True)
    return place.ravel().astype(np.int64)


def adjacency_matrix(edges: Int[np.ndarray, "e 2"], values: np.ndarray, n: int) -> sp.csr_array:
    """Return the symmetric matrix of weighted edges, each given once."""
    both = np.concatenate([edges, edges[:, ::-1]]).T
    return sp.csr_array((np.tile(values, 2), both), shape=(n, n))


def as_affine(to_space: ArrayLike | None) -> np.ndarray:
    """Return an affine map of space as a matrix, by default that which changes nothing.

    Raise InvalidParameterError if it is no such matrix or cannot be inverted.
    """
    if to_space is None:
        return np.eye(4)
    matrix = real_numbers(to_space, "to_space").astype(np.float64)
    if (
        matrix.shape != (4, 4)
        or not np.isfinite(matrix).all()
        or not np.array_equal(matrix[3], [0, 0, 0, 1])
        or np.linalg.matrix_rank(matrix[:3, :3]) < 3
    ):
        given = matrix.tolist() if matrix.size <= 16 else "larger"
        raise InvalidParameterError(
            "to_space must be an affine map that can be inverted, finite numbers of shape (4, 4) whose "
            f"last row is 0, 0, 0, 1; it is {given}, of shape {matrix.shape}."
        )
    return matrix


def different_values(table: np.ndarray, most: int, noun: str) -> str:
    """List the different values of a table, the first of them if they are too many."""
    there = np.unique(table)
    ending = f", ... ({len(there)} {noun})" if len(there) > most else ""
    return ", ".join(f"{value:g}" for value in there[:most].astype(float)) + ending


def source_sets(sources: ArrayLike, n_points: int) -> list[Int[np.ndarray, " s"]]:
    """Return the points of each source, ascending: a source is a point, or a set of points.

    Raises an error if one is not a point.
    """
    try:
        entries: list[Any] = list(sources)  # type: ignore[arg-type]
    except (TypeError, KeyError):  # one number, or an object that is read by names
        entries = [sources]
    sets = [source_points(entry, n_points) for entry in entries]
    if len(sets) == n_points:
        require_no_mask(np.concatenate(sets), "The list of sources", n_points)
    return sets


def source_points(source: ArrayLike, n_points: int) -> Int[np.ndarray, " s"]:
    """Return the points of one source, ascending and each once. Raises an error if one is not a point."""
    numbers = whole_numbers(source, "A source", 0, n_points - 1)
    require_no_mask(numbers, "A source", n_points)
    return np.unique(numbers)


def require_sources(sources: ArrayLike, n_points: int) -> Int[np.ndarray, " k"]:
    """Return sources as integers.

    Raise InvalidParameterError if there is none, or one is not a point.
    """
    wanted = whole_numbers(sources, "A source", 0, n_points - 1)
    if not wanted.size:
        raise InvalidParameterError(NO_SOURCE)
    require_no_mask(wanted, "The list of sources", n_points)
    return wanted
