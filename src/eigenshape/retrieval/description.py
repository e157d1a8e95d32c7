"""Describe a mesh by any recipe, to search an index or to be kept in one."""

from eigenshape._arguments import require_type
from eigenshape._typing import Integer
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.retrieval.kinds import AnyRecipe, Descriptor, kind_of
from eigenshape.retrieval.patches.descriptor import PatchRecipe
from eigenshape.scans.partial import view_number


def describe(mesh: MeshLike, recipe: AnyRecipe | None = None) -> Descriptor:
    """Describe a mesh, to search an index for similar shapes or to compare it with another.

    `ShapeIndex.query` describes a mesh by itself; describe it here to ask several indexes, or by a
    recipe of your choice. `ShapeIndex.add` describes a mesh that is to be found.

    Parameters
    ----------
    mesh : MeshLike
        A closed or open surface, of any size and in any pose. Patches of a surface of more than
        30,000 vertices are those of one that is thinned out to fewer (`extract_patches`).
    recipe : HeatRecipe or PatchRecipe, optional
        By default patches with the codebook that comes with the library, ``PatchRecipe()``. The
        presets of heat are ``SCALE_FREE`` and ``THESIS``.

    Returns
    -------
    HeatDescriptor or PatchDescriptor

    Raises
    ------
    InvalidShapeError
        If a face has no area or occurs twice, a vertex has no face, or the mesh is a soup (faces
        lie edge on edge without sharing vertices).

    See Also
    --------
    ShapeIndex, matching_score, patch_scores, find_heat_features, extract_patches

    Examples
    --------
    >>> import eigenshape as es
    >>> fish = es.make_creature("fish", n_vertices=500)
    >>> es.describe(fish).codes.shape  # the whole and six views of it
    (7, 3, 3, 1280)
    >>> es.describe(fish, es.retrieval.SCALE_FREE).vectors.shape  # 15 feature points
    (15, 15)
    """
    mesh = as_mesh(mesh)
    require_type(recipe, AnyRecipe | None, "recipe")
    if recipe is None:
        recipe = PatchRecipe()
    descriptor: Descriptor = kind_of(recipe).describe_query(mesh, recipe)
    return descriptor


def describe_to_store(
    mesh: TriangleMesh, recipe: AnyRecipe, n_views: Integer | None = None
) -> list[Descriptor]:
    """Describe a mesh as an index keeps it: the whole, and what viewpoints see if it is closed."""
    kind = kind_of(recipe)
    count = kind.n_views if n_views is None else view_number(n_views, "n_views")
    descriptors: list[Descriptor] = kind.describe_to_store(mesh, recipe, count)
    return descriptors
