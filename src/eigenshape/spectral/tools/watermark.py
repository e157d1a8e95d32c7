"""Watermarks in the low frequencies of a shape (after Ohbuchi, Mukaiyama and Takahashi 2002)."""

from dataclasses import dataclass
from hashlib import shake_256
from pathlib import Path
from typing import overload

import numpy as np
from jaxtyping import Float, Int
from scipy.special import betainc, ndtri

from certeig.kit.arguments import describe_value
from certeig.kit.arrays import positive_number, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.text import html_repr
from certeig.kit.typing import Integer
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import rotations_and_stretches, size_one
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import vertex_components
from eigenshape.operators.robust import robust_laplacian
from eigenshape.spectral.solve import solve_spectrum

# Root mean square by which a mark moves a surface by default, as a share of the diagonal of the
# box: below what is seen, and found under noise of twice the size (experiment ch1_watermark).
DEFAULT_STRENGTH = 5e-4
# Largest strength: beyond it the shape is another.
MOST_STRENGTH = 0.1
DEFAULT_MODES = 100  # modes that carry the mark, beside the constant ones

# Coefficients of at most this share of the largest are rounding errors without a direction: all
# those of a sphere but three are.
LEAST_COEFFICIENT = 1e-9

Key = str | bytes


@dataclass(frozen=True)
class WatermarkTest:
    """The evidence that a mesh carries the watermark of a key.

    Attributes
    ----------
    score : float
        Correlation of the mark with the low frequencies of the difference to the original, -1 to 1.
    false_alarm : float
        Probability of this score or a higher one if the mesh does not carry the mark.
    n_numbers : int
        Number of independent numbers that are compared.

    See Also
    --------
    detect_watermark

    Examples
    --------
    Only the right key finds the mark:

    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> marked = es.spectral.embed_watermark(ball, "a secret", k=50)
    >>> es.spectral.detect_watermark(ball, marked, "a secret", k=50).score > 0.9
    True
    >>> es.spectral.detect_watermark(ball, marked, "another key", k=50).false_alarm > 1e-6
    True
    """

    score: float
    false_alarm: float
    n_numbers: int

    _repr_html_ = html_repr


def embed_watermark(
    mesh: MeshLike,
    key: Key,
    *,
    strength: float = DEFAULT_STRENGTH,
    k: Integer = DEFAULT_MODES,
    cache: str | Path | None = None,
) -> TriangleMesh:
    """Move the vertices of a mesh imperceptibly by a pattern that only a key reveals.

    The pattern is white noise made from the key, projected on the lowest eigenfunctions: each
    coefficient of the coordinates in these modes, a vector in R³, moves by an independent Gaussian
    vector. In the manner of Ohbuchi, Mukaiyama and Takahashi (2002) the mark lies in low
    frequencies, where noise does least (thesis 1.2.3). Each coefficient moves at a right angle to
    itself, since smoothing makes it longer or shorter and so leaves the mark alone. Coefficients of
    one eigenspace count as one vector, so it does not matter which eigenvectors a machine finds.

    Parameters
    ----------
    mesh : MeshLike
    key : str or bytes
        The secret. Whoever knows it and the original can find the mark and remove it.
    strength : float
        Root mean square by which the surface moves, as a share of the diagonal of its bounding box;
        more than 0, at most 0.1.
    k : int
        Number of modes that carry the mark, beside one constant mode for each component.
    cache : path, optional
        Folder in which the spectrum of the mesh is kept, as of `solve_spectrum`. Detection takes it
        from there.

    Returns
    -------
    TriangleMesh
        With the same faces.

    Raises
    ------
    InvalidParameterError
        If the key is empty or neither text nor bytes, `strength` is not in 0..0.1, or there are
        fewer than `k` modes.
    InvalidShapeError
        If `robust_laplacian` cannot be built on the mesh.

    See Also
    --------
    detect_watermark

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(3)
    >>> marked = es.spectral.embed_watermark(ball, "a secret", k=50)
    >>> bool(abs(marked.vertices - ball.vertices).max() < 0.01)
    True
    >>> es.spectral.detect_watermark(ball, marked, "a secret", k=50).false_alarm < 1e-30
    True
    """
    mesh = as_mesh(mesh)
    secret = _require_key(key)
    share = positive_number(strength, "strength")
    if share > MOST_STRENGTH:
        raise InvalidParameterError(
            f"strength must be at most {MOST_STRENGTH} of the diagonal; it is {share}."
        )
    points, scale = size_one(mesh.vertices)
    basis, mass, groups = _low_modes((points, mesh.faces), k, cache)
    own = basis.T @ (mass[:, None] * points)
    pattern, _ = _across(_pattern(secret, basis, mass), own, groups)
    diagonal = np.linalg.norm(np.ptp(points, axis=0))
    size = share * diagonal * np.sqrt(mass.sum()) / np.linalg.norm(pattern)
    return TriangleMesh((points + size * (basis @ pattern)) * scale, mesh.faces)


