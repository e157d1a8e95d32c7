import warnings
from dataclasses import replace

import numpy as np
import pytest
from exact_quadratures import sphere_quadrature, torus_quadrature
from scipy.special import eval_legendre

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.samples.quadrature import Quadrature, shape_quadrature
from eigenshape.geometry.simplices import dual_volumes, mean_side_length
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.operators.clouds import kernel
from eigenshape.operators.clouds.gaussian import (
    functional_laplacian,
    gaussian_laplacian,
    mesh_laplacian,
    pointwise_time,
    quadrature_laplacian,
)
from eigenshape.shapes.domains import box, circle
from eigenshape.shapes.spheres import random_sphere
from eigenshape.shapes.surfaces import grid, icosphere


def by_the_book(points, weights, t, dim):
    """Thesis 2.1, entry by entry: L f(x_i) = 1/(t (4πt)^{m/2}) Σ_j A_j exp(-|x_i - x_j|²/4t) (f_i - f_j)."""
    squares = ((points[:, None] - points) ** 2).sum(axis=2)
    matrix = -weights * np.exp(-squares / (4 * t)) / (t * (4 * np.pi * t) ** (dim / 2))
    np.fill_diagonal(matrix, 0)
    np.fill_diagonal(matrix, -matrix.sum(axis=1))
    return matrix


def test_the_mesh_laplacian_is_the_one_of_the_book():
    mesh = icosphere(2)
    t = mean_side_length(mesh) ** 2
    found = mesh_laplacian(mesh, cutoff=20.0)
    assert found.kernel.t == pytest.approx(t, rel=1e-14)
    expected = by_the_book(mesh.vertices, dual_volumes(mesh), t, 2)
    matrix = found.stiffness.toarray() / found.mass.diagonal()[:, None]
    np.testing.assert_allclose(matrix, expected, rtol=1e-11, atol=1e-12 * expected.max())


def test_the_graph_laplacian_is_the_one_of_the_book():
    points = np.random.default_rng(0).random((80, 3))
    found = gaussian_laplacian(points, 0.05, 2, cutoff=30.0)
    expected = by_the_book(points, np.full(80, 1 / 80), 0.05, 2)
    np.testing.assert_allclose(
        found.stiffness.toarray() * 80, expected, rtol=1e-11, atol=1e-12 * expected.max()
    )
    assert found.mass.diagonal().tolist() == [1 / 80] * 80


def test_a_scale_has_three_names():
    mesh = icosphere(2)
    e = mean_side_length(mesh)
    one, two, three = (
        mesh_laplacian(mesh),
        mesh_laplacian(mesh, h=2 * e),
        mesh_laplacian(mesh, t=e**2),
    )
    for other in (two, three):
        assert other.kernel.t == pytest.approx(one.kernel.t, rel=1e-14)
        assert other.kernel.edge_factor == pytest.approx(2, rel=1e-14)
        assert other.kernel.width == pytest.approx(2 * e, rel=1e-14)
        np.testing.assert_allclose(other.stiffness.data, one.stiffness.data, rtol=1e-12)


def test_the_random_walk_form_changes_the_mass_alone():
    mesh = icosphere(2)
    literal, walk = mesh_laplacian(mesh), mesh_laplacian(mesh, form="random-walk")
    assert (literal.stiffness != walk.stiffness).nnz == 0
    weights, t = dual_volumes(mesh), literal.kernel.t
    squares = ((mesh.vertices[:, None] - mesh.vertices) ** 2).sum(axis=2)
    gaussian = (
        np.exp(-squares / (4 * t)) / (4 * np.pi * t) * (squares <= (4 * literal.kernel.width) ** 2)
    )
    np.testing.assert_allclose(walk.mass.diagonal(), weights * (gaussian @ weights), rtol=1e-12)
    np.testing.assert_array_equal(literal.mass.diagonal(), weights)


def test_on_flat_ground_both_distances_are_one():
    mesh = grid(16, 16)
    straight, along = (
        mesh_laplacian(mesh, distance=distance) for distance in ("euclidean", "geodesic")
    )
    np.testing.assert_allclose(along.stiffness.toarray(), straight.stiffness.toarray(), atol=1e-12)
    np.testing.assert_allclose(along.mass.diagonal(), straight.mass.diagonal())


def test_a_kernel_along_the_surface_does_not_leak_between_sheets():
    sheet = grid(20, 20)
    folded = np.array([[x, y, 0.0] if x <= 0.5 else [1 - x, y, 0.02] for x, y, _ in sheet.vertices])
    mesh = TriangleMesh(folded, sheet.faces)
    low, high = 2 * 21 + 10, 18 * 21 + 10
    assert mesh_laplacian(mesh).stiffness[low, high] < -1e-3
    assert mesh_laplacian(mesh, distance="geodesic").stiffness[low, high] == 0


