"""Layers and losses on functional maps, and DiffusionNet on operator bundles."""

import numpy as np
import pytest

pytest.importorskip("torch.nn", reason="torch is not installed: pip install 'eigenshape[torch]'")

import torch
from gradients import relative_error

import eigenshape as es
import eigenshape.torch as et

HORSE, BIPED = (es.make_creature(kind, n_vertices=500) for kind in ("quadruped", "biped"))
SPECTRA = [et.solve_spectrum(mesh.vertices, mesh.faces, 8) for mesh in (HORSE, BIPED)]
BUNDLES = [es.spectral.operator_bundle(mesh, 12) for mesh in (HORSE, BIPED)]
SHAPES = [et.shape_tensors(*pair) for pair in zip((HORSE, BIPED), BUNDLES, strict=True)]
MAPS = {"fitted": et.functional_map, "soft": et.map_from_features}


def noise(*shape, seed=0):
    return torch.randn(*shape, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


def features(seed):
    return noise(len((HORSE, BIPED)[seed].vertices), 12, seed=seed)


@pytest.mark.parametrize("kind", MAPS)
def test_gradients_of_maps_by_features(kind):
    def number(ours, theirs):
        return (noise(8, 8) * MAPS[kind](*SPECTRA, ours, theirs)).sum()

    assert relative_error(number, features(0), features(1)) < 1e-6


@pytest.mark.parametrize("kind", MAPS)
def test_gradients_of_maps_by_vertices(kind):
    """Squares, as the sign of an eigenvector may change beside the given vertices."""

    def number(vertices):
        spectrum = et.solve_spectrum(vertices, HORSE.faces, 8)
        mapping = MAPS[kind](spectrum, SPECTRA[1], features(0), features(1))
        return (noise(8, 8) * mapping**2).sum()

    assert relative_error(number, HORSE.vertices, step=1e-4) < 1e-6


def test_gradients_of_penalties():
    def number(one, two):
        return sum(i * part for i, part in enumerate(et.map_penalties(one, two, *SPECTRA), 1))

    assert relative_error(number, noise(8, 8), noise(8, 8, seed=1)) < 1e-6


def test_a_fitted_map_is_the_minimum():
    def energy(mapping):
        ours, theirs = (et.coefficients(s, features(i)) for i, s in enumerate(SPECTRA))
        low, low_there = (spectrum.eigenvalues for spectrum in SPECTRA)
        commutators = (low_there[:, None] - low) / max(low[-1], low_there[-1])
        return ((mapping @ ours - theirs) ** 2).sum() / 12 + 0.5 * (
            commutators**2 * mapping**2
        ).sum()

    found = et.functional_map(*SPECTRA, features(0), features(1), commuting=0.5)
    found = found.detach().requires_grad_()
    (slope,) = torch.autograd.grad(energy(found), found)
    torch.testing.assert_close(slope, torch.zeros(8, 8).double(), atol=1e-9, rtol=0)


@pytest.mark.parametrize("kind", MAPS)
def test_features_of_a_network_meet_spectra_of_double_precision(kind):
    single, double = (
        MAPS[kind](*bases, *(features(seed).to(dtype) for seed in (0, 1)))
        for bases, dtype in ((SHAPES, torch.float64), (SPECTRA, torch.float32))
    )
    assert (single.dtype, double.dtype) == (torch.float32, torch.float64)
    expected = MAPS[kind](*SPECTRA, features(0), features(1))
    torch.testing.assert_close(double, expected, atol=1e-4, rtol=0)
    mixed = MAPS[kind](SPECTRA[0], SHAPES[1], features(0).numpy(), features(1).float())
    assert mixed.dtype in (torch.float32, torch.float64)


def test_a_hard_correspondence_is_a_permutation():
    features = torch.eye(len(HORSE.vertices), dtype=torch.float64)
    order = np.random.default_rng(0).permutation(len(features))
    moved = et.solve_spectrum(HORSE.vertices[order], np.argsort(order)[HORSE.faces], 8)
    mapping = et.map_from_features(SPECTRA[0], moved, features, features[order], temperature=0.01)
    torch.testing.assert_close(mapping.abs(), torch.eye(8).double(), atol=1e-6, rtol=0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: et.functional_map(*SPECTRA, features(0), features(1)[:, :3]),
            "as many features; there are 12 and 3",
        ),
        (
            lambda: et.functional_map(*SPECTRA, features(0), features(1), commuting=0),
            "commuting must be positive",
        ),
        (
            lambda: et.spectral_loss(SPECTRA[0], torch.ones(9)),
            "no more than the spectrum; there are 9",
        ),
        (lambda: et.spectral_loss(SPECTRA[0], torch.zeros(3)), "there are 0 above 0 of 3"),
        (
            lambda: et.shape_tensors(es.icosphere(1), BUNDLES[0]),
            "must be of the shape beside it; it has 500",
        ),
        (
            lambda: et.join_shapes(
                [SHAPES[0], et.shape_tensors(BIPED, es.spectral.operator_bundle(BIPED, 3))]
            ),
            r"one number of eigenpairs; the numbers are \[3, 12\]",
        ),
        (
            lambda: et.coefficients(SPECTRA[0], torch.ones(500)),
            r"one row for each of the 500 points; the shape is \(500,\)",
        ),
        (
            lambda: et.map_from_features(*SPECTRA, features(0)[:9], features(1)),
            r"each of the 500 points; the shape is \(9, 12\)",
        ),
        (
            lambda: et.coefficients.__wrapped__(BUNDLES[0], features(0)),
            r"an OperatorBundle. Pass et.solve_spectrum\(vertices, faces, k\)",
        ),
        (
            lambda: et.map_penalties(torch.eye(8), torch.eye(7), *SPECTRA),
            r"inverse must have shape \(8, 8\).*the shape is \(7, 7\)",
        ),
        (
            lambda: et.spectral_loss(SPECTRA[0], [0.0, torch.nan]),
            "finite numbers in one row; .* 1 are not finite",
        ),
        (lambda: et.move_shape(SHAPES[0], torch.ones(3, 3)), "RᵀR = I and determinant 1"),
        (lambda: et.move_shape(SHAPES[0], -torch.eye(3)), "RᵀR = I and determinant 1"),
        (
            lambda: et.DiffusionNetBlock(3)(torch.ones(9, 3), BUNDLES[0]),
            "one row for each of the 500 points; there are 9 rows",
        ),
        (
            lambda: et.DiffusionNetBlock.forward.__wrapped__(None, torch.ones(500, 3), HORSE),
            "the value is a TriangleMesh. Pass eigenshape.torch.shape_tensors",
        ),
        (
            lambda: et.heat_kernel_signature.__wrapped__(
                es.solve_spectrum(es.cotangent_laplacian(HORSE), 3), 1
            ),
            r"the value is a Spectrum. Pass eigenshape.torch.solve_spectrum\(",
        ),
    ],
)
def test_bad_arguments_are_named(call, message):
    with pytest.raises(es.InvalidParameterError, match=message):
        call()


