import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.samples.quadrature import shape_quadrature
from eigenshape.geometry.samples.spacing import neighbor_distance
from eigenshape.operators.catalog import build_laplacian
from eigenshape.operators.clouds import cloud_kernel
from eigenshape.operators.clouds.cloud_kernel import cloud_width, point_cloud_laplacian
from eigenshape.operators.clouds.gaussian import gaussian_laplacian
from eigenshape.shapes.exact import sphere_eigenvalues
from eigenshape.shapes.spheres import (
    fibonacci_sphere,
    random_sphere,
    three_sphere,
    uneven_sphere,
)
from eigenshape.spectral.solve import solve_spectrum


@pytest.mark.parametrize("mesh", [fibonacci_sphere(1500), uneven_sphere(1500)])
@pytest.mark.parametrize("form", ["literal", "random-walk"])
def test_points_hear_the_sphere_also_at_uneven_density(mesh, form):
    laplacian = point_cloud_laplacian(PointCloud(mesh.vertices), correct="log", form=form)
    found = solve_spectrum(laplacian, 16).eigenvalues
    np.testing.assert_allclose(found, sphere_eigenvalues(16), rtol=0.03, atol=1e-8)


def test_the_graph_laplacian_does_not_bear_uneven_density():
    points = uneven_sphere(1500).vertices
    t = point_cloud_laplacian(PointCloud(points)).kernel.t
    found = solve_spectrum(
        gaussian_laplacian(points, t, 2, correct="log", form="random-walk"), 16
    ).eigenvalues
    assert (
        np.abs(found[1:] / sphere_eigenvalues(16)[1:] - 1).max() > 0.1
    )  # it hears the density as well


def test_the_mass_is_the_measure_of_the_cloud():
    cloud = PointCloud(fibonacci_sphere(300).vertices)
    np.testing.assert_array_equal(
        point_cloud_laplacian(cloud, form="literal").mass.diagonal(),
        shape_quadrature(cloud).weights,
    )


def sphere_error(points, **options):
    found = solve_spectrum(point_cloud_laplacian(PointCloud(points), **options), 36).eigenvalues
    return float(np.median(np.abs(found[1:] / sphere_eigenvalues(36)[1:] - 1)))


THESIS = {"edge_factor": 2, "correct": None, "form": "literal"}


@pytest.mark.long
def test_the_defaults_are_more_accurate_than_the_thesis_form():
    even = fibonacci_sphere(1500).vertices
    random = random_sphere(1500, rng=np.random.default_rng(1)).vertices
    heights = 1 + 0.02 * np.random.default_rng(0).standard_normal((1500, 1))
    for points in (even, uneven_sphere(1500).vertices, random, even * heights):
        assert sphere_error(points) < 0.5 * sphere_error(points, **THESIS)


@pytest.mark.long
def test_errors_on_random_points_decrease_with_their_number():
    clouds = [random_sphere(n, rng=np.random.default_rng(2)).vertices for n in (800, 3200)]
    few, many = (sphere_error(points) for points in clouds)
    fixed_few, fixed_many = (sphere_error(points, edge_factor=2) for points in clouds)
    # Theory: e^{4/3}, 2.5 times less for four times as many points; with h = 2e hardly less.
    assert many < few / 2.5
    assert fixed_many > fixed_few / 1.5


def test_the_width_of_even_points_is_two_edges_and_of_random_ones_more():
    for even in (fibonacci_sphere(1500).vertices, uneven_sphere(1500).vertices):
        assert cloud_width(PointCloud(even)) == 2 * neighbor_distance(even, 2)
    random = random_sphere(4000, rng=np.random.default_rng(1)).vertices
    cloud = PointCloud(random)
    width = cloud_width(cloud)
    assert 2.4 < width / neighbor_distance(random, 2) < 2.8
    assert point_cloud_laplacian(cloud).kernel.width == pytest.approx(width, rel=1e-12)
    for size in (1e-90, 1e90):
        assert cloud_width(PointCloud(size * random)) == pytest.approx(size * width, rel=1e-9)


def test_a_wide_kernel_does_not_reach_more_than_a_thousand_points(monkeypatch):
    cloud = PointCloud(random_sphere(4000, rng=np.random.default_rng(1)).vertices)
    free = cloud_width(cloud)
    monkeypatch.setattr(cloud_kernel, "MOST_REACHED", 300)
    assert 2 * neighbor_distance(cloud.points, 2) < cloud_width(cloud) < free
    laplacian = point_cloud_laplacian(cloud)
    assert laplacian.stiffness.nnz / cloud.n_points == pytest.approx(300, rel=0.1)


