"""Gradients of spectra and of what is made of them, against central differences."""

import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("torch.nn", reason="torch is not installed: pip install 'eigenshape[torch]'")

import torch
from gradients import central_slope, relative_error

import eigenshape as es
import eigenshape.torch as et
from eigenshape.torch import adjoint
from eigenshape.torch.operators import as_tensor

CREATURE = es.make_creature("quadruped", n_vertices=600)
# Pairs that end with a whole group: of the ball 1 + 3 + 5, of the torus one and six of two.
SHAPES = {
    "ball": (es.icosphere(3), 9),
    "torus": (es.shapes.torus(30, 12), 13),
    "creature": (CREATURE, 12),
    "cut scan": (
        es.partial_scan(es.make_creature("biped", n_vertices=900), [0.3, 0.2, 1]).mesh,
        12,
    ),
}


def noise(*shape):
    return torch.randn(*shape, generator=torch.Generator().manual_seed(0), dtype=torch.float64)


def numbers_of(mesh, k):
    """Functions of the vertices, each to one number, that respect groups."""
    spectrum = et.solve_spectrum(mesh.vertices, mesh.faces, k)
    area, n = spectrum.mass.sum().item(), len(mesh.vertices)
    weights, times = noise(n, 2), [0.02 * area, 0.1 * area]
    energies = np.log(spectrum.eigenvalues[[2, 6]].numpy())

    def solve(vertices):
        return et.solve_spectrum(vertices, mesh.faces, k)

    def sums(vertices):
        values = solve(vertices).eigenvalues
        return sum((i + 1) * values[group].sum() for i, group in enumerate(spectrum.groups))

    def projectors(vertices):
        bases = [solve(vertices).eigenvectors[:, group] for group in spectrum.groups]
        parts = [(basis @ (basis.T @ weights) * weights.flip(0)).sum() for basis in bases]
        return sum((i + 1) * part for i, part in enumerate(parts))

    return {
        "sums of groups": sums,
        "projectors": projectors,
        "heat": lambda v: (weights * et.heat_kernel_signature(solve(v), times)).sum(),
        "waves": lambda v: (weights * et.wave_kernel_signature(solve(v), energies, 0.5)).sum(),
        "kernel": lambda v: (weights.T * et.heat_kernel(solve(v), times[0], [0, 7])).sum(),
        "distances": lambda v: (weights.T * et.heat_distances(v, mesh.faces, [0, 7])).sum(),
        "loss": lambda v: et.spectral_loss(solve(v), spectrum.eigenvalues * 1.5),
        "operator": lambda v: (
            (et.cotangent_laplacian(v, mesh.faces)[0] @ weights).square().sum()
            + (et.cotangent_laplacian(v, mesh.faces)[1] * weights[:, 0]).sum()
        ),
    }


FUNCTIONS = list(numbers_of(*SHAPES["creature"]))


@pytest.mark.parametrize("function", FUNCTIONS)
@pytest.mark.parametrize("shape", SHAPES)
def test_gradients_are_those_of_central_differences(shape, function):
    mesh, k = SHAPES[shape]
    number = numbers_of(mesh, k)[function]
    # Directions of flow turn fast where heat comes from two sides.
    step = 1e-5 if function == "distances" else 1e-3
    assert relative_error(number, mesh.vertices, step=step) < 1e-6


@pytest.mark.data
@pytest.mark.long
def test_gradients_on_a_real_cat(data):
    mesh = es.read_mesh(data / "retrieval" / "cat" / "tosca_cat2.ply")
    weights = noise(len(mesh.vertices), 2)
    area = es.geometry.surface_area(mesh)

    def number(vertices):
        spectrum = et.solve_spectrum(vertices, mesh.faces, 20)
        return (weights * et.heat_kernel_signature(spectrum, [1e-3 * area, 1e-2 * area])).sum()

    size = float(np.ptp(mesh.vertices))
    # Slivers bend the function on a short way.
    assert relative_error(number, mesh.vertices, step=1e-4 * size) < 1e-6


