"""Procrustes fits: known answers, scipy's of two shapes, and semilandmarks that slide as in geomorph."""

import inspect
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import RBFInterpolator
from scipy.spatial import procrustes as scipy_procrustes
from scipy.spatial.distance import cdist
from scipy.spatial.transform import Rotation

import eigenshape as es
from eigenshape.morphometrics import procrustes, splines

RNG = np.random.default_rng
fit_procrustes = es.morphometrics.fit_procrustes


def some_shapes(n=6, k=8, spread=0.3, seed=0):
    rng = RNG(seed)
    return rng.standard_normal((k, 3)) + spread * rng.standard_normal((n, k, 3))


def moved(shapes, seed=0):
    """Return shapes turned, in other sizes, at other places."""
    rng = RNG(seed)
    turns = Rotation.random(len(shapes), rng=rng).as_matrix()
    sizes = np.exp(rng.standard_normal(len(shapes)))[:, None, None]
    return sizes * shapes @ turns + 100 * rng.standard_normal((len(shapes), 1, 3))


def test_a_shape_that_is_moved_and_scaled_is_the_same_shape():
    shape = some_shapes(1)[0]
    fit = fit_procrustes(moved(np.stack([shape] * 5)))
    np.testing.assert_allclose(fit.shapes, np.stack([fit.mean] * 5), atol=1e-12)
    assert fit.distances().max() < 1e-7  # the root of rounding errors
    size = np.linalg.norm(shape - shape.mean(axis=0))
    np.testing.assert_allclose(np.linalg.norm(fit.mean), 1)
    np.testing.assert_allclose(fit_procrustes([shape, 3 * shape]).sizes, [size, 3 * size])


def test_a_mirror_image_is_another_shape():
    shape = some_shapes(1)[0]
    assert fit_procrustes([shape, shape * [-1, 1, 1]]).distances()[0, 1] > 0.1


def test_moving_specimens_changes_neither_shapes_nor_distances():
    shapes = some_shapes()
    one, two = fit_procrustes(shapes), fit_procrustes(moved(shapes))
    np.testing.assert_allclose(one.distances(), two.distances(), atol=1e-9)
    turn = Rotation.align_vectors(one.mean, two.mean)[0].as_matrix()
    np.testing.assert_allclose(two.shapes @ turn.T, one.shapes, atol=1e-7)


@pytest.mark.parametrize("unit", [1e-100, 1e100])
def test_sizes_are_in_the_unit_of_the_points_and_shapes_have_none(unit):
    shapes = some_shapes()
    one = fit_procrustes(shapes, curves=[[0, 1, 2, 3]])
    other = fit_procrustes(unit * shapes, curves=[[0, 1, 2, 3]])
    np.testing.assert_allclose(other.shapes, one.shapes, atol=1e-9)
    np.testing.assert_allclose(other.sizes / unit, one.sizes)


def test_distances_of_pairs_are_those_of_scipy():
    shapes = some_shapes()
    distances = fit_procrustes(moved(shapes)).distances()
    for i in range(6):
        for j in range(i):
            # scipy also finds the best size: its disparity is 1 - (Σ σ)², and d² = 2 - 2 Σ σ.
            expected = scipy_procrustes(shapes[i], shapes[j])[2]
            np.testing.assert_allclose(1 - (1 - distances[i, j] ** 2 / 2) ** 2, expected, atol=1e-9)


def test_no_other_turn_of_a_specimen_lies_nearer_to_the_mean():
    fit = fit_procrustes(moved(some_shapes()))
    np.testing.assert_allclose(
        fit.mean * np.linalg.norm(fit.shapes.mean(0)), fit.shapes.mean(0), atol=1e-9
    )
    gaps = np.linalg.norm(fit.shapes - fit.mean, axis=(1, 2))
    for turn in Rotation.random(50, rng=RNG(1)).as_matrix():
        assert (np.linalg.norm(fit.shapes @ turn - fit.mean, axis=(1, 2)) > gaps).all()


def test_a_specimen_with_exchanged_landmarks_is_found():
    shapes = some_shapes(20, spread=0.05)
    shapes[13, [0, 1]] = shapes[13, [1, 0]]
    shapes[4, 2] += 0.7
    assert set(fit_procrustes(moved(shapes)).outliers().tolist()) == {4, 13}
    assert fit_procrustes(moved(some_shapes(3))).outliers().size == 0


