import dataclasses
import json
import os
import pickle
import tracemalloc

import numpy as np
import pytest

from certeig.kit.errors import FileFormatError
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.surfaces import icosphere
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum


@pytest.fixture
def spectrum():
    return solve_spectrum(cotangent_laplacian(icosphere(2), "consistent"), 10)


@pytest.mark.parametrize("name", ["a.npz", "spectrum", "b.dat"])
def test_what_is_saved_is_what_is_loaded(tmp_path, spectrum, name):
    spectrum.save(tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == [name]
    loaded = Spectrum.load(tmp_path / name)
    for field in ("eigenvalues", "eigenvectors", "residuals"):
        np.testing.assert_array_equal(getattr(loaded, field), getattr(spectrum, field))
        assert not getattr(loaded, field).flags.writeable
    assert loaded.certificate == spectrum.certificate
    assert loaded.certificate.explain() == spectrum.certificate.explain()
    assert (loaded.mass != spectrum.mass).nnz == 0


def test_all_pairs_have_an_infinite_shift_on_disk_too(tmp_path):
    whole = solve_spectrum(cotangent_laplacian(icosphere(1)), 42)
    whole.save(tmp_path / "all.npz")
    assert np.isinf(Spectrum.load(tmp_path / "all.npz").certificate.shift)


def rewritten(path, **changes):
    with np.load(path) as archive:
        parts = {**archive, **changes}
    np.savez(path, **parts)


def test_files_that_are_no_spectra(tmp_path, spectrum):
    path = tmp_path / "s.npz"
    for content in (b"", b"nothing", pickle.dumps([1, 2])):
        path.write_bytes(content)
        with pytest.raises(
            FileFormatError, match=r"s\.npz must hold a spectrum that eigenshape saved; "
        ):
            Spectrum.load(path)
    spectrum.save(path)
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(FileFormatError, match="must hold a spectrum that eigenshape saved"):
        Spectrum.load(path)
    np.savez(path, a=np.arange(3))
    with pytest.raises(FileFormatError, match="'head is not a file in the archive'"):
        Spectrum.load(path)
    with pytest.raises(FileNotFoundError):
        Spectrum.load(tmp_path / "none.npz")


def test_parts_that_do_not_fit(tmp_path, spectrum):
    path = tmp_path / "s.npz"
    spectrum.save(path)
    rewritten(path, eigenvalues=spectrum.eigenvalues[:-1])
    with pytest.raises(
        FileFormatError, match="must hold arrays that fit one another; their shapes are"
    ):
        Spectrum.load(path)
    spectrum.save(path)
    rewritten(path, mass_indices=spectrum.mass.indices + 1000)
    with pytest.raises(FileFormatError, match="must hold a spectrum that eigenshape saved"):
        Spectrum.load(path)
    facts = {"eigenshape_spectrum": 99, "certificate": dataclasses.asdict(spectrum.certificate)}
    rewritten(path, head=np.array(json.dumps(facts)))
    with pytest.raises(
        FileFormatError, match="must hold a spectrum in format 2; it is in format 99"
    ):
        Spectrum.load(path)


def swapped(values):
    return values[::-1]


def negative(values):
    return values - 1.0


def text(values):
    return values.astype(str)


def half_missing(values):
    return np.where(np.arange(len(values)) == 3, np.nan, values)


@pytest.mark.parametrize(
    ("part", "harm", "message"),
    [
        ("eigenvalues", swapped, "must hold ascending eigenvalues; number 1 is"),
        ("eigenvalues", negative, "must hold eigenvalues of at least 0; number 0 is -"),
        ("eigenvalues", text, "must hold finite float64 numbers as eigenvalues"),
        ("eigenvalues", half_missing, "must hold finite float64 numbers as eigenvalues"),
        (
            "eigenvalues",
            lambda values: values + 1j,
            "must hold finite float64 numbers as eigenvalues",
        ),
        (
            "eigenvectors",
            lambda values: np.full_like(values, np.inf),
            "must hold finite float64 numbers as eigenv",
        ),
        ("mass_data", half_missing, "must hold finite float64 numbers as mass"),
        (
            "residuals",
            lambda values: values - 1,
            "must hold residuals of at least 0; number 0 is -",
        ),
        (
            "eigenvalues",
            lambda values: np.array(values[0]),
            "must hold arrays that fit one another",
        ),
    ],
)
def test_what_no_spectrum_holds_is_refused(tmp_path, spectrum, part, harm, message):
    path = tmp_path / "s.npz"
    spectrum.save(path)
    with np.load(path) as archive:
        harmed = harm(archive[part])
    rewritten(path, **{part: harmed})
    with pytest.raises(FileFormatError, match=message):
        Spectrum.load(path)


@pytest.mark.parametrize(
    ("fact", "value"),
    [
        ("count", "ten"),
        ("shift", None),
        ("gap", [0.0]),
        ("clusters", ["1"]),
        ("n_found", 10.5),
        ("resolution", np.nan),
    ],
)
def test_a_certificate_of_other_types_is_refused(tmp_path, spectrum, fact, value):
    path = tmp_path / "s.npz"
    spectrum.save(path)
    facts = dataclasses.asdict(spectrum.certificate) | {fact: value}
    rewritten(
        path,
        head=np.array(json.dumps({"eigenshape_spectrum": 2, "key": None, "certificate": facts})),
    )
    with pytest.raises(FileFormatError, match=f"must hold a certificate whose {fact} is "):
        Spectrum.load(path)


def test_a_spectrum_is_loaded_by_its_key_alone(tmp_path, spectrum):
    path = tmp_path / "s.npz"
    spectrum.save(path, key="a cat")
    assert Spectrum.load(path, key="a cat").certificate == Spectrum.load(path).certificate
    with pytest.raises(
        FileFormatError, match="must hold the spectrum of the key a dog; its key is a cat"
    ):
        Spectrum.load(path, key="a dog")


def test_what_is_packed_is_refused_before_it_is_unpacked(tmp_path, spectrum):
    path = tmp_path / "bomb.npz"
    spectrum.save(path)
    with np.load(path) as archive:
        parts = dict(archive)
    parts["eigenvectors"] = np.zeros((2**21, 8))  # 128 MB in 130 KB
    np.savez_compressed(path, **parts)
    tracemalloc.start()
    with pytest.raises(FileFormatError, match=r"its part \w+\.npy is compressed"):
        Spectrum.load(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 2**20


def test_what_declares_more_than_it_holds_is_refused(tmp_path, spectrum):
    path = tmp_path / "s.npz"
    spectrum.save(path)
    content = path.read_bytes()
    shape = str(spectrum.eigenvectors.shape).encode()
    larger = f"({'9' * (len(str(spectrum.eigenvectors.shape[0])))}, 99)".encode()
    assert shape in content
    path.write_bytes(content.replace(shape, larger))
    with pytest.raises(FileFormatError, match="must hold a spectrum that eigenshape saved"):
        Spectrum.load(path)


def test_a_folder_and_a_pipe_are_no_spectra(tmp_path):
    with pytest.raises(FileFormatError, match="must be a file; it is a folder"):
        Spectrum.load(tmp_path)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(FileFormatError, match="must be a file; it is a pipe"):
        Spectrum.load(tmp_path / "pipe")
