"""Spectral compression of meshes (Karni and Gotsman 2000): patches, coefficients, entropy coding."""

import lzma
import struct
from hashlib import sha256
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arguments import describe_value
from certeig.kit.arrays import ReadOnly, record, whole_number
from certeig.kit.errors import FileFormatError
from certeig.kit.memory import available_memory
from certeig.kit.progress import Progress, silent
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import Integer
from eigenshape._vectors import size_one
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.spectral.tools.connectivity import OTHER, read_faces, write_faces
from eigenshape.spectral.tools.patch_basis import (
    find_patches,
    find_seed,
    patch_basis,
    patch_laplacians,
)

MAGIC = b"\x93ESHAPE\n"
# Version of the file format, with all that the basis depends on; other versions are refused.
VERSION = 1
# Magic, version, numbers of vertices and faces, scale, step, corner of the box; then the packed
# lengths of the streams.
HEADER = struct.Struct("<8sI 2Q 2d 3d")
STREAMS = (
    "symbols", "references", "seeds", "means", "large means", "coefficients", "large coefficients",
)  # fmt: skip
LENGTHS = struct.Struct(f"<{len(STREAMS)}Q")
# Bytes of the SHA-256 at the end of a file: an error goes unseen with probability 2^-128.
N_CHECK = 16
# Bits of the quantization that can be requested: below 4 nothing is left of a shape, and beyond 24
# the basis is no longer precise enough.
FEWEST_BITS, MOST_BITS = 4, 24
# Memory that a vertex or a face takes while a file is read, in bytes, and the share of the
# machine's memory that a file may ask for.
BYTES_PER_ELEMENT, SHARE_OF_READING = 1200, 0.5
# Most symbols per face: a side that opens takes one, and a face at which a walk starts three.
SYMBOLS_PER_FACE = 6


@record
class CompressedMesh(ReadOnly):
    """A mesh as a short string of bytes, and what it cost.

    Attributes
    ----------
    data : bytes
        What `decompress_mesh` reads, and what the files of `eigenshape compress` hold.
    vertex_order : (n,) int
        The vertex of the given mesh that each decompressed vertex is.
    n_connectivity_bytes, n_geometry_bytes : int
        Size of the faces and of the coordinates in `data`. The rest is the header.
    step : float
        Quantization step of the coefficients, in length.
    rms_error, max_error : float
        Root mean square and maximum of the distances between given and decompressed vertices, in
        length. The root mean square is at most √3/2 of the step.

    See Also
    --------
    compress_mesh, decompress_mesh

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(3)
    >>> packed = es.spectral.compress_mesh(ball, bits=12)
    >>> packed.rms_error < packed.step  # both in length
    True

    Values at the vertices follow the new order of the vertices:

    >>> height = ball.vertices[:, 2]
    >>> unpacked = es.spectral.decompress_mesh(packed.data)
    >>> bool(abs(unpacked.vertices[:, 2] - height[packed.vertex_order]).max() <= packed.max_error)
    True
    """

    data: bytes
    vertex_order: Int[np.ndarray, " n"]
    n_connectivity_bytes: int
    n_geometry_bytes: int
    step: float
    rms_error: float
    max_error: float


