import numpy as np
import pytest
from bent_shapes import lump, lump_rig

from certeig.kit.errors import InvalidParameterError
from eigenshape.deformation.deform import deform
from eigenshape.deformation.handles import Rotation
from eigenshape.deformation.pose_transfer import transfer_deformation
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.creatures import make_creature
from eigenshape.spectral.maps.functional_map import FunctionalMap
from eigenshape.spectral.solve import solve_spectrum

TURN = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])


def mapped(target, k):
    return FunctionalMap(
        np.eye(k), *(solve_spectrum(cotangent_laplacian(mesh), k) for mesh in (lump(), target))
    )


@pytest.fixture(scope="module")
def bent():
    return deform(lump_rig(), lump().vertices[:, 0] > 0.6, Rotation([0.6, 0, 0], [0, 1, 2], 0.8))


@pytest.mark.long
def test_a_creature_is_given_its_own_pose():
    """Turns alone travel, so what is left is how far the pose stretches edges, by 3 %."""
    rest, pose = (make_creature("giraffe", number, n_vertices=1500) for number in (1, 4))
    spectrum = solve_spectrum(cotangent_laplacian(rest), 60)
    found = transfer_deformation(rest, pose, rest, FunctionalMap(np.eye(60), spectrum, spectrum))
    moved = np.linalg.norm(pose.vertices - rest.vertices, axis=1)
    assert np.linalg.norm(found.vertices - pose.vertices, axis=1).max() < 0.05 * moved.max()


def test_few_modes_carry_less(bent):
    mapping = mapped(lump(), 100)
    off = [
        np.linalg.norm(
            transfer_deformation(lump(), bent, lump(), mapping, n_modes=k).vertices - bent.vertices
        )
        for k in (100, 20, 5)
    ]
    assert off[0] < off[1] < off[2]


@pytest.mark.long
def test_a_turned_and_larger_copy_is_bent_likewise(bent):
    copy = TriangleMesh(7 * lump().vertices @ TURN.T + [1, 2, 3], lump().faces)
    here = transfer_deformation(lump(), bent, lump(), mapped(lump(), 60))
    there = transfer_deformation(lump(), bent, copy, mapped(copy, 60))
    np.testing.assert_allclose(there.vertices, 7 * here.vertices @ TURN.T + [1, 2, 3], atol=1e-5)


def test_a_shape_that_is_moved_as_a_whole_takes_the_other_along():
    away = TriangleMesh(lump().vertices @ TURN.T + [1, 2, 3], lump().faces)
    found = transfer_deformation(lump(), away, lump(), mapped(lump(), 20))
    np.testing.assert_allclose(found.vertices, away.vertices, atol=1e-10)


def test_what_does_not_fit_is_refused(bent):
    mapping, cut = mapped(lump(), 20), TriangleMesh(lump().vertices, lump().faces[1:])
    other = TriangleMesh(np.vstack([lump().vertices, [[9.0, 9, 9]]]), lump().faces)
    with pytest.raises(InvalidParameterError, match="Poses of one mesh must have the same faces"):
        transfer_deformation(lump(), cut, lump(), mapping)
    with pytest.raises(InvalidParameterError, match="it has 642 vertices, and the mesh has 643"):
        transfer_deformation(lump(), bent, other, mapping)
    with pytest.raises(InvalidParameterError, match=r"n_modes must lie in 1\.\.20"):
        transfer_deformation(lump(), bent, lump(), mapping, n_modes=21)
