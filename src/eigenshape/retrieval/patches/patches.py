"""Local descriptors of a surface: geodesic discs of several radii around sampled points."""

from dataclasses import replace
from functools import partial

import numpy as np
from jaxtyping import Float, Float32, Int

from certeig.kit.arrays import ReadOnly, record, whole_number
from certeig.kit.threads import map_in_threads, one_blas_thread
from certeig.kit.typing import Integer
from eigenshape._corners import mean_normals
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.distances.geodesic import farthest_points
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.normalize import normalize_mesh
from eigenshape.geometry.orientation import orient_outward
from eigenshape.geometry.repairs.repair_steps import fragment_vertices
from eigenshape.geometry.requirements import require_describable, require_oriented
from eigenshape.geometry.resolution.subdivision import split_long_edges
from eigenshape.geometry.resolution.thinning import thin_out
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.topology import boundary_vertices, is_closed, submesh
from eigenshape.operators.smoothing import denoise
from eigenshape.retrieval.patches.patch_loops import (
    AREA,
    RING_NUMBERS,
    RINGS,
    fill_discs,
    shorten_paths,
)
from eigenshape.scans.depth_camera import simulate_scan
from eigenshape.scans.partial import view_number, viewer, viewpoint

N_SAMPLES = 150  # points of a surface; time and stored bytes grow with their square
# Viewpoints from which a closed shape is described beside the whole. Each costs one more
# description and 6 KB in the index.
N_VIEWS = 6
RADII = 0.05 * 1.25 ** np.arange(1, 10)  # of the discs, in sides of the box
# Vertices above which a surface is thinned out first. A description of so many takes 5 CPU seconds
# with six views, and of a million 270 otherwise; what the discs measure hardly changes.
MOST_VERTICES = 30_000
# Edges longer than this many √area are split, or few vertices fall into a disc: of 22 bones that were
# decimated to a third, 15 did not find themselves, and 3 do not now. By the area, and not by the box, moved
# copies are split in the same way. Edges longer than COARSE √area are split before noise is removed, since
# it cannot be told from the form there: a box would become a ball.
LONGEST_EDGE, COARSE = 0.048, 0.06
# A disc nearer to a boundary than this share of its radius weighs less, since part of it is cut
# off, but never less than LEAST_WEIGHT of a whole one.
AT_BOUNDARY = 0.5
LEAST_WEIGHT = 0.02
LEAST_AREA = 1e-3  # share of a flat disc's area, added before the logarithm
DISCS_PER_TASK = 16  # that a thread describes in a row: with them a task takes some milliseconds


@record
class Patches(ReadOnly):
    """Geodesic discs around m points of a shape in a unit box, each described at r radii.

    Attributes
    ----------
    numbers : (m, r, 64) float32
        Descriptor of each disc; see `extract_patches`.
    weights : (m, r) float32
        Share of the surface that a point stands for, less near a boundary.
    vertices : (m,) int
        The vertex of each point; if edges were split (`extract_patches`), one near it.
    distances : (m, m) float32
        Geodesic distances between points, in sides of the box. Long ones are sums of short ones,
        and so a few per cent too long; infinite between components.
    places, normals : (m, 3) float32
        Position in the unit box, around the origin, and unit normal outward.

    Examples
    --------
    The first element describes the whole shape, the others what viewpoints see of it:

    >>> import eigenshape as es
    >>> whole, view = es.retrieval.extract_patches(es.icosphere(2), n_samples=20, n_views=1)
    >>> whole.numbers.shape, whole.distances.shape
    ((20, 9, 64), (20, 20))
    >>> es.retrieval.patch_descriptor([whole, view], es.retrieval.PatchRecipe()).codes.shape
    (2, 3, 3, 1280)
    """

    numbers: Float32[np.ndarray, "m r c"]
    weights: Float32[np.ndarray, "m r"]
    vertices: Int[np.ndarray, " m"]
    distances: Float32[np.ndarray, "m m"]
    places: Float32[np.ndarray, "m 3"]
    normals: Float32[np.ndarray, "m 3"]


