"""Seams that are open by the rounding of stored coordinates, and gaps that are meant."""

import numpy as np
import pytest
from broken_meshes import soup

from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair import repair, suggest_repairs
from eigenshape.geometry.repairs.repair_steps import weld_seams
from eigenshape.geometry.requirements import require_joined
from eigenshape.geometry.seams import seams
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import disjoint_union, euler_characteristic, is_closed
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.surfaces import grid, icosphere
from eigenshape.spectral.solve import solve_spectrum


def sheet(points):
    """Connect an array of points, rows by columns, by triangles."""
    rows, columns = points.shape[:2]
    at = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (part.ravel() for part in (at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]))
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return TriangleMesh(points.reshape(-1, 3).astype(np.float64), faces)


def tube(dtype=np.float64, n=38):
    """A tube whose last column is computed from 2π."""
    angle, height = np.meshgrid(
        np.linspace(0, 2 * np.pi, n + 1, dtype=dtype),
        np.linspace(0, 1, 11, dtype=dtype),
        indexing="ij",
    )
    return sheet(np.stack([np.cos(angle), np.sin(angle), height], axis=-1))


def uv_sphere(dtype=np.float64):
    angle, polar = np.meshgrid(
        np.linspace(0, 2 * np.pi, 25, dtype=dtype),
        np.linspace(0, np.pi, 13, dtype=dtype),
        indexing="ij",
    )
    ring = np.sin(polar)
    return sheet(np.stack([np.cos(angle) * ring, np.sin(angle) * ring, np.cos(polar)], axis=-1))


def as_text(mesh, style):
    rows = [[float(format(x, style)) for x in row] for row in mesh.vertices.tolist()]
    return TriangleMesh(rows, mesh.faces)


def as_single(mesh):
    return TriangleMesh(mesh.vertices.astype(np.float32).astype(np.float64), mesh.faces)


def slit(gap, n=20):
    """A square of size 1, cut in the middle, whose right half is moved to the right."""
    whole = grid(n, n)
    is_right = whole.vertices[whole.faces].mean(axis=1)[:, 0] > 0.5
    faces = whole.faces + np.where(is_right, whole.n_vertices, 0)[:, None]
    used, renumbered = np.unique(faces, return_inverse=True)
    points = np.concatenate([whole.vertices, whole.vertices + np.array([gap, 0, 0])])
    return TriangleMesh(points[used], renumbered.reshape(-1, 3))


def turned(mesh):
    rotation = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    return TriangleMesh(mesh.vertices @ rotation, mesh.faces)


TEXTS = [".6f", ".8f", ".6g", ".9g", ".5f"]


@pytest.mark.parametrize(
    "mesh",
    [
        tube(),
        tube(np.float32),
        turned(tube()),
        as_single(turned(tube())),
        *(as_text(turned(tube()), style) for style in TEXTS),
        *(as_text(as_single(turned(tube(np.float32))), style) for style in TEXTS),
        as_text(TriangleMesh(150 * turned(tube()).vertices, tube().faces), ".3f"),
    ],
)
def test_a_tube_is_closed_whatever_its_coordinates_were_stored_as(mesh):
    assert len(seams(mesh)) == 10
    assert suggest_repairs(mesh) == ("weld_seams",)
    done = weld_seams(mesh)
    assert done.mesh.n_vertices == mesh.n_vertices - 11
    assert euler_characteristic(done.mesh) == 0
    assert suggest_repairs(done.mesh) == ()


def test_the_report_says_how_far_and_the_spectrum_is_that_of_a_tube():
    done = repair(tube(), ["auto"])
    assert done.report == (
        "weld_seams joined 11 vertices along seams, which were open by up to 2.4e-16",
    )
    values = solve_spectrum(cotangent_laplacian(done.mesh), 3).eigenvalues
    np.testing.assert_allclose(values[1:], 1, rtol=0.02)
    assert repair(tube(np.float32), ["weld_seams"]).report[0].endswith("up to 1.7e-07")


@pytest.mark.parametrize("scale", [1e-300, 2.0**-40, 2.0**40, 1e300])
def test_the_unit_does_not_matter(scale):
    mesh = TriangleMesh(scale * tube().vertices, tube().faces)
    assert weld_seams(mesh).mesh.n_vertices == mesh.n_vertices - 11


def test_neither_order_nor_loose_vertices_matter():
    mesh = turned(tube())
    order = np.random.default_rng(1).permutation(mesh.n_vertices)
    places = np.empty(len(order), dtype=np.int64)
    places[order] = np.arange(len(order))
    shuffled = TriangleMesh([*mesh.vertices[order], [1e9, 0, 0]], places[mesh.faces][::-1])
    assert len(seams(shuffled)) == 10


