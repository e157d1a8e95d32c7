import pickle
import warnings

import numpy as np
import pytest
from bent_shapes import bumpy, lump, lump_rig

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.deformation.binding import bind
from eigenshape.deformation.rig import eigen_skeleton, pose_rig, project_on_modes, rig_shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair import repair
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.topology import disjoint_union, submesh
from eigenshape.operators.clouds.gaussian import mesh_laplacian
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.graph import graph_laplacian
from eigenshape.shapes.surfaces import icosphere, torus
from eigenshape.spectral.solve import solve_spectrum


def test_all_modes_give_the_shape_back():
    mesh = bumpy(torus(12, 8))
    rig = rig_shape(mesh)
    assert rig.n_modes == mesh.n_vertices
    np.testing.assert_allclose(eigen_skeleton(rig, rig.n_modes), mesh.vertices, atol=1e-12)


def test_a_skeleton_is_the_plain_least_squares_fit():
    rig = lump_rig()
    for n_modes in (1, 8, 50, 300):
        modes = rig.eigenvectors[:, :n_modes]
        plain = modes @ np.linalg.lstsq(modes, rig.mesh.vertices, rcond=None)[0]
        np.testing.assert_allclose(eigen_skeleton(rig, n_modes), plain, atol=1e-12)
    assert (np.abs(eigen_skeleton(rig, 1) - rig.mesh.vertices.mean(axis=0)) < 1e-12).all()


def test_the_factor_of_fewer_modes_is_the_leading_part():
    rig = lump_rig()
    for n_modes in (1, 8, 300):
        modes, part = rig.eigenvectors[:, :n_modes], rig.factor[:n_modes, :n_modes]
        np.testing.assert_array_equal(part, np.tril(part))
        gram = modes.T @ modes
        np.testing.assert_allclose(part @ part.T, gram, atol=1e-12 * np.abs(gram).max())


def test_projection_finds_the_coefficients_of_a_sum_of_modes():
    rig, wanted = lump_rig(), np.random.default_rng(0).standard_normal((20, 2))
    np.testing.assert_allclose(
        project_on_modes(rig, rig.eigenvectors[:, :20] @ wanted, 20), wanted, atol=1e-12
    )


def test_there_is_one_more_mode_for_each_further_component():
    mesh = disjoint_union(lump(), icosphere(1), icosphere(1))
    rig = rig_shape(mesh)
    assert rig.n_modes == 302
    assert rig.components.max() == 2


@pytest.mark.filterwarnings("ignore:Eigenvalues from number")
def test_spectra_of_other_operators_serve():
    """Each fits a region in its own mass: a graph's modes are not orthonormal by area."""
    mesh = lump()
    region = mesh.vertices[:, 0] > 0.6
    cotangents = bind(lump_rig(), [region], n_modes=50).shares[0]
    for laplacian, least in ((mesh_laplacian(mesh), 0.99), (graph_laplacian(mesh), 0.98)):
        rig = rig_shape(mesh, solve_spectrum(laplacian, 50))
        shares = bind(rig, [region]).shares[0]
        assert rig.n_modes == 50
        assert (shares == 1).any()
        assert (shares == 0).sum() > 200
        assert np.corrcoef(shares, cotangents)[0, 1] > least


def test_areas_are_those_of_the_vertices():
    np.testing.assert_allclose(lump_rig().areas, dual_volumes(lump()), rtol=1e-14)


def test_a_pose_keeps_all_but_the_vertices():
    rig = lump_rig()
    other = pose_rig(rig, 2 * rig.mesh.vertices)
    assert other.eigenvectors is rig.eigenvectors
    np.testing.assert_array_equal(other.mesh.vertices, 2 * rig.mesh.vertices)
    with pytest.raises(InvalidShapeError, match="vertices must be finite; vertex 0"):
        pose_rig(rig, np.full_like(rig.mesh.vertices, np.nan))


def test_the_weights_of_edges_cannot_be_changed():
    rig = rig_shape(icosphere(1))
    for edges in (rig.edges, pickle.loads(pickle.dumps(rig)).edges):
        for array in (edges.weights, edges.starts, edges.others, edges.matrix.data):
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 0


def test_what_cannot_be_rigged_is_refused():
    spectrum = solve_spectrum(cotangent_laplacian(icosphere(1)), 5)
    with pytest.raises(
        InvalidParameterError,
        match="spectrum must be of the shape; it has 42 points for 642 vertices",
    ):
        rig_shape(lump(), spectrum)
    with pytest.raises(InvalidParameterError, match=r"n_modes must lie in 1\.\.300; it is 301"):
        eigen_skeleton(lump_rig(), 301)
    spare = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]], [[0, 1, 2]])
    with pytest.raises(InvalidShapeError, match="vertex 3"):
        rig_shape(spare)
    flat = TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    with pytest.raises(InvalidShapeError, match="face 0"):
        rig_shape(flat)


def test_seams_are_named():
    """A lump that is cut open along x = 0.1, as an exporter of textures does; the remedy joins it."""
    whole = lump(2)
    behind = whole.vertices[whole.faces].mean(axis=1)[:, 0] < 0.1
    front, back = submesh(whole, ~behind)[0], submesh(whole, behind)[0]
    cut = disjoint_union(front, back)
    message = r"sides \[\d+, \d+\] and \[\d+, \d+\] lie on each other and do not \(\d+ such\)"
    with pytest.warns(UserWarning, match=message):
        rig_shape(cut)
    joined = repair(cut, ["weld_seams"]).mesh
    assert joined.n_vertices == whole.n_vertices
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rig_shape(joined)
