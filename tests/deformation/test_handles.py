import numpy as np
import pytest

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape.deformation.handles import Rotation, Scaling, Translation, affine_offset

QUARTER = np.pi / 2
POINTS = np.array([[1.0, 0.0, 0.0], [2.0, 0.0, 5.0], [1.0, 3.0, 0.0]])


def moved(handle, points, share=1.0):
    points = np.asarray(points, dtype=float)
    return points + handle.carry(points, np.full(len(points), share))


def test_a_quarter_turn_by_hand():
    about_z = Rotation([0, 0, 0], [0, 0, 7], QUARTER)
    np.testing.assert_allclose(
        moved(about_z, POINTS), [[0, 1, 0], [0, 2, 5], [-3, 1, 0]], atol=1e-15
    )
    about_x = Rotation([0, 1, 0], [1, 0, 0], QUARTER)
    np.testing.assert_allclose(
        moved(about_x, [[4, 1, 2], [4, 3, 0]]), [[4, -1, 0], [4, 1, 2]], atol=1e-15
    )


def test_by_a_share_of_it_a_point_turns_by_that_share_of_the_angle():
    pivot, axis, shares = [0.3, -1, 2], [1, 2, 3], np.array([0.0, 0.25, 1.0])
    found = Rotation(pivot, axis, 2.0).carry(POINTS, shares)
    alone = [
        Rotation(pivot, axis, 2.0 * share).carry(POINTS[[i]], np.ones(1))[0]
        for i, share in enumerate(shares)
    ]
    np.testing.assert_allclose(found, alone, atol=1e-15)
    assert (found[0] == 0).all()


def test_beyond_a_whole_turn_it_goes_on_turning():
    one, more = (
        Rotation([0, 0, 0], [0, 0, 1], QUARTER),
        Rotation([0, 0, 0], [0, 0, 1], QUARTER + 4 * np.pi),
    )
    np.testing.assert_allclose(moved(one, POINTS), moved(more, POINTS), atol=1e-14)
    np.testing.assert_allclose(
        moved(more, [[1, 0, 0]], 2 / 9), [[-1, 0, 0]], atol=1e-14
    )  # 2/9 of 9/2 π
    np.testing.assert_allclose(more.turn, [0, 0, 4.5 * np.pi])


def test_a_translation_goes_by_its_share_and_turns_nothing():
    handle = Translation([2, 0, -4])
    np.testing.assert_array_equal(moved(handle, POINTS, 0.5) - POINTS, [[1, 0, -2]] * 3)
    np.testing.assert_array_equal(handle.turn, [0, 0, 0])


def test_a_scaling_keeps_its_pivot_and_goes_by_its_share():
    handle = Scaling([1, 0, 0], [3, 1, 0.5])
    np.testing.assert_array_equal(moved(handle, POINTS), [[1, 0, 0], [4, 0, 2.5], [1, 3, 0]])
    np.testing.assert_array_equal(moved(handle, POINTS, 0.5), [[1, 0, 0], [3, 0, 3.75], [1, 3, 0]])
    np.testing.assert_array_equal(handle.turn, [0, 0, 0])


@pytest.mark.parametrize(
    "handle",
    [
        Rotation([1, -2, 3], [1, 1, -2], 5.0),
        Translation([1, 2, 3]),
        Scaling([1, -2, 3], [0.5, 1, 4]),
    ],
)
def test_the_matrix_says_what_carry_does(handle):
    ends = np.column_stack([POINTS, np.ones(3)])
    np.testing.assert_allclose(
        ends @ affine_offset(handle).T, handle.carry(POINTS, np.ones(3)), atol=1e-14
    )


def test_a_far_pivot_costs_no_digits_of_the_matrix():
    near, far = (affine_offset(Rotation([size, 0, 0], [0, 0, 1], QUARTER)) for size in (1.0, 1e100))
    np.testing.assert_allclose(far[:, :3], near[:, :3], atol=1e-15)
    np.testing.assert_allclose(far[:, 3] / 1e100, [1, -1, 0], atol=1e-15)


