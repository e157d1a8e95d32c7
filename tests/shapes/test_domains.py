import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.measure import enclosed_volume, face_normals
from eigenshape.geometry.requirements import require_volumes
from eigenshape.geometry.simplices import simplex_volumes
from eigenshape.geometry.topology import (
    boundary_vertices,
    is_closed,
    is_manifold,
    unreferenced_vertices,
)
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes import exact
from eigenshape.shapes.domains import ball, box, circle, disc, interval, irregular_grid
from eigenshape.shapes.spheres import (
    fibonacci_sphere,
    projective_plane,
    random_sphere,
    sphere_hull,
    three_sphere,
    uneven_sphere,
)
from eigenshape.shapes.surfaces import icosphere
from eigenshape.spectral.solve import solve_spectrum

RNG = np.random.default_rng
QUALITY = 0.45  # of the worst tetrahedron of a ball; it falls to 0.50 as n grows, 0.51 at n = 40
DOMAINS = {
    "interval": (lambda: interval(40, 2.0), 2.0, 0, exact.box_eigenvalues(8, [2.0])),
    "circle": (lambda: circle(60), 2 * np.pi, 1e-3, exact.sphere_eigenvalues(9, 1)),
    "disc": (lambda: disc(16), np.pi, 1e-3, exact.disc_eigenvalues(15)),
    "irregular": (lambda: irregular_grid(24, 20, rng=RNG(0)), 1.0, 0, exact.box_eigenvalues(15)),
    "box": (lambda: box(9, 14, 9, sides=(1, 2, 1)), 2.0, 0, exact.box_eigenvalues(10, (1, 2, 1))),
    "ball": (lambda: ball(12), 4 / 3 * np.pi, 0.01, exact.ball_eigenvalues(9)),
    "fibonacci": (lambda: fibonacci_sphere(1500), 4 * np.pi, 0.003, exact.sphere_eigenvalues(25)),
    "random": (
        lambda: random_sphere(1500, rng=RNG(0)),
        4 * np.pi,
        0.006,
        exact.sphere_eigenvalues(25),
    ),
    "uneven": (lambda: uneven_sphere(1500), 4 * np.pi, 0.004, exact.sphere_eigenvalues(25)),
    "three-sphere": (
        lambda: three_sphere(2500),
        2 * np.pi**2,
        0.03,
        exact.sphere_eigenvalues(14, 3),
    ),
    "projective plane": (
        lambda: projective_plane(3),
        2 * np.pi,
        0.012,
        exact.projective_plane_eigenvalues(15),
    ),
}


@pytest.mark.parametrize("name", DOMAINS)
def test_each_has_its_volume_and_its_spectrum(name):
    make, volume, lost, eigenvalues = DOMAINS[name]
    mesh = make()
    require_volumes(mesh)
    assert not unreferenced_vertices(mesh).size
    assert (
        -lost - 1e-12 <= simplex_volumes(mesh).sum() / volume - 1 <= 1e-12
    )  # inscribed: never too much
    found = solve_spectrum(cotangent_laplacian(mesh, "averaged"), len(eigenvalues)).eigenvalues
    np.testing.assert_allclose(found, eigenvalues, rtol=0.035, atol=1e-8)


@pytest.mark.parametrize(
    ("mesh", "eigenvalues"),
    [
        (disc(16), exact.disc_eigenvalues(10, "dirichlet")),
        (box(10, 10, 10), exact.box_eigenvalues(7, (1, 1, 1), "dirichlet")),
        (ball(14), exact.ball_eigenvalues(9, "dirichlet")),
        (interval(50), exact.box_eigenvalues(5, [1.0], "dirichlet")),
    ],
)
def test_held_at_their_boundary_they_are_drums(mesh, eigenvalues):
    laplacian = cotangent_laplacian(mesh, "averaged")
    found = solve_spectrum(laplacian, len(eigenvalues), fixed=boundary_vertices(mesh)).eigenvalues
    np.testing.assert_allclose(found, eigenvalues, rtol=0.07)


@pytest.mark.parametrize(
    "mesh", [fibonacci_sphere(60), uneven_sphere(60), random_sphere(60, rng=RNG(3))]
)
def test_spheres_are_closed_and_face_outward(mesh):
    assert is_closed(mesh)
    assert is_manifold(mesh)
    outward = np.einsum("fi,fi->f", face_normals(mesh), mesh.vertices[mesh.faces].mean(axis=1))
    assert outward.min() > 0


@pytest.mark.parametrize("mesh", [disc(1), disc(5), irregular_grid(6, 3, jitter=0.45, rng=RNG(1))])
def test_flat_ones_are_manifolds_that_face_up(mesh):
    assert is_manifold(mesh)
    np.testing.assert_allclose(
        face_normals(mesh), np.tile([0.0, 0, 1], (mesh.n_faces, 1)), atol=1e-12
    )


