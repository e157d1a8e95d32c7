"""As rigid as possible against libigl's: whatever it finds with equal handles has more of our energy."""

import sys
from pathlib import Path

import igl
import numpy as np
import pytest

from eigenshape.deformation import rigidity
from eigenshape.deformation.binding import bind
from eigenshape.deformation.handles import Rotation
from eigenshape.deformation.rig import rig_shape
from eigenshape.deformation.rigidity import fit_turns
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.shapes.surfaces import icosphere

sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "experiments" / "ch6_deformation")]
from peers import as_rigid_as_possible  # noqa: E402

BALL = icosphere(3)
LONG = TriangleMesh(BALL.vertices * [1, 1, 3], BALL.faces)


def energy(edges, rest, posed):
    turns = fit_turns(edges, rest, posed)
    one = np.repeat(np.arange(len(rest)), np.diff(edges.starts))
    arms, after = rest[edges.others] - rest[one], posed[edges.others] - posed[one]
    return (
        edges.weights @ ((np.einsum("eij,ej->ei", turns[one], arms) - after) ** 2).sum(axis=1) / 2
    )


@pytest.mark.parametrize("kind", ["SPOKES", "SPOKES_AND_RIMS"])
@pytest.mark.parametrize("rounds", [1, 100])
def test_libigl_finds_no_less_energy(kind, rounds, monkeypatch):
    """From our result, and from the shape at rest, with the same vertices held in the same places."""
    monkeypatch.setattr(rigidity, "ENERGY_TOLERANCE", 0.0)
    rig, z = rig_shape(LONG), LONG.vertices[:, 2]
    binding = bind(rig, [z > 1.5], fixed=z < -1.5)
    ours = as_rigid_as_possible(binding, [Rotation([0, 0, 0], [1, 0, 0], 0.5)], n_rounds=3000)
    held = np.setdiff1d(np.arange(len(z)), binding.part.free)
    least = energy(rig.edges, LONG.vertices, ours)
    for start in (ours, LONG.vertices):
        data = igl.ARAPData()
        data.energy, data.max_iter = getattr(igl, f"ARAP_ENERGY_TYPE_{kind}"), rounds
        igl.arap_precomputation(LONG.vertices, LONG.faces, 3, held.astype(np.int64), data)
        theirs = igl.arap_solve(np.ascontiguousarray(ours[held]), data, start.copy())
        np.testing.assert_allclose(theirs[held], ours[held], atol=1e-12)
        assert energy(rig.edges, LONG.vertices, theirs) > (1 - 1e-9) * least
