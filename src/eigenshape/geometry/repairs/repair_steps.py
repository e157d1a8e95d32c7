"""The repairs of meshes and clouds, one function each; each reports what it did."""

from typing import Any

import numpy as np
from jaxtyping import Bool, Int
from scipy.spatial import cKDTree

from certeig.kit.errors import InvalidParameterError
from eigenshape._arrays import label_components, number_places
from eigenshape._corners import scaled_corners, side_lengths
from eigenshape._errors import count_nouns
from eigenshape._vectors import scale_to_unit, size_one, triangle_areas
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair_report import (
    MeshT,
    RepairedCloud,
    RepairedMesh,
    simplex_noun,
)
from eigenshape.geometry.seams import seams
from eigenshape.geometry.simplices import MEASURES, degenerate_simplices
from eigenshape.geometry.simplicial import Mesh
from eigenshape.geometry.topology import (
    edge_table,
    repeated_simplices,
    require_simplices_everywhere,
    submesh,
    unreferenced_vertices,
    vertex_components,
)

# A face is a needle if one of its sides is shorter than this share of another. Cotangents of 1e6
# are the largest that solvers handled beside ordinary ones in every mesh that was tried; with 1e9
# they lost the eigenvalue 0 in meshes of many parts.
NEEDLE = 1e-6
# A side shorter than this share of the longest side of the whole mesh is collapsed too: the area
# there is below 1e-18 of others, and rounding hides one beside the other. Surfaces graded by tens
# from side to side are solved down to 1e-9, and no longer at 1e-10.
TINY_SIDE = 1e-9


def weld(mesh: MeshT, *, tolerance: float = 0.0) -> RepairedMesh[MeshT]:
    """Join all vertices that lie at the same place.

    Vertices linked by a chain of distances up to `tolerance`, a share of the diagonal of the
    bounding box, are all joined. Closed pieces that touch are joined too; `weld_seams` keeps them
    apart. Raises an error if `tolerance` is not in 0..0.1.
    """
    if not 0 <= tolerance <= 0.1:
        raise InvalidParameterError(
            f"tolerance must lie in 0..0.1 of the diagonal of the bounding box; it is {tolerance}."
        )
    if tolerance == 0:
        group = number_places(mesh.points)
    else:
        points, _ = scale_to_unit(mesh.points)
        radius = tolerance * float(np.linalg.norm(np.ptp(points, axis=0)))
        near = cKDTree(points).query_pairs(radius, output_type="ndarray")
        _, group = label_components(mesh.n_points, *near.T)
    return _merge_vertices(mesh, group, "weld joined {} to others at the same place")


def weld_seams(mesh: MeshT) -> RepairedMesh[MeshT]:
    """Join boundary edges that lie on each other, such as the seams of a surface that was cut open.

    Edges may be apart by the rounding of stored coordinates, as `seams` tells. This also connects a
    soup of separate triangles. Pieces that touch without such a seam, as closed pieces do, stay
    apart. Only edges on the boundary change: they get two faces or more.
    """
    one, two = seams(mesh).transpose(1, 0, 2).reshape(2, -1)
    _, group = label_components(mesh.n_points, one, two)
    gaps, scale = size_one(mesh.points[one] - mesh.points[two])
    widest = scale * float(np.linalg.norm(gaps, axis=1).max(initial=0.0))
    report = "weld_seams joined {} along seams"
    if widest > 0:
        report += f", which were open by up to {widest:.2g}"
    return _merge_vertices(mesh, group, report)


def _merge_vertices(mesh: MeshT, group: Int[np.ndarray, " n"], report: str) -> RepairedMesh[MeshT]:
    """Replace each group of vertices by its first vertex; these keep their order."""
    _, first, number = np.unique(group, return_index=True, return_inverse=True)
    kept, renumbered = np.unique(first[number], return_inverse=True)
    joined = type(mesh)(mesh.points[kept], renumbered[mesh.simplices])
    n_joined = count_nouns(mesh.n_points - joined.n_points, "vertex")
    return RepairedMesh(joined, (report.format(n_joined),), kept)


def drop_degenerate(mesh: Mesh) -> RepairedMesh[Any]:
    """Remove faces without area, or simplices without volume; their vertices stay.

    If a vertex of such a face lies on its longest side, the face on the other side of that edge is
    split at the vertex. So no slit opens, and a closed surface stays closed.
    """
    n_flat = len(degenerate_simplices(mesh))
    n_split = 0
    if n_flat and isinstance(mesh, TriangleMesh):
        mesh, n_split = flip_flat_faces(mesh)
    measure = MEASURES.get(mesh.dim, MEASURES[3])[2]
    report = f"drop_degenerate removed {count_nouns(n_flat, simplex_noun(mesh))} without {measure}"
    if n_split:
        report += f", and split {count_nouns(n_split, 'neighbor')} at their vertices"
    return _drop_simplices(mesh, degenerate_simplices(mesh), report)


