"""Make a surface of a cloud of points: a level set of a field that their normals determine."""

from itertools import permutations

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int
from scipy import fft, ndimage
from scipy.sparse import csgraph
from scipy.spatial import cKDTree

from eigenshape._corners import cut_tetrahedra
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import area_vectors, row_dots, size_one, triangle_areas
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair_report import RepairedMesh
from eigenshape.geometry.topology import submesh, vertex_components

FEWEST_POINTS = 100  # below, a grid as fine as the points has about ten cells a side
N_NEIGHBORS = 16  # of a point, which determine its plane
# Width of a cell of the grid, in typical distances between neighboring points. A finer grid keeps
# thinner limbs, and gives more vertices: at 1.25 about three for each point.
CELL_IN_SPACINGS = 1.25
MOST_CELLS = 96  # along the largest extent: about 40,000 vertices at most
MARGIN = 0.25  # free space around the points, in extents: the field is periodic
SMOOTHING = 1.0  # standard deviation of the Gaussian that smooths the normals, in cells
REACH = 3  # cells around a point in which there is a surface; it closes holes of this radius
SUPPORT = 1.0  # cells between a face and the nearest point, above which the face has no support
RIM_STEPS = 8  # averages that smooth the boundary, each over a face and those around it
# A vertex keeps this share of an edge of the grid away from its ends, so no triangle is a needle.
CLOSEST_TO_CORNER = 0.15
LEAST_SPREAD = 0.05  # of the nearest points in the second direction, relative to the first
# Share of points that a surface may miss, which means to be more than two cells away from them.
MOST_MISSED, MISSED_CELLS = 0.1, 2.0

CUBE = np.array(list(np.ndindex(2, 2, 2)))
# Six tetrahedra around the diagonal of a cube; those of neighboring cubes fit together. An axis
# takes 4, 2 or 1 steps in `CUBE`.
TETRAHEDRA = np.array([[0, one, one + two, 7] for one, two, _ in permutations((4, 2, 1))])


