"""A codebook of patches, learned from shapes without labels, and Fisher vectors in it."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property, lru_cache
from hashlib import sha256
from importlib.resources import files
from io import BytesIO

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float, Float32
from scipy.cluster.vq import kmeans2
from scipy.special import logsumexp

from eigenshape._arguments import require_each, require_type
from eigenshape._arrays import freeze
from eigenshape._errors import InvalidParameterError
from eigenshape._text import html_repr
from eigenshape._threads import one_blas_thread
from eigenshape.retrieval.patches.patches import Patches

BASES = (0, 3, 6)  # radii, by number, for each of which a codebook is learned
# A shape is encoded at each base radius and the next two, with the codebook of the base, so that
# shapes whose boxes differ by up to 1.25² compare.
N_SIZES = 3
N_AXES = 20  # principal axes that are kept of the 64 numbers of a disc
N_ENTRIES = 32  # Gaussians of each mixture; the length of a code is 2 × N_ENTRIES × N_AXES
LEAST_SPREAD = 0.1  # standard deviation by which a number is divided at least, against noise
MOST_SPREADS = 3.0  # standard deviations at which a number is clipped
LEAST_EIGENVALUE = 1e-9  # of the covariance, so that whitening stays finite
LEAST_VARIANCE = 1e-3  # of an entry; whitened numbers have variance 1
LEAST_COUNT = 1e-9  # patches, added to the count of each entry so that none is divided by 0
ROUNDS = 60  # of expectation and maximization at most
CONVERGED = 1e-5  # gain of the mean log-likelihood below which the fit ends
POWER = 0.4  # of the entries of a Fisher vector; below 1, frequent patches count less
DEFAULT = "default_codebook.npz"  # written by experiments/ch5_retrieval/make_codebook.py


@dataclass(frozen=True, eq=False, repr=False)
class PatchCodebook:
    """A mixture of w Gaussians over whitened patches, for each of b base radii.

    Two codebooks are equal if all their numbers are. `train_codebook` makes one from patches.

    Attributes
    ----------
    means, spreads : (b, c) float32
        Mean and standard deviation of each of the c numbers of a patch.
    axes : (b, c, d) float32
        Columns that whiten: d principal axes over the roots of their eigenvalues.
    shares : (b, w) float32
        Weights of the Gaussians; they sum to 1.
    centers, variances : (b, w, d) float32
        Of the Gaussians, whose covariances are diagonal.

    See Also
    --------
    train_codebook, default_codebook, PatchRecipe

    Examples
    --------
    >>> import eigenshape as es
    >>> codebook = es.retrieval.default_codebook()
    >>> n_radii, n_entries, n_axes = codebook.centers.shape
    >>> codebook.shares.shape == (n_radii, n_entries)
    True
    >>> es.retrieval.PatchRecipe(codebook) == es.retrieval.PatchRecipe()  # the default
    True
    """

    means: Float32[np.ndarray, "b c"]
    spreads: Float32[np.ndarray, "b c"]
    axes: Float32[np.ndarray, "b c d"]
    shares: Float32[np.ndarray, "b w"]
    centers: Float32[np.ndarray, "b w d"]
    variances: Float32[np.ndarray, "b w d"]

    _repr_html_ = html_repr

    @cached_property
    def digest(self) -> str:
        """Return the SHA-256 of all numbers."""
        return sha256(
            b"".join(getattr(self, field.name).tobytes() for field in fields(self))
        ).hexdigest()

    @property
    def code_shape(self) -> tuple[int, int, int]:
        """Return the numbers of base radii, of sizes, and of entries of a Fisher vector."""
        n_bases, n_entries, n_axes = self.centers.shape
        return n_bases, N_SIZES, 2 * n_entries * n_axes

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PatchCodebook) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def __repr__(self) -> str:
        return f"PatchCodebook({self.digest[:8]})"


def train_codebook(shapes: Sequence[Patches], *, seed: int = 0) -> PatchCodebook:
    """Learn a codebook from the patches of shapes without labels.

    At each base radius the numbers are scaled to unit variance, turned to their 20 principal axes
    and whitened. A mixture of 32 Gaussians with diagonal covariance is then fitted by expectation
    and maximization.

    Parameters
    ----------
    shapes : sequence of Patches
        Of `extract_patches`, of whole shapes and partial views.
    seed : int
        Of the random choice of the first centers.

    Returns
    -------
    PatchCodebook

    Raises
    ------
    InvalidParameterError
        If there are fewer than 64 patches, two for each Gaussian.

    See Also
    --------
    train_codebook_from_files, default_codebook

    Examples
    --------
    >>> import eigenshape as es
    >>> fish = es.make_creature("fish", n_vertices=500)
    >>> codebook = es.retrieval.train_codebook(es.retrieval.extract_patches(fish, n_views=0))
    >>> codebook.centers.shape
    (3, 32, 20)
    """
    require_each(shapes, Patches, "shapes")
    count = sum(len(shape.vertices) for shape in shapes)
    if count < 2 * N_ENTRIES:
        raise InvalidParameterError(
            f"A codebook takes at least {2 * N_ENTRIES} patches; {len(shapes)} shapes have {count}."
        )
    with one_blas_thread():
        books = [
            _train_at_radius(np.concatenate([shape.numbers[:, base] for shape in shapes]), seed)
            for base in BASES
        ]
    return PatchCodebook(
        *(freeze(np.stack(parts).astype(np.float32)) for parts in zip(*books, strict=True))
    )


@lru_cache(maxsize=1)
def default_codebook() -> PatchCodebook:
    """Return the codebook that comes with the library, learned from synthetic creatures.

    Use it for collections of fewer than 40 shapes, which are too small to learn from. How much a
    codebook of your own finds is measured in ``experiments/ch5_retrieval``.

    Returns
    -------
    PatchCodebook

    See Also
    --------
    train_codebook, train_codebook_from_files, make_creature

    Examples
    --------
    >>> import eigenshape as es
    >>> es.retrieval.default_codebook().shares.shape
    (3, 32)
    """
    return read_codebook((files("eigenshape.retrieval.patches") / DEFAULT).read_bytes())


def write_codebook(codebook: PatchCodebook) -> bytes:
    """Return a codebook as the bytes of an npz file; the same bytes for the same numbers.

    Parameters
    ----------
    codebook : PatchCodebook

    Returns
    -------
    bytes

    See Also
    --------
    read_codebook

    Examples
    --------
    >>> import eigenshape as es
    >>> codebook = es.retrieval.default_codebook()
    >>> es.retrieval.read_codebook(es.retrieval.write_codebook(codebook)) == codebook
    True
    """
    require_type(codebook, PatchCodebook, "codebook")
    file = BytesIO()
    arrays = {field.name: getattr(codebook, field.name) for field in fields(codebook)}
    np.savez_compressed(file, **arrays)
    return file.getvalue()


def read_codebook(data: bytes) -> PatchCodebook:
    """Return the codebook that `write_codebook` turned into bytes.

    Parameters
    ----------
    data : bytes

    Returns
    -------
    PatchCodebook

    See Also
    --------
    write_codebook

    Examples
    --------
    >>> import eigenshape as es
    >>> data = es.retrieval.write_codebook(es.retrieval.default_codebook())
    >>> es.retrieval.read_codebook(data).means.shape
    (3, 64)
    """
    with np.load(BytesIO(data)) as arrays:
        return PatchCodebook(**{name: freeze(arrays[name]) for name in arrays.files})


def _train_at_radius(rows: Float32[np.ndarray, "p c"], seed: int) -> tuple[np.ndarray, ...]:
    """Return means, spreads, axes, shares, centers and variances of p patches at one radius."""
    numbers = rows.astype(np.float64)
    mean = numbers.mean(axis=0)
    spread = np.maximum(numbers.std(axis=0), LEAST_SPREAD)
    scaled = _standardize(numbers, mean, spread)
    values, vectors = sl.eigh(scaled.T @ scaled / len(scaled))
    lengths = np.sqrt(np.maximum(values[::-1][:N_AXES], LEAST_EIGENVALUE))
    axes = vectors[:, ::-1][:, :N_AXES] / lengths
    return mean, spread, axes, *_fit_mixture(scaled @ axes, seed)


def _standardize(
    numbers: Float[np.ndarray, "p c"],
    mean: Float[np.ndarray, " c"],
    spread: Float[np.ndarray, " c"],
) -> Float[np.ndarray, "p c"]:
    return np.clip((numbers - mean) / spread, -MOST_SPREADS, MOST_SPREADS)


def _fit_mixture(
    points: Float[np.ndarray, "p d"], seed: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fit shares, centers and variances of a mixture of Gaussians with diagonal covariance.

    Expectation and maximization (Dempster, Laird and Rubin 1977), from the clusters of k-means++.
    """
    centers, labels = kmeans2(points, N_ENTRIES, minit="++", rng=np.random.default_rng(seed))
    belief, before = np.eye(N_ENTRIES)[labels], -np.inf
    for _ in range(ROUNDS):
        counts = belief.sum(axis=0) + LEAST_COUNT
        centers = belief.T @ points / counts[:, None]
        squares = belief.T @ points**2 / counts[:, None]
        variances = np.maximum(squares - centers**2, LEAST_VARIANCE)
        shares = counts / counts.sum()
        joint = _log_joint(points, shares, centers, variances)
        likelihood = logsumexp(joint, axis=1, keepdims=True)
        belief, mean = np.exp(joint - likelihood), float(likelihood.mean())
        if mean - before < CONVERGED:
            break
        before = mean
    return shares, centers, variances


