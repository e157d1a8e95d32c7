"""Errors that the docs print: curvature, distances, heat traces, geometry from eigenvalues, clusters, bends."""

import sys
import warnings
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import potpourri3d as pp3d
from sklearn.cluster import SpectralClustering
from sklearn.datasets import make_blobs, make_circles, make_moons
from sklearn.metrics import adjusted_rand_score
from sklearn.preprocessing import StandardScaler

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))

from frame import rounded
from outputs import give_out, options_of
from real_shapes import DATA, require_data

SPHERE_TRACE = sum(
    (2 * d + 1) * np.exp(-d * (d + 1.0)) for d in range(40)
)  # Z(1) of the unit sphere
EXACT = {  # eigenvalues, condition, area, boundary length
    "unit sphere": (es.shapes.sphere_eigenvalues, None, 4 * np.pi),
    "projective plane": (es.shapes.projective_plane_eigenvalues, None, 2 * np.pi),
    "flat torus, 1 × 1": (lambda k: es.shapes.flat_torus_eigenvalues(k, np.eye(2)), None, 1.0),
    "flat torus, 1 × 2": (
        lambda k: es.shapes.flat_torus_eigenvalues(k, np.diag([1.0, 2.0])),
        None,
        2.0,
    ),
    "unit disc, Neumann": (lambda k: es.shapes.disc_eigenvalues(k, "neumann"), "neumann", np.pi),
    "unit disc, Dirichlet": (
        lambda k: es.shapes.disc_eigenvalues(k, "dirichlet"),
        "dirichlet",
        np.pi,
    ),
    "unit square, Neumann": (lambda k: es.shapes.box_eigenvalues(k, (1.0, 1.0)), "neumann", 1.0),
}


def curvature(*, quick: bool) -> dict[str, Any]:
    """Return the error of principal curvatures on the unit sphere, where both are 1, root mean square."""
    found = {}
    for level in (2,) if quick else (2, 3, 4):
        n = es.icosphere(level).n_vertices
        spheres = {
            "icosphere": es.icosphere(level),
            "uneven": es.shapes.uneven_sphere(n),
            "random": es.shapes.random_sphere(n, rng=np.random.default_rng(1)),
        }
        found[str(n)] = {
            name: np.sqrt(np.mean((es.geometry.principal_curvatures(mesh).values - 1) ** 2))
            for name, mesh in spheres.items()
        }
    return found


def distances(*, quick: bool) -> dict[str, Any]:
    """Return errors of distances by heat from a vertex of the unit sphere."""
    found = {}
    for level in (2,) if quick else (2, 3, 4, 5):
        ball = es.icosphere(level)
        exact = np.arccos(np.clip(ball.vertices @ ball.vertices[0], -1, 1))
        found[str(ball.n_vertices)] = sizes(es.calculus.heat_distances(ball, [0])[0] - exact)
    return found


def sizes(errors: np.ndarray) -> dict[str, float]:
    """Return the largest and the mean error."""
    return {"largest": np.abs(errors).max(), "mean": np.abs(errors).mean()}


def octasphere(times: int) -> es.TriangleMesh:
    """Return a sphere that has its equator along edges."""
    points = np.concatenate([np.eye(3), -np.eye(3)])
    faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    ball = es.TriangleMesh(points, faces)
    for _ in range(times):
        finer = es.geometry.subdivide(ball)
        lengths = np.linalg.norm(finer.vertices, axis=1, keepdims=True)
        ball = es.TriangleMesh(finer.vertices / lengths, finer.faces)
    return ball


def equator(times: int) -> tuple[es.TriangleMesh, list[int], np.ndarray]:
    """Return a sphere, its equator run eastward, and the distance to it, positive in the south."""
    ball = octasphere(times - 1)
    x, y, z = ball.vertices.T
    on = np.flatnonzero(np.abs(z) < 1e-12)
    around = on[np.argsort(np.arctan2(y[on], x[on]))].tolist()
    return ball, [*around, around[0]], -np.arcsin(np.clip(z, -1, 1))