def test_an_axis_of_length_one_is_kept_to_the_last_digit():
    rng = np.random.default_rng(0)
    for axis in rng.standard_normal((50, 3)) * 10.0 ** rng.integers(-200, 200, (50, 1)):
        once = Rotation([0, 0, 0], axis, 1.0).axis
        np.testing.assert_allclose(once @ once, 1, rtol=1e-15)
        np.testing.assert_array_equal(Rotation([0, 0, 0], once, 1.0).axis, once)


def test_bad_numbers_are_refused_by_name():
    with pytest.raises(
        InvalidParameterError, match=r"axis must have a direction; it is \[0, 0, 0\]"
    ):
        Rotation([0, 0, 0], [0, 0, 0], 1.0)
    with pytest.raises(
        InvalidParameterError, match=r"pivot must have three numbers; the shape is \(2,\)"
    ):
        Rotation([0, 0], [0, 0, 1], 1.0)
    with pytest.raises(InvalidParameterError, match="angle must be finite; entry 0 is inf"):
        Rotation([0, 0, 0], [0, 0, 1], np.inf)
    with pytest.raises(InvalidParameterError, match="vector must be finite; entry 1 is nan"):
        Translation([0, np.nan, 0])
    with pytest.raises(
        InvalidParameterError, match=r"the factor along y is -2\.0\. A factor of 0.5"
    ):
        Scaling([0, 0, 0], [1, -2, 1])
    assert Scaling([0, 0, 0], [1, 0.5, 1]).factors[1] == 0.5


def test_each_vertex_is_scaled_by_its_share():
    bar = es.geometry.boundary_surface(es.shapes.box(4, 16, 4, sides=(1, 4, 1)))
    binding = es.deformation.bind(es.rig_shape(bar), [bar.vertices[:, 1] > 1.5])
    handle = Scaling([0.5, 2, 0.5], [2, 1, 0.5])
    scaled = bar.vertices + handle.carry(bar.vertices, binding.shares[0])
    for mode in ("graded", "uncrossed"):
        bent = es.deformation.bend(binding, [handle], mode=mode).vertices
        np.testing.assert_allclose(bent, scaled, atol=1e-14)
    by_thesis = es.deformation.bend(binding, [handle], mode="thesis").vertices
    width, _, depth = np.ptp(by_thesis[bar.vertices[:, 1] == 4], axis=0)
    assert width > 1.8
    assert depth < 0.6


def test_a_turned_end_keeps_its_size_while_the_other_one_is_scaled():
    bar = es.geometry.boundary_surface(es.shapes.box(4, 16, 4, sides=(1, 4, 1)))
    upper, lower = (bar.vertices[:, 1] > 3, bar.vertices[:, 1] < 1)
    binding = es.deformation.bind(es.rig_shape(bar), [upper, lower])
    handles = [Rotation([0.5, 3, 0.5], [0, 0, 1], 0.5), Scaling([0.5, 1, 0.5], [2, 1, 2])]
    bent = es.deformation.bend(binding, handles).vertices
    for height, share in ((4, 0), (0, binding.shares[1][lower].max())):
        one, other = ((bar.vertices == [side, height, 0]).all(axis=1) for side in (0, 1))
        width = np.linalg.norm(bent[one] - bent[other])
        np.testing.assert_allclose(width, 1 + share, rtol=0.1)


def test_every_method_asks_for_one_handle_a_region():
    mesh = es.icosphere(1)
    binding = es.deformation.bind(es.rig_shape(mesh), [mesh.vertices[:, 2] > 0.2])
    response = es.deformation.skeleton_response(binding)
    detailed = es.deformation.detailed_skeleton(binding)
    two = [es.Translation([0, 0, 1])] * 2
    calls = (
        lambda: es.deformation.bend(binding, two),
        lambda: es.deformation.move_skeleton(response, two),
        lambda: es.deformation.eigen_deformation(detailed, two),
    )
    for call in calls:
        with pytest.raises(es.InvalidParameterError, match="there are 1 regions and 2 handles"):
            call()