def test_values_are_those_of_the_library():
    spectrum = et.solve_spectrum(CREATURE.vertices, CREATURE.faces, 10)
    laplacian = es.cotangent_laplacian(CREATURE)
    ours = es.solve_spectrum(laplacian, 10)
    W, mass = et.cotangent_laplacian(CREATURE.vertices, CREATURE.faces)
    np.testing.assert_allclose(W.to_dense(), laplacian.stiffness.toarray(), atol=1e-12)
    np.testing.assert_allclose(mass, laplacian.mass.diagonal(), rtol=1e-12)
    np.testing.assert_allclose(spectrum.eigenvalues, ours.eigenvalues, atol=1e-9)
    np.testing.assert_allclose(spectrum.eigenvectors, ours.eigenvectors, atol=1e-7)
    assert spectrum.certificate.complete
    times = es.spectral.default_times(ours)[::20]
    heat, waves = (
        es.heat_kernel_signature(ours, times),
        es.wave_kernel_signature(ours, [2.0], sigma=0.3),
    )
    np.testing.assert_allclose(et.heat_kernel_signature(spectrum, times), heat, rtol=1e-7)
    np.testing.assert_allclose(et.wave_kernel_signature(spectrum, [2.0], 0.3), waves, rtol=1e-6)
    kernel = es.spectral.heat_kernel(ours, [0, 7], None, times[0])
    found = et.heat_kernel(spectrum, times[0], [0, 7])
    np.testing.assert_allclose(found, kernel, rtol=1e-6, atol=1e-9)
    distances = et.heat_distances(CREATURE.vertices, CREATURE.faces, [0, 7])
    expected = es.calculus.heat_distances(CREATURE, [0, 7])
    np.testing.assert_allclose(distances, expected, atol=1e-9)


def test_distances_of_far_coordinates_and_other_components():
    ball = es.icosphere(1)
    both = (
        np.concatenate([ball.vertices, ball.vertices + 5]),
        np.concatenate([ball.faces, ball.faces + 42]),
    )
    vertices = torch.tensor(both[0] * 1e60, requires_grad=True)
    distances = et.heat_distances(vertices, both[1], [0])
    assert torch.isinf(distances[0, 42:]).all()
    distances[0, :42].sum().backward()
    assert vertices.grad.isfinite().all()
    # Lengths are linear in the size.
    slope = (vertices.grad * vertices.detach()).sum()
    torch.testing.assert_close(slope, distances[0, :42].sum().detach(), rtol=1e-9, atol=0)


def petersen():
    """The Petersen graph, whose Laplacian has the eigenvalues 0, 2 (five times) and 5 (four times)."""
    outer = [(i, (i + 1) % 5) for i in range(5)]
    spokes = [(i, i + 5) for i in range(5)]
    inner = [(5 + i, 5 + (i + 2) % 5) for i in range(5)]
    return np.array(outer + spokes + inner).T


def weighted_operator(weights, masses):
    rows, columns = torch.tensor(petersen())
    places = torch.stack([torch.cat(pair) for pair in ((rows, columns), (columns, rows))])
    adjacency = torch.sparse_coo_tensor(
        places, torch.cat([weights, weights]), (10, 10), check_invariants=True
    )
    degrees = torch.zeros(10, dtype=torch.float64).index_add(0, places[0], torch.cat([weights] * 2))
    every = torch.arange(10).expand(2, -1)
    W = torch.sparse_coo_tensor(every, degrees, (10, 10), check_invariants=True) - adjacency
    return W, masses


def test_projectors_of_a_graph_with_multiplicities():
    test = noise(10, 10)

    def number(weights, masses):
        spectrum = et.solve_operator(*weighted_operator(weights, masses), 10)
        two = spectrum.eigenvectors[:, 1:6]
        return (test * (two @ two.T)).sum() + spectrum.eigenvalues[1:6].mean()

    weights, masses = np.ones(15), np.ones(10)
    spectrum = et.solve_operator(
        *weighted_operator(torch.tensor(weights), torch.tensor(masses)), 10
    )
    assert [each.stop - each.start for each in spectrum.groups] == [1, 5, 4]
    assert relative_error(number, weights, masses) < 1e-6


