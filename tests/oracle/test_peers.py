"""The factor that turns what other libraries return into our W and B, on made-up and real meshes."""

import igl
import lapy
import numpy as np
import pytest
import robust_laplacian
import scipy.sparse as sp
from pyFM.mesh import laplacian as pyfm

from eigenshape.io.mesh_files import read_mesh
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.surfaces import torus

FACTORS = {  # theirs = factor × ours
    "libigl stiffness": -1.0,
    "libigl mass": 1.0,
    "LaPy stiffness": 1.0,
    "LaPy mass": 1.0,
    "robust_laplacian stiffness": 1.0,
    "robust_laplacian mass": 1.0,
    "pyFM stiffness": 1.0,
    "pyFM mass": 1.0,
}


def stiffnesses(vertices, faces):
    solver = lapy.Solver(lapy.TriaMesh(vertices, faces), lump=True)
    return {
        "libigl": igl.cotmatrix(vertices, faces),
        "LaPy": solver.stiffness,
        "pyFM": pyfm.cotangent_weights(vertices, faces),
    }


def masses(vertices, faces):
    mesh = lapy.TriaMesh(vertices, faces)
    lumped = {
        "libigl": igl.massmatrix(vertices, faces, igl.MASSMATRIX_TYPE_BARYCENTRIC),
        "LaPy": lapy.Solver(mesh, lump=True).mass,
        "pyFM": pyfm.dia_area_mat(vertices, faces),
    }
    consistent = {
        "libigl": igl.massmatrix(vertices, faces, igl.MASSMATRIX_TYPE_FULL),
        "LaPy": lapy.Solver(mesh, lump=False).mass,
        "pyFM": pyfm.fem_area_mat(vertices, faces),
    }
    return {"lumped": lumped, "consistent": consistent}


def assert_multiple(theirs, ours, factor):
    difference = abs(sp.csr_array(theirs) - factor * ours)
    assert difference.max() <= 1e-9 * abs(ours).max()


@pytest.fixture(scope="module", params=["torus", pytest.param("horse", marks=pytest.mark.data)])
def mesh(request):
    if request.param == "torus":
        return torus(24, 12)
    return read_mesh(request.getfixturevalue("data") / "classics" / "horse.ply")


def test_stiffness_of_peers(mesh):
    ours = cotangent_laplacian(mesh).stiffness
    for name, theirs in stiffnesses(np.array(mesh.vertices), np.array(mesh.faces)).items():
        assert_multiple(theirs, ours, FACTORS[f"{name} stiffness"])


def test_masses_of_peers(mesh):
    for kind, matrices in masses(np.array(mesh.vertices), np.array(mesh.faces)).items():
        ours = cotangent_laplacian(mesh, kind).mass
        for name, theirs in matrices.items():
            assert_multiple(theirs, ours, FACTORS[f"{name} mass"])


def test_robust_laplacian_on_delaunay_triangles():
    mesh = torus(24, 12)
    ours = cotangent_laplacian(mesh)
    stiffness, mass = robust_laplacian.mesh_laplacian(np.array(mesh.vertices), np.array(mesh.faces))
    assert_multiple(stiffness, ours.stiffness, FACTORS["robust_laplacian stiffness"])
    assert_multiple(mass, ours.mass, FACTORS["robust_laplacian mass"])