def reconstruct_surface(
    cloud: PointCloud, normals: Float[np.ndarray, "n 3"] | None = None
) -> RepairedMesh[TriangleMesh]:
    """Compute a surface near the points of a cloud, closed where the points leave only small holes.

    The field is the one whose slopes fit the normals of the points best (Kazhdan, Bolitho and
    Hoppe, "Poisson surface reconstruction", 2006, section 3), on a regular grid, where a Fourier
    transform solves the equation. A normal is the thin direction of the nearest points; normals
    are turned to the same side along the tree of the smoothest steps (Hoppe et al., "Surface
    reconstruction from unorganized points", 1992). Parts of the level set without points are
    dropped, so the scan of one side stays open.

    Raise InvalidShapeError if there are too few points, more than a tenth of them is not near the
    surface, as where limbs are thinner than the distance between points, or they lie on lines.

    Parameters
    ----------
    cloud : PointCloud
        At least 100 different points of a surface in R³.
    normals : (n, 3) float, optional
        Outward unit normals, where they are known.

    Returns
    -------
    RepairedMesh
        The surface, the nearest point of each vertex, and a report of one sentence.
    """
    if cloud.n_points < FEWEST_POINTS or cloud.points.shape[1] != 3:
        raise InvalidShapeError(
            f"A cloud must have at least {FEWEST_POINTS} points in R^3 to become a surface; this "
            f"is a {cloud!r}."
        )
    low = cloud.points.min(axis=0)
    points, scale = size_one(cloud.points - low)
    distances, neighbors = cKDTree(points).query(points, N_NEIGHBORS + 1)
    if normals is None:
        normals = _oriented_normals(points, neighbors[:, 1:])
    # The nearest k points fill a disc of k times the area of one.
    areas = np.pi * distances[:, -1] ** 2 / N_NEIGHBORS
    extent = float(points.max())
    cell = max(CELL_IN_SPACINGS * float(np.sqrt(np.median(areas))), extent / MOST_CELLS)
    places = (points + MARGIN * extent) / cell
    counts = [
        fft.next_fast_len(int(np.ceil(size + MARGIN * extent / cell)) + 1, real=True)
        for size in places.max(axis=0)
    ]
    near = np.zeros(counts, dtype=bool)
    near[tuple(places.astype(int).T)] = True
    near = ndimage.binary_dilation(near, iterations=REACH)
    mesh = _level_set(places, -normals * areas[:, None] / cell**2, near)
    # Drop large pieces whose faces are far from all points, or face away from the nearest.
    corners = mesh.vertices[mesh.faces]
    facing = area_vectors(corners)
    distance, nearest = cKDTree(places).query(corners.mean(axis=1))
    # A camera sees few points on a face that turns away from it: far is what is far for them.
    reach = SUPPORT * np.clip((np.sqrt(areas) / cell)[nearest], 1, REACH)
    bare = (row_dots(facing, normals[nearest]) < 0) | (distance > reach)
    if bare.any():
        # Single points decide where the boundary runs, so it is ragged: averages of what faces say over
        # their neighbors move it as mean curvature does (Merriman, Bence and Osher, 1992).
        corner_of = sp.csr_array(
            (
                np.ones(3 * mesh.n_faces),
                (np.repeat(np.arange(mesh.n_faces), 3), mesh.faces.ravel()),
            ),
            shape=(mesh.n_faces, mesh.n_vertices),
        )
        n_around = np.maximum(corner_of.sum(axis=0), 1)
        share = bare.astype(float)
        for _ in range(RIM_STEPS):
            share = corner_of @ ((corner_of.T @ share) / n_around) / 3
        bare = share > 0.5
        bare = _large_pieces(mesh, bare)  # smaller ones close holes
        kept = _large_pieces(mesh, ~bare)
        if not kept.any():
            raise _misses_points(1, len(places))
        mesh = submesh(mesh, kept)[0]
    missed = np.mean(cKDTree(mesh.vertices).query(places)[0] > MISSED_CELLS)
    if missed > MOST_MISSED:
        raise _misses_points(missed, cloud.n_points)
    vertices = (mesh.vertices * cell - MARGIN * extent) * scale + low
    sentence = (
        f"reconstruct_surface made {mesh.n_vertices:,} vertices and {mesh.n_faces:,} faces of "
        f"{cloud.n_points:,} points"
    )
    nearest = cKDTree(places).query(mesh.vertices)[1]
    return RepairedMesh(TriangleMesh(vertices, mesh.faces), (sentence,), nearest)


def _oriented_normals(
    points: Float[np.ndarray, "n 3"], neighbors: Int[np.ndarray, "n k"]
) -> Float[np.ndarray, "n 3"]:
    """Return unit normals that agree with those of neighbors, and point away from the middle."""
    around = points[neighbors]
    around -= around.mean(axis=1, keepdims=True)
    spreads, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", around, around))
    n_lines = np.count_nonzero(spreads[:, 1] < LEAST_SPREAD**2 * spreads[:, 2])
    if n_lines > MOST_MISSED * len(points):
        raise InvalidShapeError(
            "The points around a point must spread in two directions; those of "
            f"{n_lines} of {len(points)} lie on a line. Give points of a surface."
        )
    normals = axes[:, :, 0]
    n, k = neighbors.shape
    one, two = np.repeat(np.arange(n), k), neighbors.ravel()
    places = one.astype(np.int32), two.astype(np.int32)  # as SciPy 1.15 needs them for the forest
    bend = 1 - np.abs(row_dots(normals[one], normals[two]))
    # A stored weight of zero would be no edge.
    graph = sp.csr_array((bend + 1e-3, places), shape=(n, n))
    forest = csgraph.minimum_spanning_tree(graph.maximum(graph.T))
    count, part = csgraph.connected_components(forest, directed=False)
    for number in range(count):
        members = np.flatnonzero(part == number)
        order, before = csgraph.breadth_first_order(forest, members[0], directed=False)
        for point in order[1:].tolist():
            if normals[point] @ normals[before[point]] < 0:
                normals[point] *= -1
        outward = points[members] - points[members].mean(axis=0)
        if np.einsum("ni,ni->", outward, normals[members]) < 0:
            normals[members] *= -1
    return normals


