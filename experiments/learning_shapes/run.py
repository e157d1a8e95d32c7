"""Four things that are found or learned by gradients of spectra, on shapes that the library makes.

    python experiments/learning_shapes/run.py --out figures.json --pictures FOLDER   minutes
    python experiments/learning_shapes/run.py --quick                                seconds

Torch must be installed: pip install 'eigenshape[torch]'.
"""

import sys
from pathlib import Path

import numpy as np
import torch
from scipy.spatial import KDTree

import eigenshape as es
import eigenshape.torch as et

sys.path.append(str(Path(__file__).resolve().parents[1]))

from outputs import give_out, options_of, output_folder

KIND = "quadruped"
PARTS = ("front legs", "hind legs", "head and neck", "tail", "trunk")


def main() -> None:
    """Run all four, print their figures, and draw."""
    parser = options_of(__doc__)
    parser.add_argument("--pictures", type=output_folder, help="draw into this folder")
    options = parser.parse_args()
    torch.manual_seed(0)
    torch.set_num_threads(1)
    small = options.quick
    results, drawn = {}, {}
    for work in (isospectralize, denoise, segment, learn_maps):
        results[work.__name__], drawn[work.__name__] = work(small=small)
    give_out(results, options.out)
    if options.pictures:
        for name, figure in drawn.items():
            es.save_figure(figure(), options.pictures / f"{name}.png")


def isospectralize(*, small: bool):
    """Move a sphere until its lowest eigenvalues are those of another shape (Cosmo and others 2019)."""
    start, k = es.icosphere(2 if small else 3), 12 if small else 16
    x, y, z = start.vertices.T
    target = es.TriangleMesh(
        np.column_stack([1.3 * x, 0.9 * y * (1 + 0.3 * x), 0.7 * z]), start.faces
    )
    wanted = et.solve_spectrum(target.vertices, target.faces, k).eigenvalues
    # Smooth moves alone: by low eigenfunctions of the sphere, the lower the farther.
    low = es.solve_spectrum(es.cotangent_laplacian(start), 25)
    basis = torch.tensor(low.eigenvectors[:, 1:] * (2 / low.eigenvalues[1:]))
    moves = (1e-3 * torch.randn(24, 3, dtype=torch.float64)).requires_grad_()
    optimizer = torch.optim.Adam([moves], lr=0.02)
    losses = []
    for _ in range(40 if small else 100):
        optimizer.zero_grad()
        vertices = torch.tensor(start.vertices) + basis @ moves
        loss = et.spectral_loss(et.solve_spectrum(vertices, start.faces, k), wanted)
        losses.append(loss.item())
        loss.backward()
        optimizer.step()
    found = es.TriangleMesh(vertices.detach().numpy(), start.faces)
    figures = {
        "eigenvalues": k,
        "error before": losses[0] ** 0.5,
        "error after": losses[-1] ** 0.5,
    }
    return figures, lambda: es.plot.figure_poses({"start": start, "found": found, "target": target})


def denoise(*, small: bool):
    """Move the vertices of a noisy shape until its spectrum is that of the clean one."""
    clean = es.make_creature(KIND, n_vertices=500 if small else 1000)
    generator = np.random.default_rng(0)
    length = np.sqrt(es.geometry.surface_area(clean) / len(clean.faces))
    noise = 0.2 * length * generator.standard_normal(clean.vertices.shape)
    noisy = es.TriangleMesh(clean.vertices + noise, clean.faces)
    wanted = et.solve_spectrum(clean.vertices, clean.faces, 60).eigenvalues
    vertices = torch.tensor(noisy.vertices, requires_grad=True)
    optimizer = torch.optim.Adam([vertices], lr=0.02 * length)
    for _ in range(30 if small else 60):
        optimizer.zero_grad()
        spectrum = et.solve_spectrum(vertices, clean.faces, 60)
        stay = (vertices - torch.tensor(noisy.vertices)).square().mean() / length**2
        loss = et.spectral_loss(spectrum, wanted) + 1e-3 * stay
        loss.backward()
        optimizer.step()
    found = es.TriangleMesh(vertices.detach().numpy(), clean.faces)

    def roughness(mesh: es.TriangleMesh) -> float:
        """Return the mean angle between normals of a mesh and of the clean one, in degrees."""
        cosines = np.einsum(
            "ij,ij->i", es.geometry.face_normals(mesh), es.geometry.face_normals(clean)
        )
        return float(np.degrees(np.arccos(np.clip(cosines, -1, 1))).mean())

    values = [
        et.solve_spectrum(each.vertices, each.faces, 60).eigenvalues for each in (noisy, found)
    ]
    figures = {
        "error of eigenvalues before": float((values[0] / wanted - 1)[1:].abs().mean()),
        "error of eigenvalues after": float((values[1] / wanted - 1)[1:].abs().mean()),
        "angle of normals before": roughness(noisy),
        "angle of normals after": roughness(found),
    }
    return figures, lambda: es.plot.figure_poses({"noisy": noisy, "found": found, "clean": clean})


