import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import eigenshape
from certeig import archive
from certeig.kit import files
from certeig.kit.errors import InvalidParameterError
from eigenshape.operators.clouds.gaussian import mesh_laplacian
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.laplacian import Laplacian
from eigenshape.shapes.surfaces import icosphere
from eigenshape.spectral import cache, solve
from eigenshape.spectral.solve import solve_spectrum


@pytest.fixture
def laplacian():
    return cotangent_laplacian(icosphere(2), "consistent")


@pytest.fixture
def nothing_computed(monkeypatch):
    """Make the work of a solve fail."""

    def refuse(*_):
        message = "computed"
        raise AssertionError(message)

    return lambda: monkeypatch.setattr(solve, "normalize", refuse)


def require_same(one, two):
    for field in ("eigenvalues", "eigenvectors", "residuals"):
        np.testing.assert_array_equal(getattr(one, field), getattr(two, field))
    assert one.certificate == two.certificate
    assert (one.mass != two.mass).nnz == 0


def changed(matrix, place):
    """Change the last bit of an entry and of its mirror image."""
    other = matrix.copy()
    row = int(np.searchsorted(other.indptr, place, side="right")) - 1
    column = int(other.indices[place])
    other[row, column] = other[column, row] = np.nextafter(other[row, column], np.inf)
    return other


def test_a_hit_is_what_was_computed_and_computes_nothing(tmp_path, laplacian, nothing_computed):
    folder = tmp_path / "made" / "when missing"
    plain = solve_spectrum(laplacian, 20)
    first = solve_spectrum(laplacian, 20, cache=folder)
    all_below = solve_spectrum(laplacian, below=7.0, cache=str(folder))
    assert len(list(folder.iterdir())) == 2
    nothing_computed()
    require_same(first, plain)
    require_same(solve_spectrum(laplacian, 20, cache=folder), plain)
    require_same(solve_spectrum(laplacian, np.int64(20), cache=folder), plain)
    require_same(solve_spectrum(laplacian, below=7.0, cache=folder), all_below)
    again = cotangent_laplacian(icosphere(2), "consistent")
    require_same(solve_spectrum(again, 20, cache=folder), plain)
    with pytest.raises(AssertionError, match="computed"):
        solve_spectrum(laplacian, 21, cache=folder)


def test_another_entry_is_another_key(laplacian):
    keys = {cache.content_key(laplacian, ("lowest", 5))}
    places = np.random.default_rng(0).choice(laplacian.stiffness.nnz, 20, replace=False)
    for place in places.tolist():
        keys.add(
            cache.content_key(
                Laplacian(changed(laplacian.stiffness, place), laplacian.mass), ("lowest", 5)
            )
        )
        keys.add(
            cache.content_key(
                Laplacian(laplacian.stiffness, changed(laplacian.mass, place)), ("lowest", 5)
            )
        )
    mirrored = {
        frozenset(ends)
        for ends in zip(*(part[places] for part in laplacian.stiffness.tocoo().coords), strict=True)
    }
    assert len(keys) == 1 + 2 * len(mirrored)


def test_another_question_is_another_key(laplacian, monkeypatch):
    kernel = mesh_laplacian(icosphere(2))
    asked = [
        ("lowest", 5),
        ("lowest", 6),
        ("below", 5.0),
        ("below", np.nextafter(5.0, 6)),
        ("between", 5.0, 6.0),
    ]
    keys = [cache.content_key(laplacian, request) for request in asked]
    for other in (
        kernel,
        replace(kernel, kernel=None),
        replace(kernel, kernel=replace(kernel.kernel, corrected=True)),
    ):
        keys.append(cache.content_key(other, asked[0]))
    keys.append(
        cache.content_key(Laplacian(laplacian.mass, laplacian.stiffness + laplacian.mass), asked[0])
    )
    monkeypatch.setattr(cache, "FORMAT", 99)
    keys.append(cache.content_key(laplacian, asked[0]))
    monkeypatch.setattr(cache, "version", lambda _: "99.0")
    keys.append(cache.content_key(laplacian, asked[0]))
    assert len(set(keys)) == len(keys) == 11