def test_an_affine_map_has_no_bending_energy_and_the_matrix_is_that_of_scipys_spline():
    rng = RNG(0)
    points, ends = rng.standard_normal((2, 9, 3))
    bending = splines.bending_matrix(points)
    affine = points @ rng.standard_normal((3, 3)) + 5
    assert np.abs(bending @ affine).max() < 1e-12
    assert np.linalg.eigvalsh(bending).min() > -1e-12
    assert np.linalg.matrix_rank(bending) == 9 - 4
    # A spline is Σ w_i (-|z - x_i|) and an affine map, with w = L Y.
    places = rng.standard_normal((40, 3))
    spline = RBFInterpolator(points, ends, kernel="linear", degree=1)
    rest = spline(places) + cdist(places, points) @ (bending @ ends)
    columns = np.column_stack([np.ones(40), places])
    np.testing.assert_allclose(
        columns @ np.linalg.lstsq(columns, rest, rcond=None)[0], rest, atol=1e-9
    )


def energies(shapes, mean):
    bending = splines.bending_matrix(mean)
    return np.einsum("nki,kl,nli->n", shapes, bending, shapes)


def scene(seed=0, n=5):
    """Return affine images of one scene, with its semilandmarks misplaced along a line and in a plane."""
    rng = RNG(seed)
    corners = np.concatenate([np.zeros((1, 3)), 3 * np.eye(3), [[3.0, 3, 3]]])
    line = np.linspace(corners[0], corners[4], 6)[1:-1]  # rows 5..8, between rows 0 and 4
    plane = np.column_stack([rng.uniform(0, 3, (5, 2)), np.zeros(5)])  # rows 9..13, on z = 0
    base = np.concatenate([corners, line, plane])
    wrong = np.repeat(base[None], n, axis=0)
    wrong[:, 5:9] += 0.2 * rng.uniform(-1, 1, (n, 4, 1)) * (corners[4] - corners[0]) / 5
    wrong[:, 9:, :2] += 0.3 * rng.uniform(-1, 1, (n, 5, 2))
    maps = np.eye(3) + 0.2 * rng.standard_normal((n, 3, 3))
    normals = np.full(wrong.shape, np.nan)
    normals[:, 9:] = np.linalg.inv(maps)[:, None, :, 2]  # covectors go by the inverse
    return wrong @ maps, [[0, 5, 6, 7, 8, 4]], normals


def test_semilandmarks_slide_until_nothing_but_an_affine_map_is_left():
    specimens, curves, normals = scene()
    fixed = fit_procrustes(specimens)
    assert energies(fixed.shapes, fixed.mean).min() > 1e-4
    slid = fit_procrustes(moved(specimens), curves=curves)
    on_line = fit_procrustes(specimens, curves=curves)
    np.testing.assert_allclose(slid.distances(), on_line.distances(), atol=1e-6)
    assert (energies(on_line.shapes, on_line.mean) < energies(fixed.shapes, fixed.mean)).all()
    both = fit_procrustes(specimens, curves=curves, normals=normals)
    assert energies(both.shapes, both.mean).max() < energies(fixed.shapes, fixed.mean).min() / 20
    assert both.distances()[0, 1] < fixed.distances()[0, 1]


def test_semilandmarks_stay_on_their_tangents_and_landmarks_where_they_are():
    specimens, curves, normals = scene()
    sliders, across = procrustes._sliders(specimens, curves, [], normals)
    assert sliders.rows.tolist() == [5, 6, 7, 8, *np.repeat(range(9, 14), 2).tolist()]
    assert sliders.patch.tolist() == list(range(9, 14))
    bending = splines.bending_matrix(specimens[1])
    slid = sliders.slide(specimens[0], across[0], specimens[1], bending)
    np.testing.assert_array_equal(slid[:5], specimens[0, :5])
    steps = slid - specimens[0]
    np.testing.assert_allclose(np.sum(steps[9:] * normals[0, 9:], axis=1), 0, atol=1e-12)
    # No further step along the tangents lowers the energy, or the distance.
    near = sliders.slide(specimens[0], across[0], specimens[1], np.eye(14))
    rng = RNG(0)
    line, plane = (
        np.diff(specimens[0, [0, 4]], axis=0),
        np.eye(3)
        - np.einsum(
            "ki,kj->kij", *2 * [across[0] / np.linalg.norm(across[0], axis=1, keepdims=True)]
        ),
    )
    for _ in range(50):
        step = np.zeros((14, 3))
        step[5:9] = 0.1 * rng.standard_normal((4, 1)) * line
        step[9:] = np.einsum("kij,kj->ki", plane, 0.1 * rng.standard_normal((5, 3)))
        least, other = energies(np.stack([slid, slid + step]), specimens[1])
        assert other > least
        assert np.linalg.norm(near + step - specimens[1]) > np.linalg.norm(near - specimens[1])


