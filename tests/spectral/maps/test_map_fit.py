"""Maps from descriptors: without pairs, told from mirror images, on whole and larger copies; and what is refused."""

import numpy as np
import pytest

import eigenshape as es
from certeig.kit import memory

HAND = es.make_creature("hand", 1, n_vertices=600)
TURN = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]
COPY = es.TriangleMesh(3 * HAND.vertices @ (TURN * np.linalg.det(TURN)).T, HAND.faces)
ITSELF = np.arange(HAND.n_vertices)


def solve(mesh, k=40):
    return es.solve_spectrum(es.cotangent_laplacian(mesh), k)


@pytest.fixture(scope="module")
def hand():
    return solve(HAND)


@pytest.fixture(scope="module")
def copy():
    return solve(COPY)


def refined_points(mapping, k=40):
    return es.spectral.point_map(es.spectral.refine_map(mapping, k))


@pytest.mark.parametrize("kind", ["waves", "heat"])
def test_a_copy_is_found_without_pairs(hand, copy, kind):
    found = es.functional_map(hand, copy, descriptors=kind, meshes=(HAND, COPY))
    assert np.array_equal(refined_points(found), ITSELF)


def test_own_descriptors_may_have_any_unit(hand, copy):
    one, two = (es.wave_kernel_signature(shape)[:, ::20] for shape in (hand, copy))
    first = es.functional_map(hand, copy, n_modes=10, descriptors=(one, two))
    second = es.functional_map(hand, copy, n_modes=10, descriptors=(one, 1e200 * two - 5e198))
    np.testing.assert_allclose(first.matrix, second.matrix, atol=1e-7)


@pytest.mark.parametrize("size", [1e-100, 1e100])
def test_the_map_does_not_depend_on_the_unit(hand, size):
    mesh = es.TriangleMesh(size * HAND.vertices, HAND.faces)
    found = es.functional_map(
        hand, solve(mesh), n_modes=10, descriptors="waves", meshes=(HAND, mesh)
    )
    signs = np.sign(np.diag(found.matrix))  # a tie for the largest entry may turn a mode over
    np.testing.assert_allclose(found.matrix, np.diag(signs), atol=1e-6)


def test_orientation_tells_a_shape_from_its_mirror_image():
    """An animal has one symmetry besides itself; with faces turned inward its mirror image is found."""
    shape = es.make_creature("quadruped", n_vertices=500)
    spectrum = solve(shape, 60)
    inward = es.TriangleMesh(shape.vertices, shape.faces[:, ::-1])
    centered = shape.vertices - shape.vertices.mean(axis=0)
    for target, handed in ((shape, 1), (inward, -1)):
        found = es.functional_map(
            spectrum, spectrum, n_modes=12, descriptors="waves", meshes=(shape, target)
        )
        turned = np.linalg.lstsq(centered, centered[refined_points(found)], rcond=None)[0]
        assert np.linalg.det(turned) == pytest.approx(
            handed, abs=0.2
        )  # vertices are not quite mirrored


def test_pairs_and_descriptors_work_together(hand, copy):
    pairs = np.column_stack([es.geometry.farthest_points(HAND, 4)[0]] * 2)
    found = es.functional_map(hand, copy, pairs, descriptors="waves")
    assert np.array_equal(refined_points(found), ITSELF)


def test_a_term_of_weight_0_is_left_out(hand, copy):
    both = {"n_modes": 10, "descriptors": "waves"}
    plain = es.functional_map(hand, copy, **both, products=0)
    for same in (
        es.functional_map(hand, copy, **both, products=0, orientation=0, meshes=(HAND, COPY)),
        es.functional_map(hand, copy, **both, products=1e-12),
    ):
        np.testing.assert_allclose(same.matrix, plain.matrix, atol=1e-6)


def test_between_different_shapes_a_bijective_map_reaches_more_of_the_source(hand):
    """And its matrix is nearer to an orthogonal one, which a bijection that keeps areas has."""
    animal = es.make_creature("quadruped", 2, n_vertices=600)
    start = es.functional_map(
        hand, solve(animal), n_modes=12, descriptors="waves", meshes=(HAND, animal)
    )
    maps = [es.spectral.refine_map(start, 40, bijective=each) for each in (False, True)]
    reached = [len(np.unique(es.spectral.point_map(each))) for each in maps]
    gaps = [np.linalg.norm(each.matrix @ each.matrix.T - np.eye(40)) for each in maps]
    assert reached[1] > reached[0]
    assert gaps[1] < gaps[0]


def test_bijective_refinement_finds_a_copy(hand, copy):
    start = es.functional_map(hand, copy, descriptors="waves", meshes=(HAND, COPY))
    for n_samples in (None, 150):
        found = es.spectral.refine_map(start, 40, bijective=True, n_samples=n_samples)
        assert np.array_equal(es.spectral.point_map(found), ITSELF)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "needs pairs, descriptors or both; there are none"),
        (
            {"pairs": [[0, 0]], "meshes": (HAND, HAND)},
            "meshes serve the orientation of descriptors",
        ),
        (
            {"descriptors": "wks"},
            'must be "waves", "heat" or a pair of arrays; the value is \'wks\'',
        ),
        ({"descriptors": (ITSELF,)}, "a pair of arrays, one for each shape; the value is a tuple"),
        (
            {"descriptors": (ITSELF, ITSELF[:-1])},
            r"descriptors\[1\] must hold one number per point",
        ),
        (
            {"descriptors": (HAND.vertices, HAND.vertices[:, :2])},
            "as many functions on the source as on the target; there are 3 and 2",
        ),
        ({"descriptors": (ITSELF, 0 * ITSELF + 7)}, "must vary on both shapes"),
        (
            {"descriptors": "waves", "meshes": (HAND,)},
            "meshes must be a pair, the source and the target",
        ),
        (
            {"descriptors": "waves", "meshes": (HAND, es.icosphere(1))},
            r"meshes\[1\] has 42, and its spectrum 600",
        ),
        (
            {"descriptors": "waves", "products": -1.0},
            "products must be one number, at least 0; it is -1.0",
        ),
    ],
)
def test_refused(hand, options, message):
    with pytest.raises(es.InvalidParameterError, match=message):
        es.functional_map(hand, hand, **options)


def test_equations_that_do_not_fit_into_memory_are_refused(hand, monkeypatch):
    monkeypatch.setattr(memory, "machine_memory", lambda: 1e6)
    with pytest.raises(es.InvalidParameterError, match="Take fewer modes, and extend the map"):
        es.functional_map(hand, hand, n_modes=20, descriptors="waves")