def extract_patches(
    mesh: MeshLike,
    *,
    n_samples: Integer = N_SAMPLES,
    n_views: Integer = N_VIEWS,
    n_frames: Integer = 0,
    clean: bool = True,
) -> list[Patches]:
    """Describe geodesic discs around points of a surface, and of what single viewpoints see of it.

    Points are farthest-point samples; radii R are nine from 0.0625 to 0.37 sides of the box. The
    normal n of a disc is the mean normal within 0.35 R. Only vertices q that face the same way
    count, N_q · n > 0, so that a scan from one side compares with the whole. In each of four rings
    of equal width a disc has 16 numbers: histograms of N_q · n (8 bins) and of the height
    (x_q - x_p) · n / R (6 bins), as square roots of shares of area; the logarithm of the area up to
    that ring over that of a flat disc; and the mean ratio of straight to geodesic distance.

    Components whose area is less than that of a point are left out (`fragment_vertices`). A surface
    of more than 30,000 vertices is thinned out to fewer first: short edges collapse, and topology
    stays. Edges longer than 0.048 roots of the area are split, so that coarse surfaces, and flat faces
    of machine parts, compare with fine ones. The points are, or lie near, vertices of the surface
    that was given.

    Parameters
    ----------
    mesh : MeshLike
        Of any size: it is scaled to a unit box.
    n_samples : int
        Points at most; never more than vertices, after edges are split.
    n_views : int
        Viewpoints, spread evenly around the shape, if it is closed. An open shape has none.
    n_frames : int
        Of these viewpoints, how many are described once more as a depth camera sees the shape from
        there (`simulate_scan`), with its noise and its gaps, so that single depth scans find the shape.
    clean : bool
        Whether to describe a copy that is turned outward (`orient_outward`) and smoothed as far as
        its noise requires (`denoise`), so that a scan compares with clean shapes. If False, faces
        must be oriented outward.

    Returns
    -------
    list of Patches
        The whole first, then the views, then the depth scans. All points lie at vertices of the whole.

    Raises
    ------
    InvalidParameterError
        If n_samples is not positive, or n_views or n_frames is not in 0..1000.
    InvalidShapeError
        If a face has no area or occurs twice, a vertex has no face, the mesh is a soup (faces lie
        edge on edge without sharing vertices), or neighboring faces disagree and `clean` is False.

    See Also
    --------
    train_codebook, patch_descriptor

    Examples
    --------
    >>> import eigenshape as es
    >>> whole, view = es.retrieval.extract_patches(es.icosphere(2), n_samples=20, n_views=1)
    >>> whole.numbers.shape
    (20, 9, 64)
    """
    return mesh_patches(
        as_mesh(mesh),
        n_samples=whole_number(n_samples, "n_samples", 1),
        n_views=view_number(n_views, "n_views"),
        n_frames=view_number(n_frames, "n_frames"),
        clean=clean,
    )


@one_blas_thread()
def mesh_patches(
    mesh: TriangleMesh,
    *,
    n_samples: int = N_SAMPLES,
    n_views: int = N_VIEWS,
    n_frames: int = 0,
    clean: bool = True,
) -> list[Patches]:
    """Describe the discs of a mesh and of its views, as `extract_patches` does."""
    require_describable(mesh)
    whole = np.arange(mesh.n_vertices)
    if mesh.n_vertices > MOST_VERTICES:
        mesh, whole = thin_out(mesh, MOST_VERTICES)
    if clean:
        mesh, origins = _clean_surface(mesh)
    else:
        require_oriented(mesh)
        mesh, origins = _with_short_edges(mesh, LONGEST_EDGE)
    whole = whole[origins]
    jobs = [lambda: _disc_patches(mesh, n_samples)]
    if is_closed(mesh):
        see = viewer(mesh)

        def describe_view(number: int) -> Patches:
            part = see(number)
            patches = _disc_patches(part.mesh, n_samples)
            return replace(patches, vertices=part.source_vertices[patches.vertices])

        jobs += [partial(describe_view, number) for number in range(n_views)]
        jobs += [
            partial(_frame_patches, mesh, number, n_samples, clean=clean)
            for number in range(n_frames)
        ]
    found = map_in_threads(lambda job: job(), jobs)
    return [replace(each, vertices=whole[each.vertices]) for each in found]


def _clean_surface(mesh: TriangleMesh) -> tuple[TriangleMesh, Int[np.ndarray, " k"]]:
    """Turn a mesh outward, remove its noise, and split its long edges, so that its discs are comparable.

    Returns the mesh and, for each of its vertices, a near one of the given mesh.
    """
    mesh, near = _with_short_edges(mesh, COARSE)
    mesh, origins = _with_short_edges(denoise(orient_outward(mesh)), LONGEST_EDGE)
    return mesh, near[origins]


