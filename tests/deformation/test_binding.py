import numpy as np
import pytest
from bent_shapes import lump_rig, tube, tube_rig

from certeig.kit.errors import InvalidParameterError
from eigenshape.deformation.binding import bind
from eigenshape.deformation.deform import bend, deform
from eigenshape.deformation.handles import Rotation, Translation
from eigenshape.deformation.region_patches import FREE_DEPTH
from eigenshape.deformation.rig import rig_shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.shapes.surfaces import icosphere

TOP, BOTTOM = (tube().vertices[:, 2] >= 4.5, tube().vertices[:, 2] <= 1.5)
ROW = np.arange(tube().n_vertices) // 12  # .15 apart
TETRAHEDRON = TriangleMesh(
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
)  # fmt: skip


@pytest.mark.parametrize(
    ("first", "n_modes"), [(10, 8), (22, 8), (23, 50), (36, 50), (37, 300), (39, 300)]
)
def test_small_regions_take_many_modes(first, n_modes):
    """Rows first..40 reach 40 - first rows from their boundary, the others first: δ = 18/22, 17/23, 4/36, 3/37."""
    binding = bind(tube_rig(), [first <= ROW])
    inside, outside = (binding.distances[0][part].max() for part in (first <= ROW, first > ROW))
    assert inside / outside == pytest.approx((40 - first) / first, rel=1e-9)
    assert binding.n_modes.tolist() == [n_modes]


def test_shares_are_one_deep_inside_and_nought_far_away():
    binding = bind(tube_rig(), [TOP])
    (shares,) = binding.shares
    assert shares.min() == 0
    assert shares.max() == 1
    assert (shares[TOP] == 1).sum() >= 48
    assert (shares[ROW >= 33] > 0.95).all()
    assert (shares[ROW <= 20] < 0.05).all()
    assert (shares[TOP] > 0.5).all()
    assert (shares[~TOP] < 0.5).all()
    # Held is what has a share of 0 or 1, but for what is near the boundary of the region.
    (distance,) = binding.distances
    depth = min(distance[TOP].max(), distance[~TOP].max())
    sure = (shares == 0) | (shares == 1)
    np.testing.assert_array_equal(binding.held, sure & (distance >= FREE_DEPTH * depth))
    assert not binding.held[binding.part.free].any()


def test_in_each_component_something_of_region_and_rest_is_held():
    """A region may have only the tip of a component, or nearly all of it."""
    one, two = icosphere(2), icosphere(2)
    mesh = disjoint_union(one, TriangleMesh(0.3 * two.vertices + [5.0, 0, 0], two.faces))
    z = mesh.vertices[:, 2]
    small = np.arange(mesh.n_vertices) >= one.n_vertices
    for height in (0.25, -0.25, 0.0):
        region = np.where(small, z > height, z > 0.2)
        binding = bind(rig_shape(mesh), [region])
        (shares,) = binding.shares
        sure = (shares == 0) | (shares == 1)
        sides = [region & small, ~region & small, region & ~small, ~region & ~small]
        for side in sides:
            assert (binding.held & side).any() == (sure & side).any()
        assert sum((sure & side).any() for side in sides) >= 3


def test_half_of_the_depth_of_a_region_is_free_on_both_sides():
    binding = bind(tube_rig(), [TOP])
    (distance,) = binding.distances
    depth = distance[TOP].max()  # the rest is deeper
    assert depth < distance[~TOP].max()
    assert not binding.held[distance < FREE_DEPTH * depth].any()
    (shares,) = binding.shares
    far = (distance > depth) & ((shares == 0) | (shares == 1))
    assert far.any()
    assert binding.held[far].all()
    moved = bend(binding, [Rotation([0, 0, 0], [0, 0, 1], 0.5)]).vertices
    rest = tube_rig().mesh.vertices
    stays = binding.held & ~TOP
    np.testing.assert_array_equal(moved[stays], rest[stays])


def test_what_is_fixed_stays_and_the_rest_is_free():
    binding = bind(tube_rig(), [TOP], fixed=BOTTOM)
    (shares,) = binding.shares
    assert (shares[TOP] == 1).all()
    assert (shares[BOTTOM] == 0).all()
    np.testing.assert_array_equal(binding.part.free, np.flatnonzero(~TOP & ~BOTTOM))
    between = np.array([shares[row == ROW].mean() for row in range(10, 31)])
    assert (np.diff(between) >= 0).all()
    assert ((between > 0.1) & (between < 0.9)).sum() >= 8


def test_fixing_nothing_is_not_to_fix():
    one, two = bind(tube_rig(), [TOP]), bind(tube_rig(), [TOP], fixed=[])
    np.testing.assert_array_equal(one.shares, two.shares)


