"""The connected pieces of a shape, and what matching works on: each itself, or a copy.

A copy has neither too many vertices nor needles nor long edges. Loose pieces are left out.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from certeig.kit.arrays import ReadOnly, record
from eigenshape._corners import mean_normals
from eigenshape._errors import count_nouns
from eigenshape.geometry.face_turns import inconsistent_edges
from eigenshape.geometry.measure import edge_lengths, face_areas, surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.orientation import orient_outward
from eigenshape.geometry.repairs.repair import repair
from eigenshape.geometry.repairs.repair_steps import largest_component
from eigenshape.geometry.resolution.subdivision import split_long_edges
from eigenshape.geometry.resolution.thinning import thin_out
from eigenshape.geometry.topology import edge_table, submesh, vertex_components
from eigenshape.matching.spectral_refinement import places_in_faces
from eigenshape.operators.smoothing import denoise

# A piece with more vertices than this is thinned out to fewer. On three pairs of skulls of 90,000
# vertices (24 mm long) the mean error at 51 landmarks is 0.21 mm with 16,000, at 15 CPU s a pair; that
# of copies decimated elsewhere to 9,600 is 0.23.
MOST_VERTICES = 16_000
# A piece with an edge shorter than NEEDLE √area gets a copy, in which edges shorter than SHORT √area
# are joined. Smoothing would shrink the faces at such edges until no operator can be solved. The
# smallest disc that is compared has a radius of 0.075 √area, and meshes of 5,000 vertices have edges
# of 0.015 √area.
NEEDLE, SHORT = 1e-4, 0.003
# Edges longer than this many √area, of the larger shape, are split, since coarse meshes have coarse patches and
# few sound eigenfunctions. Of copies decimated to 300 and 600 vertices (edges of 0.08 and 0.05 √area) on shapes of
# 5,000 in another pose, the mean error falls from 6.9 and 3.9 hundredths of √area to 1.0 and 0.8; with
# half this length it is as large.
LONG = 0.06
# Places on the whole of the corners of one face that are farther apart than this many √area of the
# whole are not interpolated: the map is torn there.
TORN = 0.1
# Length, in √area, that a difference of normals counts for when the nearest point is looked for: enough
# to keep the two sides of a wall of 0.02 apart. With 0.08, as in fits, noisy normals move the points of
# skulls by 0.15 mm; 0.003 is as good.
NORMAL_SHARE = 0.01


@record
class WorkingCopy:
    """A connected surface that faces outward, and the mesh that stands for it while matching.

    Both are one mesh if that is neither too large nor too coarse and has no needles. `turned` says that the
    faces of the original looked inward before.
    """

    original: TriangleMesh
    mesh: TriangleMesh
    turned: bool

    @cached_property
    def clean(self) -> TriangleMesh:
        """The mesh without noise, so that patches of a scan compare with those of a clean shape."""
        return denoise(self.mesh)


# What may be left to do after edges are joined. The orientation is that of the original.
REPAIRS = ("drop_duplicate_faces", "drop_degenerate", "drop_unreferenced", "largest_component")


def longest_edge(*meshes: TriangleMesh) -> float:
    """Return the length of the longest edge that matching meshes allows; by the area of the largest one."""
    return LONG * float(np.sqrt(max(map(surface_area, meshes))))


def make_working_copy(mesh: TriangleMesh, longest: float) -> WorkingCopy:
    """Return a connected mesh as it is, or with a copy that matching can work on.

    Edges that are longer than `longest` are split.
    """
    outward = orient_outward(mesh)
    turned = outward is not mesh
    unit = float(np.sqrt(surface_area(mesh)))
    has_needles = edge_lengths(mesh).min() < NEEDLE * unit
    copy = outward
    if mesh.n_vertices > MOST_VERTICES or has_needles:
        thin, _ = thin_out(outward, MOST_VERTICES)
        copy = repair(_join_short_edges(thin, SHORT * unit), REPAIRS).mesh
        # Rims that were joined side by side may look different ways.
        while len(edges := inconsistent_edges(copy)):
            at_edges = np.isin(copy.faces, edges).sum(axis=1) > 1
            copy = largest_component(submesh(copy, ~at_edges)[0]).mesh
    copy, _ = split_long_edges(copy, longest, MOST_VERTICES)
    return WorkingCopy(outward, copy, turned)


def _join_short_edges(mesh: TriangleMesh, length: float) -> TriangleMesh:
    """Join the ends of edges that are shorter than a length, also where that changes the topology.

    In each round the edges that are the shortest at both of their ends are joined, so that no chain
    of short edges shrinks to a point.
    """
    faces = mesh.faces
    while True:
        edges = edge_table(TriangleMesh(mesh.vertices, faces)).edges
        lengths = np.linalg.norm(np.subtract(*mesh.vertices[edges.T]), axis=1)
        rank = np.argsort(np.argsort(lengths, kind="stable"))
        first = np.full(mesh.n_vertices, len(edges))
        np.minimum.at(first, edges.ravel(), np.repeat(rank, 2))
        joined = (lengths < length) & (first[edges] == rank[:, None]).all(axis=1)
        if not joined.any():
            break
        target = np.arange(mesh.n_vertices)
        target[edges[joined, 1]] = edges[joined, 0]
        faces = target[faces]
        faces = faces[(faces != faces[:, [1, 2, 0]]).all(axis=1)]
    # Pairs of faces with the same corners that look opposite ways are flaps that were joined.
    _, number = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True)
    number = number.ravel()
    steps = np.sign(faces[:, [1, 2, 0]] - faces).sum(axis=1)  # 1 or -1: which way it looks
    sides = np.bincount(number, weights=steps)
    count = np.bincount(number)
    kept = (count[number] == 1) | (sides[number] != 0)
    return TriangleMesh(mesh.vertices, faces[kept])


def carry_map(
    part: WorkingCopy,
    whole: WorkingCopy,
    faces: Int[np.ndarray, " k"],
    weights: Float[np.ndarray, "k 3"],
    values: Float[np.ndarray, "k c"],
) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, "n 3"], Float[np.ndarray, "n c"]]:
    """Carry a map of working copies over to the meshes that they stand for.

    Parameters
    ----------
    part, whole : WorkingCopy
    faces, weights : (k,) int, (k, 3) float
        Where each vertex of the copy of the part lies on the copy of the whole.
    values : (k, c) float
        Of the vertices of the copy of the part, to be interpolated.

    Returns
    -------
    faces, weights : (n,) int, (n, 3) float
        Where each vertex of the part lies on the whole, with the corners of faces in the order that
        they had before the whole was turned outward.
    values : (n, c) float
    """
    same_part, same_whole = (copy.mesh is copy.original for copy in (part, whole))
    if same_part and same_whole:
        return faces, weights[:, ::-1] if whole.turned else weights, values
    # Places on the whole with their normals, which keep the two sides of a thin wall apart
    images = np.einsum(
        "kc,kcd->kd", weights, _with_normals(whole.mesh, whole)[whole.mesh.faces[faces]]
    )
    if not same_part:
        at_faces, shares = _nearest_places(part, part.mesh, _with_normals(part.original, part))
        corners = part.mesh.faces[at_faces]
        values = np.einsum("nc,ncd->nd", shares, values[corners])
        ends = images[corners]
        apart = np.linalg.norm(ends - ends[:, [1, 2, 0]], axis=2).max(axis=1)
        torn = apart > TORN * np.sqrt(surface_area(whole.original))
        shares[torn] = np.eye(3)[shares[torn].argmax(axis=1)]
        images = np.einsum("nc,ncd->nd", shares, ends)
    faces, weights = _nearest_places(whole, whole.original, images)
    return faces, weights[:, ::-1] if whole.turned else weights, values


def _with_normals(mesh: TriangleMesh, copy: WorkingCopy) -> Float[np.ndarray, "n 6"]:
    """Return places of vertices, and normals of a length that suits the size of the original."""
    length = NORMAL_SHARE * np.sqrt(surface_area(copy.original))
    return np.hstack([mesh.vertices, length * mean_normals(mesh)])


def _nearest_places(
    copy: WorkingCopy, mesh: TriangleMesh, points: Float[np.ndarray, "p 6"]
) -> tuple[Int[np.ndarray, " p"], Float[np.ndarray, "p 3"]]:
    """Return the nearest face of the nearest vertex of a mesh, by places and normals, and weights."""
    corners = _with_normals(mesh, copy)
    return places_in_faces(mesh, corners, points, cKDTree(corners).query(points)[1])


@record
class Piece(ReadOnly):
    """A connected piece of a mesh: its faces and vertices there, its area, and its working copy."""

    faces: Int[np.ndarray, " f"]
    vertices: Int[np.ndarray, " n"]
    area: float
    copy: WorkingCopy

    def clean_area(self) -> float:
        """Return the area without noise: that of a quarter of an edge adds a fifth."""
        return surface_area(self.copy.clean)


def split_pieces(mesh: TriangleMesh, least: float, longest: float) -> list[Piece]:
    """Return the pieces with at least this share of the area, the largest first, and at least one.

    In their copies no edge is longer than `longest`.
    """
    count, labels = vertex_components(mesh)
    owners = labels[mesh.faces[:, 0]]
    areas = np.bincount(owners, weights=face_areas(mesh), minlength=count)
    found: list[Piece] = []
    for number in np.argsort(-areas, kind="stable").tolist():
        if found and areas[number] < least * areas.sum():
            break
        keep = owners == number
        piece, vertices = submesh(mesh, keep) if count > 1 else (mesh, np.arange(mesh.n_vertices))
        copy = make_working_copy(piece, longest)
        found.append(Piece(np.flatnonzero(keep), vertices, float(areas[number]), copy))
    return found


def report_left_out(mesh: TriangleMesh, kept: Sequence[Piece], name: str) -> tuple[str, ...]:
    """Return a sentence on the pieces of a shape that are not kept; none if all are."""
    n_lost = vertex_components(mesh)[0] - len(kept)
    if not n_lost:
        return ()
    share = 1 - sum(piece.area for piece in kept) / surface_area(mesh)
    verb = "was" if n_lost == 1 else "were"
    pieces = count_nouns(n_lost, "loose piece")
    return (f"{pieces} of {100 * share:.2g} % of the area of the {name} {verb} left out",)
