"""Show which limb tells two groups of bodies apart, in six poses, each with triangles of its own."""

import numpy as np

import eigenshape as es

N_MODES = 40


def make_body(pose: int, swollen: float, n_vertices: int) -> es.TriangleMesh:
    """Return a biped in a pose, with its left arm swollen, on triangles of its own."""
    rest, posed = (es.make_creature("biped", each, n_vertices=2 * n_vertices) for each in (0, pose))
    on_arm = np.clip((rest.vertices[:, 0] - 0.3) / 0.15, 0, 1)  # from the elbow on
    outward = swollen * on_arm[:, None] * es.geometry.vertex_normals(posed)
    body = es.TriangleMesh(posed.vertices + outward, posed.faces)
    return es.geometry.decimate(body, n_faces=2 * n_vertices).mesh


def main(n_vertices: int = 700) -> dict[str, np.ndarray]:
    """Match all bodies to the first one, and show on it where the two groups differ in area."""
    groups = np.array([0, 0, 0, 1, 1, 1])
    bodies = [make_body(1 + i, 0.05 * group, n_vertices) for i, group in enumerate(groups)]
    spectra = [es.solve_spectrum(es.cotangent_laplacian(body), N_MODES) for body in bodies]
    target = es.matching.prepare_target(bodies[0])
    maps = {}
    for i in range(1, len(bodies)):
        match = es.match_shapes(bodies[i], target)
        rough = es.spectral.map_from_points(spectra[0], spectra[i], match)
        maps[0, i] = es.spectral.refine_map(rough, N_MODES)

    latent = es.spectral.latent_basis(maps)
    areas = latent.differences("area")
    change = areas[groups == 1].mean(axis=0) - areas[groups == 0].mean(axis=0)
    region = es.spectral.difference_regions(latent, 0, change)
    changed = region > 0.5 * region.max()
    places = bodies[0].vertices[changed]
    print(
        f"{changed.mean():.0%} of the vertices, from {places.min(axis=0)} to {places.max(axis=0)}"
    )

    # The first principal component of the differences, without a look at the groups
    rows = areas.reshape(len(bodies), -1)
    left, sizes, _ = np.linalg.svd(rows - rows.mean(axis=0), full_matrices=False)
    print(f"first component: {sizes[0] ** 2 / (sizes**2).sum():.0%}, scores {left[:, 0].round(2)}")
    return {"vertices": bodies[0].vertices, "region": region, "scores": left[:, 0]}


if __name__ == "__main__":
    main()
