"""A map of points made smooth and precise by the lowest eigenfunctions of both shapes."""

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import ReadOnly, record
from certeig.kit.threads import map_in_threads
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.matching.match_loops import nearest_face_points
from eigenshape.operators.cotangent import surface_laplacian
from eigenshape.spectral.solve import solve_spectrum

N_MODES = (100, 150)  # of the whole, round by round; 200 more improve the error by 0.01
MODES_PER_VERTEX = 1 / 5  # at most: higher ones of a coarse mesh are no longer those of the shape
# Modes of the part reach this many times as far up as those of the whole.
SPECTRAL_MARGIN = 1.2
# Modes of a part are more than its share of the area says, since its boundary is free.
EXTRA = 1.25, 15
ROWS_AT_ONCE = (
    200  # vertices whose distances to all others a thread has in memory: they fit its cache
)


@record
class Modes(ReadOnly):
    """Eigenvalues, in 1 / unit², and eigenfunctions of a surface, orthonormal by its areas."""

    eigenvalues: Float[np.ndarray, " k"]
    functions: Float[np.ndarray, "n k"]
    areas: Float[np.ndarray, " n"]


def lowest_modes(mesh: TriangleMesh, count: int = N_MODES[-1]) -> Modes:
    """Return so many modes of a surface, or fewer if it has few vertices."""
    k = max(min(count, int(mesh.n_vertices * MODES_PER_VERTEX)), 2)
    spectrum = solve_spectrum(surface_laplacian(mesh), k)
    return Modes(spectrum.eigenvalues, spectrum.eigenvectors, dual_volumes(mesh))


def modes_of_part(mesh: TriangleMesh, whole: Modes) -> Modes:
    """Return the modes of a part below `SPECTRAL_MARGIN` times the largest eigenvalue of the whole."""
    areas = dual_volumes(mesh)
    share = SPECTRAL_MARGIN * areas.sum() / whole.areas.sum()
    count = int(len(whole.eigenvalues) * share * EXTRA[0]) + EXTRA[1]
    return lowest_modes(mesh, count)


def refine_places(
    part: Modes, whole: Modes, mesh: TriangleMesh, places: Int[np.ndarray, " n"]
) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, "n 3"]]:
    """Return a face of the whole and weights in it for each vertex of a part, from a first guess.

    Modes of the whole are pulled back to the part, made smooth by a fit of modes of the part, and
    each vertex goes to the point of the whole whose modes are nearest (Ovsjanikov and others 2012;
    Rodolà and others 2017 for parts): first to a vertex, in the last round to a point of a face.
    """
    vertices = np.arange(len(places))
    for wanted in N_MODES:
        places, smooth = smooth_places(part, whole, places, wanted, vertices)
        if wanted >= len(whole.eigenvalues):
            break
    theirs = np.ascontiguousarray(whole.functions[:, : smooth.shape[1]])
    return places_in_faces(mesh, theirs, smooth, places)


def corners_of_faces(
    mesh: TriangleMesh, vertices: Int[np.ndarray, " p"]
) -> tuple[Int[np.ndarray, " p"], Float[np.ndarray, "p 3"]]:
    """Return the first face at each given vertex, and weights, all on that vertex."""
    first = np.zeros(mesh.n_vertices, dtype=np.int64)
    first[mesh.faces[::-1].ravel()] = np.repeat(np.arange(mesh.n_faces)[::-1], 3)
    faces = first[vertices]
    return faces, (mesh.faces[faces] == vertices[:, None]).astype(np.float64)


def places_in_faces(
    mesh: TriangleMesh,
    corners: Float[np.ndarray, "n k"],
    points: Float[np.ndarray, "p k"],
    vertices: Int[np.ndarray, " p"],
) -> tuple[Int[np.ndarray, " p"], Float[np.ndarray, "p 3"]]:
    """Return the face at a given vertex that is nearest to each point, and the weights in it.

    Points and vertices are compared in k dimensions, whichever they are.
    """
    order = np.argsort(mesh.faces.ravel(), kind="stable")
    starts = np.searchsorted(mesh.faces.ravel()[order], np.arange(mesh.n_vertices + 1))
    return nearest_face_points(points, corners, mesh.faces, starts, order // 3, vertices)


def smooth_places(
    part: Modes,
    whole: Modes,
    places: Int[np.ndarray, " n"],
    wanted: int,
    vertices: Int[np.ndarray, " v"],
) -> tuple[Int[np.ndarray, " v"], Float[np.ndarray, "v k"]]:
    """Return where a map that so many modes make smooth places vertices, and the smooth modes there."""
    k = min(wanted, len(whole.eigenvalues))
    low = part.eigenvalues < SPECTRAL_MARGIN * whole.eigenvalues[k - 1]
    low[0] = True
    ours, theirs = part.functions[:, low], whole.functions[:, :k]
    matrix = (ours * part.areas[:, None]).T @ theirs[places]
    smooth = ours[vertices] @ matrix
    # Half the digits are enough to find the nearest vertex, and take half the time.
    points = smooth.astype(np.float32)
    columns = np.ascontiguousarray(theirs.T, dtype=np.float32)
    halves = (columns**2).sum(axis=0) / 2

    def nearest_from(first: int) -> Int[np.ndarray, " r"]:
        return (halves - points[first : first + ROWS_AT_ONCE] @ columns).argmin(axis=1)

    found = map_in_threads(nearest_from, range(0, len(points), ROWS_AT_ONCE))
    return np.concatenate(found), smooth