def part_labels(individual: int, n: int) -> np.ndarray:
    """Return the part of each vertex, told by its place in the rest pose."""
    x, y, z = es.make_creature(KIND, 0, n_vertices=n, individual=individual).vertices.T
    height = (y - y.min()) / np.ptp(y)
    along = (z - z.min()) / np.ptp(z)
    labels = np.full(len(x), 4)
    labels[along > 0.72] = 2
    labels[along < 0.15] = 3
    legs = height < 0.42
    labels[legs & (along > 0.5)] = 0
    labels[legs & (along <= 0.5)] = 1
    return labels


def make_unit(pose: int, n: int, individual: int) -> es.TriangleMesh:
    """Return a creature of area 1."""
    mesh = es.make_creature(KIND, pose, n_vertices=n, individual=individual)
    return es.TriangleMesh(mesh.vertices / es.geometry.surface_area(mesh) ** 0.5, mesh.faces)


def learned_shape(
    pose: int, individual: int, n: int, k: int
) -> tuple[es.TriangleMesh, et.ShapeTensors]:
    """Return a creature of area 1, and its operators with its labels."""
    mesh = make_unit(pose, n, individual)
    bundle = es.spectral.operator_bundle(mesh, k)
    return mesh, et.shape_tensors(mesh, bundle, part_labels(individual, n))


def heat_features(shape: et.ShapeTensors) -> torch.Tensor:
    """Return logarithms of heat kernel signatures at 16 times, which do not change with the pose."""
    times = torch.logspace(-3, 0, 16)
    heat = shape.eigenvectors**2 @ torch.exp(-shape.eigenvalues[:, None] * times)
    return torch.log(heat.clamp_min(1e-6))


def segment(*, small: bool):
    """Train DiffusionNet to name the parts of quadrupeds, and test it on other individuals and poses."""
    n, k, rounds = (500, 24, 12) if small else (800, 32, 30)
    n_train, n_test = (4, 2) if small else (10, 5)
    train = [learned_shape(pose, pose, n, k)[1] for pose in range(1, n_train + 1)]
    tests = [learned_shape(pose, pose, n, k) for pose in range(101, 101 + n_test)]
    network = et.DiffusionNet(16, len(PARTS), width=16, n_blocks=2)
    optimizer = torch.optim.Adam(network.parameters(), lr=5e-3)
    for _ in range(rounds):
        for number in torch.randperm(n_train).tolist():
            size = float(torch.empty(1).uniform_(0.95, 1.05))
            shape = et.move_shape(train[number], et.random_rotation(), size)
            optimizer.zero_grad()
            scores = network(heat_features(shape), shape)
            torch.nn.functional.cross_entropy(scores, shape.labels).backward()
            optimizer.step()
    with torch.no_grad():
        guesses = [network(heat_features(shape), shape).argmax(dim=1) for _, shape in tests]
    right = [
        (guess == shape.labels).float().mean().item()
        for guess, (_, shape) in zip(guesses, tests, strict=True)
    ]
    shares = [(shape.labels == 4).float().mean().item() for _, shape in tests]
    figures = {
        "shapes to learn from": n_train,
        "accuracy on others": float(np.mean(right)),
        "lowest": min(right),
        "accuracy of the largest part alone": float(np.mean(shares)),
    }
    mesh, _ = tests[0]
    of_faces = guesses[0][torch.tensor(mesh.faces)].mode(dim=1).values.numpy()
    return figures, lambda: es.figure_segments(mesh, of_faces)


def posed_shape(pose: int, n: int, k: int) -> tuple[es.TriangleMesh, et.ShapeTensors]:
    """Return one individual of area 1 in a pose, and its operators."""
    mesh = make_unit(pose, n, 0)
    return mesh, et.shape_tensors(mesh, es.spectral.operator_bundle(mesh, k))


def wave_features(shape: et.ShapeTensors, energies: torch.Tensor) -> torch.Tensor:
    """Return wave kernel signatures, each less its mean and divided by its spread over the shape."""
    sigma = 3.5 * (energies[1] - energies[0])
    distances = energies[:, None] - torch.log(shape.eigenvalues[1:])
    bands = torch.softmax(-(distances**2) / (2 * sigma**2), dim=1)
    waves = shape.eigenvectors[:, 1:] ** 2 @ bands.T
    return (waves - waves.mean(dim=0)) / waves.std(dim=0)


def between_vertices(mesh: es.TriangleMesh) -> np.ndarray:
    """Return the distances along the surface between all vertices."""
    return es.geometry.geodesic_distances(mesh, np.arange(mesh.n_vertices))


def points_of_map(
    mapping: torch.Tensor, source: et.ShapeTensors, target: et.ShapeTensors
) -> np.ndarray:
    """Return the vertex of the source that a functional map gives to each vertex of the target."""
    images = target.eigenvectors @ mapping
    return KDTree(source.eigenvectors.numpy()).query(images.numpy())[1]