@pytest.mark.parametrize("size", [1e-100, 1e-30, 1e30, 1e100])
@pytest.mark.parametrize("options", [{}, {"form": "random-walk"}, {"distance": "geodesic"}])
def test_units_scale_exactly(size, options):
    mesh = icosphere(2)
    one = mesh_laplacian(mesh, **options)
    other = mesh_laplacian(TriangleMesh(size * mesh.vertices, mesh.faces), **options)
    np.testing.assert_allclose(other.stiffness.data, one.stiffness.data, rtol=1e-11)
    np.testing.assert_allclose(other.mass.diagonal() / size / size, one.mass.diagonal(), rtol=1e-12)
    assert other.kernel.edge_factor == pytest.approx(one.kernel.edge_factor, rel=1e-12)


def test_curves_and_volumes_have_one_too():
    line = SimplicialMesh(
        np.linspace(0, 1, 40)[:, None], np.column_stack([np.arange(39), np.arange(1, 40)])
    )
    found = mesh_laplacian(line)
    x = line.points[:, 0]
    middle = (found.stiffness @ x**2 / found.mass.diagonal())[15:25]
    np.testing.assert_allclose(middle, -2, rtol=0.01)  # Δ x² = -2 with our sign


def test_entries_beyond_floats_are_refused():
    points = 1e-90 * np.random.default_rng(0).random((30, 3))
    with pytest.raises(
        InvalidShapeError, match=r"Entries of a kernel matrix must be floats; theirs are about 2\^1"
    ):
        gaussian_laplacian(points, 1e-180, 3)


@pytest.mark.parametrize("degree", [1, 2, 5])
@pytest.mark.parametrize("t", [0.02, 0.1])
def test_the_functional_approximation_on_the_sphere_is_exact(degree, t):
    measure = sphere_quadrature(48)
    harmonic = eval_legendre(degree, measure.points[:, 2])
    found = functional_laplacian(measure, t) @ harmonic
    np.testing.assert_allclose(
        found, es.shapes.sphere_functional_eigenvalues(degree**2 + 1, t)[-1] * harmonic, atol=1e-9
    )


@pytest.mark.long
def test_the_functional_tends_to_the_operator_as_t_shrinks():
    measure = sphere_quadrature(60)
    field = eval_legendre(2, measure.points[:, 2])
    errors = [
        np.abs(functional_laplacian(measure, t) @ field - 6 * field).max()
        for t in (0.04, 0.02, 0.01)
    ]
    np.testing.assert_allclose(
        np.log2(errors[:-1]) - np.log2(errors[1:]), 1, atol=0.1
    )  # first order in t


@pytest.mark.long
def test_the_functional_on_a_torus_does_not_depend_on_the_nodes():
    one, two = torus_quadrature(80, 40), torus_quadrature(160, 80)
    field = lambda points: points[:, 0] ** 2 + points[:, 2]  # noqa: E731
    coarse = functional_laplacian(one, 0.01) @ field(one.points)
    fine = functional_laplacian(two, 0.01) @ field(two.points)
    np.testing.assert_allclose(fine.reshape(160, 80)[::2, ::2].ravel(), coarse, atol=1e-8)


def test_the_pointwise_time_has_no_unit_of_its_own():
    # 0.3 R² (e/R)^p with p = 10/11, 1 and 14/13 in dimensions 1, 2 and 3; R of a circle is its radius.
    ring, sphere, solid = circle(500), icosphere(4), box(4, 4, 4)
    e = mean_side_length(ring)
    assert pointwise_time(ring) == pytest.approx(0.3 * e ** (10 / 11), rel=1e-3)
    assert pointwise_time(sphere) == pytest.approx(0.3 * mean_side_length(sphere), rel=1e-3)
    radius = (1 / (2 * np.pi**2)) ** (1 / 3)
    power = (mean_side_length(solid) / radius) ** (14 / 13)
    assert pointwise_time(solid) == pytest.approx(0.3 * radius**2 * power, rel=1e-12)
    for scale in (1e-100, 3.0, 1e100):
        scaled = TriangleMesh(sphere.vertices * scale, sphere.faces)
        assert pointwise_time(scaled) == pytest.approx(pointwise_time(sphere) * scale**2, rel=1e-12)


