"""Methods of deformation that chapter 6 compares with."""

import sys
from pathlib import Path

import numpy as np
import pytest

from eigenshape.deformation.binding import bind
from eigenshape.deformation.handles import Rotation, Translation
from eigenshape.deformation.rig import rig_shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.cotangent import cotangent_laplacian

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "experiments" / "ch6_deformation"), str(ROOT / "tests" / "deformation")]
from bent_shapes import lump, lump_rig, tube, tube_rig  # noqa: E402
from peers import as_rigid_as_possible, biharmonic_blend, spectral_rigid  # noqa: E402

PEERS = [as_rigid_as_possible, biharmonic_blend, spectral_rigid]
TURN, PULL = Rotation([0.6, 0, 0], [0, 1, 2], 0.8), Translation([0, 0.3, 0])
HEAD, TAIL = lump().vertices[:, 0] > 0.6, lump().vertices[:, 0] < -0.7


@pytest.mark.long
@pytest.mark.parametrize("peer", PEERS)
@pytest.mark.parametrize("handle", [Rotation([1, 2, 3], [0, 0, 1], 0.0), Translation([0, 0, 0])])
def test_what_moves_nothing_leaves_all_in_place(peer, handle):
    found = peer(bind(lump_rig(), [HEAD], fixed=TAIL), [handle])
    np.testing.assert_allclose(found, lump().vertices, atol=1e-13)


@pytest.mark.parametrize(
    ("peer", "within"),
    [(as_rigid_as_possible, 0), (biharmonic_blend, 1e-15), (spectral_rigid, 0.02)],
)
def test_what_is_held_is_where_it_belongs(peer, within):
    rest, binding = lump().vertices, bind(lump_rig(), [HEAD, TAIL])
    found = peer(binding, [TURN, PULL])
    expected = rest + sum(
        handle.carry(rest, share)
        for handle, share in zip((TURN, PULL), binding.shares, strict=True)
    )
    held = np.setdiff1d(np.arange(642), binding.part.free)
    assert np.abs(found[held] - expected[held]).max() <= within


@pytest.mark.parametrize("peer", PEERS)
def test_one_motion_for_all_is_that_motion(peer):
    """Where all that is held moves alike, so does the rest."""
    rest, binding = lump().vertices, bind(lump_rig(), [HEAD, ~HEAD])
    found = peer(binding, [PULL, PULL])
    np.testing.assert_allclose(
        found - rest,
        np.tile(PULL.vector, (642, 1)),
        atol=1e-6 if peer is not biharmonic_blend else 1e-11,
    )


def test_biharmonic_weights_by_a_dense_solve():
    """min |M^-1/2 W w|² with w told where a vertex is held: normal equations by least squares."""
    rig, binding = tube_rig(), bind(tube_rig(), [np.arange(492) >= 360], fixed=np.arange(492) < 132)
    laplacian = cotangent_laplacian(tube())
    root = laplacian.stiffness.toarray() / np.sqrt(laplacian.mass.diagonal())[:, None]
    free = binding.part.free
    weights = binding.shares[0].copy()
    held = np.setdiff1d(np.arange(492), free)
    weights[free] = np.linalg.lstsq(root[:, free], -root[:, held] @ weights[held], rcond=None)[0]
    found = biharmonic_blend(binding, [Translation([0, 0, 1])])
    np.testing.assert_allclose(found, rig.mesh.vertices + weights[:, None] * [0, 0, 1], atol=1e-8)


@pytest.mark.parametrize("size", [1e-100, 1e100])
@pytest.mark.parametrize("peer", PEERS)
def test_units_change_no_peer(peer, size):
    one = peer(bind(lump_rig(), [HEAD]), [TURN])
    other = rig_shape(TriangleMesh(size * lump().vertices, lump().faces))
    handle = Rotation(size * TURN.pivot, TURN.axis, TURN.angle)
    np.testing.assert_allclose(peer(bind(other, [HEAD]), [handle]) / size, one, atol=1e-9)