def test_shares_of_several_regions_never_exceed_one():
    middle = (ROW > 15) & (ROW < 30)
    binding = bind(tube_rig(), [TOP, BOTTOM, middle])
    assert binding.shares.shape == (3, 492)
    assert binding.shares.min() >= 0
    assert binding.shares.sum(axis=0).max() <= 1 + 1e-15


def test_regions_must_not_overlap():
    with pytest.raises(
        InvalidParameterError, match=r"must not overlap; vertex 360 is in two of them \(132 such\)"
    ):
        bind(tube_rig(), [TOP, TOP])
    with pytest.raises(
        InvalidParameterError, match="Regions and fixed vertices must not overlap; vertex 480"
    ):
        bind(tube_rig(), [TOP], fixed=iter([0, 480]))


def test_regions_without_a_boundary_are_refused():
    with pytest.raises(
        InvalidParameterError, match="There must be at least one region; none was given"
    ):
        bind(tube_rig(), [])
    with pytest.raises(InvalidParameterError, match="where it bends; region 1 holds no vertex"):
        bind(tube_rig(), [TOP, []])
    with pytest.raises(
        InvalidParameterError, match="region 0 holds 492 of 492 vertices, whole components"
    ):
        bind(tube_rig(), [np.ones(492, dtype=bool)])


def test_modes_can_be_chosen():
    assert bind(tube_rig(), [TOP], n_modes=20).n_modes.tolist() == [20]
    with pytest.raises(InvalidParameterError, match=r"n_modes must lie in 1\.\.300; it is 301"):
        bind(tube_rig(), [TOP], n_modes=301)
    for fixed in (None, BOTTOM):
        with pytest.raises(
            InvalidParameterError,
            match="Modes must differ between a region and the rest; the lowest 1 are",
        ):
            bind(tube_rig(), [TOP], fixed=fixed, n_modes=1)


@pytest.mark.parametrize("n_modes", [3, 8, 50, None])
def test_a_single_vertex_goes_where_its_handle_takes_it(n_modes):
    """However few modes there are to tell it, and however small they find it."""
    rig = lump_rig()
    binding = bind(rig, [[100]], n_modes=n_modes)
    assert binding.shares[0, 100] == 1
    assert (binding.shares[0] == 0).sum() > 0
    bent = deform(rig, [100], Translation([0.1, 0, 0]), n_modes=n_modes)
    np.testing.assert_array_equal(bent.vertices[100], rig.mesh.vertices[100] + [0.1, 0, 0])


@pytest.fixture(scope="module")
def two_parts():
    return rig_shape(disjoint_union(tube(), icosphere(2)))


def test_a_component_in_the_region_goes_with_it_and_another_stays(two_parts):
    turn = Rotation([0, 0, 4.5], [1, 0, 0], 1.0)
    ball = np.arange(two_parts.mesh.n_vertices) >= 492
    rest = two_parts.mesh.vertices
    alone = bind(two_parts, [np.append(TOP, np.zeros(162, dtype=bool))])
    # As many as hold the 50 modes that the rule gives to the tube
    on_tube = (two_parts.areas[~ball] @ two_parts.eigenvectors[~ball] ** 2).cumsum()
    (n_modes,) = alone.n_modes
    np.testing.assert_allclose(on_tube[[n_modes - 2, n_modes - 1]], [49, 50], atol=1e-9)
    assert np.isinf(alone.distances[0][ball]).all()
    assert (alone.shares[0][ball] == 0).all()
    together = deform(two_parts, np.append(TOP, np.ones(162, dtype=bool)), turn)
    expected = rest + turn.carry(rest, np.ones(len(rest)))
    np.testing.assert_array_equal(together.vertices[ball], expected[ball])


def test_a_whole_component_is_refused(two_parts):
    with pytest.raises(
        InvalidParameterError, match="region 0 holds 162 of 654 vertices, whole components"
    ):
        bind(two_parts, [np.arange(492, 654)])


def test_what_nothing_holds_is_refused(two_parts):
    with pytest.raises(InvalidParameterError, match="the component of vertex 492 has none"):
        bind(two_parts, [np.flatnonzero(TOP)], fixed=np.flatnonzero(BOTTOM))


@pytest.mark.parametrize("mode", ["graded", "thesis"])
def test_a_tetrahedron_stretches(mode):
    bent = deform(rig_shape(TETRAHEDRON), [3], Translation([0, 0, 1]), mode=mode)
    np.testing.assert_allclose(
        bent.vertices, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 2]], atol=1e-14
    )