def test_gradients_by_a_mass_that_is_not_diagonal():
    laplacian = es.cotangent_laplacian(CREATURE, "consistent")
    W, B = laplacian.stiffness.tocoo(), laplacian.mass.tocoo()
    weights = noise(len(CREATURE.vertices))

    def number(stretch):
        """Scale rows and columns of B, which keeps it definite."""
        rows, columns = torch.tensor(B.row), torch.tensor(B.col)
        values = torch.tensor(B.data.copy()) * stretch[rows] * stretch[columns]
        mass = torch.sparse_coo_tensor(
            np.stack([B.row, B.col]), values, B.shape, check_invariants=True
        )
        stiffness = torch.sparse_coo_tensor(
            np.stack([W.row, W.col]), torch.tensor(W.data.copy()), W.shape, check_invariants=True
        )
        spectrum = et.solve_operator(stiffness, mass, 6)
        return (weights * spectrum.eigenvectors[:, 3] ** 2).sum() + spectrum.eigenvalues.sum()

    assert relative_error(number, np.ones(len(CREATURE.vertices))) < 1e-6


def test_second_derivatives_of_eigenvalues():
    generator = torch.Generator().manual_seed(3)
    direction = torch.randn(CREATURE.vertices.shape, generator=generator, dtype=torch.float64)
    direction /= direction.norm()

    def slope(distance):
        vertices = torch.tensor(CREATURE.vertices) + distance * direction
        vertices.requires_grad_()
        value = et.solve_spectrum(vertices, CREATURE.faces, 6).eigenvalues[3]
        return vertices, torch.autograd.grad(value, vertices, create_graph=True)[0]

    vertices, gradient = slope(0.0)
    (found,) = torch.autograd.grad((gradient * direction).sum(), vertices)
    bent = central_slope(lambda d: (slope(d)[1] * direction).sum().item(), 1e-4)
    assert (found * direction).sum().item() == pytest.approx(bent, rel=1e-6)


def test_second_derivatives_of_the_sum_of_a_group():
    """The group splits along the way; its sum stays smooth."""
    ball = es.icosphere(3)
    direction = noise(*ball.vertices.shape) / len(ball.vertices) ** 0.5

    def slope(distance):
        vertices = (torch.tensor(ball.vertices) + distance * direction).requires_grad_()
        value = et.solve_spectrum(vertices, ball.faces, 4).eigenvalues[1:].sum()
        return vertices, torch.autograd.grad(value, vertices, create_graph=True)[0]

    vertices, gradient = slope(0.0)
    (found,) = torch.autograd.grad((gradient * direction).sum(), vertices)
    bent = central_slope(lambda d: (slope(d)[1] * direction).sum().item(), 1e-3)
    assert (found * direction).sum().item() == pytest.approx(bent, rel=1e-6)


def ball_spectrum(k=9):
    ball = es.icosphere(3)
    vertices = torch.tensor(ball.vertices, requires_grad=True)
    return vertices, et.solve_spectrum(vertices, ball.faces, k)


@pytest.mark.parametrize(
    ("number", "message"),
    [
        (
            lambda s: s.eigenvalues[2],
            r"differentiated by their sum; numbers 1 to 3 lie near 1\.99.* gaps of",
        ),
        (lambda s: s.eigenvectors[0, 2], r"differentiated by their projector .*numbers 1 to 3"),
        (lambda s: (s.eigenvectors[0] ** 2 * s.eigenvalues).sum(), "differentiated by their sum"),
    ],
)
def test_what_has_no_derivative_is_refused_with_the_gap(number, message):
    _, spectrum = ball_spectrum()
    with pytest.raises(es.InvalidParameterError, match=message):
        number(spectrum).backward()


def test_a_group_that_k_cuts_is_refused_and_the_rest_is_not():
    vertices, spectrum = ball_spectrum(k=6)
    spectrum.eigenvalues[1:4].sum().backward(retain_graph=True)
    assert vertices.grad.abs().max() > 0
    with pytest.raises(
        es.InvalidParameterError, match=r"must be complete .* Solve for k=4 or k=9 or more"
    ):
        et.heat_kernel_signature(spectrum, [1.0]).sum().backward()
    # The copies of eigenvalue 0 of 20 pieces go beyond the pairs that are solved.
    ball = es.icosphere(1)
    pieces = np.concatenate([ball.vertices + 3 * i for i in range(20)])
    faces = np.concatenate([ball.faces + 42 * i for i in range(20)])
    spectrum = et.solve_spectrum(torch.tensor(pieces, requires_grad=True), faces, 2)
    with pytest.raises(es.InvalidParameterError, match=r"must be complete .* a larger k"):
        spectrum.eigenvalues.sum().backward()