@one_blas_thread()
def compress_mesh(
    mesh: MeshLike, bits: Integer = 12, *, progress: Progress | None = None
) -> CompressedMesh:
    """Compress a mesh by the spectral coefficients of its coordinates (Karni and Gotsman 2000).

    The mesh is cut into patches of at most 400 vertices. In each, the coordinates are written in
    the eigenvectors of the graph Laplacian, and the coefficients are rounded to multiples of a
    step: the longest side of the bounding box divided by 2^bits. Most of those of high frequency
    become 0 or ±1, which take little space. Rounding moves vertices by at most √3/2 of the step
    (root mean square), because the basis is orthonormal.

    The basis is not stored: the reader computes it from the faces. A potential of hashed numbers
    makes all eigenvalues of a patch differ, and the writer checks that they differ by far more than
    rounding on any machine, so that every machine finds the same vectors up to rounding errors.

    Faces are written as a walk over the mesh. So vertices and faces come back in another order,
    with the same orientation; `vertex_order` translates.

    Parameters
    ----------
    mesh : MeshLike
        Any triangle mesh, manifold or not.
    bits : int
        4 to 24; the precision of coordinates relative to the bounding box, as for Draco.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    CompressedMesh

    Raises
    ------
    InvalidParameterError
        If `bits` is not in 4..24.
    ConvergenceError
        If no potential separates the eigenvalues of a patch.

    See Also
    --------
    decompress_mesh

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(3)
    >>> packed = es.spectral.compress_mesh(ball, bits=12)
    >>> len(packed.data) < 3500, packed.max_error < 0.002
    (True, True)
    >>> again = es.spectral.decompress_mesh(packed.data)
    >>> gaps = again.vertices - ball.vertices[packed.vertex_order]
    >>> bool(abs(gaps).max() < 0.002)
    True
    """
    mesh = as_mesh(mesh)
    n_bits = whole_number(bits, "bits", FEWEST_BITS, MOST_BITS)
    report = progress or silent
    report(0.0, "faces")
    symbols, references, order, faces = write_faces(mesh.faces, mesh.n_vertices)
    points, scale = size_one(mesh.vertices[order])
    low = points.min(axis=0)
    # A shape without extent has no error at any step.
    step = float((points.max(axis=0) - low).max()) / 2**n_bits or 1.0

    graph, patches = find_patches(faces, len(points))
    seeds, means, coefficients = bytearray(), [], []
    squares, largest = 0.0, 0.0
    for number, (patch, laplacian) in enumerate(patch_laplacians(graph, patches)):
        report(0.1 + 0.9 * number / len(patches), "coefficients")
        seed, basis = find_seed(laplacian)
        places = (points[patch] - low) / step
        mean = np.rint(places.mean(axis=0))
        exact = basis.T @ (places - mean)
        rounded = np.rint(exact)
        gaps = basis @ (exact - rounded)
        squares += float((gaps**2).sum())
        largest = max(largest, float((gaps**2).sum(axis=1).max()))
        seeds.append(seed)
        means.append(mean)
        coefficients.append(rounded.astype(np.int64))

    streams = (
        symbols,
        to_varints(references),
        bytes(seeds),
        *to_bytes(np.diff(np.array(means), axis=0, prepend=0).astype(np.int64).T.ravel()),
        *to_bytes(np.concatenate(coefficients)[_frequency_order(patches)].ravel()),
    )
    packed = [pack(stream) for stream in streams]
    head = HEADER.pack(MAGIC, VERSION, len(points), len(faces), scale, step, *low)
    body = head + LENGTHS.pack(*map(len, packed)) + b"".join(packed)
    report(1.0, "done")
    return CompressedMesh(
        data=body + sha256(body).digest()[:N_CHECK],
        vertex_order=order,
        n_connectivity_bytes=sum(map(len, packed[:2])),
        n_geometry_bytes=sum(map(len, packed[2:])),
        step=step * scale,
        rms_error=float(np.sqrt(squares / len(points))) * step * scale,
        max_error=float(np.sqrt(largest)) * step * scale,
    )


