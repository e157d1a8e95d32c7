"""Attributes transferred from a mesh to a repaired or decimated one."""

from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import csr_array

from eigenshape._arrays import number_places, sorted_rows
from eigenshape._corners import mean_normals
from eigenshape._vectors import area_vectors, row_dots, size_one, unit_vectors
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.distances.closest import closest_points
from eigenshape.geometry.distances.closest_loops import nearest_around
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union, join_places
from eigenshape.io.attributes import MeshAttributes

# Faces are searched this many times as far from the middle of a new face as its corners are.
REACH = 1.5
MOST_COPIES = 8  # faces at one place and of one side that keep their own attributes
# Values on both sides of an edge differ by more than this where there is a seam. Interpolation
# rounds coordinates, and colors to whole numbers.
SEAMS = {"texture_coordinates": 1e-6, "colors": 1}


def carry_attributes(attributes: MeshAttributes, mesh: MeshLike) -> MeshAttributes:
    """Carry the attributes of a mesh to a repaired or decimated one.

    Each face takes material and group of the old face that is nearest to its middle. From there the
    search for the nearest points of its corners spreads over the old faces, but not across seams:
    edges where texture coordinates or colors jump, or the material or group changes. At the points
    found, texture coordinates, normals and colors are interpolated. So each face looks into one
    chart of the texture, and a face of the old mesh gets back the very values that it had.

    Faces and vertices may have been dropped, welded, reordered or turned over, and new faces, such
    as those of a filled hole, look as what is beside them.

    Parameters
    ----------
    attributes : MeshAttributes
        Of the mesh before.
    mesh : MeshLike
        The mesh after the repair, and before it is bent.

    Returns
    -------
    MeshAttributes
        Of `mesh`.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> path = pathlib.Path(tempfile.mkdtemp(), "a.ply")
    >>> es.write_mesh(es.icosphere(1), path)
    >>> mesh, attributes = es.read_mesh(path, attributes=True)
    >>> done = es.repair(es.TriangleMesh(mesh.vertices, mesh.faces[5:]), ["fill_holes"])
    >>> es.io.carry_attributes(attributes, done.mesh).mesh.n_faces == done.mesh.n_faces
    True
    """
    mesh = as_mesh(mesh)
    old = attributes.mesh
    if np.array_equal(old.faces, mesh.faces) and np.array_equal(old.vertices, mesh.vertices):
        return attributes
    # The numbers of the places where the corners of all faces lie, the old faces first
    both = disjoint_union(old, mesh)
    places = number_places(both.vertices)[both.faces]
    starts, left = _nearest_faces(old, mesh, places)
    # A face at the places of an old one has its very values; corners of others lie on old faces.
    faces, weights = np.column_stack([starts] * 3), np.zeros((mesh.n_faces, 3, 3))
    old_order = np.argsort(places[: old.n_faces][starts], axis=1, kind="stable")
    order = np.argsort(places[old.n_faces :], axis=1, kind="stable")
    weights[np.arange(mesh.n_faces)[:, None], order, old_order] = 1.0
    if left.size:
        new_corners = mesh.vertices[mesh.faces[left]]
        neighbors = _neighbors(attributes, places[: old.n_faces])
        faces[left], weights[left] = _corner_places(old, new_corners, starts[left], neighbors)
    return _gather(attributes, mesh, _corner_matrix(faces, weights, old), starts)


def wear_attributes(
    attributes: MeshAttributes,
    mesh: TriangleMesh,
    places: Float[np.ndarray, "n 3"],
    faces: Int[np.ndarray, " n"],
) -> MeshAttributes:
    """Carry attributes to a mesh of another shape, each vertex of which has a place on a face of the old mesh.

    As in `carry_attributes` each face looks into one chart of the texture: that at its middle, which
    is on the side of a seam where most of it lies.
    """
    old = attributes.mesh
    numbers = number_places(old.vertices)[old.faces]
    wanted = places[mesh.faces]
    middles = wanted.mean(axis=1, keepdims=True)
    # From the nearest corner the search for the middle follows the surface, so that it does not
    # jump to another limb, and it crosses seams.
    nearest = np.linalg.norm(wanted - middles, axis=2).argmin(axis=1)
    starts = faces[mesh.faces][np.arange(mesh.n_faces), nearest]
    across = _neighbors(MeshAttributes.plain(old), numbers)
    starts = _corner_places(old, np.repeat(middles, 3, axis=1), starts, across)[0][:, 0].copy()
    found = _corner_places(old, wanted, starts, _neighbors(attributes, numbers))
    matrix = _corner_matrix(*found, old)
    # Rounding must not split vertices: corners that look alike get what the first of them has.
    keys = [mesh.faces.ravel(), np.repeat(attributes.face_parts[starts], 3)]
    for name, step in SEAMS.items():
        values = getattr(attributes, name)
        if values is not None:
            keys.append(np.rint(matrix @ values.reshape(matrix.shape[1], -1) / step))
    first, groups = split_corners(keys)
    worn = _gather(attributes, mesh, matrix[first[groups]], starts)
    # The mesh is smooth, also across seams of the texture.
    joined = join_places(mesh)[0]
    normals = mean_normals(joined)[joined.faces]
    return replace(worn, places=places, normals=normals)