def test_random_points_of_a_circle_have_its_eigenvalues():
    angles = 2 * np.pi * np.sort(np.random.default_rng(5).random(1000))
    circle = PointCloud(np.column_stack([np.cos(angles), np.sin(angles)]), 1)
    exact = np.array([1.0, 1, 4, 4, 9, 9])
    found = solve_spectrum(point_cloud_laplacian(circle), 7).eigenvalues[1:]
    np.testing.assert_allclose(found, exact, rtol=0.02)
    # With h = 2e the gaps between the points nearly separate the circle into pieces.
    with pytest.warns(UserWarning, match="over half of the heat stays"):
        torn = point_cloud_laplacian(circle, edge_factor=2)
    narrow = solve_spectrum(torn, 7).eigenvalues[1:]
    assert (narrow < 0.2 * exact).all()


def half_thinned(ratio, seed=0):
    """Return random points of a sphere, of whose lower half one in `ratio` is left."""
    random = np.random.default_rng(seed)
    points = random.standard_normal((4000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    kept = (points[:, 2] > 0) | (random.random(4000) < 1 / ratio)
    return PointCloud(points[kept], 2)


@pytest.mark.parametrize("ratio", [1, 2, 3, 5])
def test_a_density_that_varies_a_little_is_no_fault(ratio):
    laplacian = build_laplacian(half_thinned(ratio))  # warnings are errors
    assert laplacian.kernel is not None
    assert solve_spectrum(laplacian, 2).eigenvalues[1] == pytest.approx(2, rel=0.1)


@pytest.mark.parametrize(("ratio", "wrong"), [(10, 0.8), (20, 0.3), (100, 0.01)])
def test_points_beyond_the_reach_of_the_kernel_are_named_and_get_the_robust_operator(ratio, wrong):
    cloud = half_thinned(ratio)
    with pytest.warns(UserWarning, match=r"over half of the heat stays at \d+ points.*robust_lapl"):
        kernel = point_cloud_laplacian(cloud)
    found = solve_spectrum(kernel, 2).eigenvalues[1]
    assert found < 2 * wrong
    with pytest.warns(UserWarning, match="too uneven for a kernel of one width"):
        robust = build_laplacian(cloud)
    assert 1.2 < solve_spectrum(robust, 2).eigenvalues[1] < 2
    # There is no robust operator in R^4.
    flat = PointCloud(np.column_stack([cloud.points, np.zeros(cloud.n_points)]), 2)
    with pytest.warns(UserWarning, match="over half of the heat stays"):
        same = build_laplacian(flat)
    assert solve_spectrum(same, 2).eigenvalues[1] == pytest.approx(found, rel=1e-6, abs=1e-9)


@pytest.mark.long
def test_a_three_sphere_from_points_alone():
    laplacian = point_cloud_laplacian(
        PointCloud(three_sphere(1500).points, 3), edge_factor=1.6, correct="log"
    )
    found = solve_spectrum(laplacian, 5).eigenvalues
    np.testing.assert_allclose(found, sphere_eigenvalues(5, 3), rtol=0.12, atol=1e-8)


@pytest.mark.parametrize("size", [1e-100, 1e100])
def test_units_scale_exactly(size):
    points = fibonacci_sphere(200).vertices
    one, other = (point_cloud_laplacian(PointCloud(scale * points)) for scale in (1.0, size))
    np.testing.assert_allclose(other.stiffness.data, one.stiffness.data, rtol=1e-8)
    np.testing.assert_allclose(other.mass.diagonal() / size / size, one.mass.diagonal(), rtol=1e-9)


def test_two_clouds_are_two_components_and_one_that_is_torn_is_refused():
    ball = fibonacci_sphere(200).vertices
    two = PointCloud(np.vstack([ball, ball + np.array([9.0, 0, 0])]))
    values = solve_spectrum(point_cloud_laplacian(two), 3).eigenvalues
    np.testing.assert_allclose(values[:2], 0, atol=1e-10)
    assert values[2] > 1
    # A curve of two dense ends and a long sparse middle: its mean distance of neighbors says nothing of the middle.
    steps = np.concatenate([np.linspace(0, 1, 200), [4.0, 7.0], np.linspace(10, 11, 200)])
    curve = PointCloud(np.column_stack([steps, 0.01 * steps**2]), 1)
    with pytest.raises(
        InvalidShapeError, match=r"has none within \S+ \(2 such\)\. Choose a larger t"
    ):
        point_cloud_laplacian(curve)


def test_scales_are_as_for_meshes():
    cloud = PointCloud(fibonacci_sphere(200).vertices)
    with pytest.raises(
        InvalidParameterError, match="At most one of t, h and edge_factor must be given"
    ):
        point_cloud_laplacian(cloud, t=1.0, h=1.0)
    with pytest.raises(
        InvalidParameterError, match=r"A kernel must reach the neighbors, h ≥ e; h = 2√t is 0\.5"
    ):
        point_cloud_laplacian(cloud, edge_factor=0.5)
    for size in np.random.default_rng(0).uniform(1, 9, 9):
        other = PointCloud(size * cloud.points)
        with pytest.raises(InvalidParameterError, match="Choose t = e² = ") as refusal:
            point_cloud_laplacian(other, t=1e-6)
        named = float(str(refusal.value).split("e² = ")[1].split(",")[0])
        assert point_cloud_laplacian(other, t=named).n_points == 200
