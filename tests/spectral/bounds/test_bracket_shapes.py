"""Shapes that are no manifolds: what holds together is told by facets."""

import numpy as np
import pytest
from intervals import assert_around, finer

from eigenshape.geometry.facets import without_pinches
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair import repair
from eigenshape.geometry.topology import disjoint_union
from eigenshape.io.mesh_files import read_mesh
from eigenshape.io.shape_files import read_shape
from eigenshape.operators.fem import fem_laplacian
from eigenshape.shapes import exact
from eigenshape.shapes.surfaces import grid, icosphere
from eigenshape.spectral.bounds.brackets import bracket_eigenvalues
from eigenshape.spectral.solve import solve_spectrum


def test_parts_that_touch_in_a_point_are_apart():
    front, back = grid(8, 8), grid(8, 8)
    points = np.concatenate([front.vertices, back.vertices - [1, 1, 0]])
    names = np.arange(2 * front.n_vertices)
    names[2 * front.n_vertices - 1] = 0  # the corner (1, 1) of one is (0, 0) of the other
    mesh = TriangleMesh(
        points[:-1], names[np.concatenate([front.faces, back.faces + front.n_vertices])]
    )
    found = bracket_eigenvalues(mesh, 20)
    assert found.n_zero == 2
    assert_around(found, np.repeat(exact.box_eigenvalues(10), 2))


def test_three_pages_at_an_edge():
    # Functions on three unit squares sewn along one side: their mean is Neumann's there, two differences Dirichlet's.
    page = grid(10, 10)
    rim = page.vertices[:, 0] == 0
    points, faces, n = [page.vertices], [page.faces], page.n_vertices
    for angle in (2.0, 4.0):
        names = np.where(rim, np.arange(n), np.arange(n) + len(np.concatenate(points)))
        turned = page.vertices @ [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [0, 0, 1]]
        points.append(turned)
        faces.append(names[page.faces])
    used, corners = np.unique(np.concatenate(faces), return_inverse=True)
    mesh = TriangleMesh(np.concatenate(points)[used], corners.reshape(-1, 3))
    modes = np.arange(30)
    mixed = np.sort(np.add.outer((modes + 0.5) ** 2, modes**2), axis=None) * np.pi**2
    known = np.sort(np.concatenate([exact.box_eigenvalues(30), np.repeat(mixed[:30], 2)]))[:30]
    assert_around(bracket_eigenvalues(mesh, 30), known)


def test_a_closed_part_stays_free_where_another_is_held():
    found = bracket_eigenvalues(disjoint_union(icosphere(1), grid(6, 6)), 8, boundary="dirichlet")
    assert found.n_zero == 1
    assert found.lower[0] == found.upper[0] == 0 < found.lower[1]


@pytest.mark.long
@pytest.mark.data
def test_a_real_solid(data):
    mesh = read_shape(data / "tets" / "octopus-low.mesh")
    found = bracket_eigenvalues(mesh, 12)
    assert_around(
        found,
        np.maximum(solve_spectrum(fem_laplacian(mesh, 3), 12).eigenvalues, 0) * (np.arange(12) > 0),
    )


@pytest.mark.long
@pytest.mark.data
@pytest.mark.parametrize(
    "name",
    ["trimesh/teapot.stl", "geometrycentral/triple_vierbein.obj", "geometrycentral/fan3.obj"],
)
def test_real_surfaces_that_are_no_manifolds(data, name):
    mesh = repair(
        read_mesh(data / "nasty" / name), ("weld", "drop_degenerate", "drop_unreferenced")
    ).mesh
    k = min(30, mesh.n_vertices)
    found = bracket_eigenvalues(mesh, k)
    fine = without_pinches(finer(mesh, 1))
    known = solve_spectrum(fem_laplacian(fine, 3), k).eigenvalues.copy()
    assert (known[: found.n_zero] < 1e-9 * known[-1]).all()
    known[: found.n_zero] = 0
    assert_around(found, known)