@pytest.mark.parametrize("harm", ["cut", "empty", "one bit", "not ours"])
def test_a_damaged_file_is_computed_again_and_replaced(tmp_path, laplacian, nothing_computed, harm):
    plain = solve_spectrum(laplacian, 20, cache=tmp_path)
    (path,) = tmp_path.iterdir()
    whole = path.read_bytes()
    bit = bytearray(whole)
    bit[len(whole) // 2] ^= 1
    path.write_bytes(
        {"cut": whole[:-100], "empty": b"", "one bit": bytes(bit), "not ours": b"hello" * 99}[harm]
    )
    with pytest.warns(
        UserWarning,
        match=r"A spectrum in the cache cannot be used and is computed again: .*\.npz must hold",
    ):
        require_same(solve_spectrum(laplacian, 20, cache=tmp_path), plain)
    assert list(tmp_path.iterdir()) == [path]
    nothing_computed()
    require_same(solve_spectrum(laplacian, 20, cache=tmp_path), plain)


def test_a_folder_that_cannot_be_written_to_is_refused_before_anything_is_computed(
    tmp_path, laplacian, nothing_computed, monkeypatch
):
    nothing_computed()
    (tmp_path / "file").write_text("")
    with pytest.raises(
        InvalidParameterError, match=r"cache must be a folder that can be written to; .*file: "
    ):
        solve_spectrum(laplacian, 5, cache=tmp_path / "file")

    def forbid(**_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(files.tempfile, "TemporaryFile", forbid)
    with pytest.raises(InvalidParameterError, match=r"cache must be .* Permission denied"):
        solve_spectrum(laplacian, 5, cache=tmp_path)


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere"
)
def test_a_read_only_folder_is_refused_and_still_read(tmp_path, laplacian, nothing_computed):
    plain = solve_spectrum(laplacian, 5, cache=tmp_path)
    tmp_path.chmod(0o500)
    nothing_computed()
    require_same(solve_spectrum(laplacian, 5, cache=tmp_path), plain)
    with pytest.raises(
        InvalidParameterError, match="cache must be a folder that can be written to"
    ):
        solve_spectrum(laplacian, 6, cache=tmp_path)


def test_a_question_that_is_refused_leaves_nothing(tmp_path, laplacian):
    for options, rule in (({"k": 0}, "k must lie in"), ({"below": -1.0}, "below must be positive")):
        with pytest.raises(InvalidParameterError, match=rule):
            solve_spectrum(laplacian, **options, cache=tmp_path / "folder")
    assert not list(tmp_path.glob("folder/*"))


@pytest.mark.long
def test_two_processes_may_write_at_once(tmp_path, laplacian):
    code = (
        "import sys, eigenshape as es; laplacian = es.cotangent_laplacian(es.icosphere(2), 'consistent'); "
        "[es.solve_spectrum(laplacian, k, cache=sys.argv[1]) for k in range(1, 9)]"
    )
    environment = os.environ | {"PYTHONPATH": str(Path(eigenshape.__file__).parents[1])}
    both = [
        subprocess.Popen([sys.executable, "-W", "error", "-c", code, tmp_path], env=environment)
        for _ in range(2)
    ]
    assert [process.wait() for process in both] == [0, 0]
    assert len(list(tmp_path.iterdir())) == 8
    require_same(solve_spectrum(laplacian, 8, cache=tmp_path), solve_spectrum(laplacian, 8))


def test_a_spectrum_under_the_name_of_another_is_not_believed(tmp_path, laplacian):
    plain = solve_spectrum(laplacian, 20, cache=tmp_path)
    (path,) = tmp_path.iterdir()
    other = tmp_path / "other"
    solve_spectrum(cotangent_laplacian(icosphere(1)), 20, cache=other)
    (copied,) = other.iterdir()
    path.write_bytes(copied.read_bytes())
    with pytest.warns(UserWarning, match="must hold the spectrum of the key"):
        require_same(solve_spectrum(laplacian, 20, cache=tmp_path), plain)


@pytest.mark.parametrize("entry", ["a folder", "a pipe"])
def test_an_entry_that_is_no_file_neither_hangs_nor_loses_the_spectrum(tmp_path, laplacian, entry):
    plain = solve_spectrum(laplacian, 20, cache=tmp_path)
    (path,) = tmp_path.iterdir()
    path.unlink()
    path.mkdir() if entry == "a folder" else os.mkfifo(path)
    with pytest.warns(UserWarning, match="cache") as said:
        require_same(solve_spectrum(laplacian, 20, cache=tmp_path), plain)
    first, second = (str(warning.message) for warning in said)
    assert f"cannot be used and is computed again: {path} must be a file; it is {entry}" in first
    assert "was computed and could not be kept in the cache" in second


def test_a_full_disk_does_not_lose_the_spectrum(tmp_path, laplacian, monkeypatch):
    plain = solve_spectrum(laplacian, 20)

    def fill(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(archive.np, "savez", fill)
    with pytest.warns(
        UserWarning, match="could not be kept in the cache: .*No space left on device"
    ):
        require_same(solve_spectrum(laplacian, 20, cache=tmp_path), plain)
    assert not list(tmp_path.iterdir())