def square(times: int) -> tuple[es.TriangleMesh, list[int], np.ndarray]:
    """Return a plane of side 1, a square in its middle run counter-clockwise, and the distance to that."""
    n = 12 * 2 ** (times - 3)
    plane, low, high = es.shapes.grid(n, n), n // 4, 3 * n // 4
    places = {tuple(place): at for at, place in enumerate(np.rint(plane.vertices[:, :2] * n))}
    corners = [(low, low), (high, low), (high, high), (low, high), (low, low)]
    loop = [places[low, low]]
    for start, end in pairwise(corners):
        steps = np.linspace(start, end, high - low + 1)[1:]
        loop += [places[tuple(np.rint(step))] for step in steps]
    beyond = np.abs(plane.vertices[:, :2] - 0.5) - 0.25
    outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
    return plane, loop, outside + np.minimum(beyond.max(axis=1), 0)


def signed_distances(*, quick: bool) -> dict[str, Any]:
    """Return errors of signed distances by heat, of ours and of potpourri3d's, which has the opposite sign."""
    found: dict[str, Any] = {}
    for name, make in {"equator": equator, "square": square}.items():
        for times in (3,) if quick else (3, 4, 5, 6):
            mesh, loop, exact = make(times)
            solver = pp3d.MeshSignedHeatSolver(np.array(mesh.vertices), np.array(mesh.faces))
            theirs = -solver.compute_distance([[(vertex, []) for vertex in loop]])
            found.setdefault(name, {})[str(mesh.n_vertices)] = {
                "eigenshape": sizes(es.calculus.signed_heat_distance(mesh, [loop]) - exact),
                "potpourri3d": sizes(theirs - exact),
            }
    return found


def logarithms(*, quick: bool) -> dict[str, Any]:
    """Return the largest error of logarithmic maps on the unit sphere, within 1.5 of the source."""
    found = {}
    for level in (2,) if quick else (2, 3, 4, 5):
        ball = es.icosphere(level)
        source, frame = ball.vertices[0], es.operators.tangent_frames(ball)[0]
        angles = np.arccos(np.clip(ball.vertices @ source, -1, 1))
        tangents = ball.vertices - np.outer(np.cos(angles), source)
        tangents[1:] *= (angles / np.linalg.norm(tangents, axis=1).clip(1e-300))[1:, None]
        exact, near = tangents @ frame.T, angles < 1.5
        found[str(ball.n_vertices)] = {
            method: np.linalg.norm(
                es.calculus.logarithmic_map(ball, 0, method=method) - exact, axis=1
            )[near].max()
            for method in ("affine", "adaptive", "radial")
        }
    return found


def trace(*, quick: bool) -> dict[str, Any]:
    """Return relative errors of Z(1) of the sphere by quadratic elements, and after Romberg's steps."""
    levels = (2, 3) if quick else (2, 3, 4)
    column = []
    for level in levels:
        laplacian = es.operators.fem_laplacian(es.icosphere(level), order=2)
        values = es.solve_spectrum(laplacian, 64).eigenvalues
        column.append(float(np.exp(-values).sum()))
    found = {}
    for step in range(len(levels)):
        found[str(step)] = [value / SPHERE_TRACE - 1 for value in column]
        factor = 4 ** (step + 1)
        column = [(factor * fine - coarse) / (factor - 1) for coarse, fine in pairwise(column)]
    return found


def described(found: Any, area: float) -> dict[str, Any]:
    """Return what was recovered of a surface, and the errors that are stated."""
    row = {
        "area": found.area / area - 1,
        "area, stated": found.area_error / area,
        "characteristic": found.euler_characteristic,
        "characteristic, stated": found.euler_characteristic_error,
    }
    if found.boundary_length is not None:
        row |= {"length": found.boundary_length, "length, stated": found.boundary_length_error}
    return row


def exact_geometry(*, quick: bool) -> dict[str, Any]:
    """Return what exact eigenvalues say of surfaces."""
    k = 60 if quick else 300
    return {
        name: described(es.spectral.recover_geometry(values(k), boundary=boundary), area)
        for name, (values, boundary, area) in EXACT.items()
    }