@overload
def detect_watermark(
    original: MeshLike,
    suspect: MeshLike,
    key: Key,
    *,
    k: Integer = ...,
    cache: str | Path | None = ...,
) -> WatermarkTest: ...
@overload
def detect_watermark(
    original: MeshLike,
    suspect: MeshLike,
    key: list[Key] | tuple[Key, ...],
    *,
    k: Integer = ...,
    cache: str | Path | None = ...,
) -> tuple[WatermarkTest, ...]: ...
def detect_watermark(
    original: MeshLike,
    suspect: MeshLike,
    key: Key | list[Key] | tuple[Key, ...],
    *,
    k: Integer = DEFAULT_MODES,
    cache: str | Path | None = None,
) -> WatermarkTest | tuple[WatermarkTest, ...]:
    """Test whether a mesh carries the watermark of a key, with the unmarked original at hand.

    The suspect is moved, turned and scaled onto the original (Umeyama 1991). The score is the
    correlation of the pattern of the key with the difference of both, in the lowest modes and at
    right angles to the coefficients of the original. If the key has nothing to do with the suspect,
    its pattern is a Gaussian vector that is independent of this difference, so it points in a
    uniformly random direction among m dimensions, two for each simple eigenvalue, and the
    score s is exceeded with probability I(1 - s²; (m - 1)/2, 1/2) / 2, with the regularized
    incomplete beta function I. This is exact, whatever was done to the suspect.

    The mark survives similarity transformations, smoothing, noise and quantization. It does not
    survive what takes the correspondence of vertices: remeshing, simplification, cropping or
    another order of the vertices. Bending hides it, because the difference then is the bend.

    Parameters
    ----------
    original : MeshLike
        The mesh that was given to `embed_watermark`.
    suspect : MeshLike
        A mesh with the same vertices in the same order; its faces do not matter.
    key : str or bytes, or a list of them
        With many keys, as to find who passed a copy on, multiply the false-alarm probability of the
        best by their number.
    k, cache
        As given to `embed_watermark`.

    Returns
    -------
    WatermarkTest, or a tuple with one for each key
        If the suspect is the original itself, the score is 0 and the false-alarm probability 1.

    Raises
    ------
    InvalidParameterError
        If the key is empty or neither text nor bytes, there are fewer than `k` modes, or the number
        of vertices differs.
    InvalidShapeError
        If `robust_laplacian` cannot be built on the original, or all vertices of the suspect
        coincide.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(3)
    >>> copy = es.spectral.embed_watermark(ball, "copy 2", k=50)
    >>> keys = [f"copy {number}" for number in range(4)]
    >>> tests = es.spectral.detect_watermark(ball, copy, keys, k=50)
    >>> [test.false_alarm < 1e-6 for test in tests]
    [False, False, True, False]
    """
    mesh, other = as_mesh(original, "original"), as_mesh(suspect, "suspect")
    keys = key if isinstance(key, list | tuple) else [key]
    secrets = [_require_key(each) for each in keys]
    if other.n_vertices != mesh.n_vertices:
        raise InvalidParameterError(
            "The suspect must have the vertices of the original, in the same order; it has "
            f"{other.n_vertices} vertices and the original has {mesh.n_vertices}."
        )
    points, _ = size_one(mesh.vertices)
    basis, mass, groups = _low_modes((points, mesh.faces), k, cache)
    # Move, turn and scale the suspect onto the original in the weighted least squares (Umeyama 1991).
    moved, _ = size_one(other.vertices)
    shares = mass[:, None] / mass.sum()
    middle, goal = (shares * moved).sum(axis=0), (shares * points).sum(axis=0)
    centered, wanted = moved - middle, points - goal
    spread = float((shares * centered**2).sum())
    if not np.ptp(moved, axis=0).any():
        raise InvalidShapeError(
            f"The suspect must have an extent; all of its vertices are at {middle.tolist()}."
        )
    rotation, stretches = rotations_and_stretches(wanted.T @ (shares * centered))
    aligned = goal + stretches.sum() / spread * centered @ rotation.T
    own = basis.T @ (mass[:, None] * points)
    difference = basis.T @ (mass[:, None] * (aligned - points))
    found, dimension = _across(difference, own, groups)
    length = np.linalg.norm(found)
    tests = []
    for secret in secrets:
        pattern, _ = _across(_pattern(secret, basis, mass), own, groups)
        score = 0.0
        if length > 0:
            score = float((pattern * found).sum() / (np.linalg.norm(pattern) * length))
        chance = _exceedance(score, dimension) if length > 0 else 1.0
        tests.append(WatermarkTest(score, chance, dimension))
    return tuple(tests) if isinstance(key, list | tuple) else tests[0]


