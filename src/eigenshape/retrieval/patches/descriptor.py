"""The patch descriptor of a shape: codes in a codebook, and points that can be matched."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf

import numpy as np
from jaxtyping import Int, Int8

from certeig.kit.arguments import require_each, require_type
from certeig.kit.arrays import ReadOnly, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.text import Shown
from certeig.kit.threads import one_blas_thread
from eigenshape.retrieval.patches.codebook import (
    CLIP,
    PatchCodebook,
    default_codebook,
    encode_patches,
    round_codes,
)
from eigenshape.retrieval.patches.matching import PatchPoints, patch_points
from eigenshape.retrieval.patches.mirror_images import is_mirror_image
from eigenshape.retrieval.patches.patches import Patches
from eigenshape.scans.partial import view_number


@dataclass(frozen=True)
class PatchRecipe(Shown):
    """Describe a shape by patches, encoded in a codebook.

    Two descriptors compare only if their recipes are equal.

    Parameters
    ----------
    codebook : PatchCodebook, optional
        By default the one that comes with the library (`default_codebook`).
    clip : float
        Largest entry of a Fisher vector of unit length that is told apart; entries are rounded to
        sevenths of it.
    n_frames : int
        Sides from which an index describes a closed shape as a depth camera sees it, beside its
        views. Six find more for queries that are single depth scans, and take 35 KB
        and 1 CPU second a shape.

    Raises
    ------
    InvalidParameterError
        If `clip` is not positive and finite, or `n_frames` is negative.

    See Also
    --------
    HeatRecipe, train_codebook

    Examples
    --------
    >>> import eigenshape as es
    >>> es.retrieval.PatchRecipe() == es.retrieval.PatchRecipe(es.retrieval.default_codebook())
    True
    """

    codebook: PatchCodebook = field(default_factory=default_codebook)
    clip: float = CLIP
    n_frames: int = 0

    def __post_init__(self) -> None:
        view_number(self.n_frames, "n_frames")
        if not 0 < self.clip < inf:
            raise InvalidParameterError(
                f"clip must be positive and finite; it is {self.clip}. The default is {CLIP}."
            )

    @property
    def name(self) -> str:
        """Return a short name for messages and tables."""
        frames = f" with {self.n_frames} frames" if self.n_frames else ""
        return f"patches {self.codebook.digest[:8]}{frames}"


@record
class PatchDescriptor(ReadOnly):
    """A shape described by patches, and w partial views of it if it is closed.

    Attributes
    ----------
    codes : (1 + w, b, s, v) int8
        Fisher vectors of the shape and of its views, at b base radii and s sizes.
        Whole numbers from -7 to 7: sevenths of the recipe's clip.
    points : tuple of PatchPoints
        Points of the shape and of its views, at vertices of the whole. An index keeps those of the
        whole shape alone: with those of views it found no more.
    recipe : PatchRecipe

    See Also
    --------
    patch_scores, match_patches

    Examples
    --------
    The codes have a row for the shape and one for each view; so do the points:

    >>> import eigenshape as es
    >>> fish = es.describe(es.make_creature("fish", n_vertices=500))
    >>> len(fish.codes) == len(fish.points)
    True
    >>> bool((fish.vertices == fish.points[0].vertices).all())
    True
    """

    codes: Int8[np.ndarray, "w b s v"]
    points: tuple[PatchPoints, ...]
    recipe: PatchRecipe

    @property
    def vertices(self) -> Int[np.ndarray, " m"]:
        """Return the vertex of each patch of the whole shape."""
        return self.points[0].vertices

    def is_mirror_image(self, other: "PatchDescriptor") -> bool | None:
        """Say whether a shape is rather like the mirror image of another one.

        Parameters
        ----------
        other : PatchDescriptor
            By the same codebook.

        Returns
        -------
        bool or None
            None if it cannot be told: both sides are alike, as of an animal, hardly anything agrees, or
            the surface is a sheet.
        """
        require_type(other, PatchDescriptor, "other")
        return is_mirror_image(self.points[0], other.points[0])


def patch_descriptor(patches: Sequence[Patches], recipe: PatchRecipe) -> PatchDescriptor:
    """Encode the patches of a shape, and of its views, as one descriptor.

    Use this for patches that you extracted yourself; `describe` does both in one call.

    Parameters
    ----------
    patches : sequence of Patches
        Of `extract_patches`: the whole shape first, then its views.
    recipe : PatchRecipe

    Returns
    -------
    PatchDescriptor

    Raises
    ------
    InvalidParameterError
        If `patches` is empty.

    See Also
    --------
    extract_patches, describe

    Examples
    --------
    >>> import eigenshape as es
    >>> patches = es.retrieval.extract_patches(es.icosphere(2), n_samples=20, n_views=1)
    >>> es.retrieval.patch_descriptor(patches, es.retrieval.PatchRecipe()).codes.shape
    (2, 3, 3, 1280)
    """
    require_type(recipe, PatchRecipe, "recipe")
    require_each(patches, Patches, "patches")
    if not patches:
        raise InvalidParameterError(
            "A patch descriptor needs the patches of a shape; the list is empty. "
            "Pass extract_patches(mesh)."
        )
    with one_blas_thread():
        codes = np.stack(
            [round_codes(encode_patches(each, recipe.codebook), recipe.clip) for each in patches]
        )
        points = tuple(patch_points(each, recipe.codebook) for each in patches)
    return PatchDescriptor(codes, points, recipe)
