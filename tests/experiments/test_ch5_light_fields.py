"""LFD, a method that the thesis compares with."""

import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import eigenshape as es

sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "experiments" / "ch5_retrieval")]
import light_fields as lf  # noqa: E402

few = settings(deadline=None, max_examples=8)


def creature(kind):
    return es.make_creature(kind, n_vertices=800)


def disc(size=201):
    row, column = np.mgrid[:size, :size] - size // 2
    return row**2 + column**2 <= (size // 2 - 3) ** 2


def test_moments_are_those_of_the_definition():
    rng = np.random.default_rng(3)
    r, angle = np.sqrt(rng.random(50)), 2 * np.pi * rng.random(50)
    found = lf.zernike_magnitudes(lf.power_sums(r * np.cos(angle), r * np.sin(angle), lf.ORDER))
    # R_1^1 = r, R_2^0 = 2r² - 1, R_2^2 = r², R_3^1 = 3r³ - 2r, R_3^3 = r³, R_4^0 = 6r⁴ - 6r² + 1
    radial = [
        (r, 1),
        (2 * r**2 - 1, 0),
        (r**2, 2),
        (3 * r**3 - 2 * r, 1),
        (r**3, 3),
        (6 * r**4 - 6 * r**2 + 1, 0),
    ]
    np.testing.assert_allclose(
        found[:6], [abs(np.mean(R * np.exp(1j * m * angle))) for R, m in radial], rtol=1e-12
    )
    assert len(found) == 35


def test_a_disc_has_no_moments_and_no_waves():
    assert np.abs(lf._describe_silhouette(disc())).max() < 0.01


def test_a_square_has_only_waves_of_its_symmetry():
    image = np.zeros((200, 200), dtype=bool)
    image[50:151, 50:151] = True
    waves = lf._fourier(image, np.array([100.0, 100.0]))
    assert np.abs(waves[[3, 7]]).min() > 0.005
    assert np.abs(np.delete(waves, [3, 7])).max() < 1e-3


def test_the_outline_goes_once_around():
    image = np.zeros((9, 9), dtype=bool)
    image[2:6, 3:8] = True
    path = lf.outline(image)
    assert len(path) == 14 + 1
    assert path[0] == path[-1]
    border = {
        (row, column) for row, column in np.argwhere(image) if row in (2, 5) or column in (3, 7)
    }
    assert set(path) == border


def test_a_thin_outline_goes_there_and_back():
    image = np.zeros((5, 5), dtype=bool)
    image[2, 1:4] = True
    assert [column for _, column in lf.outline(image)] == [1, 2, 3, 2, 1]
    image[:] = False
    image[4, 4] = True
    assert lf.outline(image) == [(4, 4)]


@few
@given(st.integers(0, 2**32 - 1))
@example(126)  # two pieces of one size
def test_turns_by_a_quarter_and_mirrors_leave_the_numbers(seed):
    rng = np.random.default_rng(seed)
    image = np.zeros((64, 64), dtype=bool)
    for _ in range(4):
        row, column = rng.integers(5, 40, 2)
        image[row : row + rng.integers(5, 20), column : column + rng.integers(5, 20)] = True
    expected = lf._describe_silhouette(image)
    for other in (np.rot90(image), image[:, ::-1]):
        np.testing.assert_allclose(
            lf._describe_silhouette(other.copy())[:35], expected[:35], atol=1e-12
        )
        # The outline starts elsewhere, so that its samples lie between the old ones.
        np.testing.assert_allclose(
            lf._describe_silhouette(other.copy())[35:], expected[35:], atol=0.02
        )


def test_the_sixty_pairings_are_a_group():
    pairings = lf._pairings()
    rows = {tuple(row) for row in pairings}
    assert len(rows) == 60
    assert tuple(range(10)) in rows
    assert all(sorted(row) == list(range(10)) for row in rows)
    assert {tuple(one[list(two)]) for one in pairings for two in rows} == rows


def test_turns_spread_views():
    turns = lf._turns(10)
    assert np.array_equal(turns[:3], lf._turns(3))
    axes = np.concatenate([lf._axes() @ turn.T for turn in turns])
    cosines = np.abs(axes @ axes.T)[~np.eye(len(axes), dtype=bool)]
    assert np.degrees(np.arccos(cosines.max())) > 5


def test_a_turn_of_the_dodecahedron_is_no_difference():
    turn = Rotation.from_rotvec(2 * np.pi / 3 * lf._axes()[4]).as_matrix()
    hand = creature("hand")
    turned = es.TriangleMesh(hand.vertices @ turn.T, hand.faces)
    one, two, other = (
        lf.light_field(mesh, n_fields=1) for mesh in (hand, turned, creature("quadruped"))
    )
    assert lf.light_field_distance(one, one) == 0
    assert lf.light_field_distance(one, two) < 0.05 * lf.light_field_distance(one, other)
    assert lf.light_field_distance(one, other) == pytest.approx(
        lf.light_field_distance(other, one), rel=1e-12
    )


@pytest.mark.long
@few
@given(st.integers(0, 2**32 - 1))
def test_any_turn_is_less_than_another_shape(seed):
    turn = Rotation.random(random_state=seed).as_matrix()
    hand = creature("hand")
    turned = es.TriangleMesh(hand.vertices @ turn.T, hand.faces)
    one, two, other = (
        lf.light_field(mesh, n_fields=4, size=96) for mesh in (hand, turned, creature("quadruped"))
    )
    assert lf.light_field_distance(one, two) < 0.5 * lf.light_field_distance(one, other)


@few
@given(st.floats(-30, 30), st.integers(0, 2**32 - 1))
def test_size_and_place_drop_out(power, seed):
    place = np.random.default_rng(seed).standard_normal(3)
    hand = creature("hand")
    moved = es.TriangleMesh(10.0**power * (hand.vertices + place), hand.faces)
    one, two = (lf.light_field(mesh, n_fields=1, size=96) for mesh in (hand, moved))
    # A pixel at the very edge may fall to the other side by rounding.
    np.testing.assert_allclose(two, one, atol=0.01)


def test_a_flat_shape_may_show_nothing():
    found = lf.light_field(
        es.TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), n_fields=1, size=32
    )
    assert np.isfinite(found).all()
