"""Random pencils with multiplicities, negative eigenvalues and clusters: none is missed."""

import known_spectra as known
import numpy as np
import pytest
import scipy.sparse as sp

import certeig

QUICK, ALL = 200, 2000
BATCH = 100


def missed(seed: int) -> int:
    """Return how many of the lowest eigenvalues of one random pencil are not found."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(301, 420)) if rng.random() < 0.6 else int(rng.integers(1, 301))
    values = known.random_values(n, rng) * 10.0 ** rng.integers(-3, 4)
    if rng.random() < 0.2:
        values += 10.0 ** rng.integers(0, 4) * np.ptp(values)
    stiffness, mass = known.pencil_with(
        values, rng, identity=bool(rng.random() < 0.5), turns=int(rng.integers(1, 4))
    )
    if rng.random() < 0.2:  # in parts that no entry connects
        copies = int(rng.integers(2, 5))
        stiffness, mass = (
            sp.csr_array(sp.block_diag([each] * copies)) for each in (stiffness, mass)
        )
        values = np.repeat(values, copies)
    k = int(rng.integers(1, min(len(values), 40) + 1))
    spectrum = certeig.eigenpairs(stiffness, mass, k=k)
    assert spectrum.certificate.complete
    # Every exact eigenvalue has one that was found, in order, up to rounding of both matrices
    off = np.abs(spectrum.eigenvalues - values[:k])
    return int(np.count_nonzero(off > 1e-8 * np.abs(values).max()))


@pytest.mark.parametrize("batch", range(QUICK // BATCH))
def test_nothing_is_missing_from_random_pencils(batch):
    assert sum(map(missed, range(batch * BATCH, (batch + 1) * BATCH))) == 0


@pytest.mark.long
@pytest.mark.parametrize("batch", range(QUICK // BATCH, ALL // BATCH))
def test_nothing_is_missing_from_many_random_pencils(batch):
    assert sum(map(missed, range(batch * BATCH, (batch + 1) * BATCH))) == 0