def network(**options):
    torch.manual_seed(0)
    net = et.DiffusionNet(3, 4, width=6, n_blocks=2, **options).double()
    for block in net.blocks:
        block.times.data = torch.linspace(1e-3, 0.1, 6).double()
    return net


def test_gradients_of_diffusion_net_by_its_input_and_its_times():
    net = network()

    def number(values, times):
        options = {"blocks.0.times": times}
        out = torch.func.functional_call(net, options, (values, BUNDLES[0]))
        return (noise(*out.shape) * out).sum()

    given = noise(len(HORSE.vertices), 3), net.blocks[0].times.detach()
    assert relative_error(number, *given, step=1e-5) < 1e-6


def test_a_bundle_a_shape_and_a_batch_give_the_same_numbers():
    net = network()
    double = [shape.to(torch.float64) for shape in SHAPES]
    batch = et.join_shapes(double)
    together = net(batch.points, batch).split(batch.sizes)
    for shape, bundle, found in zip(double, BUNDLES, together, strict=True):
        torch.testing.assert_close(net(shape.points, shape), found, atol=1e-9, rtol=0)
        torch.testing.assert_close(net(shape.points, bundle), found, atol=1e-4, rtol=0)
    of_shapes = network(at="shapes")
    means = of_shapes(batch.points, batch)
    assert means.shape == (2, 4)
    torch.testing.assert_close(means[1], (double[1].mass @ together[1]) / double[1].mass.sum())


def test_a_block_follows_the_published_formula():
    """Sharp, Attaiki, Crane and Ovsjanikov 2022, equations 3 to 5, with complex gradients."""
    block = network().blocks[0]
    values = noise(len(HORSE.vertices), 6)
    bundle = BUNDLES[0]
    times, vectors = block.times.detach().numpy(), bundle.eigenvectors
    spectral = vectors.T @ (bundle.mass[:, None] * values.numpy())
    diffused = vectors @ (np.exp(-np.outer(bundle.eigenvalues, times)) * spectral)
    gradient = bundle.gradient_x @ diffused + 1j * (bundle.gradient_y @ diffused)
    turn = block.stretch.weight.detach().numpy() + 1j * block.turn.weight.detach().numpy()
    features = np.tanh((gradient.conj() * (gradient @ turn.T)).real)
    joined = torch.tensor(np.hstack([values.numpy(), diffused, features]))
    expected = values + block.perceptron(joined)
    torch.testing.assert_close(block(values, bundle), expected, atol=1e-9, rtol=0)


def test_moved_shapes_have_the_operators_that_would_be_computed():
    rotation = et.random_rotation(torch.Generator().manual_seed(4))
    torch.testing.assert_close(rotation @ rotation.T, torch.eye(3).double())
    assert rotation.det() > 0
    mesh = es.TriangleMesh(2.5 * HORSE.vertices @ rotation.numpy().T, HORSE.faces)
    expected = et.shape_tensors(mesh, es.spectral.operator_bundle(mesh, 12), dtype=torch.float64)
    start = et.shape_tensors(HORSE, BUNDLES[0], dtype=torch.float64)
    moved = et.move_shape(start, rotation, 2.5)
    for name in ("points", "mass", "stiffness", "eigenvalues", "eigenvectors"):
        one, two = getattr(moved, name), getattr(expected, name)
        torch.testing.assert_close(one.to_dense(), two.to_dense(), atol=1e-6, rtol=0, msg=name)
    # Tangents may be chosen otherwise; the gradient as a vector is the same.
    functions = noise(len(HORSE.vertices), 1)

    def gradients(shape):
        parts = torch.stack([shape.gradient_x @ functions, shape.gradient_y @ functions], dim=1)
        return (shape.frames[:, :2] * parts).sum(dim=1)

    torch.testing.assert_close(gradients(moved), gradients(expected), atol=1e-9, rtol=0)