def flip_flat_faces(mesh: TriangleMesh) -> tuple[TriangleMesh, int]:
    """Flip the longest edge of each face without area; return the mesh and the number of flips.

    A face (a, b, m) without area has its vertex m on the edge (a, b). If the face were only
    removed, the edges (a, m) and (m, b) would separate from (a, b): heat would not cross there, and
    a closed surface would become open. So the face (a, b, d) on the other side of the edge is split
    at m into (a, m, d) and (m, b, d). The surface stays the same set of points.

    An edge is left alone if it does not have exactly two faces, if the edge (m, d) exists already,
    or if the flip would create another face without area, as where m coincides with a.
    """
    # A face that has a vertex twice touches an edge twice, so that it closes nothing; with it the
    # edge would have three faces, and would be left alone.
    folded = (mesh.faces == np.roll(mesh.faces, 1, axis=1)).any(axis=1)
    if folded.any() and not folded.all():
        mesh = TriangleMesh(mesh.vertices, mesh.faces[~folded])
    n_flips = 0
    while True:
        table = edge_table(mesh)
        flat = degenerate_simplices(mesh)
        points, _ = size_one(mesh.vertices)
        sides = np.stack([np.roll(mesh.faces[flat], -turn, axis=1) for turn in (1, 2)], axis=2)
        lengths = np.linalg.norm(points[sides[..., 0]] - points[sides[..., 1]], axis=2)
        corner = lengths.argmax(axis=1)  # opposite to the longest side
        (a, b), m = sides[np.arange(len(flat)), corner].T, mesh.faces[flat, corner]
        edge = table.face_edges[flat, corner]
        # Of two faces at an edge, one is the sum of their numbers less the other.
        has_two = table.n_faces[edge] == 2
        owners = np.repeat(np.arange(mesh.n_faces), 3)
        sums = np.bincount(table.face_edges.ravel(), weights=owners).astype(np.int64)
        neighbor = np.where(has_two, sums[edge] - flat, flat)
        between = mesh.faces[neighbor]
        d = between.sum(axis=1) - a - b
        one = np.where(between == b[:, None], m[:, None], between)
        two = np.where(between == a[:, None], m[:, None], between)
        keys = np.minimum(m, d) * mesh.n_vertices + np.maximum(m, d)
        known = table.edges[:, 0] * mesh.n_vertices + table.edges[:, 1]
        good = has_two & ~np.isin(neighbor, flat) & ~np.isin(keys, known)
        for halves in (one, two):
            if len(halves):
                good[degenerate_simplices(TriangleMesh(mesh.vertices, halves))] = False
        # No two flips share a face or create the same edge, so all can be done at once.
        chosen = np.flatnonzero(good)
        chosen = chosen[np.unique(neighbor[chosen], return_index=True)[1]]
        chosen = chosen[np.unique(keys[chosen], return_index=True)[1]]
        if not len(chosen):
            return mesh, n_flips
        faces = mesh.faces.copy()
        faces[flat[chosen]], faces[neighbor[chosen]] = one[chosen], two[chosen]
        mesh, n_flips = TriangleMesh(mesh.vertices, faces), n_flips + len(chosen)


def collapse_needles(mesh: MeshT) -> RepairedMesh[MeshT]:
    """Collapse sides shorter than a millionth of the longest side of their face or simplex.

    Such a face has area, but its cotangents are so large that the entries of other faces are lost
    in rounding, and its eigenvalues hide those of the shape. Sides shorter than a billionth of the
    longest side of the mesh are collapsed for the same reason. No point moves by more than the length
    of the collapsed sides. Faces that lose a side are removed. A mesh in which every face is a
    needle is left as it is.
    """
    corners, _ = scaled_corners(mesh)
    lengths = side_lengths(corners)
    # Sides of length 0 belong to faces without area, which `drop_degenerate` removes.
    least = np.maximum(NEEDLE * lengths.max(axis=1, keepdims=True), TINY_SIDE * lengths.max())
    short = (lengths > 0) & (lengths < least)
    if short.any(axis=1).all():
        short[:] = False
    in_simplex, side = np.nonzero(short)
    one, two = np.triu_indices(mesh.dim + 1, 1)
    starts, ends = mesh.simplices[in_simplex, one[side]], mesh.simplices[in_simplex, two[side]]
    _, group = label_components(mesh.n_points, starts, ends)
    joined = _merge_vertices(mesh, group, "collapse_needles joined {} to others beside them")
    ordered = np.sort(joined.mesh.simplices, axis=1)
    collapsed = (ordered[:, 1:] == ordered[:, :-1]).any(axis=1) & short.any(axis=1)
    report = (
        f"{joined.report[0]}, and removed {count_nouns(int(collapsed.sum()), simplex_noun(mesh))}"
    )
    kept = _drop_simplices(joined.mesh, np.flatnonzero(collapsed), report)
    return RepairedMesh(kept.mesh, kept.report, joined.source_vertices)


