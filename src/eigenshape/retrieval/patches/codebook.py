"""A codebook of patches: its numbers, its file, and Fisher vectors in it."""

from dataclasses import fields
from functools import cached_property, lru_cache
from hashlib import sha256
from importlib.resources import files
from io import BytesIO

import numpy as np
from jaxtyping import Float, Float32, Int8

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, freeze, record
from certeig.kit.threads import one_blas_thread
from eigenshape.retrieval.patches.patches import Patches

BASES = (0, 3, 6)  # radii, by number, for each of which a codebook is learned
# A shape is encoded at each base radius and the next two, with the codebook of the base, so that
# shapes whose boxes differ by up to 1.25² compare.
N_SIZES = 3
N_AXES = 20  # principal axes that are kept of the 64 numbers of a disc
N_ENTRIES = 32  # Gaussians of each mixture; the length of a code is 2 × N_ENTRIES × N_AXES
MOST_SPREADS = 3.0  # standard deviations at which a number is clipped
POWER = 0.4  # of the entries of a Fisher vector; below 1, frequent patches count less
LARGEST_CODE = 7  # the largest entry of a rounded code: two entries fit a byte
# Entries of Fisher vectors of unit length are clipped here: 5 % of them are larger. Hit rates of
# experiments/ch5_retrieval (tuning half) were the same from 0.05 to 0.08, and those of float32.
CLIP = 0.06
DEFAULT = "default_codebook.npz"  # written by experiments/ch5_retrieval/make_codebook.py


@record
class PatchCodebook(ReadOnly):
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


def standardize(
    numbers: Float[np.ndarray, "p c"],
    mean: Float[np.ndarray, " c"],
    spread: Float[np.ndarray, " c"],
) -> Float[np.ndarray, "p c"]:
    """Return numbers in standard deviations, clipped at three."""
    return np.clip((numbers - mean) / spread, -MOST_SPREADS, MOST_SPREADS)


def log_joint(
    points: Float[np.ndarray, "p d"],
    shares: Float[np.ndarray, " w"],
    centers: Float[np.ndarray, "w d"],
    variances: Float[np.ndarray, "w d"],
) -> Float[np.ndarray, "p w"]:
    """Return log(share × density) of each point under each Gaussian, up to a constant."""
    # In one array: a hundred shapes have 45,000 points.
    joint = points**2 @ (1 / variances).T
    joint -= 2 * points @ (centers / variances).T
    joint += (centers**2 / variances).sum(axis=1)
    joint += np.log(variances).sum(axis=1)
    joint *= -0.5
    joint += np.log(shares)
    return joint


def log_sums(joint: Float[np.ndarray, "p w"]) -> Float[np.ndarray, "p 1"]:
    """Return log(Σ exp) of each row as `scipy.special.logsumexp` does, in a third of the time."""
    place = joint.argmax(axis=1)[:, None]
    largest = np.take_along_axis(joint, place, axis=1)
    rest = joint - largest
    np.exp(rest, out=rest)
    np.put_along_axis(rest, place, 0, axis=1)
    return largest + np.log1p(rest.sum(axis=1, keepdims=True))


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
    numbers: Float[np.ndarray, "m c"], codebook: PatchCodebook, place: int
) -> Float[np.ndarray, "m d"]:
    """Whiten the numbers of patches at one radius as those of a base radius are."""
    wide = numbers.astype(np.float64)
    return standardize(wide, codebook.means[place], codebook.spreads[place]) @ codebook.axes[place]


def whiten_patches(shape: Patches, codebook: PatchCodebook) -> Float[np.ndarray, "b s m d"]:
    """Whiten the numbers of patches at each base radius, and at those of each size beside it."""
    return np.stack(
        [
            [
                whiten_numbers(shape.numbers[:, base + size], codebook, place)
                for size in range(N_SIZES)
            ]
            for place, base in enumerate(BASES)
        ]
    )


def _fisher(
    shape: Patches, radius: int, codebook: PatchCodebook, place: int
) -> Float[np.ndarray, " v"]:
    shares, centers = codebook.shares[place], codebook.centers[place]
    variances = codebook.variances[place]
    points = whiten_numbers(shape.numbers[:, radius], codebook, place)
    joint = log_joint(points, shares, centers, variances)
    belief = np.exp(joint - log_sums(joint))
    weights = shape.weights[:, radius].astype(np.float64)
    belief *= (weights / weights.sum())[:, None]
    # Moments of order 0, 1 and 2 of the patches of each Gaussian
    sums, firsts, seconds = belief.sum(axis=0)[:, None], belief.T @ points, belief.T @ points**2
    by_center = (firsts - sums * centers) / np.sqrt(variances * shares[:, None])
    moved = (seconds - 2 * firsts * centers + sums * centers**2) / variances - sums
    by_variance = moved / np.sqrt(2 * shares[:, None])
    return np.concatenate([by_center.ravel(), by_variance.ravel()])


def round_codes(codes: Float32[np.ndarray, "*k v"], clip: float) -> Int8[np.ndarray, "*k v"]:
    """Return codes in 15 steps from -clip to clip: the same matches in an eighth of the memory."""
    return np.rint(LARGEST_CODE * np.clip(codes / clip, -1, 1)).astype(np.int8)
