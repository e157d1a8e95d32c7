"""One word changes the operator: a mesh, tetrahedra, a curve, points; and an operator of your own, checked."""

import numpy as np
import scipy.sparse as sp

import eigenshape as es


def inverse_length_laplacian(mesh: es.TriangleMesh) -> es.Laplacian:
    """Weigh each edge by one over its length, as somebody might who wants an operator of their own."""
    edges = es.geometry.edge_table(mesh).edges
    half = sp.coo_array(
        (1 / es.geometry.edge_lengths(mesh), edges.T), shape=(mesh.n_vertices,) * 2
    ).tocsr()
    weights = half + half.T
    return es.Laplacian(
        sp.diags_array(weights.sum(axis=1)) - weights,
        sp.diags_array(es.geometry.dual_volumes(mesh)).tocsr(),
    )


def main() -> dict[str, np.ndarray]:
    """Solve four shapes by their usual operators, and ask which laws an operator of our own keeps."""
    sphere = es.shapes.fibonacci_sphere(1000)
    shapes = {
        "sphere": sphere,
        "box": es.shapes.box(6, 6, 6),
        "interval": es.shapes.interval(100),
        "points": es.PointCloud(sphere.vertices, dim=2),
    }
    spectra = {
        name: es.solve_spectrum(es.build_laplacian(shape), 4).eigenvalues
        for name, shape in shapes.items()
    }
    noisy = es.mesh_laplacian(sphere, correct="log", form="random-walk")
    spectra["sphere, by a kernel"] = es.solve_spectrum(noisy, 4).eigenvalues

    report = es.check_operator(
        inverse_length_laplacian, es.icosphere(2), promises={"constants", "rigid_motion", "volume"}
    )
    print(report.explain())
    return spectra


if __name__ == "__main__":
    for name, values in main().items():
        print(f"{name:<20} {np.round(values, 3)}")