def drop_duplicate_faces(mesh: MeshT) -> RepairedMesh[MeshT]:
    """Keep the first of all faces or simplices with the same corners, in any order."""
    repeated = repeated_simplices(mesh)[:, 1]
    report = f"drop_duplicate_faces removed {count_nouns(len(repeated), simplex_noun(mesh))}"
    report += " with the corners of an earlier one"
    return _drop_simplices(mesh, repeated, report)


def _drop_simplices(
    mesh: MeshT, dropped: Int[np.ndarray, " k"], report: str
) -> RepairedMesh[MeshT]:
    kept = type(mesh)(mesh.points, np.delete(mesh.simplices, dropped, axis=0))
    return RepairedMesh(kept, (report,), np.arange(mesh.n_points))


def drop_unreferenced(mesh: MeshT) -> RepairedMesh[MeshT]:
    """Remove vertices without a face or simplex."""
    n_loose = len(unreferenced_vertices(mesh))
    source, renumbered = np.unique(mesh.simplices, return_inverse=True)
    kept = type(mesh)(mesh.points[source], renumbered.reshape(mesh.simplices.shape))
    noun = "face" if mesh.dim == 2 else "simplex"
    report = f"drop_unreferenced removed {count_nouns(n_loose, 'vertex')} without a {noun}"
    return RepairedMesh(kept, (report,), source)


def largest_component(mesh: TriangleMesh) -> RepairedMesh[TriangleMesh]:
    """Keep the connected component with the largest area.

    Of components with equal areas the one with the lowest vertex is kept.
    """
    count, _ = vertex_components(mesh)
    keep = faces_of_largest(mesh)
    kept, source = submesh(mesh, keep)
    report = f"largest_component removed {count_nouns(count - 1, 'component')}"
    report += f" with {count_nouns(int((~keep).sum()), 'face')}"
    return RepairedMesh(kept, (report,), source)


def faces_of_largest(mesh: TriangleMesh) -> Bool[np.ndarray, " f"]:
    """Mark the faces of the component that `largest_component` keeps."""
    _, labels = vertex_components(mesh)
    of_face = np.unique(labels[mesh.faces[:, 0]], return_inverse=True)[1]
    areas = triangle_areas(scaled_corners(mesh)[0])
    return of_face == np.argmax(np.bincount(of_face, weights=areas))


def drop_duplicate_points(cloud: PointCloud) -> RepairedCloud:
    """Keep the first of all points of a cloud at the same place."""
    source = np.sort(np.unique(number_places(cloud.points), return_index=True)[1])
    removed = count_nouns(cloud.n_points - len(source), "point")
    report = f"drop_duplicate_points removed {removed} at the places of others"
    return RepairedCloud(PointCloud(cloud.points[source], cloud.dim), (report,), source)


# A component with less than 1/100 of the area is a fragment.
N_SHARES = 100
# If the components that are large enough have less than this share of the area together, the shape
# consists of small parts, and its largest N_SHARES components are kept instead.
LEAST_SHARE_KEPT = 0.5
# Areas, relative to the largest, are compared to this many decimals: copies of one part at
# different places differ by rounding and must count as equal.
EQUAL_DIGITS = 9


def fragment_vertices(mesh: TriangleMesh, n_shares: int = N_SHARES) -> Int[np.ndarray, " c"]:
    """Return the vertices of loose fragments: components with less than 1/n of the area.

    If most of the area is in such components, all but the n largest components are fragments. Of
    components with equal areas those with the lowest vertices are kept first.

    Raise InvalidShapeError if a vertex has no face.

    Parameters
    ----------
    mesh : TriangleMesh
    n_shares : int
        The number n, at least 1.

    Returns
    -------
    (c,) int
        Vertices, ascending; empty if the mesh is connected.
    """
    count, labels = vertex_components(mesh)
    require_simplices_everywhere(mesh)
    face_areas = triangle_areas(scaled_corners(mesh)[0])
    areas = np.bincount(labels[mesh.faces[:, 0]], weights=face_areas, minlength=count)
    if count == 1 or not areas.any():
        return np.empty(0, dtype=np.int64)
    small = n_shares * areas < areas.sum()
    if areas[~small].sum() < LEAST_SHARE_KEPT * areas.sum():
        sizes = np.round(areas / areas.max(), EQUAL_DIGITS)
        largest = np.argsort(-sizes, kind="stable")[:n_shares]
        small = np.isin(np.arange(count), largest, invert=True)
    return np.flatnonzero(small[labels])