def learn_features(train: list[et.ShapeTensors], waves_of, *, coupling: float, steps: int):
    """Train a network on pairs of poses, and return its features as a function of a shape.

    No step knows which points correspond. The losses are the penalties of Roufosse, Sharma and
    Ovsjanikov 2019 and, with some weight, the difference from the map of the soft correspondence,
    as Cao and Bernard 2022 couple the two.
    """
    torch.manual_seed(0)
    network = et.DiffusionNet(24, 32, width=32, n_blocks=2)

    def describe(shape: et.ShapeTensors) -> torch.Tensor:
        return network(waves_of(shape), shape)

    optimizer = torch.optim.Adam(network.parameters(), lr=2e-3)
    for _ in range(steps):
        source, target = (train[number] for number in torch.randperm(len(train))[:2])
        ours, theirs = describe(source), describe(target)
        there = et.functional_map(source, target, ours, theirs)
        back = et.functional_map(target, source, theirs, ours)
        loss = sum(et.map_penalties(there, back, source, target))
        if coupling:
            soft = et.map_from_features(source, target, ours, theirs)
            soft_back = et.map_from_features(target, source, theirs, ours)
            apart = (there - soft).square().mean() + (back - soft_back).square().mean()
            loss = loss + coupling * apart
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    return describe


def learn_maps(*, small: bool):
    """Learn functional maps of poses without labels, and test them on poses that were not seen.

    Two trainings: by penalties alone, and with the soft correspondence beside them.
    """
    k, steps = (24, 150) if small else (30, 400)
    # Poses take turns between two triangulations, so that none is learned.
    sizes = (500, 600) if small else (800, 1000)
    train = [posed_shape(pose, sizes[pose % 2], k)[1] for pose in range(1, 9)]
    tests = {pose: posed_shape(pose, sizes[pose % 2], k) for pose in range(101, 107)}
    pairs = [(101, 102), (103, 104), (105, 106), (102, 103)]
    ends = torch.log(train[0].eigenvalues[[1, -1]]).tolist()
    energies = torch.linspace(*ends, 24)
    # The vertices of a pose, where they lie at rest: nearest ones belong together.
    rest = {pose: make_unit(0, sizes[pose % 2], 0).vertices for pose in tests}
    belongs = {pair: KDTree(rest[pair[0]]).query(rest[pair[1]])[1] for pair in pairs}
    distances = {one: between_vertices(tests[one][0]) for one, _ in pairs}

    def waves_of(shape: et.ShapeTensors) -> torch.Tensor:
        return wave_features(shape, energies)

    def matches(one: int, other: int, describe) -> np.ndarray:
        """Return the vertex of a pose that the map gives to each vertex of another."""
        source, target = tests[one][1], tests[other][1]
        with torch.no_grad():
            mapping = et.functional_map(source, target, describe(source), describe(target))
        return points_of_map(mapping, source, target)

    def errors(describe) -> list[float]:
        """Return for each pair the mean distance from where points belong, along the surface."""
        found = []
        for one, other in pairs:
            off = distances[one][belongs[one, other], matches(one, other, describe)]
            found.append(float(off.mean()))
        return found

    def error_of_true_map(one: int, other: int) -> float:
        """Return the error of the map of the right points: no map in this basis is much better."""
        source, target = tests[one][1], tests[other][1]
        mapping = et.coefficients(target, source.eigenvectors[belongs[one, other]])
        found = points_of_map(mapping, source, target)
        return float(distances[one][belongs[one, other], found].mean())

    untrained, by_penalties, learned = (
        learn_features(train, waves_of, coupling=coupling, steps=n)
        for coupling, n in ((0.0, 0), (0.0, steps), (1.0, steps))
    )
    after = errors(learned)
    figures = {
        "poses to learn from": len(train),
        "pairs not seen": len(pairs),
        "error by wave kernel signatures": float(np.mean(errors(waves_of))),
        "error before": float(np.mean(errors(untrained))),
        "error after penalties alone": float(np.mean(errors(by_penalties))),
        "error after": float(np.mean(after)),
        "largest after": max(after),
        "error of true maps": float(np.mean([error_of_true_map(*pair) for pair in pairs])),
    }
    # The pair that signatures map worst, drawn by the distance from one paw, which tells left from
    # right and front from back.
    one, other = pairs[int(np.argmax(errors(waves_of)))]
    paw = [rest[one][:, 0].max(), rest[one][:, 1].min(), rest[one][:, 2].max()]
    field = distances[one][KDTree(rest[one]).query(paw)[1]]
    target = tests[other][0]
    drawings = {
        "a pose": (tests[one][0], field),
        "carried by wave kernel signatures": (target, field[matches(one, other, waves_of)]),
        "carried by learned features": (target, field[matches(one, other, learned)]),
    }
    return figures, lambda: es.plot.figure_fields(drawings, "distance from a paw")


if __name__ == "__main__":
    main()
