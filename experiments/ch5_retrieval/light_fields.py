"""LFD: silhouettes from all sides (Chen, Tian, Shen and Ouhyoung 2003), which the thesis compares with.

D.-Y. Chen, X.-P. Tian, Y.-T. Shen, M. Ouhyoung: On visual similarity based 3D model retrieval. Computer Graphics Forum
22, 2003. The numbers are not quantized here.
"""

from functools import lru_cache
from math import factorial

import numpy as np
from scipy.ndimage import label
from scipy.spatial.distance import cdist
from scipy.spatial.transform import Rotation

import eigenshape as es
from eigenshape.scans.raster import Raster

N_FIELDS = 10  # dodecahedra, as in the paper
N_VIEWS = 10  # silhouettes of each: 20 vertices, of which opposite ones see mirror images
ORDER = 10  # of the Zernike moments, as in the paper: 35 numbers beside the area
N_FOURIER = 10  # Fourier coefficients of an outline, as in the paper
N_NUMBERS = 35 + N_FOURIER
FOURIER_WEIGHT = 2.0  # the scale, beside 1 for moments, to which the authors' program quantizes
OUTLINE_POINTS = 256  # at which an outline is sampled, evenly along its length
MARGIN = 1.0  # pixels left free around the sphere that holds the shape
# The eight neighbors of a pixel, row and column, clockwise from the left
NEIGHBORS = [(0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1)]
CANDIDATES = 2000  # random rotations from which those of the dodecahedra are chosen


def light_field(mesh: es.TriangleMesh, n_fields: int = N_FIELDS, size: int = 256) -> np.ndarray:
    """Describe a shape by its silhouettes from the vertices of dodecahedra around it, (fields, 10, 45).

    Each silhouette has 45 numbers: the magnitudes of its Zernike moments up to order 10, over its area (35), and of the
    first 10 Fourier coefficients of the distance of its outline from its center, over the mean distance and doubled.
    Both are taken about the center of the silhouette, in units of its radius, so that they do not change if it is
    turned or mirrored. Several dodecahedra, turned against each other, make the descriptor depend less on how the
    shape lies. An empty silhouette, as of a flat shape seen edge on, has zeros.
    """
    points = _in_unit_ball(mesh)
    found = np.empty((n_fields, N_VIEWS, N_NUMBERS))
    for field, turn in enumerate(_turns(n_fields)):
        for view, axis in enumerate(_axes() @ turn.T):
            flat = (points @ _turn_towards(axis).T[:, :2]) * (size / 2 - MARGIN) + size / 2
            covered = Raster.of(np.pad(flat, ((0, 0), (0, 1))), mesh.faces, size, size).face >= 0
            found[field, view] = _describe_silhouette(covered)
    return found


def light_field_distance(first: np.ndarray, second: np.ndarray) -> float:
    """Return the sum of the L1 distances of ten pairs of silhouettes, at the relative rotation with the least sum.

    For each dodecahedron around one shape and each around the other, the 60 rotations are tried that map a dodecahedron
    to itself.
    """
    tables = cdist(first.reshape(-1, N_NUMBERS), second.reshape(-1, N_NUMBERS), "cityblock")
    tables = tables.reshape(len(first), N_VIEWS, len(second), N_VIEWS)
    paired = (tables[:, view, :, others] for view, others in enumerate(_pairings().T))
    return float(sum(paired).min())


def _in_unit_ball(mesh: es.TriangleMesh) -> np.ndarray:
    """Return the vertices about the center of the surface, scaled to a ball of radius 1.

    Unlike a bounding box, the ball does not depend on how the shape lies.
    """
    points = mesh.vertices - mesh.vertices.mean(axis=0)
    a, b, c = (points[mesh.faces[:, corner]] for corner in range(3))
    areas = np.linalg.norm(0.5 * np.cross(b - a, c - a), axis=1)
    corners = points[mesh.faces]
    center = areas @ corners.mean(axis=1) / areas.sum()
    return (points - center) / np.linalg.norm(corners - center, axis=2).max()


def _turn_towards(view: np.ndarray) -> np.ndarray:
    """Return a rotation whose third row is the unit vector `view`."""
    helper = np.eye(3)[np.argmin(np.abs(view))]
    right = np.cross(helper, view)
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(view, right), view])


def _describe_silhouette(image: np.ndarray) -> np.ndarray:
    """Return the Zernike magnitudes and the Fourier coefficients of a silhouette."""
    rows, columns = np.nonzero(image)
    if not len(rows):
        return np.zeros(N_NUMBERS)
    center = np.array([rows.mean(), columns.mean()])
    radius = np.sqrt(((rows - center[0]) ** 2 + (columns - center[1]) ** 2).max()) or 1.0
    sums = power_sums((columns - center[1]) / radius, (rows - center[0]) / radius, ORDER)
    return np.concatenate([zernike_magnitudes(sums), FOURIER_WEIGHT * _fourier(image, center)])


