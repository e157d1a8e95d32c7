"""
Maps between poses, learned without labels
==========================================

`et.functional_map` maps by features of two shapes. `et.map_penalties` says how far that map is from an
inverse, from orthogonality, and from commuting with the Laplacians (Roufosse, Sharma and Ovsjanikov
2019). A network learns features from that alone. It needs `pip install 'eigenshape[torch]'`.

.. image:: ../../../experiments/learning_shapes/learn_maps.png
   :alt: A field on a pose, and carried to another by maps of signatures and of learned features.
"""

# sphinx_gallery_thumbnail_path = '../experiments/learning_shapes/learn_maps.png'
import torch
from scipy.spatial import KDTree

import eigenshape as es
import eigenshape.torch as et


def make_pose(pose: int) -> tuple[es.TriangleMesh, et.ShapeTensors]:
    """Return a pose of a quadruped with area 1, and its operators."""
    mesh = es.make_creature("quadruped", pose, n_vertices=500)
    mesh = es.TriangleMesh(mesh.vertices / es.geometry.surface_area(mesh) ** 0.5, mesh.faces)
    return mesh, et.shape_tensors(mesh, es.spectral.operator_bundle(mesh, 24))


torch.manual_seed(0)
train = [make_pose(pose)[1] for pose in range(1, 5)]
energies = torch.linspace(*torch.log(train[0].eigenvalues[[1, -1]]).tolist(), 24)
network = et.DiffusionNet(24, 32, width=32, n_blocks=2)


def describe(shape: et.ShapeTensors) -> torch.Tensor:
    """Return what the network makes of wave kernel signatures."""
    apart = energies[:, None] - torch.log(shape.eigenvalues[1:])
    bands = torch.softmax(-((apart / (energies[1] - energies[0])) ** 2) / 24, dim=1)
    waves = shape.eigenvectors[:, 1:] ** 2 @ bands.T
    return network((waves - waves.mean(dim=0)) / waves.std(dim=0), shape)


optimizer = torch.optim.Adam(network.parameters(), lr=2e-3)
for _ in range(60):
    (one, ours), (two, theirs) = ((train[i], describe(train[i])) for i in torch.randperm(4)[:2])
    there = et.functional_map(one, two, ours, theirs)
    back = et.functional_map(two, one, theirs, ours)
    optimizer.zero_grad()
    sum(et.map_penalties(there, back, one, two)).backward()
    optimizer.step()

# %%
# Two poses that were not seen: a field is carried from one to the other.

(mesh, source), (other, target) = make_pose(101), make_pose(102)
mapping = et.functional_map(source, target, describe(source), describe(target)).detach()
places = KDTree(source.eigenvectors).query(target.eigenvectors @ mapping)[1]
field = mesh.vertices[:, 2]
es.plot.figure_fields(
    {"a pose": (mesh, field), "carried": (other, field[places])}, "place along it"
)