@one_blas_thread()
def decompress_mesh(data: bytes, *, progress: Progress | None = None) -> TriangleMesh:
    """Read a mesh that `compress_mesh` wrote.

    Machines of other kinds agree to far less than the quantization step, and not to the last bit.

    Parameters
    ----------
    data : bytes
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    TriangleMesh
        In the order of `CompressedMesh.vertex_order`.

    Raises
    ------
    FileFormatError
        If the bytes are no compressed mesh, of another version, cut off or damaged, or would take
        more than half of the machine's memory.

    See Also
    --------
    compress_mesh

    Examples
    --------
    >>> import eigenshape as es
    >>> packed = es.spectral.compress_mesh(es.shapes.grid(2, 2))
    >>> es.spectral.decompress_mesh(packed.data)
    TriangleMesh(9 vertices, 8 faces)
    """
    report = progress or silent
    report(0.0, "faces")
    n, n_faces, scale, step, low, packed = _read_container(data)
    symbols = unpack(packed["symbols"], SYMBOLS_PER_FACE * n_faces, "symbols")
    n_references = symbols.count(OTHER)
    references = unpack(packed["references"], 5 * n_references, "references")
    faces = read_faces(symbols, from_varints(references, n_references), n_faces, n)

    graph, patches = find_patches(faces, n)
    seeds = unpack(packed["seeds"], len(patches), "seeds")
    means = _read_numbers(packed, "means", 3 * len(patches)).reshape(3, -1).T.cumsum(axis=0)
    numbers = _read_numbers(packed, "coefficients", 3 * n)
    if len(seeds) != len(patches):
        raise FileFormatError(
            f"A compressed mesh must have a seed for each of {len(patches)} patches; it has "
            f"{len(seeds)}. The file is damaged."
        )
    coefficients = np.empty((n, 3), dtype=np.int64)
    coefficients[_frequency_order(patches)] = numbers.reshape(-1, 3)
    start = 0
    points = np.empty((n, 3))
    for number, (patch, laplacian) in enumerate(patch_laplacians(graph, patches)):
        report(0.1 + 0.9 * number / len(patches), "coordinates")
        _, basis, _ = patch_basis(laplacian, seeds[number])
        with np.errstate(over="ignore", invalid="ignore"):  # the result is checked below
            rows = coefficients[start : start + len(patch)]
            points[patch] = scale * (low + step * (means[number] + basis @ rows))
        start += len(patch)
    if not np.isfinite(points).all():
        raise FileFormatError(
            f"A compressed mesh must have finite coordinates; with scale {scale} and step {step} "
            "they overflow. The file is damaged."
        )
    report(1.0, "done")
    return TriangleMesh(points, faces)


def _frequency_order(patches: list[np.ndarray]) -> Int[np.ndarray, " n"]:
    """Return the order of the rows of all patches in which each one's lowest comes first."""
    frequencies = np.concatenate([np.arange(len(patch)) for patch in patches])
    return np.argsort(frequencies, kind="stable")


def _read_numbers(packed: dict[str, bytes], what: str, count: int) -> Int[np.ndarray, " c"]:
    """Unpack `count` numbers, each of a byte and a rest."""
    first = unpack(packed[what], count, what)
    rest = unpack(packed[f"large {what}"], 9 * count, what)
    if len(first) != count:
        raise FileFormatError(
            f"A compressed mesh must have {count} {what}; it has {len(first)}. The file is damaged."
        )
    return from_bytes(first, rest)


def _read_container(
    data: object,
) -> tuple[int, int, float, float, Float[np.ndarray, " 3"], dict[str, bytes]]:
    """Check the frame of a file, and return its numbers and its packed streams."""
    if not isinstance(data, bytes | bytearray | memoryview):
        raise FileFormatError(
            f"A compressed mesh must be bytes; the value is {describe_value(data)}. Pass "
            "Path(file).read_bytes()."
        )
    data = bytes(data)
    if data[: len(MAGIC)] != MAGIC:
        raise FileFormatError(
            "A compressed mesh must begin with the bytes that `eigenshape compress` writes; this "
            f"begins with {data[:8]!r}."
        )
    n_fixed = HEADER.size + LENGTHS.size + N_CHECK
    if len(data) < n_fixed:
        raise FileFormatError(
            f"A compressed mesh must have at least {n_fixed} bytes; this has {len(data)}. It is "
            "truncated."
        )
    _, version, n, n_faces, scale, step, *low = HEADER.unpack_from(data)
    if version != VERSION:
        raise FileFormatError(
            f"A compressed mesh must be of version {VERSION}; this is of version {version}. Use the "
            "version of eigenshape that wrote it."
        )
    lengths = LENGTHS.unpack_from(data, HEADER.size)
    if len(data) != n_fixed + sum(lengths):
        raise FileFormatError(
            f"A compressed mesh must have the {n_fixed + sum(lengths)} bytes that it declares; this "
            f"has {len(data)}. It is truncated or damaged."
        )
    if sha256(data[:-N_CHECK]).digest()[:N_CHECK] != data[-N_CHECK:]:
        raise FileFormatError(
            "A compressed mesh must have the checksum that it ends with; this has another. It is "
            "damaged."
        )
    numbers = np.array([scale, step, *low])
    if not np.isfinite(numbers).all() or scale <= 0 or step <= 0 or n < 1 or n_faces < 1:
        raise FileFormatError(
            "A compressed mesh must have vertices, faces, and finite numbers for its scale and "
            f"step; this has {n} vertices, {n_faces} faces, scale {scale} and step {step}."
        )
    needed, free = BYTES_PER_ELEMENT * (n + n_faces), available_memory(SHARE_OF_READING)
    if needed > free:
        raise FileFormatError(
            f"A compressed mesh must fit into {100 * SHARE_OF_READING:.0f} % of the memory, "
            f"{free / 2**30:.1f} GiB; {n} vertices and {n_faces} faces take about "
            f"{needed / 2**30:.1f} GiB."
        )
    ends = HEADER.size + LENGTHS.size + np.cumsum([0, *lengths])
    packed = {
        name: data[start:end] for name, (start, end) in zip(STREAMS, pairwise(ends), strict=True)
    }
    return n, n_faces, scale, step, np.array(low), packed


