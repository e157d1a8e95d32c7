"""Operator bundles: each array as DiffusionNet takes it, and the cache."""

import sys

import numpy as np
import pytest

import eigenshape as es
from eigenshape._workers import Item, Workers
from eigenshape.spectral.tools.vertex_gradient import fit_gradient

SQUARE = es.shapes.irregular_grid(7, 7, rng=np.random.default_rng(0))
BALL = es.icosphere(2)
NORMALS = np.random.default_rng(1).normal(size=(300, 3))
CLOUD = es.PointCloud(NORMALS / np.linalg.norm(NORMALS, axis=1, keepdims=True), 2)


def literal_gradient(points, frames, neighbors):
    """Return the complex gradient matrix, vertex by vertex, as DiffusionNet builds it (but its 1e-5)."""
    matrix = np.zeros((len(points),) * 2, dtype=complex)
    for vertex, around in enumerate(neighbors):
        edges = (points[around] - points[vertex]) @ frames[vertex, :2].T
        inverse = np.linalg.pinv(edges)
        complex_rows = inverse[0] + 1j * inverse[1]
        matrix[vertex, around] = complex_rows
        matrix[vertex, vertex] = -complex_rows.sum()
    return matrix


@pytest.mark.parametrize("shape", [BALL, CLOUD], ids=["mesh", "cloud"])
def test_gradients_are_those_of_diffusion_net(shape):
    bundle = es.spectral.operator_bundle(shape, 5)
    if shape is BALL:
        graph = es.operators.edge_graph(shape).tolil()
        neighbors = [sorted(row) for row in graph.rows]
    else:
        gaps = np.linalg.norm(shape.points[:, None] - shape.points[None], axis=2)
        neighbors = np.argsort(gaps, axis=1)[:, 1:31]
    wanted = literal_gradient(shape.points, bundle.frames, neighbors)
    np.testing.assert_allclose(bundle.gradient_x.toarray(), wanted.real, atol=1e-9)
    np.testing.assert_allclose(bundle.gradient_y.toarray(), wanted.imag, atol=1e-9)


def test_frames_are_orthonormal_and_right_handed():
    for shape in (BALL, CLOUD):
        frames = es.spectral.operator_bundle(shape, 2).frames
        grams = np.einsum("nij,nkj->nik", frames, frames)
        np.testing.assert_allclose(grams, np.broadcast_to(np.eye(3), grams.shape), atol=1e-14)
        np.testing.assert_allclose(np.linalg.det(frames), 1, atol=1e-13)
        cosines = np.abs((frames[:, 2] * shape.points).sum(axis=1))
        assert cosines.min() > 0.9


@pytest.mark.parametrize("scale", [1e-100, 1e100])
def test_gradients_of_linear_functions_are_exact_in_any_unit(scale):
    moved = (SQUARE.vertices * scale, SQUARE.faces)
    bundle = es.spectral.operator_bundle(moved, 3)
    slope = np.array([2.0, -3.0, 0.0])
    values = SQUARE.vertices @ slope
    found = np.stack([bundle.gradient_x @ values, bundle.gradient_y @ values], axis=1) * scale
    expected = bundle.frames[:, :2] @ slope
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


def test_eigenpairs_mass_and_stiffness_are_those_of_the_operator():
    laplacian = es.cotangent_laplacian(BALL)
    spectrum = es.solve_spectrum(laplacian, 7)
    bundle = es.spectral.operator_bundle(BALL, 7)
    np.testing.assert_array_equal(bundle.eigenvalues, spectrum.eigenvalues)
    np.testing.assert_array_equal(bundle.mass, laplacian.mass.diagonal())
    assert (bundle.stiffness != laplacian.stiffness).nnz == 0
    robust = es.spectral.operator_bundle(BALL, 7, operator="robust")
    np.testing.assert_allclose(robust.eigenvalues, spectrum.eigenvalues, atol=1e-9)
    cloud = es.spectral.operator_bundle(CLOUD, 3)
    assert (cloud.stiffness != es.robust_laplacian(CLOUD).stiffness).nnz == 0