def _level_set(
    places: Float[np.ndarray, "n 3"],
    slopes: Float[np.ndarray, "n 3"],
    near: Bool[np.ndarray, "x y z"],
) -> TriangleMesh:
    """Return where the field whose slopes fit best is zero in some cells, in their unit.

    The surface faces lower values.
    """
    counts = near.shape
    first = places.astype(int)
    rest = places - first
    corners = [np.ravel_multi_index(tuple((first + corner).T), counts) for corner in CUBE]
    shares = [np.prod(np.where(corner, rest, 1 - rest), axis=1) for corner in CUBE]
    waves = np.meshgrid(
        *(2 * np.pi * fft.fftfreq(count) for count in counts[:2]),
        2 * np.pi * fft.rfftfreq(counts[2]),
        indexing="ij",
        sparse=True,
    )
    # div grad f = div v, so f^ = -i k.v^ / |k|^2; the mean of the field is free.
    square = np.asarray(sum(wave**2 for wave in waves))
    square[0, 0, 0] = 1
    divergence = np.zeros(square.shape, dtype=complex)
    for axis, wave in enumerate(waves):
        total = np.zeros(int(np.prod(counts)))
        for corner, share in zip(corners, shares, strict=True):
            total += np.bincount(corner, share * slopes[:, axis], len(total))
        divergence += wave * fft.rfftn(total.reshape(counts))
    smoothed = -1j * divergence * np.exp(-0.5 * SMOOTHING**2 * square) / square
    field: Float[np.ndarray, "x y z"] = fft.irfftn(smoothed, s=counts)
    flat = field.ravel()
    at_points = sum(flat[corner] * share for corner, share in zip(corners, shares, strict=True))
    # The median at the points is 0.
    flat = flat - np.median(at_points)
    # The surface in the cells, cut into tetrahedra.
    cells = np.argwhere(near[:-1, :-1, :-1])
    cell_corners = np.ravel_multi_index(tuple(np.moveaxis(cells[:, None] + CUBE, -1, 0)), counts)
    inside = flat[cell_corners] > 0
    crossed = inside.any(axis=1) & ~inside.all(axis=1)
    ids = cell_corners[crossed][:, TETRAHEDRA].reshape(-1, 4)
    edges = cut_tetrahedra(ids, flat[ids] > 0)
    ends, faces = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    faces = faces.reshape(-1, 3)
    values = flat[ends]
    share = values[:, 0] / (values[:, 0] - values[:, 1])
    share = np.clip(share, CLOSEST_TO_CORNER, 1 - CLOSEST_TO_CORNER)[:, None]
    start, end = (
        np.column_stack(np.unravel_index(ends[:, side], counts)).astype(float) for side in (0, 1)
    )
    vertices = start + share * (end - start)
    outward = (end - start)[faces].sum(axis=1)
    turned = row_dots(area_vectors(vertices[faces]), outward) < 0
    return TriangleMesh(vertices, np.where(turned[:, None], faces[:, ::-1], faces))


def _misses_points(share: float, n_points: int) -> InvalidShapeError:
    return InvalidShapeError(
        f"A surface must reach the points of a cloud; it misses {100 * share:.0f} % of these "
        f"{n_points}, where parts are thinner than the distance between points. Give more points, or a "
        "mesh that another program made of them. The points alone have a spectrum: "
        "solve_spectrum(build_laplacian(cloud), 20), or eigenshape spectrum."
    )


def _large_pieces(mesh: TriangleMesh, chosen: Bool[np.ndarray, " f"]) -> Bool[np.ndarray, " f"]:
    """Return which of some faces lie in pieces of them that are larger than a disc of the reach."""
    if not chosen.any():
        return chosen
    pieces, _ = submesh(mesh, chosen)
    count, labels = vertex_components(pieces)
    owner = labels[pieces.faces[:, 0]]
    sizes = triangle_areas(pieces.vertices[pieces.faces])
    areas = np.bincount(owner, weights=sizes, minlength=count)
    large = np.zeros(mesh.n_faces, dtype=bool)
    large[chosen] = areas[owner] > np.pi * REACH**2
    return large
