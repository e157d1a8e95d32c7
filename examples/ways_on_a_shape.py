"""How far, which way, and what a vector becomes on the way: distances, paths, transport, and the parts of a field."""

from pathlib import Path

import numpy as np

import eigenshape as es


def main(folder: Path) -> dict[str, float]:
    """Measure a giraffe from the top of its head, walk to where it is farthest, and decompose a field on it."""
    mesh = es.make_creature("giraffe", n_vertices=2000)
    source = int(mesh.vertices[:, 1].argmax())
    solver = es.calculus.prepare_heat_geodesics(mesh)
    distances = es.calculus.heat_distances(solver, [source])[0]
    # Bands of equal distance, twelve from the source to the farthest point.
    bands = np.floor(12 * np.clip(distances / distances.max(), 0, 1 - 1e-9))
    figure = es.figure_field(mesh, bands, "distance, twelfths of the largest")
    es.save_figure(figure, folder / "distances.png")

    far = int(distances.argmax())
    path = es.calculus.geodesic_path(mesh, source, far)
    waves = es.geometry.geodesic_distances(mesh, [source])[0]

    transport = es.calculus.prepare_vector_heat(mesh)
    field = es.calculus.transport_vectors(transport, [source], [[1.0, 0.0]])
    near = int(np.argsort(distances)[60])
    coordinates = es.calculus.logarithmic_map(transport, source)[near]
    reached = es.calculus.trace_geodesic(mesh, source, coordinates).points[-1]

    frames = es.operators.tangent_frames(mesh)
    at_faces = np.einsum("nk,nkd->nd", field, frames)[mesh.faces].mean(axis=1)
    normals = es.geometry.face_normals(mesh)
    at_faces -= (at_faces * normals).sum(axis=1)[:, None] * normals
    parts = es.calculus.decompose_field(mesh, at_faces)
    areas = es.geometry.face_areas(mesh)
    energy = areas @ (at_faces**2).sum(axis=1)
    return {
        "by heat": float(distances[far]),
        "by waves": float(waves[far]),
        "along the path": path.length,
        "miss of the walk": float(np.linalg.norm(reached - mesh.vertices[near])),
        "length of a vector": float(np.linalg.norm(field, axis=1).max()),
        "exact share": float(areas @ (parts.exact**2).sum(axis=1) / energy),
        "coexact share": float(areas @ (parts.coexact**2).sum(axis=1) / energy),
        "harmonic share": float(areas @ (parts.harmonic**2).sum(axis=1) / energy),
    }


if __name__ == "__main__":
    for name, number in main(Path()).items():
        print(f"{name:<20} {number:.4f}")
