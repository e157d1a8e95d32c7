"""NIfTI files: a number for each voxel, and where the voxels lie."""

import zlib

import numpy as np
from jaxtyping import Float, Shaped

from eigenshape._errors import FileFormatError
from eigenshape.io.formats.neuro.shared import GZIP, VOLUME_SIZE, require_nibabel
from eigenshape.io.formats.numbers import require_reasonable

# Of each version: the size of its header, which is the first number of a file, the class of nibabel,
# the type and the place of the shape, and the place of the number of bits of a voxel.
HEADERS = {348: ("Nifti1Image", "i2", 40, 72), 540: ("Nifti2Image", "i8", 16, 14)}
LONGEST_HEADER = 540
MOST_BEFORE = 2**20  # bytes of notes between the header and the numbers


def parse_volume(data: bytes) -> tuple[Shaped[np.ndarray, "a b c"], Float[np.ndarray, "4 4"]]:
    """Return the numbers of a volume, and the map from voxels to space.

    Raise FileFormatError if the file does not hold what it declares, or has several frames.
    """
    nibabel = require_nibabel("nibabel")
    packed = data.startswith(GZIP)
    unpacker = zlib.decompressobj(wbits=31)
    try:
        head = unpacker.decompress(data, LONGEST_HEADER) if packed else data[:LONGEST_HEADER]
        kind, size = _read_header(head)
        if packed:
            require_reasonable(size, len(data), VOLUME_SIZE)
            data = head + unpacker.decompress(unpacker.unconsumed_tail, size + MOST_BEFORE)
    except zlib.error as err:
        raise FileFormatError(f"A packed NIfTI file must be whole; {err}.") from err
    if size > len(data):
        raise FileFormatError(
            f"A NIfTI file must hold what it declares; {size} bytes do not fit into its {len(data)}."
        )
    try:
        image = getattr(nibabel, kind).from_bytes(data)
        values = np.asanyarray(image.dataobj).reshape(image.shape[:3])
        to_space = np.asarray(image.affine, dtype=np.float64)
    except Exception as err:  # nibabel and what it calls each raise their own
        cause = " ".join(str(err).split())
        raise FileFormatError(
            f"A NIfTI file must hold a volume; {type(err).__name__}: {cause}"
        ) from err
    if values.dtype.kind not in "buif" or not np.isfinite(to_space).all():
        raise FileFormatError(
            "A volume must hold one number for each voxel, and a place for each that is finite; it holds "
            f"{values.dtype}, and the map is {to_space.tolist()}."
        )
    return np.ascontiguousarray(values, values.dtype.newbyteorder("=")), to_space


def _read_header(head: bytes) -> tuple[str, int]:
    """Return the class of nibabel that reads a file, and the number of bytes of its voxels.

    Raise FileFormatError if the header is damaged, or declares more than one frame.
    """
    first = [int(np.frombuffer(head.ljust(4, b"\0"), f"{order}i4", 1)[0]) for order in "<>"]
    order, length = next(
        ((o, n) for o, n in zip("<>", first, strict=True) if n in HEADERS), ("", 0)
    )
    if not order or len(head) < length:
        raise FileFormatError(
            "A NIfTI file must begin with its header, of 348 or 540 bytes; it begins with "
            f"{head[:4].hex(' ')}, and has {len(head)} bytes of one."
        )
    kind, number, place, place_of_bits = HEADERS[length]
    n_axes, *shape = np.frombuffer(head, f"{order}{number}", 8, place).tolist()
    bits = int(np.frombuffer(head, f"{order}i2", 1, place_of_bits)[0])
    axes = shape[:n_axes] if n_axes > 0 else []
    if not 3 <= n_axes <= 7 or min(axes) < 1 or max(axes[3:], default=1) > 1 or bits < 1:
        raise FileFormatError(
            f"A volume must have three axes and one frame; it has {axes}, of {bits} bits each."
        )
    n_voxels = axes[0] * axes[1] * axes[2]  # whole numbers of Python, which do not overflow
    return kind, n_voxels * bits // 8
