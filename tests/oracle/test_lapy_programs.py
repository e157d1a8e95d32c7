"""Programs written against LaPy, on our solver: LaPy's own tests, and neuromodes."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import eigenshape as es

PEER = Path(__file__).resolve().parents[3] / "shared" / "peers" / "lapy"
RUN = """
import eigenshape as es, pytest
es.compat.lapy.install()
raise SystemExit(pytest.main(["tests", "-q", "-p", "no:cacheprovider"]))
"""


@pytest.mark.sweep
@pytest.mark.skipif(not PEER.is_dir(), reason=f"LaPy's own tests are absent: {PEER} is no folder")
def test_lapys_own_tests_pass():
    """All 112, in 8 s: the slowest, of tetrahedra, take 0.8 s each."""
    command = [sys.executable, "-B", "-c", RUN]
    done = subprocess.run(command, cwd=PEER, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-4000:]
    assert "112 passed" in done.stdout


def documented_calls() -> dict[str, np.ndarray]:
    """Return the answers of the calls in the documentation of neuromodes, on its cortex of 4,002 vertices."""
    neuromodes = pytest.importorskip("neuromodes")
    mesh, mask = neuromodes.io.fetch_example_surf(density="4k")
    data = neuromodes.io.fetch_example_map("myelinmap", density="4k")[mask]
    solver = neuromodes.EigenSolver(mesh, mask=mask).solve(36)
    waves = solver.sim_nft_waves(nt=20, seed=1)
    recon = solver.reconstruct(data, mode_counts=[10, 36])
    scaled = neuromodes.stats.sigmoid_rescale(
        neuromodes.stats.zscorew(data, solver.mass), lower=0, upper=2
    )
    mixed = neuromodes.EigenSolver(mesh, mask=mask).solve(16, hetero=scaled, lump=True)
    return {
        "evals": solver.evals,
        "emodes": solver.emodes,
        "decompose": solver.decompose(data),
        "reconstruct": recon,
        "recon_error": solver.recon_error(data, recon),
        "compute_gem": solver.compute_gem(k=36),
        "sim_nft_waves": waves,
        "balloon_model": solver.balloon_model(waves, dt=1e-4),
        "eigenstrap": solver.eigenstrap(data, n_nulls=5, seed=3),
        "evals, heterogeneous": mixed.evals,
        "unmask_data": np.nan_to_num(mixed.unmask_data(mixed.emodes)),
    }


def test_neuromodes_gives_on_ours_what_it_gives_on_lapy():
    # A cortex has no multiple eigenvalues, and neuromodes chooses signs itself, so that even modes are equal.
    theirs = documented_calls()
    es.compat.lapy.install()
    try:
        ours = documented_calls()
    finally:
        es.compat.lapy.uninstall()
    for name, expected in theirs.items():
        np.testing.assert_allclose(
            ours[name], expected, atol=1e-7 * np.abs(expected).max(), err_msg=name
        )
