"""LFD: silhouettes from all sides (Chen, Tian, Shen and Ouhyoung 2003)."""

from functools import lru_cache
from math import factorial
from typing import SupportsIndex

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from scipy.ndimage import label
from scipy.spatial.transform import Rotation

from eigenshape._arrays import freeze, whole_number
from eigenshape._errors import InvalidParameterError, InvalidShapeError
from eigenshape._threads import one_blas_thread
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import area_vectors, scale_to_unit
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.retrieval.baselines.light_field_loops import (
    least_difference,
    outline,
    power_sums,
    silhouette,
)
from eigenshape.scans.partial import rotation_towards
from eigenshape.scans.raster import EDGE_SLACK, LEAST_DOUBLED_AREA

N_FIELDS = 10  # dodecahedra, as in the paper
N_VIEWS = 10  # silhouettes of each: 20 vertices, of which opposite ones see mirror images
ORDER = 10  # of the Zernike moments, as in the paper: 35 numbers beside the area
N_FOURIER = 10  # Fourier coefficients of an outline, as in the paper
N_NUMBERS = 35 + N_FOURIER
FOURIER_WEIGHT = 2.0  # the scale, beside 1 for moments, to which the authors' program quantizes
OUTLINE_POINTS = 256  # at which an outline is sampled, evenly along its length
MARGIN = 1.0  # pixels left free around the sphere that holds the shape
CANDIDATES = 2000  # random rotations from which those of the dodecahedra are chosen


@one_blas_thread()
def light_field(
    mesh: MeshLike, *, n_fields: SupportsIndex = N_FIELDS, size: SupportsIndex = 256
) -> Float[np.ndarray, "fields 10 45"]:
    """Describe a shape by its silhouettes from the vertices of dodecahedra around it.

    Each silhouette has 45 numbers: the magnitudes of its Zernike moments up to order 10, over its
    area (35), and of the first 10 Fourier coefficients of the distance of its outline from its
    center, over the mean distance and doubled. Both are taken about the center of the silhouette,
    in units of its radius, so that they do not change if it is turned or mirrored. Several
    dodecahedra, turned against each other, make the descriptor depend less on how the shape lies.

    Parameters
    ----------
    mesh : MeshLike
        With any number of components; the outline of a silhouette follows its largest piece.
    n_fields : int
        Dodecahedra, 1 to 100; 10 in the paper.
    size : int
        Pixels along the side of a picture, 16 to 4096; 256 in the paper.

    Returns
    -------
    (n_fields, 10, 45) float
        Without unit; zeros for an empty silhouette, as of a flat shape seen edge on.

    Raises
    ------
    InvalidShapeError
        If no face has area.
    InvalidParameterError
        If a number is out of its range.

    See Also
    --------
    light_field_distance

    References
    ----------
    D.-Y. Chen, X.-P. Tian, Y.-T. Shen, M. Ouhyoung: On visual similarity based 3D model retrieval.
    Computer Graphics Forum 22, 2003. The numbers are not quantized here.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.retrieval.baselines.light_field(es.icosphere(1), n_fields=1, size=32).shape
    (1, 10, 45)
    """
    mesh = as_mesh(mesh)
    fields = whole_number(n_fields, "n_fields", 1, 100)
    pixels = whole_number(size, "size", 16, 4096)
    points = _in_unit_ball(mesh)
    found = np.empty((fields, N_VIEWS, N_NUMBERS))
    for field, turn in enumerate(_turns(fields)):
        for view, axis in enumerate(_axes() @ turn.T):
            flat = (points @ rotation_towards(axis).T[:, :2]) * (pixels / 2 - MARGIN) + pixels / 2
            found[field, view] = _describe_silhouette(
                silhouette(flat, mesh.faces, pixels, EDGE_SLACK, LEAST_DOUBLED_AREA)
            )
    return found


def light_field_distance(
    first: Float[np.ndarray, "f v q"], second: Float[np.ndarray, "g w r"]
) -> float:
    """Return the distance of two descriptors of `light_field`.

    It is the sum of the L1 distances of ten pairs of silhouettes, at the relative rotation with the
    least sum. For each dodecahedron around one shape and each around the other, the 60 rotations
    are tried that map a dodecahedron to itself.

    Parameters
    ----------
    first, second : (n_fields, 10, 45) float

    Returns
    -------
    float

    Raises
    ------
    InvalidParameterError
        If an array has another shape.

    See Also
    --------
    light_field

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.retrieval.baselines.light_field(es.icosphere(1), n_fields=1, size=32)
    >>> es.retrieval.baselines.light_field_distance(ball, ball)
    0.0
    """
    for descriptor in (first, second):
        if descriptor.shape[1:] != (N_VIEWS, N_NUMBERS):
            raise InvalidParameterError(
                f"A light field must have shape (fields, {N_VIEWS}, {N_NUMBERS}); the shape is "
                f"{descriptor.shape}. Pass the result of light_field(mesh)."
            )
    return float(least_difference(first, second, _pairings()))


