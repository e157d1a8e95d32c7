"""Compressed meshes: what comes back, how exactly, and files that are no such meshes."""

import inspect
import os
import struct
import subprocess
import sys
import tracemalloc
from hashlib import sha256

import numpy as np
import pytest

import eigenshape as es
from eigenshape.spectral.tools import compression, connectivity, patch_basis

BALL = es.icosphere(3)
SMALL = es.icosphere(2)
SQUARE = es.shapes.grid(20, 20)  # many symmetries, so many multiple eigenvalues
PACKED = es.spectral.compress_mesh(BALL)
SMALL_PACKED = es.spectral.compress_mesh(SMALL)
TETRAHEDRON = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
CASES = {
    "sphere": BALL,
    "square": SQUARE,
    "torus": es.shapes.torus(12, 9),
    "two pieces": es.geometry.disjoint_union(es.icosphere(1), SQUARE),
    "one face": es.TriangleMesh(np.eye(3), [[0, 1, 2]]),
    "loose vertices": es.TriangleMesh(np.arange(27.0).reshape(9, 3) ** 2, [[7, 2, 4]]),
    "turned over": es.TriangleMesh(np.eye(4)[:, :3], [[0, 1, 2], [0, 1, 3]]),
    "non-manifold edge": es.TriangleMesh(
        np.random.default_rng(0).random((5, 3)), [[0, 1, 2], [1, 0, 3], [0, 1, 4]]
    ),
    "repeated": es.TriangleMesh(np.eye(4)[:, :3], [[0, 1, 2], [0, 1, 2], [2, 1, 3], [3, 3, 1]]),
    "one place": es.TriangleMesh(np.ones((4, 3)), TETRAHEDRON),
}


def turned(faces):
    """Return faces with their lowest corner first, sorted."""
    rows = [min(row[i:] + row[:i] for i in range(3)) for row in faces.tolist()]
    return sorted(rows)


@pytest.mark.parametrize("name", CASES)
def test_any_mesh_comes_back(name):
    mesh = CASES[name]
    packed = es.spectral.compress_mesh(mesh, 14)
    again = es.spectral.decompress_mesh(packed.data)
    assert sorted(packed.vertex_order) == list(range(mesh.n_vertices))
    assert turned(packed.vertex_order[again.faces]) == turned(mesh.faces)
    gaps = np.linalg.norm(again.vertices - mesh.vertices[packed.vertex_order], axis=1)
    np.testing.assert_allclose(np.sqrt((gaps**2).mean()), packed.rms_error, atol=1e-6 * packed.step)
    np.testing.assert_allclose(gaps.max(), packed.max_error, atol=1e-6 * packed.step)
    assert packed.rms_error <= np.sqrt(3) / 2 * packed.step
    sizes = packed.n_connectivity_bytes + packed.n_geometry_bytes
    assert 0 < len(packed.data) - sizes < 200


def test_random_faces_come_back():
    rng = np.random.default_rng(3)
    for _ in range(8):
        n = int(rng.integers(4, 40))
        mesh = es.TriangleMesh(
            rng.random((n, 3)), rng.integers(0, n, (int(rng.integers(1, 60)), 3))
        )
        packed = es.spectral.compress_mesh(mesh)
        again = es.spectral.decompress_mesh(packed.data)
        assert turned(packed.vertex_order[again.faces]) == turned(mesh.faces)


def test_more_bits_halve_the_error_and_take_more_space():
    sizes, errors = [], []
    for bits in (8, 10, 12):
        packed = es.spectral.compress_mesh(BALL, bits)
        sizes.append(len(packed.data))
        errors.append(packed.rms_error)
    assert sizes == sorted(sizes)
    np.testing.assert_allclose(np.array(errors[:-1]) / errors[1:], 4, rtol=0.2)


@pytest.mark.parametrize("scale", [1e-100, 2.0**40, 1e100])
def test_units_do_not_matter(scale):
    packed = es.spectral.compress_mesh((SMALL.vertices * scale, SMALL.faces))
    assert packed.rms_error == pytest.approx(SMALL_PACKED.rms_error * scale, rel=1e-2)
    again = es.spectral.decompress_mesh(packed.data).vertices / scale
    wanted = es.spectral.decompress_mesh(SMALL_PACKED.data).vertices
    np.testing.assert_allclose(again, wanted, atol=3 * SMALL_PACKED.max_error)
    if np.log2(scale).is_integer():
        np.testing.assert_array_equal(again, wanted)


