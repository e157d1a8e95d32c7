"""Area, boundary length and Euler characteristic from eigenvalues, within the stated errors."""

import os
from pathlib import Path

import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.mesh_files import read_mesh
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.fem import fem_boundary_nodes, fem_laplacian
from eigenshape.shapes.domains import disc
from eigenshape.shapes.exact import (
    box_eigenvalues,
    disc_eigenvalues,
    flat_torus_eigenvalues,
    projective_plane_eigenvalues,
    sphere_eigenvalues,
)
from eigenshape.shapes.surfaces import icosphere, torus
from eigenshape.spectral.diffusion.small_times import recover_geometry
from eigenshape.spectral.solve import solve_spectrum

EXACT = {  # eigenvalues, condition, area, boundary length, Euler characteristic
    "sphere": (sphere_eigenvalues, None, 4 * np.pi, None, 2),
    "projective plane": (projective_plane_eigenvalues, None, 2 * np.pi, None, 1),
    "flat torus": (lambda k: flat_torus_eigenvalues(k, np.eye(2)), None, 1, None, 0),
    "long flat torus": (lambda k: flat_torus_eigenvalues(k, np.diag([1, 2])), None, 2, None, 0),
    "free disc": (lambda k: disc_eigenvalues(k, "neumann"), "neumann", np.pi, 2 * np.pi, 1),
    "fixed disc": (lambda k: disc_eigenvalues(k, "dirichlet"), "dirichlet", np.pi, 2 * np.pi, 1),
    # Each right angle adds 3/8 to what the Euler characteristic would be with curved sides alone.
    "square": (lambda k: box_eigenvalues(k, (1, 1), "neumann"), "neumann", 1, 4, 1.5),
}


def require_within(found, area, length, characteristic):
    assert abs(found.area - area) <= found.area_error
    if length is not None:
        assert abs(found.boundary_length - length) <= found.boundary_length_error
    assert abs(found.euler_characteristic - characteristic) <= found.euler_characteristic_error


@pytest.mark.parametrize("k", [80, 150, 300])
@pytest.mark.parametrize("name", EXACT)
def test_exact_eigenvalues_give_the_geometry_within_the_stated_errors(name, k):
    eigenvalues, boundary, area, length, characteristic = EXACT[name]
    found = recover_geometry(eigenvalues(k), boundary=boundary)
    require_within(found, area, length, characteristic)
    if k == 300:  # and the errors are small
        assert found.area_error < 2e-4 * area
        assert length is None or found.boundary_length_error < 0.002 * length
        assert found.euler_characteristic_error < 0.08
        whole = None if name == "square" else characteristic
        assert found.whole_characteristic() == whole
        assert (found.boundary_length is None) == (length is None)


def test_units_change_with_the_shape():
    values = sphere_eigenvalues(100)
    one, two = recover_geometry(values), recover_geometry(values / 9e-20)
    assert two.area == pytest.approx(9e-20 * one.area, rel=1e-9)
    assert two.area_error == pytest.approx(9e-20 * one.area_error, rel=1e-3)
    assert two.euler_characteristic == pytest.approx(one.euler_characteristic, rel=1e-6)
    np.testing.assert_allclose(two.times, np.multiply(one.times, 9e-20))


def test_two_spheres_have_the_sum_of_all():
    both = np.sort(np.concatenate([sphere_eigenvalues(150), sphere_eigenvalues(150)]))
    found = recover_geometry(both)
    require_within(found, 8 * np.pi, None, 4)
    assert found.whole_characteristic(even=True) == 4


def test_a_number_is_rounded_only_where_the_error_leaves_no_choice():
    found = recover_geometry(sphere_eigenvalues(300))
    change = {"euler_characteristic": 1.7, "euler_characteristic_error": 0.8}
    unsure = type(found)(**{**vars(found), **change})
    assert unsure.whole_characteristic() is None
    assert unsure.whole_characteristic(even=True) == 2
    assert "of which only 2 is even" in unsure.explain()
    lost = type(found)(**{**vars(found), **change, "euler_characteristic_error": 1.4})
    assert lost.whole_characteristic(even=True) is None
    assert "which does not determine a whole number" in lost.explain()
    assert found.explain().startswith("300 eigenvalues give area 12.566")
    assert (
        "boundary 6.28"
        in recover_geometry(disc_eigenvalues(300, "dirichlet"), boundary="dirichlet").explain()
    )


def annulus(n_rings, n_around, inner=0.4):
    """Return the ring between radius `inner` and 1, in triangles that are nearly equilateral."""
    radii = np.linspace(inner, 1, n_rings + 1)
    turns = (
        2 * np.pi * (np.arange(n_around) + 0.5 * (np.arange(n_rings + 1)[:, None] % 2)) / n_around
    )
    x, y = radii[:, None] * np.cos(turns), radii[:, None] * np.sin(turns)
    points = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    ring, step = np.meshgrid(np.arange(n_rings), np.arange(n_around), indexing="ij")
    after = (step + 1) % n_around
    a, b, c, d = (i * n_around + j for i in (ring, ring + 1) for j in (step, after))
    odd = (ring % 2 == 1)[..., None]
    first = np.where(odd, np.stack([a, b, d], -1), np.stack([a, b, c], -1))
    second = np.where(odd, np.stack([a, d, c], -1), np.stack([b, d, c], -1))
    return TriangleMesh(points, np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)]))


