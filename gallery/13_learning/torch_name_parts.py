"""
A network that names the parts of animals
=========================================

`et.DiffusionNet` takes operators of a shape as `es.spectral.operator_bundle` computes them. Here it
learns the legs, head, tail and trunk of four quadrupeds, and names those of one that it has not seen.

It needs `pip install 'eigenshape[torch]'`.

.. image:: ../../../experiments/learning_shapes/segment.png
   :alt: A quadruped in a pose that was not seen, with its parts in colors.
"""

# sphinx_gallery_thumbnail_path = '../experiments/learning_shapes/segment.png'
import numpy as np
import torch

import eigenshape as es
import eigenshape.torch as et


def make_shape(number: int) -> tuple[es.TriangleMesh, et.ShapeTensors]:
    """Return an individual in a pose, with its operators, and labels by places in the rest pose."""
    rest, mesh = (
        es.make_creature("quadruped", pose, n_vertices=500, individual=number)
        for pose in (0, number)
    )
    _, y, z = ((rest.vertices - rest.vertices.min(axis=0)) / np.ptp(rest.vertices, axis=0)).T
    is_leg = y < 0.42
    labels = np.select([is_leg & (z > 0.5), is_leg, z > 0.72, z < 0.15], [0, 1, 2, 3], 4)
    mesh = es.TriangleMesh(mesh.vertices / es.geometry.surface_area(mesh) ** 0.5, mesh.faces)
    return mesh, et.shape_tensors(mesh, es.spectral.operator_bundle(mesh, 24), labels)


def features(shape: et.ShapeTensors) -> torch.Tensor:
    """Return logarithms of heat kernel signatures, which do not change with the pose."""
    heat = torch.exp(-shape.eigenvalues[:, None] * torch.logspace(-3, 0, 16))
    return torch.log((shape.eigenvectors**2 @ heat).clamp_min(1e-6))


torch.manual_seed(0)
train = [make_shape(number)[1] for number in range(1, 5)]
network = et.DiffusionNet(n_inputs=16, n_outputs=5, width=16, n_blocks=2)
optimizer = torch.optim.Adam(network.parameters(), lr=5e-3)
for _ in range(12):
    for known in train:
        shape = et.move_shape(known, et.random_rotation())  # an augmentation that costs nothing
        optimizer.zero_grad()
        torch.nn.functional.cross_entropy(network(features(shape), shape), shape.labels).backward()
        optimizer.step()

# %%
# The experiment `learning_shapes`, which drew the picture above, learns from ten of them for longer.

mesh, shape = make_shape(101)
guess = network(features(shape), shape).argmax(dim=1)
print(f"{(guess == shape.labels).float().mean():.0%} of the vertices are named rightly")
es.figure_segments(mesh, guess[torch.tensor(mesh.faces)].mode(dim=1).values.numpy())
