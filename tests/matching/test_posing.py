import numpy as np
import pytest

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape.deformation.pose_transfer import transfer_deformation
from eigenshape.matching.match import match_shapes
from eigenshape.matching.posing import take_pose


def creature(pose):
    return es.make_creature("quadruped", pose, n_vertices=800)


def aligned_error(mesh, wanted):
    """Root mean square distance after the best rigid motion, in lengths of the box."""
    one, two = (m.vertices - m.vertices.mean(axis=0) for m in (mesh, wanted))
    left, _, right = np.linalg.svd(one.T @ two)
    turn = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
    gap = np.linalg.norm(one @ turn - two, axis=1)
    return np.sqrt((gap**2).mean()) / np.ptp(two, axis=0).max()


def test_a_creature_takes_the_pose_of_itself():
    rest, posed = creature(0), creature(1)
    bent = take_pose(rest, posed)
    assert np.array_equal(bent.faces, rest.faces)
    assert aligned_error(bent, posed) < 0.5 * aligned_error(rest, posed)


@pytest.mark.long
def test_a_match_that_is_known_is_taken():
    rest, posed = creature(0), creature(1)
    areas = [es.geometry.surface_area(mesh) for mesh in (rest, posed)]
    match = match_shapes(rest, posed, scale=float(np.sqrt(areas[1] / areas[0])))
    one, two = take_pose(rest, posed, match=match), take_pose(rest, posed)
    assert np.allclose(one.vertices, two.vertices, atol=1e-6)


@pytest.mark.long
def test_a_match_of_another_mesh_is_refused():
    rest, posed = creature(0), creature(1)
    match = match_shapes(es.partial_scan(rest, [0, 0, 1]).mesh, posed)
    with pytest.raises(InvalidParameterError, match="The match must be of the mesh that is bent"):
        take_pose(rest, posed, match=match)


def test_a_list_of_vertices_is_a_map_for_transfer():
    rest, posed = creature(0), creature(1)
    bent = transfer_deformation(rest, posed, rest, np.arange(rest.n_vertices))
    assert aligned_error(bent, posed) < 0.3 * aligned_error(rest, posed)


def test_a_list_of_vertices_of_another_length_is_refused():
    rest, posed = creature(0), creature(1)
    with pytest.raises(InvalidParameterError, match="hold a vertex of `before` for each vertex"):
        transfer_deformation(rest, posed, rest, [0, 1, 2])