@pytest.mark.long
@pytest.mark.sweep
@pytest.mark.parametrize(
    ("mesh", "boundary", "characteristic", "whole"),
    [
        pytest.param(icosphere(3), None, 2, None, id="sphere"),
        pytest.param(torus(60, 30), None, 0, 0, id="torus"),
        # On coarse meshes the eigenvalues err too much for a whole number.
        pytest.param(disc(20), "neumann", 1, None, id="free disc"),
        pytest.param(disc(20), "dirichlet", 1, None, id="fixed disc"),
        pytest.param(annulus(12, 88), "neumann", 0, None, id="free annulus"),
        pytest.param(annulus(12, 88), "dirichlet", 0, None, id="fixed annulus"),
        pytest.param(disc(40), "neumann", 1, 1, id="free disc, fine"),
        pytest.param(disc(40), "dirichlet", 1, 1, id="fixed disc, fine"),
        pytest.param(annulus(24, 176), "neumann", 0, None, id="free annulus, fine"),
        pytest.param(annulus(24, 176), "dirichlet", 0, 0, id="fixed annulus, fine"),
    ],
)
def test_meshes_give_their_geometry_within_the_stated_errors(mesh, boundary, characteristic, whole):
    quadratic, cubic = (
        solve_spectrum(
            fem_laplacian(mesh, order),
            300,
            fixed=fem_boundary_nodes(mesh, order) if boundary == "dirichlet" else None,
        ).eigenvalues
        for order in (2, 3)
    )
    # Here cubic elements err by an eighth of what quadratic ones do, at the 300th eigenvalue.
    found = recover_geometry(cubic, boundary=boundary, errors=(quadratic - cubic) / 4)
    edges = mesh.vertices[np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)]
    sides, counts = np.unique(edges.reshape(-1, 6), axis=0, return_counts=True)
    length = np.linalg.norm(sides[counts == 1, :3] - sides[counts == 1, 3:], axis=1).sum()
    require_within(found, surface_area(mesh), length if boundary else None, characteristic)
    assert found.whole_characteristic() == whole


@pytest.mark.long
@pytest.mark.data
def test_genus_3_is_heard_from_300_eigenvalues():
    root = Path(__file__).resolve().parents[4] / "shared" / "data"
    data = Path(os.environ.get("EIGENSHAPE_DATA", root))
    mesh = read_mesh(data / "classics" / "genus3.off")
    found = recover_geometry(solve_spectrum(fem_laplacian(mesh, 2), 300))
    require_within(found, surface_area(mesh), None, -4)
    assert found.area_error < 0.003 * surface_area(mesh)
    assert found.whole_characteristic(even=True) == -4


GOOD = sphere_eigenvalues(60)


@pytest.mark.parametrize(
    ("values", "options", "message"),
    [
        (GOOD[:49], {}, "At least 50 eigenvalues are needed to see short times; there are 49"),
        (GOOD[::-1], {}, "eigenvalues must be ascending and at least 0; entry 1"),
        (GOOD - 1, {}, "eigenvalues must be ascending and at least 0; entry 0"),
        (np.where(GOOD == 2, np.nan, GOOD), {}, "eigenvalues must be finite; entry 1"),
        (GOOD[1:], {}, "The first eigenvalue must be 0, that of constants; it is 2"),
        (GOOD, {"boundary": "dirichlet"}, "With the Dirichlet condition no eigenvalue is 0; 1 are"),
        (
            GOOD,
            {"errors": np.ones(3)},
            "errors must hold one number per eigenvalue, 60; there are 3",
        ),
    ],
)
def test_eigenvalues_that_do_not_fit_are_named(values, options, message):
    with pytest.raises(InvalidParameterError, match=message):
        recover_geometry(values, **options)


def test_a_boundary_has_one_of_two_conditions():
    plain = getattr(recover_geometry, "__wrapped__", recover_geometry)
    with pytest.raises(InvalidParameterError, match="boundary must be 'neumann' or 'dirichlet'"):
        plain(GOOD, boundary="robin")


def test_a_spectrum_is_taken_from_its_beginning():
    laplacian = cotangent_laplacian(icosphere(2), "averaged")
    spectrum = solve_spectrum(laplacian, 100)
    assert recover_geometry(spectrum) == recover_geometry(spectrum.eigenvalues)
    with pytest.raises(InvalidParameterError, match="must begin with the lowest eigenvalue"):
        recover_geometry(solve_spectrum(laplacian, below=60.0, above=1.0))