def mesh_geometry(*, quick: bool) -> dict[str, Any]:
    """Return what eigenvalues by cubic elements say of meshes."""
    meshes = {"sphere": es.icosphere(2 if quick else 3)}
    if not quick:
        meshes |= {"torus": es.shapes.torus(60, 30)}
        meshes |= {f"disc of {n} rings": es.shapes.disc(n) for n in (20, 40)}
    found = {}
    for name, mesh in meshes.items():
        rim = es.geometry.boundary_vertices(mesh)
        for boundary in ("neumann", "dirichlet") if len(rim) else (None,):
            quadratic, cubic = (
                elements(mesh, order, boundary, 60 if quick else 300) for order in (2, 3)
            )
            geometry = es.spectral.recover_geometry(
                cubic, boundary=boundary, errors=(quadratic - cubic) / 4
            )
            title = f"{name}, {boundary}" if boundary else name
            row = described(geometry, es.geometry.surface_area(mesh))
            found[title] = {"vertices": mesh.n_vertices} | row
    return found


def elements(mesh: es.TriangleMesh, order: int, boundary: str | None, k: int) -> np.ndarray:
    """Return eigenvalues by elements of an order, under a condition."""
    laplacian = es.operators.fem_laplacian(mesh, order=order)
    if boundary == "dirichlet":
        nodes = es.operators.fem_boundary_nodes(mesh, order)
        return es.solve_spectrum(laplacian, k, fixed=nodes).eigenvalues
    return es.solve_spectrum(laplacian, k).eigenvalues


def clusters(*, quick: bool) -> dict[str, Any]:
    """Return adjusted Rand indices on scikit-learn's toy data sets."""
    n = 200 if quick else 500
    blobs, which = make_blobs(n_samples=n, random_state=170)
    sets = {
        "circles": (*make_circles(n_samples=n, factor=0.5, noise=0.05, random_state=30), 2),
        "moons": (*make_moons(n_samples=n, noise=0.05, random_state=30), 2),
        "blobs": (*make_blobs(n_samples=n, random_state=30), 3),
        "aniso": (blobs @ [[0.6, -0.6], [-0.4, 0.8]], which, 3),
        "varied": (
            *make_blobs(n_samples=n, cluster_std=[1.0, 2.5, 0.5], random_state=170),
            3,
        ),
    }
    found = {}
    for name, (points, truth, count) in sets.items():
        data = StandardScaler().fit_transform(points)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # graphs of several components
            theirs = SpectralClustering(
                count, affinity="nearest_neighbors", eigen_solver="arpack", random_state=0
            ).fit_predict(data)
        ours = {
            method: es.spectral.SpectralClusterer(count, method=method).fit_predict(data)
            for method in ("k-means", "normalized-cut")
        }
        found[name] = {
            method: adjusted_rand_score(truth, labels)
            for method, labels in {"scikit-learn": theirs, **ours}.items()
        }
    return found


def bends() -> dict[str, Any]:
    """Return what a turn of the upper part does to a sculpture with four handles."""
    mesh = es.read_mesh(DATA / "classics" / "fertility.off")
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    above, below = (low + share * (high - low) for share in (0.6, 0.2))
    upper = es.deformation.BoxRegion([-np.inf, above[1], -np.inf], [np.inf] * 3)
    lower = es.deformation.BoxRegion([-np.inf] * 3, [np.inf, below[1], np.inf])
    rig = es.rig_shape(mesh)
    rim = es.deformation.region_boundary(mesh, es.deformation.region_mask(mesh, upper))
    turn = es.Rotation(mesh.vertices[rim].mean(axis=0), [0, 0, 1], np.pi / 6)
    found = {}
    for name, options in {
        "none": {},
        "fixed": {"fixed": lower},
        "uncrossed": {"mode": "uncrossed"},
    }.items():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            bent = es.deform(rig, upper, turn, **options)
        change = es.deformation.measure_distortion(mesh, bent)
        found[name] = {
            "edges": change.edge_error,
            "least area": change.area_ratios.min(),
            "crossing": len(es.geometry.self_intersections(bent)),
        }
    return found


PARTS: dict[str, Callable[..., dict[str, Any]]] = {
    "curvature": curvature,
    "distances": distances,
    "signed distances": signed_distances,
    "logarithms": logarithms,
    "trace": trace,
    "exact geometry": exact_geometry,
    "mesh geometry": mesh_geometry,
    "clusters": clusters,
}


def main() -> None:
    """Measure all, print it, and write it where it was asked for."""
    parser = options_of(__doc__)
    options = parser.parse_args()
    results = {name: part(quick=options.quick) for name, part in PARTS.items()}
    if not options.quick:
        require_data()
        results["bends"] = bends()
    give_out(rounded(results), options.out)


if __name__ == "__main__":
    main()