def test_a_simplicial_mesh_of_triangles_is_a_surface_too():
    simplicial = es.geometry.SimplicialMesh(BALL.vertices, BALL.faces)
    bundle = es.spectral.operator_bundle(simplicial, 2)
    assert bundle.frames.shape == (162, 3, 3)


def test_edges_on_a_line_have_no_derivative_across():
    strip = es.TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    bundle = es.spectral.operator_bundle(strip, 1)
    x, y = fit_gradient(strip.vertices, bundle.frames, np.array([[0, 1], [1, 0]]))
    along = np.stack([x @ [0.0, 2, 5], y @ [0.0, 2, 5]], axis=1)[:2]
    in_space = np.einsum("ni,nij->nj", along, bundle.frames[:2, :2])
    np.testing.assert_allclose(in_space, [[2, 0, 0], [2, 0, 0]], atol=1e-12)


def test_a_kept_bundle_is_loaded_bit_for_bit(tmp_path, monkeypatch):
    first = es.spectral.operator_bundle(SQUARE, 4, cache=tmp_path)
    monkeypatch.setattr("eigenshape.spectral.tools.bundle.solve_spectrum", None)
    again = es.spectral.operator_bundle(SQUARE, 4, cache=tmp_path)
    for one, other in zip(
        es.spectral.export_bundle(first, "numpy", "double"),
        es.spectral.export_bundle(again, "numpy", "double"),
        strict=True,
    ):
        for a, b in zip(np.atleast_1d(*one), np.atleast_1d(*other), strict=True):
            np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("damage", ["flipped", "cut", "compressed", "version", "shape", "nan"])
