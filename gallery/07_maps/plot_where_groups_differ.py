"""
Where do two groups differ?
===========================

Six bodies in six poses; three have a swollen left arm. Maps from the first body to the others, and
functions that all bodies share, show where the groups differ and nothing of the poses.
"""

import numpy as np

import eigenshape as es

groups = np.array([0, 0, 0, 1, 1, 1])
rest = es.make_creature("biped", 0, n_vertices=1000)
on_arm = np.clip((rest.vertices[:, 0] - 0.3) / 0.15, 0, 1)[:, None]  # from the elbow on
bodies = []
for pose, swollen in enumerate(groups, start=1):
    posed = es.make_creature("biped", pose, n_vertices=1000)
    outward = 0.05 * swollen * on_arm * es.geometry.vertex_normals(posed)
    bodies.append(es.TriangleMesh(posed.vertices + outward, posed.faces))
poses = {f"{'swollen' if groups[i] else 'slim'} {i}": body for i, body in enumerate(bodies)}
es.plot.figure_poses(
    {name: poses[name] for name in ("slim 0", "slim 2", "swollen 4")}, view="front"
)

# %%
# A functional map from the first body to each. Here points of one number correspond; for shapes with
# triangles of their own, `es.match_shapes` finds what corresponds.

spectra = [es.solve_spectrum(es.cotangent_laplacian(body), 40) for body in bodies]
same = range(rest.n_vertices)
maps = {
    (0, i): es.spectral.map_from_points(spectra[0], spectra[i], same, n_modes=40)
    for i in range(1, len(bodies))
}

# %%
# The difference of area between the groups, as a function on the first body.

latent = es.spectral.latent_basis(maps)
areas = latent.differences("area")
change = areas[groups == 1].mean(axis=0) - areas[groups == 0].mean(axis=0)
region = es.spectral.difference_regions(latent, 0, change)
es.figure_field(bodies[0], region, "more area in the second group", view="front", color_map="magma")
# sphinx_gallery_thumbnail_number = 2