def _in_unit_ball(mesh: TriangleMesh) -> Float[np.ndarray, "n 3"]:
    """Return the vertices about the center of the surface, scaled to a ball of radius 1.

    Unlike a bounding box, the ball does not depend on how the shape lies.
    """
    points, _ = scale_to_unit(mesh)
    corners = points[mesh.faces]
    areas = np.linalg.norm(area_vectors(corners), axis=1)
    if not areas.sum() > 0:
        raise InvalidShapeError(
            f"A shape must have area to be seen; all {mesh.n_faces} faces have none."
        )
    center = areas @ corners.mean(axis=1) / areas.sum()
    return (points - center) / np.linalg.norm(corners - center, axis=2).max()


def _describe_silhouette(image: Bool[np.ndarray, "h w"]) -> Float[np.ndarray, "45"]:
    """Return the Zernike magnitudes and the Fourier coefficients of a silhouette."""
    rows, columns = np.nonzero(image)
    if not len(rows):
        return np.zeros(N_NUMBERS)
    center = np.array([rows.mean(), columns.mean()])
    radius = np.sqrt(((rows - center[0]) ** 2 + (columns - center[1]) ** 2).max()) or 1.0
    sums = power_sums((columns - center[1]) / radius, (rows - center[0]) / radius, ORDER)
    return np.concatenate([zernike_magnitudes(sums), FOURIER_WEIGHT * _fourier(image, center)])


def zernike_magnitudes(sums: Complex[np.ndarray, "m j"]) -> Float[np.ndarray, "35"]:
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


def _fourier(
    image: Bool[np.ndarray, "h w"], center: Float[np.ndarray, "2"]
) -> Float[np.ndarray, "10"]:
    """Return Fourier magnitudes of the distance from the center along the outline."""
    pieces, _ = label(image, np.ones((3, 3)))
    names, away = pieces[image] - 1, np.square(np.argwhere(image) - center).sum(axis=1)
    # Take the largest piece; of equal ones the outer one, so the choice turns with the picture.
    largest = pieces == 1 + np.lexsort((np.bincount(names, away), np.bincount(names)))[-1]
    start = int(largest.argmax())
    path = outline(largest, start // image.shape[1], start % image.shape[1]).astype(np.float64)
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    places = np.arange(OUTLINE_POINTS) * along[-1] / OUTLINE_POINTS
    distances = np.interp(places, along, np.linalg.norm(path - center, axis=1))
    waves = np.abs(np.fft.rfft(distances))
    return waves[1 : N_FOURIER + 1] / waves[0] if waves[0] > 0 else np.zeros(N_FOURIER)


@lru_cache
def _axes() -> Float[np.ndarray, "10 3"]:
    """Return one of each two opposite vertices of a dodecahedron, as unit vectors."""
    golden = (1 + np.sqrt(5)) / 2
    cube = [[1, one, two] for one in (1, -1) for two in (1, -1)]
    others = [
        np.roll([0, 1 / golden, sign * golden], turn) for turn in range(3) for sign in (1, -1)
    ]
    return freeze(np.array([*cube, *others]) / np.sqrt(3))


@lru_cache
def _pairings() -> Int[np.ndarray, "60 10"]:
    """Return where each of the 60 rotations of a dodecahedron takes each axis."""
    vertices = np.concatenate([_axes(), -_axes()])
    cosines = vertices @ vertices.T
    # There is one rotation for each directed edge: it takes the first edge there.
    edges = np.argwhere(np.isclose(cosines, np.sqrt(5) / 3))
    frames = np.array([_frame(vertices[one], vertices[two]) for one, two in edges])
    images = np.einsum("eij,kj,ak->eai", frames, frames[0].T, _axes())
    return freeze(np.abs(images @ _axes().T).argmax(axis=2))


def _frame(one: Float[np.ndarray, "3"], two: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    across = np.cross(one, two)
    across = across / np.linalg.norm(across)
    return np.column_stack([one, across, np.cross(one, across)])


@lru_cache
def _turns(count: int) -> Float[np.ndarray, "count 3 3"]:
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
    return freeze(np.array(chosen))