def split_corners(keys: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Make one vertex of all corners whose keys agree; return its first corner, and the indices."""
    _, first, indices = np.unique(
        np.column_stack(keys), axis=0, return_index=True, return_inverse=True
    )
    return first, indices.ravel()


def _corner_matrix(
    faces: Int[np.ndarray, "f 3"], weights: Float[np.ndarray, "f 3 3"], old: TriangleMesh
) -> csr_array:
    """Return what the corners of old faces give to each corner, as `MeshAttributes.corners`."""
    columns = (3 * faces[:, :, None] + np.arange(3)).ravel()
    rows = np.repeat(np.arange(faces.size), 3)
    entries = (weights.ravel(), (rows, columns))
    matrix = csr_array(entries, shape=(faces.size, 3 * old.n_faces))
    matrix.eliminate_zeros()
    return matrix


def _gather(
    attributes: MeshAttributes,
    mesh: TriangleMesh,
    matrix: csr_array,
    starts: Int[np.ndarray, " f"],
) -> MeshAttributes:
    """Interpolate values of corners by a matrix, and take those of faces from one old face each."""
    old = attributes.mesh
    carried: dict[str, Any] = {}
    for name in ("texture_coordinates", "normals", "colors"):
        values = getattr(attributes, name)
        if values is not None:
            table = interpolate(matrix, values.reshape(-1, values.shape[2]))
            if name == "normals" and matrix.nnz > len(table):  # some are means
                table = unit_vectors(table)
            carried[name] = table.reshape(-1, 3, values.shape[2])

    def at_vertices(values: np.ndarray) -> np.ndarray:
        rows = np.zeros((mesh.n_vertices, *values.shape[1:]), values.dtype)
        at_corners = values[old.faces.ravel()]
        # A corner that is an old vertex has its value, and all corners of a vertex agree but for rounding.
        rows[mesh.faces.ravel()] = interpolate(matrix, at_corners, blend=values.dtype.kind == "f")
        return rows

    fields = {}
    for name, values in attributes.fields.items():
        is_of_faces = len(values) != old.n_vertices
        fields[name] = values[starts] if is_of_faces else at_vertices(values)
    return replace(
        attributes,
        mesh=mesh,
        corners=csr_array(matrix @ attributes.corners),
        fields=fields,
        face_parts=attributes.face_parts[starts],
        face_materials=attributes.face_materials[starts],
        face_groups=attributes.face_groups[starts],
        places=None if attributes.places is None else at_vertices(attributes.places),
        **carried,
    )


def interpolate(corners: csr_array, values: np.ndarray, *, blend: bool = True) -> np.ndarray:
    """Return values at new corners in the type of the old; without blending, those of most weight."""
    if not blend:
        order = np.lexsort([corners.data, corners.tocoo().row])
        return values[corners.indices[order[corners.indptr[1:] - 1]]]
    found = corners @ values.astype(np.float64)
    return (np.rint(found) if values.dtype.kind in "iu" else found).astype(values.dtype)


def _nearest_faces(
    old: TriangleMesh, new: TriangleMesh, places: Int[np.ndarray, "g 3"]
) -> tuple[Int[np.ndarray, " f"], Int[np.ndarray, " k"]]:
    """Return the old face at the places of each new one, and the new ones that have only the nearest.

    On a sheet of two sides it is the right side.
    """
    n_old = old.n_faces
    keys = np.unique(np.sort(places, axis=1), axis=0, return_inverse=True)[1].ravel()
    # Whether a face goes around its places in their order, or the other way around
    turned = np.argsort(places, axis=1, kind="stable")
    sides = 2 * keys + np.isin(turned @ [9, 3, 1], [5, 15, 19])  # 012, 120 and 201 in base 3
    # Of several faces at one place, such as a label on a wall, the first new one is the first old one.
    old_sides, new_sides = sides[:n_old], sides[n_old:]
    olds = np.full((sides.max() + 2, MOST_COPIES), -1)
    olds[old_sides[::-1], _ranks(old_sides)[::-1]] = np.arange(n_old)[::-1]
    first = olds[:, 0]
    found = first[new_sides ^ 1]
    for same in (first[new_sides], olds[new_sides, _ranks(new_sides)]):
        found = np.where(same >= 0, same, found)
    left = np.flatnonzero(found < 0)
    if left.size:
        corners = new.vertices[new.faces[left]]
        nearest = closest_points(old, corners.mean(axis=1)).simplices
        twins = first[old_sides[nearest] ^ 1]
        normals = unit_vectors(area_vectors(corners))
        old_normals = unit_vectors(area_vectors(old.vertices[old.faces[nearest]]))
        looks_away = row_dots(normals, old_normals) < 0
        found[left] = np.where(looks_away & (twins >= 0), twins, nearest)
    return found, left


def _ranks(sides: Int[np.ndarray, " g"]) -> Int[np.ndarray, " g"]:
    """Return how many faces before each one have the same places, up to a limit."""
    order = np.argsort(sides, kind="stable")
    ranks = np.empty_like(order)
    ranks[order] = np.arange(len(sides)) - np.searchsorted(sides[order], sides[order])
    return ranks.clip(max=MOST_COPIES - 1)


def _corner_places(
    old: TriangleMesh,
    new_corners: Float[np.ndarray, "k 3 3"],
    starts: Int[np.ndarray, " k"],
    neighbors: Int[np.ndarray, "o 3"],
) -> tuple[Int[np.ndarray, "k 3"], Float[np.ndarray, "k 3 3"]]:
    """Return for each corner the old face in which its nearest point lies, and the weights there."""
    middle = old.vertices.mean(axis=0)
    corners, scale = size_one(old.vertices[old.faces] - middle)
    wanted = (new_corners - middle) / scale
    middles = wanted.mean(axis=1, keepdims=True)
    radii = np.linalg.norm(wanted - middles, axis=2).max(axis=1)
    gaps = np.linalg.norm(corners[starts].mean(axis=1) - middles[:, 0], axis=1)
    reach = REACH * np.maximum(radii, gaps)
    return nearest_around(wanted, middles[:, 0], starts, reach**2, corners, neighbors)


def _neighbors(
    attributes: MeshAttributes, places: Int[np.ndarray, "o 3"]
) -> Int[np.ndarray, "o 3"]:
    """Return the face across each edge, by place; the face itself at a border or a seam."""
    count = places.size
    here = np.arange(count)  # corners, and the edges that begin there
    ahead = here - here % 3 + (here % 3 + 1) % 3
    at = places.ravel()
    ends = np.sort(np.column_stack([at, at[ahead]]), axis=1)
    kinds = [attributes.face_parts, attributes.face_materials, attributes.face_groups]
    keys = np.column_stack([*(np.repeat(kind, 3) for kind in kinds), ends])
    order, _, repeats = sorted_rows(keys)
    begins = np.flatnonzero(~repeats)
    following = np.arange(1, count + 1)
    following[np.r_[begins[1:], count] - 1] = begins  # the last face at an edge meets the first
    across = np.empty(count, dtype=np.int64)
    across[order] = order[following]
    turned = at[across] != at[here]
    one, two = np.where(turned, ahead[across], across), np.where(turned, across, ahead[across])
    is_smooth = np.ones(count, dtype=bool)
    for name, step in SEAMS.items():
        values = getattr(attributes, name)
        if values is not None:
            rows = values.reshape(count, -1).astype(np.float64)
            is_smooth &= (np.abs(rows[here] - rows[one]) <= step).all(axis=1)
            is_smooth &= (np.abs(rows[ahead] - rows[two]) <= step).all(axis=1)
    return np.where(is_smooth, across, here).reshape(-1, 3) // 3