def _require_key(key: object) -> bytes:
    secret = key.encode() if isinstance(key, str) else key
    if not isinstance(secret, bytes) or not secret:
        raise InvalidParameterError(
            f"A key must be text or bytes, and not empty; it is {describe_value(key)}."
        )
    return secret


def _low_modes(
    mesh: tuple[Float[np.ndarray, "n 3"], np.ndarray],
    k: Integer,
    cache: str | Path | None,
) -> tuple[Float[np.ndarray, "n k"], Float[np.ndarray, " n"], Int[np.ndarray, " k"]]:
    """Return the lowest eigenfunctions that are not constant on components, B, and the eigenspaces.

    An eigenspace that k would cut is left out, since its part would depend on the machine.
    """
    n_constant, _ = vertex_components(mesh)
    wanted = whole_number(k, "k", 1, len(mesh[0]) - n_constant)
    spectrum = solve_spectrum(robust_laplacian(mesh), wanted + n_constant, cache=cache)
    proof = spectrum.certificate
    end = wanted + n_constant
    if proof.n_split and end - proof.clusters[-1] > n_constant:
        end -= proof.clusters[-1]
    groups = np.repeat(np.arange(len(proof.clusters)), proof.clusters)[n_constant:end]
    basis = spectrum.eigenvectors[:, n_constant:end]
    return basis, spectrum.mass.diagonal(), groups - groups[0]


def _pattern(
    secret: bytes, basis: Float[np.ndarray, "n k"], mass: Float[np.ndarray, " n"]
) -> Float[np.ndarray, "k 3"]:
    """Return the coefficients of white noise, which are independent Gaussian numbers.

    White noise has the variance 1 / mass at a vertex, so its coefficients have variance 1 in any
    basis with ΦᵀBΦ = I.
    """
    n = len(basis)
    words = np.frombuffer(shake_256(secret).digest(8 * 3 * n), dtype="<u8")
    uniform = ((words >> np.uint64(11)) + 0.5) / 2.0**53  # strictly between 0 and 1
    noise = ndtri(uniform).reshape(n, 3)
    return basis.T @ (np.sqrt(mass)[:, None] * noise)


def _across(
    vectors: Float[np.ndarray, "k 3"], own: Float[np.ndarray, "k 3"], groups: Int[np.ndarray, " k"]
) -> tuple[Float[np.ndarray, "k 3"], int]:
    """Take from vectors, eigenspace by eigenspace, their component along those of the original.

    All coefficients of one eigenspace count as one vector, so the choice of eigenvectors does not
    matter. The second result is the number of dimensions that are left.
    """
    squares = np.bincount(groups, weights=(own**2).sum(axis=1))
    is_clear = squares > LEAST_COEFFICIENT**2 * squares.max()
    products = np.bincount(groups, weights=(vectors * own).sum(axis=1))
    shares = np.divide(products, squares, out=np.zeros_like(squares), where=is_clear)
    return vectors - shares[groups, None] * own, own.size - int(is_clear.sum())


def _exceedance(score: float, dimension: int) -> float:
    """Return the probability that a random direction has at least this cosine with a fixed one."""
    tail = float(betainc((dimension - 1) / 2, 0.5, 1 - min(score**2, 1.0))) / 2
    return tail if score >= 0 else 1 - tail
