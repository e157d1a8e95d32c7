"""Surfaces of the structures of a brain, from a volume that holds the label of each voxel."""

from collections.abc import Iterable, Mapping

import numpy as np

from certeig.kit.arguments import require_type, require_unicode
from certeig.kit.arrays import real_numbers
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import as_affine, different_values
from eigenshape.calculus.voxels import voxel_surface
from eigenshape.geometry.mesh import TriangleMesh

# The structures of BrainPrint and their labels in aseg.mgz of FreeSurfer (FreeSurferColorLUT.txt).
FREESURFER_STRUCTURES: dict[str, tuple[int, ...]] = {
    "CorpusCallosum": (251, 252, 253, 254, 255),
    "Cerebellum": (7, 8, 16, 46, 47),
    "Ventricles": (4, 5, 14, 24, 31, 43, 44, 63),
    "3rd-Ventricle": (14, 24),
    "4th-Ventricle": (15,),
    "Brain-Stem": (16,),
    "Left-Striatum": (11, 12, 26),
    "Left-Lateral-Ventricle": (4, 5, 31),
    "Left-Cerebellum-White-Matter": (7,),
    "Left-Cerebellum-Cortex": (8,),
    "Left-Thalamus-Proper": (10,),
    "Left-Caudate": (11,),
    "Left-Putamen": (12,),
    "Left-Pallidum": (13,),
    "Left-Hippocampus": (17,),
    "Left-Amygdala": (18,),
    "Left-Accumbens-area": (26,),
    "Left-VentralDC": (28,),
    "Right-Striatum": (50, 51, 58),
    "Right-Lateral-Ventricle": (43, 44, 63),
    "Right-Cerebellum-White-Matter": (46,),
    "Right-Cerebellum-Cortex": (47,),
    "Right-Thalamus-Proper": (49,),
    "Right-Caudate": (50,),
    "Right-Putamen": (51,),
    "Right-Pallidum": (52,),
    "Right-Hippocampus": (53,),
    "Right-Amygdala": (54,),
    "Right-Accumbens-area": (58,),
    "Right-VentralDC": (60,),
}
MOST_NAMED = 20  # labels of a volume, in a message


def structure_surfaces(
    labels: ArrayLike,
    to_space: ArrayLike | None = None,
    structures: Mapping[str, int | Iterable[int]] | None = None,
) -> dict[str, TriangleMesh]:
    """Return the surfaces of the structures that a volume labels, such as aseg.mgz of FreeSurfer.

    Parameters
    ----------
    labels : (a, b, c) int
        Label of each voxel.
    to_space : (4, 4) float, optional
        Affine map from indices of voxels to coordinates. `es.io.read_volume` returns both.
    structures : mapping of str to int or ints, optional
        The labels of each structure, by name. By default, those of the thirty structures of
        BrainPrint in aseg.mgz that are there.

    Returns
    -------
    dict of str to TriangleMesh
        By the names of the structures. A structure in pieces has a surface in pieces.

    Raises
    ------
    InvalidParameterError
        If labels are no whole numbers in three dimensions, a requested structure is not there, or
        none is.

    See Also
    --------
    brain_print : Spectra of the surfaces.
    es.calculus.voxel_surface : How a surface is made.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> labels = np.zeros((20, 20, 20), dtype=int)
    >>> labels[3:9, 5:15, 5:12] = 11
    >>> labels[11:17, 5:15, 5:12] = 50
    >>> found = es.modes.structure_surfaces(labels)
    >>> list(found)
    ['Left-Striatum', 'Left-Caudate', 'Right-Striatum', 'Right-Caudate']
    """
    volume = real_numbers(labels, "labels")
    odd = volume[volume != np.round(volume)]
    if volume.ndim != 3 or odd.size:
        fact = f"there is {odd[0]:g}" if odd.size else f"the shape is {volume.shape}"
        raise InvalidParameterError(
            f"labels must be a table of whole numbers in three dimensions; {fact}."
        )
    affine = as_affine(to_space)
    if structures is not None:
        require_type(structures, Mapping, "structures")
    wanted = FREESURFER_STRUCTURES if structures is None else structures
    surfaces = {}
    for name, numbers in wanted.items():
        require_unicode(name, "Names of structures")
        of_structure = np.atleast_1d(real_numbers(np.asarray(numbers), f"labels of {name!r}"))
        inside = np.isin(volume, of_structure)
        if inside.any():
            surfaces[name] = voxel_surface(inside, affine)
        elif structures is not None:
            raise InvalidParameterError(
                f"Each structure must have a voxel; {name!r} has none of the labels "
                f"{of_structure.tolist()}. The volume holds "
                f"{different_values(volume, MOST_NAMED, 'labels')}."
            )
    if not surfaces:
        raise InvalidParameterError(
            "A structure of FreeSurfer must be among the labels, or structures= name others, as in "
            f"{{'Left-Caudate': 11}}; none is there. The volume holds "
            f"{different_values(volume, MOST_NAMED, 'labels')}."
        )
    return surfaces
