import numpy as np
import pytest
from bent_shapes import lump

from certeig.kit.errors import InvalidParameterError
from eigenshape.deformation.distortion import measure_distortion
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.shapes.surfaces import grid


def test_a_rigid_motion_distorts_nothing():
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    found = measure_distortion(lump(), TriangleMesh(lump().vertices @ turn.T + 3, lump().faces))
    assert found.edge_error < 1e-14
    np.testing.assert_allclose(found.area_ratios, 1, rtol=1e-12)
    assert not len(found.flipped)


@pytest.mark.parametrize("unit", [1e-100, 1.0, 1e100])
def test_twice_the_size_is_twice_the_edges_and_four_times_the_areas(unit):
    small, large = (TriangleMesh(unit * size * lump().vertices, lump().faces) for size in (1, 2))
    found, edges = measure_distortion(small, large), np.ptp(lump().vertices, axis=0)
    assert found.edge_error == pytest.approx(1)
    np.testing.assert_allclose(found.area_ratios, 4)
    lengths = np.linalg.norm(
        np.diff(lump().vertices[lump().faces[:, [0, 1, 2, 0]]], axis=1), axis=2
    )
    assert found.edge_error_of_box == pytest.approx(
        np.sqrt(np.mean(lengths**2)) / np.linalg.norm(edges)
    )


def test_a_face_that_is_turned_over_among_others_is_flipped():
    flat = grid(9, 9)
    moved = flat.vertices.copy()
    inner = np.argmin(np.linalg.norm(moved - moved.mean(axis=0), axis=1))
    moved[inner] += [0.0, 0.3, 0.0]  # over the edges across
    found = measure_distortion(flat, TriangleMesh(moved, flat.faces))
    assert len(found.flipped)
    corners = moved[flat.faces[found.flipped]]
    assert (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] < 0).all()


def test_other_faces_are_refused():
    with pytest.raises(InvalidParameterError, match="Poses of one mesh must have the same faces"):
        measure_distortion(lump(), TriangleMesh(lump().vertices, lump().faces[1:]))