def test_at_the_pointwise_time_functions_converge_on_random_points():
    errors = []
    for n in (250, 1000):
        mesh = random_sphere(n, rng=np.random.default_rng(0))
        laplacian = mesh_laplacian(mesh, t="pointwise")
        assert laplacian.kernel.t == pointwise_time(mesh)
        z = mesh.vertices[:, 2]
        applied = laplacian.stiffness @ z / laplacian.mass.diagonal()
        errors.append(np.abs(applied - 2 * z).max())
    assert errors[1] < 0.85 * errors[0] < 0.3


def test_another_text_is_no_time():
    with pytest.raises(InvalidParameterError, match="t must be a heat time or 'pointwise'; it is"):
        _plain(mesh_laplacian)(icosphere(1), t="best")
    with pytest.raises(InvalidParameterError, match="At most one of t, h and edge_factor must be"):
        mesh_laplacian(icosphere(1), t="pointwise", h=0.5)


def test_without_a_matrix_it_is_the_same():
    mesh = icosphere(3)
    measure, stored = shape_quadrature(mesh), mesh_laplacian(mesh)
    fields = np.random.default_rng(0).normal(size=(mesh.n_vertices, 3))
    product = functional_laplacian(measure, stored.kernel.t, cutoff=4.0) @ fields
    np.testing.assert_allclose(
        measure.weights[:, None] * product, stored.stiffness @ fields, atol=1e-11
    )
    one = functional_laplacian(measure, stored.kernel.t, cutoff=4.0) @ fields[:, 0]
    np.testing.assert_array_equal(one, product[:, 0])