@pytest.mark.parametrize(
    ("form", "tag"),
    [("flat", tag) for tag in ("fix", "BE", "PD")]
    + [("solid", tag) for tag in ("fix", "BE", "PD", "sBE", "sPD")],
)
def test_semilandmarks_slide_as_in_geomorph(form, tag):
    known = json.loads(Path(__file__).with_name("gpagen.json").read_text())[form]
    fit = fit_procrustes(
        known["points"],
        curves=[] if tag == "fix" else known["curves"],
        surfaces=known["surfaces"] if tag.startswith("s") else [],
        minimize="distance" if tag.endswith("PD") else "bending",
    )
    found = known["results"][tag]
    # Without semilandmarks geomorph stops before the mean rests.
    tolerance = 1e-6 if tag == "fix" else 1e-12
    np.testing.assert_allclose(fit.mean, found["consensus"], atol=tolerance)
    np.testing.assert_allclose(fit.shapes[-1], found["last"], atol=tolerance)
    np.testing.assert_allclose(fit.sizes, found["sizes"], rtol=1e-13)


def test_a_patch_slides_across_known_normals_or_those_of_its_nearest_points():
    rng = RNG(0)
    plane = Rotation.random(rng=rng).as_matrix()
    shape = np.concatenate(
        [rng.uniform(-1, 1, (5, 2)) @ plane[:2], 9 * rng.standard_normal((3, 3))]
    )
    normals = np.full((1, 8, 3), np.nan)
    normals[:, :5] = plane[2]
    known, own = procrustes._sliders(shape[None], [], [], normals)
    guessed, none = procrustes._sliders(shape[None], [], range(5), None)
    assert known.patch.tolist() == guessed.patch.tolist() == list(range(5))
    onto_plane = np.eye(3) - np.outer(plane[2], plane[2])
    for sliders, across in ((known, own), (guessed, none)):
        pairs = sliders._planes(shape, across[0]).reshape(5, 2, 3)
        onto = pairs.swapaxes(1, 2) @ pairs
        np.testing.assert_allclose(onto, np.stack([onto_plane] * 5), atol=1e-12)


def test_a_planar_form_is_not_its_mirror_image():
    shapes = some_shapes() * [1, 1, 0] + [0, 0, 7]
    fit = fit_procrustes(shapes)
    np.testing.assert_array_equal(fit.shapes[..., 2], 0)
    assert fit_procrustes([shapes[0], shapes[0] * [-1, 1, 1]]).distances()[0, 1] > 0.1
    matrix, _, disparity = scipy_procrustes(shapes[0, :, :2], shapes[1, :, :2])
    assert matrix.shape == (8, 2)
    cosine = 1 - fit.distances()[0, 1] ** 2 / 2
    np.testing.assert_allclose(disparity, 1 - cosine**2)


def test_wrong_specimens_are_refused():
    shapes = some_shapes()
    broken = shapes.copy()
    broken[2, 3] = np.nan
    with pytest.raises(
        es.InvalidParameterError, match=r"point 3 of specimen 2 is .*Try estimate_missing"
    ):
        fit_procrustes(broken)
    assert fit_procrustes(es.morphometrics.estimate_missing(broken)).shapes.shape == shapes.shape
    broken[2] = 1.0
    with pytest.raises(
        es.InvalidParameterError, match="3 points or more that differ; specimen 2 has 1"
    ):
        fit_procrustes(broken)
    with pytest.raises(
        es.InvalidParameterError, match="3 points or more that differ; specimen 0 has 2"
    ):
        fit_procrustes(shapes[:, :2])
    with pytest.raises(
        es.InvalidParameterError, match="normals must have the shape of the specimens"
    ):
        fit_procrustes(shapes, normals=shapes[0])
    with pytest.raises(es.InvalidParameterError, match=r"curves\[0\] must lie in 0..7; it is 8"):
        fit_procrustes(shapes, curves=[[0, 8, 2]])
    with pytest.raises(
        es.InvalidParameterError, match="minimize must be 'bending' or 'distance'; it is 'BE'"
    ):
        inspect.unwrap(fit_procrustes)(shapes, minimize="BE")
    with pytest.raises(es.InvalidParameterError, match=r"surfaces must lie in 0..7; it is 8"):
        fit_procrustes(shapes, surfaces=[8])


