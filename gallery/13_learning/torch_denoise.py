"""
A noisy shape with the spectrum of the clean one
================================================

Noise makes a surface larger, and its eigenvalues smaller. The vertices are moved until the first 60
eigenvalues are those of the clean shape. This takes out part of the noise: a spectrum says how rough
a surface is, and 60 numbers do not say where.

It needs `pip install 'eigenshape[torch]'`.

.. image:: ../../../experiments/learning_shapes/denoise.png
   :alt: A noisy quadruped, the same with the spectrum of the clean one, and the clean one.
"""

# sphinx_gallery_thumbnail_path = '../experiments/learning_shapes/denoise.png'
import numpy as np
import torch

import eigenshape as es
import eigenshape.torch as et

clean = es.make_creature("quadruped", n_vertices=500)
length = np.sqrt(es.geometry.surface_area(clean) / len(clean.faces))
noise = 0.2 * length * np.random.default_rng(0).standard_normal(clean.vertices.shape)
noisy = es.TriangleMesh(clean.vertices + noise, clean.faces)
wanted = et.solve_spectrum(clean.vertices, clean.faces, 60).eigenvalues

# %%
# The loss: relative differences of eigenvalues, and a little of the distance from the noisy shape.

start = torch.tensor(noisy.vertices)
vertices = start.clone().requires_grad_()
optimizer = torch.optim.Adam([vertices], lr=0.02 * length)
for _ in range(30):
    optimizer.zero_grad()
    spectrum = et.solve_spectrum(vertices, clean.faces, 60)
    stay = (vertices - start).square().mean() / length**2
    loss = et.spectral_loss(spectrum, wanted) + 1e-3 * stay
    loss.backward()
    optimizer.step()
found = es.TriangleMesh(vertices.detach().numpy(), clean.faces)

# %%
# Angles between the normals of the faces and those of the clean shape:

normals = es.geometry.face_normals(clean)
for name, mesh in {"noisy": noisy, "found": found}.items():
    cosines = (es.geometry.face_normals(mesh) * normals).sum(axis=1)
    print(f"{name}: {np.degrees(np.arccos(cosines.clip(-1, 1))).mean():.1f} degrees")
es.plot.figure_poses({"noisy": noisy, "found": found, "clean": clean})