def _with_short_edges(
    mesh: TriangleMesh, share: float
) -> tuple[TriangleMesh, Int[np.ndarray, " k"]]:
    """Split edges that are longer than a share of √area."""
    return split_long_edges(mesh, share * float(np.sqrt(surface_area(mesh))), MOST_VERTICES)


def _frame_patches(mesh: TriangleMesh, number: int, n_samples: int, *, clean: bool) -> Patches:
    """Describe what a depth camera sees of a shape from one of the viewpoints."""
    scan = simulate_scan(mesh, np.random.default_rng(number), view=viewpoint(number))
    patches = _disc_patches(denoise(scan.mesh) if clean else scan.mesh, n_samples)
    seen = mesh.faces[scan.source_faces[patches.vertices], 0]
    return replace(patches, vertices=seen)


def surface_patches(mesh: TriangleMesh, *, n_samples: int = N_SAMPLES) -> Patches:
    """Describe the discs of a mesh as it is; see `extract_patches`."""
    require_describable(mesh)
    require_oriented(mesh)
    return _disc_patches(mesh, n_samples)


def _disc_patches(mesh: TriangleMesh, n_samples: int) -> Patches:
    """Describe the discs of a mesh that is known to be describable and oriented."""
    fragments = fragment_vertices(mesh, n_samples)
    source = np.arange(mesh.n_vertices)
    if len(fragments):
        mesh, source = submesh(mesh, ~np.isin(mesh.faces[:, 0], fragments))

    # Without fragments there are fewer components than points, so each gets one.
    mesh = normalize_mesh(mesh, "box")
    areas = dual_volumes(mesh)
    if not areas.sum() > 0:
        raise InvalidShapeError(
            "A surface must have an area to be described by patches; all its faces have none."
        )
    n_points = min(n_samples, mesh.n_vertices)
    chosen, rows, nearest = farthest_points(mesh, n_points, reach=RADII[-1])
    normals = mean_normals(mesh)
    numbers = describe_discs(mesh, chosen, rows, RADII, normals, areas)

    # Weigh each disc by the share of the surface that is nearest to its point.
    cells = np.bincount(nearest, weights=areas / areas.sum(), minlength=len(chosen))
    weights = cells[:, None] * whole_shares(mesh, rows, RADII)

    # The waves that measure distances end at the largest radius: fill in longer ones as shortest
    # paths from point to point.
    near = rows[:, chosen]
    distances = np.minimum(near, near.T)
    shorten_paths(distances)
    return Patches(
        numbers,
        weights.astype(np.float32),
        source[chosen],
        distances.astype(np.float32),
        mesh.vertices[chosen].astype(np.float32),
        normals[chosen].astype(np.float32),
    )


def describe_discs(
    mesh: TriangleMesh,
    points: Int[np.ndarray, " m"],
    rows: Float[np.ndarray, "m n"],
    radii: Float[np.ndarray, " r"],
    normals: Float[np.ndarray, "n 3"],
    areas: Float[np.ndarray, " n"],
) -> Float32[np.ndarray, "m r c"]:
    """Return the 64 numbers of the discs around points, given the distances from these.

    Normals and areas are those of the vertices; radii ascend.
    """
    discs = len(points), len(radii)
    numbers = np.empty((*discs, RINGS, RING_NUMBERS), dtype=np.float32)
    covered = np.empty((*discs, RINGS))
    surface = mesh.vertices, normals, areas

    def describe_task(first: int) -> None:
        some = slice(first, first + DISCS_PER_TASK)
        order = np.empty(mesh.n_vertices, dtype=np.int64)
        results = numbers[some], covered[some]
        fill_discs(rows[some], points[some], surface, radii, order, *results)

    map_in_threads(describe_task, range(0, len(points), DISCS_PER_TASK))
    numbers[:, :, :, AREA] = np.log(LEAST_AREA + covered)
    return numbers.reshape(*discs, -1)


def whole_shares(
    mesh: TriangleMesh, rows: Float[np.ndarray, "m n"], radii: Float[np.ndarray, " r"]
) -> Float[np.ndarray, "m r"]:
    """Return how whole the disc around each point is: 1 away from the boundary, less near it."""
    rim = boundary_vertices(mesh)
    away = rows[:, rim].min(axis=1) if len(rim) else np.full(len(rows), np.inf)
    return np.clip(away[:, None] / (AT_BOUNDARY * radii), LEAST_WEIGHT, 1.0)
