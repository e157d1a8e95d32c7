"""Learn a codebook of patches from shapes without labels."""

from collections.abc import Sequence

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float
from scipy.cluster.vq import kmeans2

from certeig.kit.arguments import require_each
from certeig.kit.arrays import whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import Integer
from eigenshape.retrieval.patches.codebook import (
    BASES,
    N_AXES,
    N_ENTRIES,
    PatchCodebook,
    log_joint,
    log_sums,
    standardize,
)
from eigenshape.retrieval.patches.patches import Patches

LEAST_SPREAD = 0.1  # standard deviation by which a number is divided at least, against noise
LEAST_EIGENVALUE = 1e-9  # of the covariance, so that whitening stays finite
LEAST_VARIANCE = 1e-3  # of an entry; whitened numbers have variance 1
LEAST_COUNT = 1e-9  # patches, added to the count of each entry so that none is divided by 0
ROUNDS = 60  # of expectation and maximization at most
CONVERGED = 1e-5  # gain of the mean log-likelihood below which the fit ends


def train_codebook(shapes: Sequence[Patches], *, seed: Integer = 0) -> PatchCodebook:
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
        If there are fewer than 64 patches, two for each Gaussian, or the seed is no whole number
        or negative.

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
    chance = whole_number(seed, "seed", 0)
    count = sum(len(shape.vertices) for shape in shapes)
    if count < 2 * N_ENTRIES:
        raise InvalidParameterError(
            f"A codebook takes at least {2 * N_ENTRIES} patches; {len(shapes)} shapes have {count}."
        )
    books = []
    with one_blas_thread():
        for base in BASES:
            rows = np.concatenate([shape.numbers[:, base] for shape in shapes])
            numbers = rows.astype(np.float64)
            mean = numbers.mean(axis=0)
            spread = np.maximum(numbers.std(axis=0), LEAST_SPREAD)
            scaled = standardize(numbers, mean, spread)
            # Whitened along the axes of largest variance
            values, vectors = sl.eigh(scaled.T @ scaled / len(scaled))
            lengths = np.sqrt(np.maximum(values[::-1][:N_AXES], LEAST_EIGENVALUE))
            axes = vectors[:, ::-1][:, :N_AXES] / lengths
            books.append((mean, spread, axes, *_fit_mixture(scaled @ axes, chance)))
    return PatchCodebook(
        *(np.stack(parts).astype(np.float32) for parts in zip(*books, strict=True))
    )


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
        joint = log_joint(points, shares, centers, variances)
        likelihood = log_sums(joint)
        joint -= likelihood
        belief, mean = np.exp(joint, out=joint), float(likelihood.mean())
        if mean - before < CONVERGED:
            break
        before = mean
    return shares, centers, variances