def test_weights_that_are_volumes_make_the_mesh_laplacian():
    mesh = icosphere(2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = quadrature_laplacian(shape_quadrature(mesh), mesh_laplacian(mesh).kernel.t)
    assert abs(found.stiffness - mesh_laplacian(mesh).stiffness).max() < 1e-15


@pytest.mark.parametrize(
    ("options", "match"),
    [
        (
            {"t": 1.0, "h": 1.0},
            r"At most one of t, h and edge_factor must be given; given are \{'t': 1.0, 'h': 1.0\}",
        ),
        ({"t": 0.0}, "t must be positive and finite; entry 0 is 0.0"),
        ({"h": -1.0}, "h must be positive"),
        ({"edge_factor": np.nan}, "edge_factor must be positive and finite; entry 0 is nan"),
        (
            {"edge_factor": 0.9},
            r"A kernel must reach the neighbors, h ≥ e; h = 2√t is 0.9 of the mean edge length",
        ),
        ({"cutoff": 0.0}, "cutoff must be positive"),
    ],
)
def test_scales_that_cannot_be_are_refused(options, match):
    with pytest.raises(InvalidParameterError, match=match):
        mesh_laplacian(icosphere(2), **options)


@pytest.mark.parametrize(
    ("option", "match"),
    [
        ({"correct": "exp"}, "correct must be None or 'log'; it is 'exp'"),
        ({"form": "other"}, "form must be 'literal' or 'random-walk'; it is 'other'"),
    ],
)
def test_unknown_options_are_refused(option, match):
    options = kernel.KernelOptions()
    with pytest.raises(InvalidParameterError, match=match):
        kernel.choose_kernel(_unchecked(options, option), 1.0)


def _unchecked(options, changed):
    """Return options as somebody without a type checker would give them."""
    copy = replace(options)
    for name, value in changed.items():
        object.__setattr__(copy, name, value)
    return copy


def test_a_narrow_kernel_is_warned_of():
    with pytest.warns(UserWarning, match=r"A kernel of width h = 1.2 e suits regular points only"):
        mesh_laplacian(icosphere(2), edge_factor=1.2)


def test_a_time_that_leaves_nothing_is_warned_of():
    with pytest.warns(
        UserWarning,
        match="t = 2 about 1 eigenvalues .* k eigenvalues of a surface need n > 5 k t/e² points",
    ):
        mesh_laplacian(icosphere(2), t=2.0)


def test_weights_of_one_over_n_are_corrected_in_the_random_walk_form_only():
    with pytest.raises(
        InvalidParameterError, match="A correction of weights 1/n needs the random-walk form"
    ):
        gaussian_laplacian(np.random.default_rng(0).random((50, 2)), 0.1, 2, correct="log")


def test_a_point_out_of_reach_is_named():
    points = np.vstack([np.random.default_rng(0).random((60, 2)), [[9.0, 9.0]]])
    with pytest.raises(
        InvalidShapeError, match=r"has none within \S+ \(1 such\)\. Choose a larger t"
    ) as caught:
        gaussian_laplacian(points, 0.2, 2)
    assert "point 60 at [9.0, 9.0]" in str(caught.value)


def test_a_component_that_falls_apart_is_refused():
    spheres = disjoint_union(
        icosphere(2),
        TriangleMesh(icosphere(2).vertices + np.array([3.0, 0, 0]), icosphere(2).faces),
    )
    mesh_laplacian(spheres)  # two components are two parts
    strip = np.vstack(
        [spheres.faces, [[0, spheres.n_vertices // 2, 1]]]
    )  # one long triangle joins them
    with pytest.raises(
        InvalidShapeError, match=r"at t = \S+ component 0 falls into 2 parts \(2 in all\)"
    ):
        mesh_laplacian(TriangleMesh(spheres.vertices, strip), edge_factor=1.6, cutoff=1.5)


def test_a_matrix_beyond_memory_is_refused_before_it_is_built(monkeypatch):
    monkeypatch.setattr("certeig.kit.memory.machine_memory", lambda: 1e6)
    with pytest.raises(
        InvalidShapeError, match=r"50 % of the memory, 0.0 GiB; for \S+ entries, \d+ a row"
    ):
        mesh_laplacian(icosphere(3))


def test_too_small_and_equal_samples_are_refused():
    with pytest.raises(
        InvalidShapeError, match="A sample of dimension 2 must have over 6 points; it has 6"
    ):
        quadrature_laplacian(Quadrature(np.eye(6), None, 2), 1.0)
    with pytest.raises(
        InvalidShapeError, match=r"The points of a sample must differ; all 9 are \[1.0, 1.0\]"
    ):
        quadrature_laplacian(Quadrature(np.ones((9, 2)), np.ones(9), 2), 1.0)


def test_distance_is_one_of_two():
    with pytest.raises(
        InvalidParameterError, match="distance must be 'euclidean' or 'geodesic'; it is 'taxi'"
    ):
        _plain(mesh_laplacian)(icosphere(1), distance="taxi")


def _plain(function):
    return getattr(function, "__wrapped__", function)


def test_a_literal_graph_laplacian_records_the_volume_that_its_kernel_sees():
    points = 3 * es.shapes.fibonacci_sphere(600).vertices
    literal = es.operators.gaussian_laplacian(points, 0.5, 2)
    assert literal.kernel.volume == pytest.approx(4 * np.pi * 9, rel=0.03)
    walk = es.operators.gaussian_laplacian(points, 0.5, 2, form="random-walk")
    assert walk.kernel.volume == 1  # of weights 1/n, by which nothing is divided


@pytest.mark.long
@pytest.mark.parametrize("size", [1e-30, 1.0, 1e30])
def test_graph_laplacians_know_the_volume_that_their_eigenvalues_are_over(size):
    points = size * es.shapes.fibonacci_sphere(1500).vertices
    laplacian = es.operators.gaussian_laplacian(points, 0.02 * size**2, 2)
    assert laplacian.kernel.volume == pytest.approx(4 * np.pi * size**2, rel=0.02)
    es.solve_spectrum(
        laplacian, 20
    )  # whose eigenvalues are far from the last: no warning at any size
    with pytest.warns(UserWarning, match=r"too close to 1/\(t × volume\)"):
        es.solve_spectrum(laplacian, 200)


@pytest.mark.parametrize("scale", [1.0, 1e-40, 1e40])
@pytest.mark.parametrize(
    ("flat", "place"), [(1, "on a line"), (2, "in a plane"), (3, "in a flat of 3 dimensions")]
)
def test_points_must_span_the_dimension_that_they_sample(scale, flat, place):
    rng = np.random.default_rng(7)
    points = scale * (
        rng.random((60, flat)) @ rng.standard_normal((flat, 5)) + rng.standard_normal(5)
    )
    fact = rf"The points of a sample must span {flat + 1} dimensions; all 60 lie {place} through point 0"
    with pytest.raises(InvalidShapeError, match=fact):
        quadrature_laplacian(Quadrature(points, None, flat + 1), scale**2)
    assert quadrature_laplacian(Quadrature(points, None, flat), scale**2).n_points == 60


@pytest.mark.long
def test_what_converges_depends_on_how_t_falls():
    # As the docstring of mesh_laplacian says: L z of the unit sphere should be 2z.
    worst = {"e²": [], "e/10": []}
    for n in (1000, 4000, 16000):
        mesh = es.shapes.random_sphere(n, rng=np.random.default_rng(0))
        edge, z = mean_side_length(mesh), mesh.vertices[:, 2]
        for name, t in (("e²", edge**2), ("e/10", edge / 10)):
            laplacian = mesh_laplacian(mesh, t=t)
            applied = laplacian.stiffness @ z / laplacian.mass.diagonal()
            worst[name].append(np.abs(applied - 2 * z).max())
    assert worst["e²"][2] > 2 * worst["e²"][0]
    assert worst["e/10"][2] < worst["e/10"][0] / 2