def test_second_derivatives_of_eigenvectors_are_refused():
    vertices = torch.tensor(CREATURE.vertices, requires_grad=True)
    spectrum = et.solve_spectrum(vertices, CREATURE.faces, 4)
    (gradient,) = torch.autograd.grad(
        (spectrum.eigenvectors[0] ** 2).sum(), vertices, create_graph=True
    )
    with pytest.raises(es.InvalidParameterError, match="Second derivatives of functions"):
        gradient.sum().backward()


def test_equations_that_do_not_converge_are_named(monkeypatch):
    vertices = torch.tensor(CREATURE.vertices, requires_grad=True)
    spectrum = et.solve_spectrum(vertices, CREATURE.faces, 4)
    monkeypatch.setattr(adjoint, "MOST_ITERATIONS", 1)
    with pytest.raises(es.ConvergenceError, match=r"must converge; those of eigenvalues 0 to 3"):
        (spectrum.eigenvectors[0] ** 2).sum().backward()


def test_bad_input_is_refused_as_in_the_library():
    with pytest.raises(es.InvalidShapeError, match="Faces must have area"):
        et.solve_spectrum([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], 1)
    with pytest.raises(es.InvalidParameterError, match=r"k must lie in 1\.\.42"):
        et.solve_spectrum(es.icosphere(1).vertices, es.icosphere(1).faces, 43)
    with pytest.raises(es.InvalidParameterError, match="must be a sparse COO tensor"):
        et.solve_operator(torch.eye(3), torch.ones(3), 2)
    ball = es.icosphere(1)
    with pytest.raises(es.InvalidParameterError, match=r"a TriangleMesh. Pass mesh.vertices and"):
        et.solve_spectrum(ball, ball.faces, 3)
    for faces in (None, ball.faces + 0.5):
        with pytest.raises(es.InvalidShapeError, match="faces must be whole numbers"):
            et.solve_spectrum(ball.vertices, faces, 3)


def test_values_print_in_one_line():
    ball = es.icosphere(1)
    spectrum = et.solve_spectrum(ball.vertices, ball.faces, 4)
    assert repr(spectrum) == "TensorSpectrum(4 eigenpairs in 2 groups on 42 points)"
    shape = et.shape_tensors(ball, es.spectral.operator_bundle(ball, 4))
    assert repr(shape) == "ShapeTensors(42 points, 4 eigenpairs)"
    assert repr(et.join_shapes([shape] * 2)) == "ShapeTensors(2 shapes, 84 points, 4 eigenpairs)"


def test_arrays_come_in_by_dlpack_without_a_copy():
    class Elsewhere:
        """An array of another library, which speaks DLPack alone."""

        def __init__(self, array):
            self.array = array

        def __dlpack__(self, **options):
            return self.array.__dlpack__(**options)

        def __dlpack_device__(self):
            return self.array.__dlpack_device__()

    array = np.array(CREATURE.vertices)
    tensor = as_tensor(Elsewhere(array))
    array[0, 0] = 7.0
    assert tensor[0, 0] == 7.0
    found = et.solve_spectrum(Elsewhere(np.array(CREATURE.vertices)), CREATURE.faces, 3)
    shared = np.from_dlpack(found.eigenvectors)
    assert shared.ctypes.data == found.eigenvectors.data_ptr()


def test_results_do_not_depend_on_threads():
    def gradient(n):
        es.set_threads(n)
        vertices = torch.tensor(CREATURE.vertices, requires_grad=True)
        spectrum = et.solve_spectrum(vertices, CREATURE.faces, 30)
        et.heat_kernel_signature(spectrum, [0.01]).sum().backward()
        return vertices.grad.numpy()

    try:
        np.testing.assert_array_equal(gradient(1), gradient(2))
    finally:
        es.set_threads(None)


def test_without_torch_the_extra_is_named():
    code = "import sys; sys.modules['torch'] = None; import eigenshape.torch"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "MissingExtraError" in done.stderr
    assert "pip install 'eigenshape[torch]'" in done.stderr


def test_the_library_does_not_load_torch():
    code = "import eigenshape as es, sys; es.solve_spectrum; es.spectral; print('torch' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
