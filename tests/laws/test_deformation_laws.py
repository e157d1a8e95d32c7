"""What must hold for every bend of any shape: motions, units and names change nothing."""

from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation as Turn

from eigenshape.deformation.binding import bind
from eigenshape.deformation.deform import bend, deform
from eigenshape.deformation.handles import Rotation, Translation
from eigenshape.deformation.rig import rig_shape
from eigenshape.deformation.session import DeformationSession
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.shapes.surfaces import torus

modes = pytest.mark.parametrize("mode", ["graded", "thesis"])
seeds = st.integers(0, 2**16)
few = settings(deadline=None, max_examples=6, derandomize=True)


@lru_cache
def bumpy_torus(seed):
    mesh = torus(18, 10)
    return TriangleMesh(
        mesh.vertices + 0.04 * np.random.default_rng(seed).standard_normal((180, 3)), mesh.faces
    )


def task(seed):
    """A shape, two regions that do not meet, and a handle for each."""
    rng = np.random.default_rng(seed)
    mesh = bumpy_torus(seed % 3)
    side = mesh.vertices @ Turn.random(random_state=rng).as_matrix()[0] * 0.3 + mesh.vertices[:, 0]
    turn = Rotation(rng.standard_normal(3), rng.standard_normal(3), rng.uniform(-2, 2))
    return mesh, [side > 0.6, side < -0.5], [turn, Translation(0.5 * rng.standard_normal(3))]


def bent(mesh, regions, handles, mode):
    return bend(bind(rig_shape(mesh), regions, n_modes=40), handles, mode=mode).vertices


@modes
@few
@given(seeds)
def test_a_shape_that_was_moved_bends_alike(mode, seed):
    mesh, regions, (turn, shift) = task(seed)
    rng = np.random.default_rng(seed + 1)
    motion, goes = Turn.random(random_state=rng), 3 * rng.standard_normal(3)
    handles = [
        Rotation(motion.apply(turn.pivot.copy()) + goes, motion.apply(turn.axis.copy()), turn.angle)
    ]
    handles.append(Translation(motion.apply(shift.vector.copy())))
    other = bent(
        TriangleMesh(motion.apply(np.array(mesh.vertices)) + goes, mesh.faces),
        regions,
        handles,
        mode,
    )
    expected = motion.apply(bent(mesh, regions, [turn, shift], mode).copy()) + goes
    np.testing.assert_allclose(other, expected, atol=1e-9)


@modes
@few
@given(seeds, st.sampled_from([1e-100, 1e-7, 3.0, 1e100]))
def test_units_change_nothing(mode, seed, size):
    mesh, regions, (turn, shift) = task(seed)
    handles = [Rotation(size * turn.pivot, turn.axis, turn.angle), Translation(size * shift.vector)]
    other = bent(TriangleMesh(size * mesh.vertices, mesh.faces), regions, handles, mode)
    np.testing.assert_allclose(other / size, bent(mesh, regions, [turn, shift], mode), atol=1e-9)


@modes
@few
@given(seeds)
def test_names_of_vertices_and_faces_change_nothing(mode, seed):
    mesh, regions, handles = task(seed)
    rng = np.random.default_rng(seed + 1)
    order = rng.permutation(180)
    faces = rng.permutation(np.argsort(order)[mesh.faces])
    faces = np.array(
        [
            np.roll(face, turn)
            for face, turn in zip(faces, rng.integers(0, 3, len(faces)), strict=True)
        ]
    )
    other = bent(
        TriangleMesh(mesh.vertices[order], faces),
        [region[order] for region in regions],
        handles,
        mode,
    )
    np.testing.assert_allclose(other, bent(mesh, regions, handles, mode)[order], atol=1e-9)


@modes
@few
@given(seeds)
def test_the_order_of_regions_changes_nothing(mode, seed):
    mesh, regions, handles = task(seed)
    one, two = (bent(mesh, regions[::way], handles[::way], mode) for way in (1, -1))
    np.testing.assert_allclose(two, one, atol=1e-12)


@modes
@few
@given(seeds)
def test_undo_is_the_way_back_and_nothing_moves_by_nothing(mode, seed):
    mesh, regions, handles = task(seed)
    rig = rig_shape(mesh)
    session = DeformationSession(rig, mode=mode)
    session.drag(regions[0], handles[0])
    session.commit()
    assert np.abs(session.mesh.vertices - mesh.vertices).max() > 1e-3
    np.testing.assert_array_equal(session.undo().vertices, mesh.vertices)
    still = deform(rig, regions[1], Rotation(handles[0].pivot, handles[0].axis, 0.0), mode=mode)
    np.testing.assert_allclose(still.vertices, mesh.vertices, atol=0 if mode == "graded" else 1e-12)
