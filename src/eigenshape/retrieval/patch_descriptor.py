"""What a shape is known by through its patches: codes in the words of a codebook."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Int, Int8

from eigenshape._arrays import frozen
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.retrieval.codebook import PatchCodebook, encode_patches
from eigenshape.retrieval.patches import N_VIEWS, Patches, describe_patch_views, describe_patches

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
    """A shape, or what is seen of it, in words.

    Attributes
    ----------
    codes : (b, s, v) int8
        Fisher vectors of `encode_patches`, each rounded so that its largest entry is 127.
    vertices : (m,) int
        At which the patches lie.
    recipe : PatchRecipe
    """

    codes: Int8[np.ndarray, "b s v"]
    vertices: Int[np.ndarray, " m"]
    recipe: PatchRecipe


def describe_by_patches(mesh: TriangleMesh, recipe: PatchRecipe) -> PatchDescriptor:
    """Describe a surface by its patches; see `describe_patches`.

    Raises
    ------
    InvalidShapeError
        If a vertex has no face, or the surface no area.
    """
    return in_words(describe_patches(mesh), recipe)


def describe_views_by_patches(
    mesh: TriangleMesh, recipe: PatchRecipe, *, n_views: int = N_VIEWS
) -> list[PatchDescriptor]:
    """Describe what single viewpoints see of a closed shape; see `describe_patch_views`."""
    return [in_words(patches, recipe) for patches in describe_patch_views(mesh, n_views=n_views)]


def in_words(patches: Patches, recipe: PatchRecipe) -> PatchDescriptor:
    """Return the descriptor of a shape whose patches are known."""
    return PatchDescriptor(rounded(encode_patches(patches, recipe.codebook)), patches.vertices, recipe)


def rounded(codes: Float32[np.ndarray, "b s v"]) -> Int8[np.ndarray, "b s v"]:
    """Return codes as small integers, which find the same answers in a quarter of the room."""
    return frozen(np.rint(FULL * codes / np.abs(codes).max(axis=2, keepdims=True)).astype(np.int8))


def unit(codes: Int8[np.ndarray, "*k b s v"]) -> Float32[np.ndarray, "*k b s v"]:
    """Return rounded codes with unit length."""
    floats = codes.astype(np.float32)
    floats /= np.linalg.norm(floats, axis=-1, keepdims=True)
    return floats