def _log_joint(
    points: Float[np.ndarray, "p d"],
    shares: Float[np.ndarray, " w"],
    centers: Float[np.ndarray, "w d"],
    variances: Float[np.ndarray, "w d"],
) -> Float[np.ndarray, "p w"]:
    """Return log(share × density) of each point under each Gaussian, up to a constant."""
    squares = (
        points**2 @ (1 / variances).T
        - 2 * points @ (centers / variances).T
        + (centers**2 / variances).sum(axis=1)
    )
    return np.asarray(np.log(shares) - 0.5 * (squares + np.log(variances).sum(axis=1)))


@one_blas_thread()
def encode_patches(shape: Patches, codebook: PatchCodebook) -> Float32[np.ndarray, "b s v"]:
    """Encode a shape as Fisher vectors (Perronnin, Sánchez and Mensink 2010).

    They are gradients of the log-likelihood of the weighted patches by the centers and variances
    of the Gaussians, at each base radius and the next two with the mixture of the base. Entries
    are raised to the power 0.4, with their signs, and vectors have unit length.

    Returns
    -------
    (b, s, v) float32
        Of b base radii, s sizes and v = 2 × Gaussians × axes numbers.
    """
    require_type(shape, Patches, "shape")
    require_type(codebook, PatchCodebook, "codebook")
    vectors = np.empty(codebook.code_shape)
    for place, base in enumerate(BASES):
        for size in range(N_SIZES):
            vectors[place, size] = _fisher(shape, base + size, codebook, place)
    rooted = np.sign(vectors) * np.abs(vectors) ** POWER
    return np.asarray(rooted / np.linalg.norm(rooted, axis=2, keepdims=True), dtype=np.float32)