def test_a_damaged_file_is_computed_again(tmp_path, damage):
    bundle = es.spectral.operator_bundle(SQUARE, 4, cache=tmp_path)
    (path,) = tmp_path.glob("*.npz")
    data = bytearray(path.read_bytes())
    if damage == "flipped":
        data[len(data) // 2] ^= 1
        path.write_bytes(data)
    elif damage == "cut":
        path.write_bytes(data[: len(data) // 2])
    else:
        with np.load(path) as archive:
            arrays = dict(archive)
        if damage == "version":
            arrays["head"] = np.array('{"eigenshape_bundle": 0}')
        if damage == "shape":
            arrays["frames"] = arrays["frames"][:-1]
        if damage == "nan":
            arrays["mass"] = arrays["mass"] * np.nan
        (np.savez_compressed if damage == "compressed" else np.savez)(path, **arrays)
    message = {
        "compressed": "must hold a bundle that eigenshape saved; its part",
        "version": "must hold a bundle in format 1; it is in format 0",
        "shape": "must hold arrays that fit together; frames has shape",
        "nan": "must hold finite float64 numbers as mass",
    }.get(damage, "must hold a bundle that eigenshape saved")
    with pytest.warns(UserWarning, match=message):
        again = es.spectral.operator_bundle(SQUARE, 4, cache=tmp_path)
    np.testing.assert_array_equal(again.eigenvectors, bundle.eigenvectors)
    es.spectral.operator_bundle(SQUARE, 4, cache=tmp_path)  # and is kept again


@pytest.mark.long
def test_files_are_described_in_processes_and_failures_are_named(tmp_path):
    es.write_mesh(BALL, tmp_path / "ball.off")
    items = [
        Item("missing", tmp_path / "no.off"),
        Item("ball", tmp_path / "ball.off"),
    ]
    seen = []
    failed = es.spectral.cache_operator_bundles(
        items,
        es.read_mesh,
        tmp_path / "kept",
        6,
        workers=Workers(1),
        callback=lambda *a: seen.append(a),
    )
    assert [name for name, _ in failed] == ["missing"]
    assert "no.off" in failed[0][1]
    assert [done for done, *_ in seen] == [1, 2]
    assert len(list((tmp_path / "kept").glob("*.npz"))) == 1


def test_bundles_are_read_only_computed_or_read(tmp_path):
    for _ in range(2):  # the second comes from the cache
        bundle = es.spectral.operator_bundle(BALL, 3, cache=tmp_path)
        for matrix in (bundle.stiffness, bundle.gradient_x, bundle.gradient_y):
            with pytest.raises(ValueError, match="read-only"):
                matrix.data[0] = 1
        assert not bundle.eigenvectors.flags.writeable
        assert np.abs(bundle.gradient_x @ np.ones(len(bundle.mass))).max() < 1e-12


def test_scipy_and_numpy_forms_hold_the_same_numbers():
    bundle = es.spectral.operator_bundle(BALL, 3)
    *_, gradient = es.spectral.export_bundle(bundle, "scipy")
    *_, (indices, values) = es.spectral.export_bundle(bundle, "numpy")
    assert values.dtype == np.float32
    assert indices.dtype == np.int64
    np.testing.assert_array_equal(gradient.toarray()[tuple(indices)], values)


def test_torch_tensors_hold_the_same_numbers():
    torch = pytest.importorskip("torch")
    bundle = es.spectral.operator_bundle(BALL, 3)
    frames, _, stiffness, *_ = es.spectral.export_bundle(bundle, "torch", "double")
    assert frames.dtype == torch.float64
    np.testing.assert_array_equal(stiffness.to_dense().numpy(), bundle.stiffness.toarray())
    # A step of a network: gradients flow back through the sparse product.
    *_, gradient = es.spectral.export_bundle(bundle, "torch", "double")
    values = torch.ones((len(bundle.mass), 2), dtype=torch.float64, requires_grad=True)
    torch.sparse.mm(gradient, values).sum().backward()
    expected = np.asarray(bundle.gradient_y.sum(axis=0)).ravel()
    assert values.grad is not None
    np.testing.assert_allclose(values.grad.numpy()[:, 1], expected, atol=1e-12)


def test_without_torch_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    bundle = es.spectral.operator_bundle(BALL, 3)
    with pytest.raises(es.MissingExtraError, match="torch must be installed"):
        es.spectral.export_bundle(bundle)


def test_bad_arguments_are_named():
    bundle = es.spectral.operator_bundle(BALL, 3)
    cases = {
        "k must lie in 1..162; it is 0": lambda: es.spectral.operator_bundle(BALL, 0),
        "The operator of a bundle must have one unknown": lambda: es.spectral.operator_bundle(
            BALL, 3, operator="p2"
        ),
        # past the check of types, which only tests have
        "form must be 'scipy', 'numpy' or 'torch'": lambda: es.spectral.export_bundle.__wrapped__(
            bundle, "jax"
        ),
        "precision must be 'single' or 'double'": lambda: es.spectral.export_bundle.__wrapped__(
            bundle, "scipy", "half"
        ),
    }
    for message, call in cases.items():
        with pytest.raises(es.InvalidParameterError, match=message):
            call()


def test_bad_shapes_are_named():
    flat = es.PointCloud(np.eye(2), 1)
    with pytest.raises(es.InvalidShapeError, match="A bundle takes a triangle mesh or points in"):
        es.spectral.operator_bundle(flat, 1)
    with pytest.raises(es.InvalidShapeError, match="A cloud must have dim=2 and at least 3 points"):
        es.spectral.operator_bundle(es.PointCloud(np.eye(3), 1), 1)


@pytest.mark.filterwarnings("ignore:Both sides of a seam")
def test_where_normals_cancel_the_neighbors_give_the_tangent_plane():
    # Two equal triangles back to back: their normals cancel at every corner they share.
    folded = es.TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0]], [[0, 1, 2], [1, 0, 3]])
    bundle = es.spectral.operator_bundle(folded, 1)
    np.testing.assert_allclose(np.abs(bundle.frames[:, 2]), np.tile([0, 0, 1], (4, 1)), atol=1e-12)
    across = folded.vertices[:, 0]
    slopes = np.hypot(bundle.gradient_x @ across, bundle.gradient_y @ across)
    np.testing.assert_allclose(slopes, 1, rtol=1e-12)
