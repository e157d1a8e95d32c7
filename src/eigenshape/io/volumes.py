"""Volumes: a number for each voxel, and where the voxels lie."""

from pathlib import Path

import numpy as np
from jaxtyping import Float, Shaped

from certeig.kit.arrays import freeze
from eigenshape.io.formats.registry import VOLUME_FORMATS, format_of
from eigenshape.io.opening import naming, open_file


def read_volume(
    path: str | Path,
) -> tuple[Shaped[np.ndarray, "a b c"], Float[np.ndarray, "4 4"]]:
    """Read a volume, such as aseg.mgz of FreeSurfer or a segmentation in NIfTI.

    Parameters
    ----------
    path : str or Path
        Must end in .mgh, .mgz, .nii or .nii.gz.

    Returns
    -------
    values : (a, b, c) array
        Of each voxel, in the numbers of the file.
    to_space : (4, 4) float
        Affine map from indices of voxels to millimeters (right, anterior, superior), as the
        `affine` of nibabel. Surfaces of FreeSurfer have the center of the volume as their origin,
        which this map does not have.

    Raises
    ------
    FileFormatError
        If the suffix is another one, the volume has more than one frame, or the content differs
        from what the file declares.
    MissingExtraError
        If nibabel is not installed, which reads .nii.
    OSError
        If the system cannot open the file.

    See Also
    --------
    es.modes.structure_surfaces : Surfaces of the structures of a labeled volume.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import nibabel, numpy as np
    >>> import eigenshape as es
    >>> path = pathlib.Path(tempfile.mkdtemp(), "aseg.mgz")
    >>> labels = np.zeros((8, 8, 8), np.int32)
    >>> nibabel.MGHImage(labels, np.diag([2.0, 2, 2, 1])).to_filename(path)
    >>> values, to_space = es.io.read_volume(path)
    >>> values.shape, to_space[0, 0].item()
    ((8, 8, 8), 2.0)
    """
    source = open_file(path, None, VOLUME_FORMATS)
    with naming(source.path):
        values, to_space = format_of(source.suffix).load().parse_volume(source.data)
    return freeze(values), freeze(to_space)