def test_faces_take_few_bits():
    assert 8 * PACKED.n_connectivity_bytes < 2.5 * BALL.n_vertices


def test_eigenvalues_of_symmetric_patches_are_separated():
    ball = es.icosphere(2)
    graph, patches = patch_basis.find_patches(ball.faces, ball.n_vertices)
    assert len(patches) == 1
    for _, laplacian in patch_basis.patch_laplacians(graph, patches):
        assert np.diff(np.linalg.eigvalsh(laplacian)).min() < 1e-10
        seed, basis = patch_basis.find_seed(laplacian)
        values, again, components = patch_basis.patch_basis(laplacian, seed)
        np.testing.assert_array_equal(basis, again)
        assert np.diff(values).min() >= patch_basis.LEAST_GAP
        assert components.min() >= patch_basis.LEAST_COMPONENT
        # rounding of another kernel, and more
        noise = 1e-12 * np.random.default_rng(0).normal(size=laplacian.shape)
        _, other, _ = patch_basis.patch_basis(laplacian + noise + noise.T, seed)
        assert np.abs(other - basis).max() < 1e-6


def test_patches_cover_the_mesh_once_and_are_of_bounded_size():
    for mesh in (SQUARE, BALL, CASES["two pieces"]):
        _, patches = patch_basis.find_patches(mesh.faces, mesh.n_vertices)
        assert max(map(len, patches)) <= patch_basis.PATCH_SIZE
        assert len(patches) <= -(-mesh.n_vertices // patch_basis.PATCH_SIZE)
        np.testing.assert_array_equal(np.sort(np.concatenate(patches)), np.arange(mesh.n_vertices))


def test_another_seed_is_taken_if_eigenvalues_are_too_close(monkeypatch):
    laplacian = np.diag([1.0, 1.0]) - np.array([[0, 1], [1, 0]])
    monkeypatch.setattr(patch_basis, "LEAST_COMPONENT", 0.5)
    seed, _ = patch_basis.find_seed(laplacian)
    assert seed > 0
    monkeypatch.setattr(patch_basis, "LEAST_GAP", 10.0)
    with pytest.raises(es.ConvergenceError, match="Each patch must have eigenvalues 10 apart"):
        patch_basis.find_seed(laplacian)


def test_hashed_numbers_never_change():
    found = patch_basis.hashed(np.arange(3, dtype=np.uint64))
    # the first numbers of splitmix64 from 0
    wanted = [0xE220A8397B1DCDAF, 0x6E789E6AA1B965F4, 0x06C45D188009454F]
    np.testing.assert_array_equal(found, [(number >> 11) / 2**53 for number in wanted])


@pytest.mark.long
@pytest.mark.parametrize("kernel", ["Nehalem", "Prescott"])
def test_another_blas_kernel_reads_the_same_mesh(tmp_path, kernel):
    for name in ("sphere", "square"):
        (tmp_path / "mesh.esz").write_bytes(es.spectral.compress_mesh(CASES[name], 16).data)
        code = (
            "import numpy as np, eigenshape as es, pathlib\n"
            "mesh = es.spectral.decompress_mesh(pathlib.Path('mesh.esz').read_bytes())\n"
            "np.save('there.npy', mesh.vertices)"
        )
        subprocess.run(
            [sys.executable, "-c", code],
            cwd=tmp_path,
            env={**os.environ, "OPENBLAS_CORETYPE": kernel},
            check=True,
        )
        packed = (tmp_path / "mesh.esz").read_bytes()
        here = es.spectral.decompress_mesh(packed).vertices
        step = np.ptp(here, axis=0).max() / 2**16
        assert np.abs(np.load(tmp_path / "there.npy") - here).max() < 1e-3 * step


def test_a_front_has_no_side_at_a_vertex_whose_sides_are_closed():
    front = connectivity.Front()
    assert (front.previous(1), front.next(1), front.take()) == (-1, -1, None)
    front.add_face((0, 1, 2))
    assert (front.previous(1), front.next(1), front.take()) == (0, 2, (2, 0))
    front.close(0, 1)
    assert (front.previous(1), front.next(1), front.next(0)) == (-1, 2, -1)


def test_a_stream_that_would_fill_the_memory_is_given_up_at_once():
    bomb = compression.pack(bytes(20_000_000))
    tracemalloc.start()
    try:
        with pytest.raises(es.FileFormatError, match="must unpack to at most 10 bytes"):
            compression.unpack(bomb, 10, "symbols")
        assert tracemalloc.get_traced_memory()[1] < 8_000_000  # 4 MiB are the dictionary
    finally:
        tracemalloc.stop()


def sealed(body):
    return body + sha256(body).digest()[:16]


def with_streams(**changes):
    """Return the ball's file with other streams, and a checksum that fits."""
    head = PACKED.data[: compression.HEADER.size]
    packed = compression._read_container(PACKED.data)[-1] | changes
    lengths = compression.LENGTHS.pack(*(len(packed[name]) for name in compression.STREAMS))
    return sealed(head + lengths + b"".join(packed[name] for name in compression.STREAMS))


def with_header(place, value, kind="Q"):
    body = bytearray(PACKED.data[:-16])
    struct.pack_into(f"<{kind}", body, place, value)
    return sealed(bytes(body))


HOSTILE = {
    "must begin with the bytes": b"ply\nformat ascii 1.0\n",
    "It is truncated": PACKED.data[:60],
    "that it declares": PACKED.data[:-7],
    "must have the checksum": PACKED.data[:300] + b"\0\0" + PACKED.data[302:],
    "must be of version 1; this is of version 7": with_header(8, 7, "I"),
    "must fit into 50 % of the memory": with_header(12, 2**50),
    "must have vertices, faces, and finite numbers": with_header(28, np.nan, "d"),
    "must have finite coordinates": with_header(36, 1e308, "d"),
    "symbols end at face": with_header(20, 2000),
    "symbols are left over": with_header(20, 1270),
    "must name vertices 0..": with_header(12, 600),
    "must have 6 means": with_streams(means=compression.pack(b"")),
    "The seeds of a compressed mesh must unpack": with_streams(seeds=compression.pack(b"\0" * 9)),
    "must have a seed for each of 2": with_streams(seeds=compression.pack(b"\0")),
    "large numbers; 0 could be read": with_streams(
        **{"large means": compression.pack(b"\x80" * 4)}
    ),
    "The symbols of a compressed mesh are damaged": with_streams(symbols=b"\x05\x05\x05"),
}


@pytest.mark.parametrize("message", HOSTILE)
def test_files_that_are_no_compressed_meshes_are_named(message):
    with pytest.raises(es.FileFormatError, match=message):
        es.spectral.decompress_mesh(HOSTILE[message])


def test_every_cut_and_every_flipped_byte_is_noticed():
    data = es.spectral.compress_mesh((np.eye(4)[:, :3], TETRAHEDRON)).data
    for end in range(len(data)):
        with pytest.raises(es.FileFormatError):
            es.spectral.decompress_mesh(data[:end])
    for place in range(len(data)):
        flipped = bytearray(data)
        flipped[place] ^= 0x10
        with pytest.raises(es.FileFormatError):
            es.spectral.decompress_mesh(bytes(flipped))


def test_sealed_nonsense_is_refused_or_read_and_never_crashes():
    rng = np.random.default_rng(5)
    n_faces, n_vertices = 30, 12
    for _ in range(300):
        symbols = bytes(rng.integers(0, 6, 90).tolist())
        references = rng.integers(0, 20, symbols.count(4)).tolist()
        try:
            found = connectivity.read_faces(symbols, references, n_faces, n_vertices)
        except es.FileFormatError:
            continue
        assert found.min() >= 0
        assert found.max() < n_vertices


def test_a_bomb_is_not_unpacked():
    bomb = compression.pack(b"\1" * 1_000_000)
    assert len(bomb) < 1_000
    with pytest.raises(es.FileFormatError, match="must unpack to at most 100 bytes"):
        compression.unpack(bomb, 100, "symbols")
    with pytest.raises(es.FileFormatError, match="must unpack to at most 100 bytes"):
        compression.unpack(compression.pack(b"abc")[:-2], 100, "symbols")
    assert compression.unpack(compression.pack(b"a" * 100), 100, "symbols") == b"a" * 100
    assert compression.unpack(compression.pack(b""), 0, "symbols") == b""


def test_numbers_of_any_size_come_back():
    numbers = np.array([0, -1, 1, 126, 127, -127, -128, 128, 10**6, -(2**40), 2**55])
    np.testing.assert_array_equal(compression.from_bytes(*compression.to_bytes(numbers)), numbers)


def test_bad_arguments_are_named():
    with pytest.raises(es.InvalidParameterError, match=r"bits must lie in 4\.\.24; it is 3"):
        es.spectral.compress_mesh(BALL, 3)
    with pytest.raises(es.FileFormatError, match="A compressed mesh must be bytes; the value is"):
        inspect.unwrap(es.spectral.decompress_mesh)("ball.esz")