# LZMA2 without a container: our file has its own lengths and its own checksum. Bytes are coded
# whatever their place (pb) and the byte before (lc), which say nothing of a coefficient: what comes
# out is within 1 % of the entropy of each band. The dictionary bounds the memory.
FILTERS = [{"id": lzma.FILTER_LZMA2, "preset": 9, "lc": 0, "lp": 0, "pb": 0, "dict_size": 1 << 22}]
# A number of this size or more is this byte, and the rest follows in a second stream.
ESCAPE = 255
# Most bytes of a number in the second stream, seven bits each.
MOST_BYTES = 9


def pack(data: bytes) -> bytes:
    """Compress bytes."""
    return lzma.compress(data, format=lzma.FORMAT_RAW, filters=FILTERS)


def unpack(data: bytes, most: int, what: str) -> bytes:
    """Decompress bytes; never more than `most` are unpacked.

    Raise FileFormatError if there are more, or the stream is damaged.
    """
    reader = lzma.LZMADecompressor(format=lzma.FORMAT_RAW, filters=FILTERS)
    try:
        found = reader.decompress(data, max_length=most + 1)
        # a stream of exactly `most` bytes still has its end mark to read
        ended = reader.eof or (not reader.needs_input and not reader.decompress(b"", max_length=1))
    except (lzma.LZMAError, EOFError) as err:
        raise FileFormatError(f"The {what} of a compressed mesh are damaged: {err}.") from err
    if len(found) > most or not (ended or reader.eof):
        raise FileFormatError(
            f"The {what} of a compressed mesh must unpack to at most {most} bytes; they are more, "
            "or end early. The file is damaged."
        )
    return found


def to_bytes(numbers: Int[np.ndarray, " n"]) -> tuple[bytes, bytes]:
    """Return a byte for each number of any sign, and what is left of those that need more."""
    folded = np.where(numbers < 0, -2 * numbers - 1, 2 * numbers)
    large = folded[folded >= ESCAPE] - ESCAPE
    return np.minimum(folded, ESCAPE).astype(np.uint8).tobytes(), to_varints(large.tolist())


def from_bytes(first: bytes, rest: bytes) -> Int[np.ndarray, " n"]:
    """Return the numbers of `to_bytes`.

    Raise FileFormatError if the second stream does not fit the first.
    """
    folded = np.frombuffer(first, dtype=np.uint8).astype(np.int64)
    large = np.flatnonzero(folded == ESCAPE)
    folded[large] += np.array(from_varints(rest, len(large)), dtype=np.int64)
    return np.where(folded % 2, -(folded + 1) // 2, folded // 2)


def to_varints(numbers: list[int]) -> bytes:
    """Return numbers as bytes of seven bits each, the lowest first (LEB128)."""
    written = bytearray()
    for number in numbers:
        left = number
        while left > 127:
            written.append(left & 127 | 128)
            left >>= 7
        written.append(left)
    return bytes(written)


def from_varints(data: bytes, count: int) -> list[int]:
    """Return the numbers of `to_varints`.

    Raise FileFormatError if there are not `count` of them, or one has more than nine bytes.
    """
    numbers, number, shift = [], 0, 0
    for byte in data:
        number |= (byte & 127) << shift
        shift += 7
        if shift > 7 * MOST_BYTES:
            break
        if byte < 128:
            numbers.append(number)
            number = shift = 0
    if len(numbers) != count or shift:
        raise FileFormatError(
            f"A compressed mesh must have {count} large numbers; {len(numbers)} could be read. "
            "The file is damaged."
        )
    return numbers