def power_sums(x: np.ndarray, y: np.ndarray, order: int) -> np.ndarray:
    """Return the sums of z^m |z|^2j over points z = x + iy, for m + 2j up to the order."""
    sums = np.zeros((order + 1, order // 2 + 1), dtype=complex)
    z, square = x + 1j * y, x**2 + y**2
    power = np.ones_like(z)
    for m in range(order + 1):
        term = power
        for j in range((order - m) // 2 + 1):
            sums[m, j] = term.sum()
            term = term * square
        power = power * z
    return sums


def zernike_magnitudes(sums: np.ndarray) -> np.ndarray:
    """Return |Σ R_n^m(r) e^{imθ}| over the number of points, each in 0..1.

    The argument holds the sums of z^m |z|^2j over the points.
    """
    moments = [
        sum(c * sums[m, j] for j, c in enumerate(_radial(n, m)))
        for n in range(1, ORDER + 1)
        for m in range(n % 2, n + 1, 2)
    ]
    return np.abs(np.array(moments)) / sums[0, 0].real


@lru_cache
def _radial(n: int, m: int) -> tuple[int, ...]:
    """Return the coefficients of r^(m + 2j), j = 0, 1, ..., in R_n^m (Zernike 1934)."""
    half = (n - m) // 2
    return tuple(
        (-1) ** (half - j)
        * factorial((n + m) // 2 + j)
        // (factorial(half - j) * factorial(m + j) * factorial(j))
        for j in range(half + 1)
    )


def _fourier(image: np.ndarray, center: np.ndarray) -> np.ndarray:
    """Return Fourier magnitudes of the distance from the center along the outline."""
    pieces, _ = label(image, np.ones((3, 3)))
    names, away = pieces[image] - 1, np.square(np.argwhere(image) - center).sum(axis=1)
    # Take the largest piece; of equal ones the outer one, so the choice turns with the picture.
    largest = pieces == 1 + np.lexsort((np.bincount(names, away), np.bincount(names)))[-1]
    path = np.array(outline(largest), dtype=float)
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    places = np.arange(OUTLINE_POINTS) * along[-1] / OUTLINE_POINTS
    distances = np.interp(places, along, np.linalg.norm(path - center, axis=1))
    waves = np.abs(np.fft.rfft(distances))
    return waves[1 : N_FOURIER + 1] / waves[0] if waves[0] > 0 else np.zeros(N_FOURIER)


def outline(image: np.ndarray) -> list[tuple[int, int]]:
    """Return the rows and columns of the pixels passed by Moore's boundary tracing, clockwise.

    The walk starts at the uppermost, and there leftmost, pixel, and ends when its first step would
    be repeated.
    """
    inside = np.pad(image, (0, 1)).tolist()  # index -1 is outside, too
    start = int(image.argmax())
    here = start // image.shape[1], start % image.shape[1]
    path = [here]
    came, first = 0, -1  # the direction to where the walk looks from, and the first step
    while True:
        for turn in range(1, 9):
            direction = (came + turn) % 8
            row, column = here[0] + NEIGHBORS[direction][0], here[1] + NEIGHBORS[direction][1]
            if inside[row][column]:
                break
        else:
            return path  # a single pixel
        if here == path[0] and direction == first:
            return path
        if first < 0:
            first = direction
        here = row, column
        path.append(here)
        # The last pixel looked at before the step is behind the new one: look on from there.
        came = (direction + 5) % 8 if direction % 2 else (direction + 6) % 8


@lru_cache
def _axes() -> np.ndarray:
    """Return one of each two opposite vertices of a dodecahedron, as unit vectors."""
    golden = (1 + np.sqrt(5)) / 2
    cube = [[1, one, two] for one in (1, -1) for two in (1, -1)]
    others = [
        np.roll([0, 1 / golden, sign * golden], turn) for turn in range(3) for sign in (1, -1)
    ]
    return np.array([*cube, *others]) / np.sqrt(3)


@lru_cache
def _pairings() -> np.ndarray:
    """Return where each of the 60 rotations of a dodecahedron takes each axis."""
    vertices = np.concatenate([_axes(), -_axes()])
    cosines = vertices @ vertices.T
    # There is one rotation for each directed edge: it takes the first edge there.
    edges = np.argwhere(np.isclose(cosines, np.sqrt(5) / 3))
    frames = np.array([_frame(vertices[one], vertices[two]) for one, two in edges])
    images = np.einsum("eij,kj,ak->eai", frames, frames[0].T, _axes())
    return np.abs(images @ _axes().T).argmax(axis=2)


def _frame(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    across = np.cross(one, two)
    across = across / np.linalg.norm(across)
    return np.column_stack([one, across, np.cross(one, across)])


@lru_cache
def _turns(count: int) -> np.ndarray:
    """Return rotations, each of which takes the axes as far as possible from all before.

    The first is the identity. The others are chosen from a fixed list of random ones, so that a
    larger count keeps the rotations of a smaller one.
    """
    candidates = Rotation.from_quat(
        np.random.default_rng(0).standard_normal((CANDIDATES, 4))
    ).as_matrix()
    axes = np.einsum("cij,aj->cai", candidates, _axes())
    chosen, nearest = [np.eye(3)], np.abs(axes @ _axes().T).max(axis=(1, 2))
    while len(chosen) < count:
        best = int(nearest.argmin())
        chosen.append(candidates[best])
        nearest = np.maximum(nearest, np.abs(axes @ axes[best].T).max(axis=(1, 2)))
    return np.array(chosen)
