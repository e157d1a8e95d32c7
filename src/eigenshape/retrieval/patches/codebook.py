"""A vocabulary of patches, learnt from shapes without labels, and the shapes' vectors in it (Fisher vectors)."""

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
from eigenshape._arrays import frozen
from eigenshape._errors import InvalidParameterError
from eigenshape._threads import one_blas_thread
from eigenshape.retrieval.patches.patches import Patches

BASES = (0, 3, 6)  # radii at which words are learnt
N_SIZES = 3  # radii from each of these on at which a shape is encoded, in the same words
N_AXES = 20
N_WORDS = 32
LEAST_SPREAD = 0.1  # of a number, so that one that hardly varies is not blown up
CLIPPED = 3.0  # spreads
LEAST_VARIANCE = 1e-3  # of a word, where all words' together is 1
ROUNDS = 60
SETTLED = 1e-5  # of the likelihood
POWER = 0.4
MADE = "made_words.npz"


@dataclass(frozen=True, eq=False, repr=False)
class PatchCodebook:
    """For each base radius: how numbers are centred, scaled and turned, and a mixture of Gaussians.

    Equal to another whose numbers are the same.

    Attributes
    ----------
    means, spreads : (b, c) float32
    axes : (b, c, d) float32
        Columns that whiten.
    shares : (b, w) float32
        Of the words, summing to 1.
    centers, variances : (b, w, d) float32
    """

    means: Float32[np.ndarray, "b c"]
    spreads: Float32[np.ndarray, "b c"]
    axes: Float32[np.ndarray, "b c d"]
    shares: Float32[np.ndarray, "b w"]
    centers: Float32[np.ndarray, "b w d"]
    variances: Float32[np.ndarray, "b w d"]

    @cached_property
    def digest(self) -> str:
        """Return the SHA-256 of all numbers."""
        return sha256(
            b"".join(getattr(self, field.name).tobytes() for field in fields(self))
        ).hexdigest()

    @property
    def code_shape(self) -> tuple[int, int, int]:
        """Return base radii, sizes, and numbers of a Fisher vector."""
        n_bases, n_words, n_axes = self.centers.shape
        return n_bases, N_SIZES, 2 * n_words * n_axes

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PatchCodebook) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def __repr__(self) -> str:
        return f"PatchCodebook({self.digest[:8]})"


def train_codebook(shapes: Sequence[Patches], *, seed: int = 0) -> PatchCodebook:
    """Learn words of patches from shapes, and from partial views of them, none of which need a label.

    At each base radius numbers are scaled to unit variance, turned to their 20 principal axes and whitened, and a
    mixture of 32 Gaussians with diagonal covariance is fitted by expectation and maximisation.

    Parameters
    ----------
    shapes : sequence of Patches
    seed : int
        Of the first words.

    Raises
    ------
    InvalidParameterError
        If there are fewer patches than words.
    """
    require_each(shapes, Patches, "shapes")
    count = sum(len(shape.vertices) for shape in shapes)
    if count < 2 * N_WORDS:
        raise InvalidParameterError(
            f"A codebook takes at least {2 * N_WORDS} patches; {len(shapes)} shapes have {count}."
        )
    with one_blas_thread():
        books = [
            _trained(np.concatenate([s.numbers[:, base] for s in shapes]), seed) for base in BASES
        ]
    return PatchCodebook(
        *(frozen(np.stack(parts).astype(np.float32)) for parts in zip(*books, strict=True))
    )


@lru_cache(maxsize=1)
def made_codebook() -> PatchCodebook:
    """Return the words that come with the library, learnt from made-up creatures (`make_creature`) alone.

    For collections too small to learn words from.
    """
    return read_codebook((files("eigenshape.retrieval.patches") / MADE).read_bytes())


def write_codebook(codebook: PatchCodebook) -> bytes:
    """Return a codebook as the bytes of an npz file, the same for the same numbers."""
    require_type(codebook, PatchCodebook, "codebook")
    file = BytesIO()
    np.savez_compressed(
        file, **{field.name: getattr(codebook, field.name) for field in fields(codebook)}
    )
    return file.getvalue()


def read_codebook(data: bytes) -> PatchCodebook:
    """Return the codebook of `write_codebook`."""
    with np.load(BytesIO(data)) as arrays:
        return PatchCodebook(**{name: frozen(arrays[name]) for name in arrays.files})