def whiten_numbers(
    shape: Patches, radius: int, codebook: PatchCodebook, place: int
) -> Float[np.ndarray, "m d"]:
    """Whiten the numbers at one radius as those of a base radius are."""
    scaled = _standardize(
        shape.numbers[:, radius].astype(np.float64), codebook.means[place], codebook.spreads[place]
    )
    return scaled @ codebook.axes[place]


def _fisher(
    shape: Patches, radius: int, codebook: PatchCodebook, place: int
) -> Float[np.ndarray, " v"]:
    shares, centers = codebook.shares[place], codebook.centers[place]
    variances = codebook.variances[place]
    points = whiten_numbers(shape, radius, codebook, place)
    joint = _log_joint(points, shares, centers, variances)
    belief = np.exp(joint - logsumexp(joint, axis=1, keepdims=True))
    weights = shape.weights[:, radius].astype(np.float64)
    belief *= (weights / weights.sum())[:, None]
    # Moments of order 0, 1 and 2 of the patches of each Gaussian
    sums, firsts, seconds = belief.sum(axis=0)[:, None], belief.T @ points, belief.T @ points**2
    by_center = (firsts - sums * centers) / np.sqrt(variances * shares[:, None])
    moved = (seconds - 2 * firsts * centers + sums * centers**2) / variances - sums
    by_variance = moved / np.sqrt(2 * shares[:, None])
    return np.concatenate([by_center.ravel(), by_variance.ravel()])
