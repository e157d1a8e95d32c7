"""Arguments that no call can use are named: maps that are not finite, extreme units, names that are none."""

import subprocess
import sys

import numpy as np
import pytest

import eigenshape as es

BALL = es.icosphere(2)
SPECTRUM = es.solve_spectrum(es.cotangent_laplacian(BALL), 9)
CUBE = np.pad(np.ones((3, 3, 3), dtype=np.int64), 1)
SPECIMENS = np.random.default_rng(0).standard_normal((6, 5, 3))

STATISTICS = {
    "fit_procrustes": es.morphometrics.fit_procrustes,
    "principal_components": es.morphometrics.principal_components,
    "compare_groups": lambda x: es.morphometrics.compare_groups(x, list("aaabbb")),
    "fit_allometry": lambda x: es.morphometrics.fit_allometry(x, np.arange(1.0, 7.0)),
    "symmetric_components": lambda x: es.morphometrics.symmetric_components(x, [[0, 1]]),
    "estimate_missing": lambda x: es.morphometrics.estimate_missing(
        np.concatenate([x, np.where(np.arange(5)[:, None] == 0, np.nan, x[:1])])
    ),
    "warp_mesh": lambda x: es.morphometrics.warp_mesh(BALL, x[0], x[1]),
}


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize(
    "call",
    [
        lambda affine: es.calculus.voxel_surface(CUBE, affine),
        lambda affine: es.modes.structure_surfaces(CUBE, affine, {"a": 1}),
    ],
)
def test_a_map_that_is_not_finite_is_named(call, bad):
    affine = np.eye(4)
    affine[0, 1] = bad
    with pytest.raises(es.InvalidParameterError, match="to_space must be an affine map"):
        call(affine)


def test_a_tiny_map_that_turns_left_into_right_keeps_faces_outward():
    small = es.calculus.voxel_surface(CUBE, np.diag([-1e-120, 1e-120, 1e-120, 1]))
    usual = es.calculus.voxel_surface(CUBE, np.diag([-1.0, 1, 1, 1]))
    np.testing.assert_array_equal(small.faces, usual.faces)


@pytest.mark.parametrize("unit", [1e-300, 1e-200, 1e-130, 1e130, 1e200, 1e300])
@pytest.mark.parametrize("name", STATISTICS)
def test_statistics_of_an_extreme_unit_are_refused_with_a_remedy_that_works(name, unit):
    with pytest.raises(es.InvalidParameterError, match=r"extent of a specimen.*in another unit"):
        STATISTICS[name](unit * SPECIMENS)
    STATISTICS[name](unit * SPECIMENS / unit)


def test_scores_that_are_not_finite_are_named():
    found = es.morphometrics.principal_components(SPECIMENS)
    with pytest.raises(es.InvalidParameterError, match=r"scores must be finite; that of mode 1"):
        found.shape([0.0, np.inf])


@pytest.mark.parametrize(
    "call",
    [
        lambda: es.modes.wave_response(np.ones((4, 5)), SPECTRUM, 1e300),
        lambda: es.modes.wave_response(np.ones((4, 5)), SPECTRUM, 0.1, length_scale=1e300),
        lambda: es.modes.wave_response(np.ones((4, 5)), SPECTRUM, 0.1, damping=1e300),
        lambda: es.modes.blood_response(np.ones((4, 5)), 1e300),
    ],
)
def test_a_response_that_floats_cannot_represent_is_refused(call):
    with pytest.raises(es.InvalidParameterError, match="response must be finite; that of row"):
        call()


def test_steps_of_the_nonlinear_model_are_bounded():
    with pytest.raises(es.InvalidParameterError, match="dt must be at most 50000 s"):
        es.modes.blood_response(np.ones((1, 3)), 1e300, linear=False)


@pytest.mark.parametrize("unit", [1e-300, 1e-160, 1e160, 1e300])
def test_accuracies_and_nulls_do_not_depend_on_the_unit_of_maps(unit):
    maps = np.random.default_rng(0).standard_normal((BALL.n_vertices, 2))
    curve = es.modes.accuracy_curve(maps, SPECTRUM)
    np.testing.assert_allclose(es.modes.accuracy_curve(unit * maps, SPECTRUM), curve)
    mixed = es.modes.accuracy_curve(maps * [1, unit], SPECTRUM, weights=np.full(len(maps), unit))
    np.testing.assert_allclose(mixed, curve, rtol=1e-6)
    usual, extreme = (
        es.modes.rotation_nulls(
            scale * maps, SPECTRUM, 3, rng=np.random.default_rng(0), resample="affine"
        )
        for scale in (1.0, unit)
    )
    np.testing.assert_allclose(extreme / unit, usual, rtol=1e-6, atol=1e-9)


def test_energies_far_from_all_eigenvalues_see_the_nearest_one():
    waves = es.wave_kernel_signature(SPECTRUM, [1e300, -1e300, 1e40])
    assert np.isfinite(waves).all()
    np.testing.assert_allclose(waves[:, 0], waves[:, 2])
    narrow = es.wave_kernel_signature(SPECTRUM, [0.0], sigma=1e-300)
    np.testing.assert_allclose(narrow[:, 0], waves[:, 1])


def test_times_and_reaches_beyond_all_use_are_named():
    laplacian = es.cotangent_laplacian(es.icosphere(3))
    with pytest.raises(es.InvalidParameterError, match=r"1e\+40 is too long. Leave it out"):
        es.spectral.approximate_heat_signature(laplacian, 5, [0.1, 1e40])
    with pytest.raises(es.InvalidParameterError, match="reach must be at most the number"):
        es.operators.denoise(BALL, reach=1e300)
    assert es.stability.admissible_times(delta=1e300, spacing=0.1, eigenvalue=2.0).empty


def test_a_shape_without_a_text_as_its_name_is_refused(tmp_path):
    # In a process of its own: the type checks of these tests would speak before ours.
    calls = [
        "es.ShapeIndex.create('index').add(name, ball)",
        "es.retrieval.Item(name, 'a.ply')",
        "es.collections.build_collection({name: ball, 'b': ball}, 'of')",
        "es.modes.brain_print({name: ball})",
        "es.modes.structure_surfaces(np.ones((3, 3, 3), dtype=int), None, {name: 1})",
        "es.io.write_fields(ball, 'a.vtp', {name: np.ones(ball.n_vertices)})",
        "es.io.find_items([name])",
    ]
    script = ["import shutil, numpy as np, eigenshape as es", "ball = es.icosphere(2)"]
    for call in calls:
        script += [
            "for name in (None, 5, b'a'):",
            "    shutil.rmtree('index', ignore_errors=True)",
            "    try:",
            f"        {call}",
            "    except es.InvalidParameterError:",
            "        print('refused')",
        ]
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(script)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["refused"] * 3 * len(calls)
