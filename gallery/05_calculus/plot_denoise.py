"""
Remove the noise of a scan
==========================

`es.operators.denoise` measures the noise and lets the surface flow as long as that requires. Taubin's
filter takes a number of steps instead.
"""

import numpy as np

import eigenshape as es

clean = es.make_creature("biped", n_vertices=3000)
noise = 0.25 * es.geometry.edge_lengths(clean).mean()
rng = np.random.default_rng(0)
noisy = es.TriangleMesh(
    clean.vertices + noise * rng.standard_normal((clean.n_vertices, 3)), clean.faces
)
poses = {
    "scan": noisy,
    "denoise": es.operators.denoise(noisy),
    "Taubin, 10 steps": es.calculus.taubin_smooth(noisy),
}
for name, mesh in poses.items():
    away = np.abs(es.geometry.signed_distance(clean, mesh.vertices))
    print(f"{name:18} {np.sqrt(np.mean(away**2)) / noise:.2f} of the noise is left")

# %%
# Normals show noise best, and pictures are shaded by them.

es.plot.figure_poses(poses, view="front")