@pytest.mark.parametrize("mesh", [box(2, 3, 1), ball(4)])
def test_the_boundary_of_a_solid_is_closed(mesh):
    facets = np.concatenate([np.delete(mesh.simplices, corner, axis=1) for corner in range(4)])
    _, counts = np.unique(np.sort(facets, axis=1), axis=0, return_counts=True)
    assert set(counts.tolist()) == {1, 2}
    outside = boundary_vertices(mesh)
    if mesh.n_points == 125:
        np.testing.assert_allclose(np.linalg.norm(mesh.points[outside], axis=1), 1, rtol=1e-14)
        assert np.linalg.norm(np.delete(mesh.points, outside, axis=0), axis=1).max() < 0.99


@pytest.mark.parametrize("n", [2, 3, 8, 9, 20])
def test_no_tetrahedron_of_a_ball_is_flat_however_fine(n):
    mesh = ball(n)
    first, second = np.triu_indices(4, 1)
    corners = mesh.points[mesh.simplices]
    sides = ((corners[:, first] - corners[:, second]) ** 2).sum(axis=(1, 2))
    quality = (
        12 * (3 * simplex_volumes(mesh)) ** (2 / 3) / sides
    )  # 1 where all sides are equal, 0 where flat
    assert quality.min() > QUALITY
    on_boundary = np.isin(mesh.simplices, boundary_vertices(mesh)).sum(axis=1)
    assert on_boundary.max() == 3  # one side of it at most


def test_a_hull_that_leaves_the_origin_out_faces_outward():
    mesh = random_sphere(20, rng=RNG(4176))  # a seed whose points all lie on one side of the origin
    assert is_closed(mesh)
    assert enclosed_volume(mesh) > 0
    outward = mesh.vertices[mesh.faces] - mesh.vertices.mean(axis=0)
    assert np.linalg.det(outward).min() > 0
    assert np.linalg.det(mesh.vertices[mesh.faces]).min() < 0


def test_the_density_of_an_uneven_sphere_falls_as_told():
    heights = uneven_sphere(20_000, ratio=4.0).vertices[:, 2]
    bands, _ = np.histogram(heights, np.linspace(-1, 1, 11))
    np.testing.assert_allclose(bands / 20_000, np.linspace(0.046, 0.154, 10), atol=0.001)
    assert np.ptp(np.histogram(uneven_sphere(5000, ratio=1.0).vertices[:, 2], 10)[0]) <= 1


def test_antipodes_become_one_and_no_length_changes():
    mesh, sphere = projective_plane(4), icosphere(4)
    assert mesh.points.shape == (1281, 5)
    assert exact.projective_plane_eigenvalues(7).tolist() == [0, 6, 6, 6, 6, 6, 20]
    lengths = np.linalg.norm(mesh.points, axis=1)
    np.testing.assert_allclose(lengths, lengths[0], rtol=1e-12)  # it lies on a sphere of R⁵
    # A chord is shorter than its arc by a share that falls with its square; so are the sides of both meshes.
    np.testing.assert_allclose(np.sort(sides(mesh))[::2], np.sort(sides(sphere))[::4], rtol=2e-3)


def sides(mesh):
    first, second = np.triu_indices(3, 1)
    corners = mesh.points[mesh.simplices]
    return np.linalg.norm(corners[:, first] - corners[:, second], axis=2).ravel()


def test_what_cannot_be_is_refused():
    with pytest.raises(
        InvalidParameterError, match=r"jitter must be at least 0 and less than 0\.5; it is 0\.5"
    ):
        irregular_grid(3, 3, jitter=0.5, rng=RNG(0))
    with pytest.raises(InvalidParameterError, match="sides must be three lengths; there are 2"):
        box(2, 2, 2, sides=(1.0, 2.0))
    with pytest.raises(InvalidParameterError, match=r"ratio must lie in 1\.\.1e6; it is 0\.5"):
        uneven_sphere(30, ratio=0.5)
    with pytest.raises(
        InvalidParameterError, match="condition must be 'neumann' or 'dirichlet'; it is 'robin'"
    ):
        exact.box_eigenvalues.__wrapped__(3, [1.0], "robin")
    with pytest.raises(
        InvalidShapeError,
        match="Points of a sphere must have a convex hull with volume; these 4 have none",
    ):
        sphere_hull([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    with pytest.raises(
        InvalidShapeError,
        match=r"must lie on their hull; point 4 at \[0\.0, 0\.0\] does not \(1 such\)",
    ):
        sphere_hull([[1.0, 0], [0, 1], [-1, 0], [0, -1], [0, 0]])
