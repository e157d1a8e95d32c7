"""Three things that are found or learned by gradients of spectra, on shapes that the library makes.

    python experiments/learning_shapes/run.py --out figures.json --pictures FOLDER   minutes
    python experiments/learning_shapes/run.py --quick                                seconds

Torch must be installed: pip install 'eigenshape[torch]'.
"""

import sys
from pathlib import Path

import numpy as np
import torch

import eigenshape as es
import eigenshape.torch as et

sys.path.append(str(Path(__file__).resolve().parents[1]))

from outputs import give_out, options_of, output_folder

KIND = "quadruped"
PARTS = ("front legs", "hind legs", "head and neck", "tail", "trunk")


def main() -> None:
    """Run all three, print their figures, and draw."""
    parser = options_of(__doc__)
    parser.add_argument("--pictures", type=output_folder, help="draw into this folder")
    options = parser.parse_args()
    torch.manual_seed(0)
    torch.set_num_threads(1)
    small = options.quick
    results, drawn = {}, {}
    for work in (isospectralize, denoise, segment):
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


if __name__ == "__main__":
    main()
