import numpy as np
import pytest

from eigenshape._errors import InvalidParameterError, InvalidShapeError
from eigenshape.geometry import creatures
from eigenshape.geometry.creatures import CREATURES, make_creature
from eigenshape.geometry.measure import degenerate_faces, edge_lengths, enclosed_volume
from eigenshape.geometry.topology import is_closed, is_manifold, unreferenced_vertices, vertex_components

N = 1500
each_kind = pytest.mark.parametrize("kind", CREATURES)


@each_kind
def test_the_skin_is_one_closed_manifold_that_faces_outward(kind):
    mesh = make_creature(kind, n_vertices=N)
    assert is_closed(mesh)
    assert is_manifold(mesh)
    assert vertex_components(mesh)[0] == 1
    assert unreferenced_vertices(mesh).size == 0
    assert degenerate_faces(mesh).size == 0
    assert enclosed_volume(mesh) > 0
    assert abs(mesh.n_vertices / N - 1) < 0.05


@each_kind
def test_poses_bend_and_hardly_stretch(kind):
    rest = make_creature(kind, n_vertices=N)
    for pose in (1, 2, 3):
        posed = make_creature(kind, pose, n_vertices=N)
        np.testing.assert_array_equal(posed.faces, rest.faces)
        assert np.abs(posed.vertices - rest.vertices).max() > 0.05
        assert np.median(np.abs(edge_lengths(posed) / edge_lengths(rest) - 1)) < 0.04
        assert enclosed_volume(posed) > 0


def test_the_same_seed_gives_the_same_bits():
    first = make_creature("fish", 5, n_vertices=800, individual=2)
    creatures._at_rest.cache_clear()
    again = make_creature("fish", 5, n_vertices=800, individual=2)
    np.testing.assert_array_equal(again.vertices, first.vertices)
    np.testing.assert_array_equal(again.faces, first.faces)


def test_individuals_differ_in_proportions():
    one, two = (make_creature("fish", n_vertices=800, individual=i) for i in (0, 1))
    assert abs(enclosed_volume(one) / enclosed_volume(two) - 1) > 0.01


def test_an_unknown_kind_is_refused_by_name():
    with pytest.raises(InvalidParameterError, match=r"kind must be one of ant, biped, .*; it is 'unicorn'"):
        make_creature("unicorn")


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"pose": -1}, r"pose must lie in 0\.\.4294967295; it is -1"),
        ({"n_vertices": 499}, r"n_vertices must lie in 500\.\.100000; it is 499"),
        ({"individual": 2**32}, r"individual must lie in 0\.\.4294967295; it is 4294967296"),
    ],
)
def test_numbers_out_of_range_are_refused(options, match):
    with pytest.raises(InvalidParameterError, match=match):
        make_creature("fish", **options)


def test_limbs_finer_than_the_grid_are_refused():
    with pytest.raises(
        InvalidShapeError, match=r"must be smooth at the size of the grid; at spacing 0\.1\d* it is not"
    ):
        make_creature("ant", n_vertices=500)