@pytest.mark.parametrize("gap", [1e-4, 1e-6, 1e-10, 1e-13])
def test_a_slit_in_double_precision_stays(gap):
    for mesh in (slit(gap), turned(slit(gap)), slit(gap, 16)):
        assert not len(seams(mesh))
        assert weld_seams(mesh).mesh.n_vertices == mesh.n_vertices


@pytest.mark.parametrize("store", [as_single, lambda mesh: as_text(mesh, ".6f")])
def test_a_slit_of_some_roundings_stays(store):
    assert not len(seams(store(turned(slit(1e-5)))))
    assert len(seams(store(turned(slit(1e-7))))) == 20


def test_far_from_the_origin_roundings_are_those_of_the_place():
    # In the middle between two single numbers, which are 1/32 and 1/4 apart here
    offset = np.array([500_000 + 1 / 64, 4_000_000 + 1 / 8, 100])
    mesh = tube()
    exact = TriangleMesh(50 * mesh.vertices, mesh.faces)
    rng = np.random.default_rng(2)
    noisy = exact.vertices + offset + rng.uniform(-1e-3, 1e-3, exact.vertices.shape)
    single = as_single(TriangleMesh(noisy, mesh.faces))
    gaps = single.vertices[:11] - single.vertices[-11:]
    assert np.abs(gaps).max() >= 0.25  # one side is rounded up, and the other one down
    # Coordinates along z are small, and their rounding does not reach across the noise.
    assert not len(seams(single))
    noisy[-11:, 2] = noisy[:11, 2]
    assert len(seams(as_single(TriangleMesh(noisy, mesh.faces)))) == 10
    vertices = mesh.vertices + offset
    vertices[:11, :2] = np.nextafter(vertices[:11, :2], np.inf)
    double = TriangleMesh(vertices, mesh.faces)
    assert len(seams(double)) == 10


@pytest.mark.parametrize("mesh", [uv_sphere(), uv_sphere(np.float32), as_text(uv_sphere(), ".6f")])
def test_a_globe_is_closed_at_its_seam_and_poles(mesh):
    done = repair(mesh, ["auto"])
    assert is_closed(done.mesh)
    assert (euler_characteristic(done.mesh), done.mesh.n_faces) == (2, 528)
    assert suggest_repairs(done.mesh) == ()


def test_mirrored_halves_meet():
    half = sheet(tube(np.float32).vertices.reshape(39, 11, 3)[:20])
    # Both ends of the half tube lie beside the plane y = 0 by rounding.
    mirrored = TriangleMesh(half.vertices * np.array([1, -1, 1]), half.faces[:, ::-1])
    both = disjoint_union(half, mirrored)
    done = repair(both, ["auto"])
    assert euler_characteristic(done.mesh) == 0
    assert done.mesh.n_vertices == both.n_vertices - 22
    with pytest.raises(ValueError, match="edge on edge must share their vertices"):
        require_joined(both)
    require_joined(done.mesh)


def test_short_sides_are_not_joined():
    # Sides of 3e-7 in single precision, as long as some roundings: no triangle is swallowed.
    ball = icosphere(1)
    tiny = TriangleMesh(1e-6 * ball.vertices + np.array([1.0, 0, 0]), ball.faces)
    both = as_single(soup(disjoint_union(ball, tiny)))
    welded = weld_seams(both).mesh
    triangles = welded.vertices[welded.faces]
    assert welded.n_vertices == 2 * ball.n_vertices
    assert (np.ptp(triangles, axis=1).max(axis=1) > 0).all()


def test_solids_and_curves_have_seams_too():
    noise = 1e-16 * np.arange(24)[:, None]
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])
    solid = SimplicialMesh(points, [[0, 1, 2, 3], [1, 2, 3, 4]])
    apart = soup(solid)
    open_solid = SimplicialMesh(apart.points + noise[:8], apart.simplices)
    assert weld_seams(open_solid).mesh.n_points == 5
    curve = SimplicialMesh([[0.1, 0], [0.3, 1], [0.1 + 1e-16, 0]], [[0, 1], [1, 2]])
    assert weld_seams(curve).mesh.n_points == 2
    nowhere = SimplicialMesh([[0.0, 0], [0, 0]], [[0, 1]])
    assert weld_seams(nowhere).mesh.n_points == 1