def _trained(rows: Float32[np.ndarray, "p c"], seed: int) -> tuple[np.ndarray, ...]:
    numbers = rows.astype(np.float64)
    mean, spread = numbers.mean(axis=0), np.maximum(numbers.std(axis=0), LEAST_SPREAD)
    scaled = _scaled(numbers, mean, spread)
    values, vectors = sl.eigh(scaled.T @ scaled / len(scaled))
    axes = vectors[:, ::-1][:, :N_AXES] / np.sqrt(np.maximum(values[::-1][:N_AXES], 1e-9))
    return mean, spread, axes, *_mixture(scaled @ axes, seed)


def _scaled(
    numbers: Float[np.ndarray, "p c"],
    mean: Float[np.ndarray, " c"],
    spread: Float[np.ndarray, " c"],
) -> Float[np.ndarray, "p c"]:
    return np.clip((numbers - mean) / spread, -CLIPPED, CLIPPED)


def _mixture(
    points: Float[np.ndarray, "p d"], seed: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fit shares, centres and variances of words by expectation and maximisation (Dempster, Laird and Rubin 1977)."""
    centers, labels = kmeans2(points, N_WORDS, minit="++", rng=np.random.default_rng(seed))
    belief, before = np.eye(N_WORDS)[labels], -np.inf
    for _ in range(ROUNDS):
        weights = belief.sum(axis=0) + 1e-9
        centers = belief.T @ points / weights[:, None]
        variances = np.maximum(belief.T @ points**2 / weights[:, None] - centers**2, LEAST_VARIANCE)
        shares = weights / weights.sum()
        joint = _log_joint(points, shares, centers, variances)
        likelihood = logsumexp(joint, axis=1, keepdims=True)
        belief, mean = np.exp(joint - likelihood), float(likelihood.mean())
        if mean - before < SETTLED:
            break
        before = mean
    return shares, centers, variances


def _log_joint(
    points: Float[np.ndarray, "p d"],
    shares: Float[np.ndarray, " w"],
    centers: Float[np.ndarray, "w d"],
    variances: Float[np.ndarray, "w d"],
) -> Float[np.ndarray, "p w"]:
    """Return for each point and word the logarithm of its density times the word's share, but for a constant."""
    squares = (
        points**2 @ (1 / variances).T
        - 2 * points @ (centers / variances).T
        + (centers**2 / variances).sum(axis=1)
    )
    return np.asarray(np.log(shares) - 0.5 * (squares + np.log(variances).sum(axis=1)))


@one_blas_thread()
def encode_patches(shape: Patches, codebook: PatchCodebook) -> Float32[np.ndarray, "b s v"]:
    """Encode a shape as Fisher vectors: how its patches would have the words move (Perronnin, Sánchez, Mensink 2010).

    At each base radius and at the next two, by the words of the base. Gradients by centres and variances of the
    log-likelihood, each patch by its weight; signed powers of .4; unit length.

    Returns
    -------
    (b, s, v) float32
        Of b base radii, s sizes and v = 2 × words × axes numbers.
    """
    require_type(shape, Patches, "shape")
    require_type(codebook, PatchCodebook, "codebook")
    vectors = np.empty(codebook.code_shape)
    for place, base in enumerate(BASES):
        for size in range(N_SIZES):
            vectors[place, size] = _fisher(shape, base + size, codebook, place)
    rooted = np.sign(vectors) * np.abs(vectors) ** POWER
    return np.asarray(rooted / np.linalg.norm(rooted, axis=2, keepdims=True), dtype=np.float32)


def whitened(
    shape: Patches, radius: int, codebook: PatchCodebook, place: int
) -> Float[np.ndarray, "m d"]:
    """Turn the numbers at one radius into the whitened ones of a base radius."""
    scaled = _scaled(
        shape.numbers[:, radius].astype(np.float64), codebook.means[place], codebook.spreads[place]
    )
    return scaled @ codebook.axes[place]


def _fisher(
    shape: Patches, radius: int, codebook: PatchCodebook, place: int
) -> Float[np.ndarray, " v"]:
    shares, centers, variances = (
        codebook.shares[place],
        codebook.centers[place],
        codebook.variances[place],
    )
    points = whitened(shape, radius, codebook, place)
    joint = _log_joint(points, shares, centers, variances)
    belief = np.exp(joint - logsumexp(joint, axis=1, keepdims=True))
    weights = shape.weights[:, radius].astype(np.float64)
    belief *= (weights / weights.sum())[:, None]
    sums, firsts, seconds = belief.sum(axis=0)[:, None], belief.T @ points, belief.T @ points**2
    by_center = (firsts - sums * centers) / np.sqrt(variances * shares[:, None])
    moved = (seconds - 2 * firsts * centers + sums * centers**2) / variances - sums
    return np.concatenate([by_center.ravel(), (moved / np.sqrt(2 * shares[:, None])).ravel()])