def test_a_mean_that_does_not_rest_is_an_error(monkeypatch):
    monkeypatch.setattr(procrustes, "MOST_ROUNDS", 2)
    with pytest.raises(es.ConvergenceError, match="The mean shape must rest; after 2 rounds"):
        fit_procrustes(some_shapes())


def test_a_mesh_goes_with_its_landmarks():
    ball = es.icosphere(2)
    rng = RNG(0)
    starts = ball.vertices[rng.choice(ball.n_vertices, 12, replace=False)]
    ends = starts + 0.2 * rng.standard_normal(starts.shape)
    warped = es.morphometrics.warp_mesh(ball, starts, ends)
    places = [int(np.argmin(cdist(ball.vertices, [start]))) for start in starts]
    np.testing.assert_allclose(warped.vertices[places], ends, atol=1e-9)
    np.testing.assert_array_equal(warped.faces, ball.faces)
    grown = es.morphometrics.warp_mesh(ball, starts, 1.1 * starts)
    change = es.geometry.signed_distance(ball, grown.vertices)
    np.testing.assert_allclose(change, 0.1, atol=0.01)
    with pytest.raises(
        es.InvalidParameterError, match="as many ends as starts; there are 11 and 12"
    ):
        es.morphometrics.warp_mesh(ball, starts, ends[1:])
    with pytest.raises(
        es.InvalidParameterError, match="4 points or more that differ and lie in no plane"
    ):
        es.morphometrics.warp_mesh(ball, starts * [1, 1, 0], ends)
    with pytest.raises(es.InvalidParameterError, match="there are 3, and"):
        es.morphometrics.warp_mesh(ball, starts[:3], ends[:3])


def test_missing_points_come_from_the_mean_by_a_spline():
    shape = some_shapes(1)[0]
    affine = shape @ (np.eye(3) + 0.2 * RNG(2).standard_normal((3, 3))) + 4
    broken = affine.copy()
    broken[[1, 6]] = np.nan
    found = es.morphometrics.estimate_missing([shape, broken])
    np.testing.assert_allclose(found[1], affine, atol=1e-9)
    np.testing.assert_array_equal(found[0], shape)
    with pytest.raises(
        es.InvalidParameterError, match="specimen 0, which has most points, lacks point 1"
    ):
        es.morphometrics.estimate_missing(broken[None])
    broken[2:] = np.nan
    with pytest.raises(es.InvalidParameterError, match="Known points of specimen 1 must be 4"):
        es.morphometrics.estimate_missing([shape, broken])


@pytest.mark.data
def test_real_skulls_are_fitted(data):
    paths = sorted((data / "mice").glob("*.mrk.json"))
    if not paths:
        pytest.skip(f"no landmark files in {data / 'mice'}")
    skulls = {path.name: es.morphometrics.read_landmarks(path) for path in paths}
    fit = fit_procrustes(skulls)
    points = [skull.points for skull in skulls.values()]
    expected = scipy_procrustes(points[0], points[7])[2]
    found = 1 - (1 - fit.distances()[0, 7] ** 2 / 2) ** 2
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    # A skull is 24 mm long; the root mean square distance of its landmarks from their middle is 5 to 9 mm.
    assert ((fit.sizes / np.sqrt(51) > 5) & (fit.sizes / np.sqrt(51) < 9)).all()
    found = es.morphometrics.principal_components(fit.shapes)
    assert found.scores.shape == (len(points), len(points) - 1)
    growth = es.morphometrics.fit_allometry(fit.shapes, fit.sizes)
    assert growth.p_value < 0.01
    assert 0.02 < growth.share < 0.5


def test_a_mesh_is_not_bent_by_landmarks_of_another_unit_without_a_word():
    ball = es.icosphere(2)
    corners = es.shapes.box(1, 1, 1).points
    with pytest.warns(UserWarning, match="starts are 0.000866 times as large as the mesh"):
        es.morphometrics.warp_mesh(ball, corners / 1000, corners / 999)
