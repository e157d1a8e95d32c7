"""Curves of semilandmarks: even points on lines, circles and surfaces, and the tables of them."""

import json
import warnings

import numpy as np
import pytest

import eigenshape as es

Landmarks = es.morphometrics.Landmarks
resample = es.morphometrics.resample_curves


def arc(n, turn=1.0, radius=1.0):
    """Return points at uneven angles of a circle."""
    angles = turn * 2 * np.pi * np.linspace(0, 1, n) ** 1.2
    return radius * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(n)])


def drawn(n=9, **changes):
    """Return a curve of a third of a circle, after a landmark of no curve."""
    points = np.concatenate([[[0, 0, 2.0]], arc(n, 1 / 3)])
    names = ["top", *(f"drawn {i}" for i in range(n))]
    return Landmarks(names, points, curves=[range(1, n + 1)], **changes)


def gaps(landmarks, number=0):
    return np.linalg.norm(np.diff(landmarks.points[list(landmarks.curves[number])], axis=0), axis=1)


@pytest.mark.parametrize("count", [2, 3, 25])
def test_points_of_an_arc_are_spaced_evenly(count):
    found = resample(drawn(), count)
    assert found.names[:3] == ("top", "drawn 0", "drawn 8")
    assert found.curves == ((1, *range(3, count + 1), 2),)
    np.testing.assert_array_equal(found.points[:3], drawn().points[[0, 1, 9]])
    chord = 2 * np.sin(np.pi / 3 / (count - 1))
    np.testing.assert_allclose(gaps(found), chord, rtol=2e-3)
    np.testing.assert_allclose(np.linalg.norm(found.points[1:], axis=1), 1, rtol=2e-3)


def test_points_of_a_closed_curve_are_spaced_evenly():
    points = arc(17)[:-1]
    ring = Landmarks([str(i) for i in range(16)], points, curves=[[*range(16), 0]])
    found = resample(ring, 12)
    assert found.names[0] == "0"
    assert found.curves == ((*range(12), 0),)
    np.testing.assert_allclose(gaps(found), 2 * np.sin(np.pi / 12), rtol=1e-3)


def test_points_lie_on_the_surface():
    ball = es.icosphere(4)
    found = resample(drawn(4), 9, mesh=ball)
    on = es.geometry.closest_points(ball, found.points[3:]).points
    np.testing.assert_allclose(on, found.points[3:], atol=1e-12)
    np.testing.assert_allclose(gaps(found), gaps(found).mean(), rtol=2e-3)


def test_resampling_changes_with_scale_and_nothing_else():
    for unit in (1e-100, 1e100):
        large = Landmarks(drawn().names, unit * drawn().points, curves=drawn().curves)
        expected = resample(drawn(), 7).points
        np.testing.assert_allclose(resample(large, 7).points / unit, expected, atol=1e-12)


def test_resampled_curves_are_resampled_again():
    once = resample(drawn(), 40)
    twice = resample(once, 9)
    np.testing.assert_allclose(twice.points, resample(drawn(), 9).points, atol=1e-4)
    assert twice.names == resample(drawn(), 9).names


def test_curves_share_ends_and_have_numbers_of_their_own():
    points = np.array([[0, 0, 0], [1, 0, 0], [3, 0, 0], [3, 1, 0], [3, 4, 0.0]])
    both = Landmarks("abcde", points, spread=[0, 1, 2, 3, 4], curves=[[0, 1, 2], [2, 3, 4]])
    found = resample(both, [4, 3])
    assert found.names == ("a", "c", "e", "curve 1 point 1", "curve 1 point 2", "curve 2 point 1")
    assert found.curves == ((0, 3, 4, 1), (1, 5, 2))
    np.testing.assert_allclose(found.points[3:], [[1, 0, 0], [2, 0, 0], [3, 2, 0]], atol=1e-9)
    np.testing.assert_array_equal(found.spread, [0, 2, 4, np.nan, np.nan, np.nan])
    # A point inside of one curve that ends another stays where it is.
    fork = Landmarks("abcd", points[:4], curves=[[0, 1, 2], [1, 3]])
    assert resample(fork, 3).names == ("a", "b", "c", "d", "curve 1 point 1", "curve 2 point 1")


def test_wrong_curves_and_numbers_are_refused():
    curve = drawn()
    with pytest.raises(es.InvalidParameterError, match=r"n_points must lie in 2..10000; it is 1"):
        resample(curve, 1)
    with pytest.raises(es.InvalidParameterError, match="there are 2 numbers and 1 curves"):
        resample(curve, [3, 4])
    ring = Landmarks("abc", arc(4)[:-1], curves=[[0, 1, 2, 0]])
    with pytest.raises(
        es.InvalidParameterError, match=r"closed .* 3 points or more; curves\[0\] would have 2"
    ):
        resample(ring, 2)
    missing = curve.points.copy()
    missing[4] = np.nan
    for points in (missing, np.ones_like(missing)):
        with pytest.raises(
            es.InvalidParameterError, match=r"must not all coincide; those of curves\[0\] are"
        ):
            resample(Landmarks(curve.names, points, curves=curve.curves), 5)
    ball = es.icosphere(3)
    with pytest.raises(
        es.InvalidParameterError,
        match=r"A curve must lie on the surface; curves\[0\] lies 0.497 from it",
    ):
        resample(drawn(2), 5, mesh=ball)
    with pytest.raises(es.InvalidParameterError, match=r"lies 9 from it"):
        resample(Landmarks(curve.names, 10 * curve.points, curves=curve.curves), 5, mesh=ball)
    assert len(resample(drawn(5), 5, mesh=ball).names) == 6  # with the points that were asked for


def test_curves_of_slicer_become_sliders_of_r(tmp_path):
    points = arc(6, 0.4).tolist()
    listed = [{"label": f"C-{i}", "position": place} for i, place in enumerate(points)]
    lists = [
        {"type": "Fiducial", "controlPoints": [{"label": "top", "position": [0, 0, 1]}, listed[0]]},
        {"type": "Curve", "controlPoints": listed},
        {"type": "ClosedCurve", "controlPoints": [listed[0], listed[2], listed[4]]},
    ]
    (tmp_path / "skull.mrk.json").write_text(json.dumps({"markups": lists}))
    template = es.morphometrics.read_landmarks(tmp_path / "skull.mrk.json")
    assert template.curves == ((1, 2, 3, 4, 5, 6), (1, 3, 5, 1))
    # Inner points of one that are inside of the other are of both; ends stay.
    even = resample(template, [5, 4])
    assert even.names[:3] == ("top", "C-0", "C-5")
    assert even.curves == ((1, 3, 4, 5, 2), (1, 6, 7, 8, 1))
    es.morphometrics.write_landmarks({"a": even, "b": even}, tmp_path / "two.sliders.csv")
    assert (tmp_path / "two.sliders.csv").read_text() == (
        "before,slide,after\n2,4,5\n4,5,6\n5,6,3\n2,7,8\n7,8,9\n8,9,2\n"
    )
    es.morphometrics.write_landmarks({"a": even, "b": even}, tmp_path / "two.tps")
    with warnings.catch_warnings(action="error"):
        found = es.morphometrics.read_specimens(tmp_path / "two.tps")
    np.testing.assert_array_equal(found["b"].points, even.points)
    other = Landmarks(even.names, even.points, curves=even.curves[:1])
    with pytest.raises(
        es.InvalidParameterError, match=r"All curves of specimens .* same rows; 'a' has .* 'b' "
    ):
        es.morphometrics.write_landmarks({"a": even, "b": other}, tmp_path / "two.sliders.csv")
