import dataclasses
import json
import pickle

import numpy as np
import pytest

from eigenshape._errors import FileFormatError
from eigenshape.geometry.surfaces import icosphere
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.spectral.solver import solve_spectrum
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
        with pytest.raises(FileFormatError, match=r"s\.npz must hold a spectrum that eigenshape saved; "):
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
    with pytest.raises(FileFormatError, match="must hold arrays that fit one another; their shapes are"):
        Spectrum.load(path)
    spectrum.save(path)
    rewritten(path, mass_indices=spectrum.mass.indices + 1000)
    with pytest.raises(FileFormatError, match="must hold a spectrum that eigenshape saved"):
        Spectrum.load(path)
    facts = {"eigenshape_spectrum": 99, "certificate": dataclasses.asdict(spectrum.certificate)}
    rewritten(path, head=np.array(json.dumps(facts)))
    with pytest.raises(FileFormatError, match="must hold a spectrum in format 1; it is in format 99"):
        Spectrum.load(path)
