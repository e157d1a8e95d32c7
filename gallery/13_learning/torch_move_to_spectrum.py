"""
A sphere that takes the spectrum of an egg
==========================================

Eigenvalues have derivatives by the vertices, so a shape can be moved until its spectrum is another's
(isospectralization; Cosmo and others 2019). The sphere begins with groups of equal eigenvalues;
`eigenshape.torch` differentiates each group by its sum, where single eigenvalues have no derivative.

It needs `pip install 'eigenshape[torch]'`.

.. image:: ../../../experiments/learning_shapes/isospectralize.png
   :alt: A sphere, what it was moved to, and the egg whose spectrum it has.
"""

# sphinx_gallery_thumbnail_path = '../experiments/learning_shapes/isospectralize.png'
import numpy as np
import torch

import eigenshape as es
import eigenshape.torch as et

sphere = es.icosphere(2)
x, y, z = sphere.vertices.T
egg = es.TriangleMesh(np.column_stack([1.3 * x, 0.9 * y * (1 + 0.3 * x), 0.7 * z]), sphere.faces)
wanted = et.solve_spectrum(egg.vertices, egg.faces, 12).eigenvalues
print(et.solve_spectrum(sphere.vertices, sphere.faces, 9).groups)  # 1, 3 and 5 equal eigenvalues

# %%
# The vertices move smoothly: by low eigenfunctions of the sphere, the lower the farther.

low = es.solve_spectrum(es.cotangent_laplacian(sphere), 25)
basis = torch.tensor(low.eigenvectors[:, 1:] * (2 / low.eigenvalues[1:]))
torch.manual_seed(0)
moves = (1e-3 * torch.randn(24, 3, dtype=torch.float64)).requires_grad_()
optimizer = torch.optim.Adam([moves], lr=0.02)
for step in range(40):
    optimizer.zero_grad()
    vertices = torch.tensor(sphere.vertices) + basis @ moves
    loss = et.spectral_loss(et.solve_spectrum(vertices, sphere.faces, 12), wanted)
    loss.backward()
    optimizer.step()
    if step in (0, 39):
        print(f"step {step}: eigenvalues are {loss.item() ** 0.5:.1%} away")

# %%
# A spectrum does not know place and direction, so the egg that is found lies otherwise. The picture
# above is drawn by the experiment `learning_shapes`, with a finer sphere and 100 steps.

found = es.TriangleMesh(vertices.detach().numpy(), sphere.faces)
es.plot.figure_poses({"start": sphere, "found": found, "target": egg})
