"""What a shape is known by through its patches: codes in the words of a codebook, and points that can be matched."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Int, Int8

from eigenshape._arguments import require_each, require_type
from eigenshape._arrays import frozen
from eigenshape._errors import InvalidParameterError
from eigenshape._threads import one_blas_thread
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.orientation import orient_outward
from eigenshape.geometry.requirements import require_describable
from eigenshape.operators.smoothing import denoise
from eigenshape.retrieval.patches.codebook import PatchCodebook, encode_patches
from eigenshape.retrieval.patches.matching import PatchPoints, patch_points
from eigenshape.retrieval.patches.patches import (
    N_VIEWS,
    Patches,
    describe_patch_views,
    describe_patches,
)

FULL = 127  # the largest entry of a code


@dataclass(frozen=True)
class PatchRecipe:
    """Patches in the words of a codebook; two descriptors compare only if their words are the same.

    Parameters
    ----------
    codebook : PatchCodebook
    """

    codebook: PatchCodebook

    @property
    def name(self) -> str:
        """Return what errors and tables call it."""
        return f"patches {self.codebook.digest[:8]}"


@dataclass(frozen=True, eq=False)
class PatchDescriptor:
    """A shape in words, and what is seen of it from some sides if it is closed.

    Attributes
    ----------
    codes : (1 + w, b, s, v) int8
        Fisher vectors of `encode_patches`, of the shape and of w views, each rounded so that its largest entry is 127.
    points : tuple of 1 + w PatchPoints
        The same in points, at vertices of the whole.
    recipe : PatchRecipe
    """

    codes: Int8[np.ndarray, "w b s v"]
    points: tuple[PatchPoints, ...]
    recipe: PatchRecipe

    @property
    def vertices(self) -> Int[np.ndarray, " m"]:
        """Return the vertex of each patch of the whole shape."""
        return self.points[0].vertices


def seen_patches(mesh: MeshLike, *, n_views: int = N_VIEWS) -> list[Patches]:
    """Describe the patches of a surface, and of what single viewpoints see of it if it is closed.

    They are those of a copy that `orient_outward` has turned and `denoise` has smoothed as far as its noise asks for,
    so that neither sets a scan apart from clean shapes.

    Parameters
    ----------
    mesh : MeshLike
    n_views : int
        Viewpoints, spread evenly around the shape.

    Returns
    -------
    list of Patches
        The whole first.

    Raises
    ------
    InvalidShapeError
        If a face has no area, or as `describe_patches`.
    """
    mesh = as_mesh(mesh)
    require_describable(mesh)
    clean = denoise(orient_outward(mesh))
    return [describe_patches(clean), *describe_patch_views(clean, n_views=n_views)]


def describe_by_patches(
    mesh: TriangleMesh, recipe: PatchRecipe, *, n_views: int = N_VIEWS
) -> PatchDescriptor:
    """Describe a surface by its patches; see `seen_patches`."""
    return in_words(seen_patches(mesh, n_views=n_views), recipe)


def in_words(patches: Sequence[Patches], recipe: PatchRecipe) -> PatchDescriptor:
    """Return the descriptor of a shape from its patches, and those of its views.

    Raises
    ------
    InvalidParameterError
        If there are none.
    """
    require_type(recipe, PatchRecipe, "recipe")
    require_each(patches, Patches, "patches")
    if not patches:
        raise InvalidParameterError(
            "A descriptor takes patches of a shape, then of its views; there are none."
        )
    with one_blas_thread():
        codes = np.stack([rounded(encode_patches(each, recipe.codebook)) for each in patches])
        points = tuple(patch_points(each, recipe.codebook) for each in patches)
    return PatchDescriptor(frozen(codes), points, recipe)


def rounded(codes: Float32[np.ndarray, "*k v"]) -> Int8[np.ndarray, "*k v"]:
    """Return codes as small integers, which find the same answers in a quarter of the room."""
    return np.rint(FULL * codes / np.abs(codes).max(axis=-1, keepdims=True)).astype(np.int8)
