import numpy as np
import pytest

import eigenshape as es

N_MODES = 40


def make_body(pose, swollen, n_vertices=700):
    """Return a biped in a pose, with its left arm swollen, on triangles of its own."""
    rest, posed = (es.make_creature("biped", each, n_vertices=2 * n_vertices) for each in (0, pose))
    on_arm = np.clip((rest.vertices[:, 0] - 0.3) / 0.15, 0, 1)  # from the elbow on
    outward = swollen * on_arm[:, None] * es.geometry.vertex_normals(posed)
    body = es.TriangleMesh(posed.vertices + outward, posed.faces)
    return es.geometry.decimate(body, n_faces=2 * n_vertices).mesh


@pytest.mark.long
def test_two_groups_differ_in_the_left_arm():
    """Matches, functional maps and the latent basis together find what differs, and no pose."""
    groups = np.array([0, 0, 0, 1, 1, 1])
    bodies = [make_body(1 + i, 0.05 * group) for i, group in enumerate(groups)]
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
    places = bodies[0].vertices
    assert places[region > 0.5 * region.max(), 0].min() > 0.2  # no other limb is there

    # The first principal component of the differences, without a look at the groups
    rows = areas.reshape(len(bodies), -1)
    left, _, _ = np.linalg.svd(rows - rows.mean(axis=0), full_matrices=False)
    scores = left[:, 0] * np.sign(left[-1, 0])
    assert scores[:3].max() < 0 < scores[3:].min()
