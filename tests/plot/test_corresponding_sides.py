import numpy as np
from scipy.spatial.transform import Rotation

import eigenshape as es
from eigenshape.matching.shape_match import ShapeMatch
from eigenshape.plot.shape_pairs import figure_match


def identity_match(mesh):
    """Return the map of a mesh onto a copy with the same numbers of vertices."""
    vertices = np.arange(mesh.n_vertices)
    faces = np.array([np.flatnonzero((mesh.faces == vertex).any(axis=1))[0] for vertex in vertices])
    corners = mesh.faces[faces]
    weights = (corners == vertices[:, None]).astype(float)
    sure, none = np.ones(len(vertices)), np.zeros((len(vertices), 12))
    return ShapeMatch(
        vertices, faces, corners, weights, sure, none, 1.0, 1.0, 1.0, True, 1, 1.0, ()
    )


def test_a_part_and_a_whole_that_lies_otherwise_are_drawn_from_the_same_side():
    part = es.make_creature("quadruped", n_vertices=500)
    turn = Rotation.from_euler("xyz", [2.0, 0.5, -1.0]).as_matrix()
    whole = es.TriangleMesh(5 * part.vertices @ turn.T + [1, 2, 3], part.faces)
    figure = figure_match(part, whole, identity_match(part))
    one, two = (np.asarray(axes.get_images()[0].get_array()) for axes in figure.axes)
    assert np.abs(one - two).max() < 1e-6


def test_one_part_is_in_the_singular():
    mesh = es.icosphere(1)
    one = np.zeros(mesh.n_faces, dtype=int)
    titles = [es.figure_segments(mesh, one, marked).axes[0].get_title() for marked in (None, [3])]
    assert titles == [
        "1 part",
        "1 part around its feature point (hollow: on the far side)",
    ]
