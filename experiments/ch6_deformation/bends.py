"""The methods that are compared: each takes a binding and its handles, and returns vertices."""

from collections.abc import Callable, Sequence

import igl  # of the test extra
import numpy as np
from peers import as_rigid_as_possible, biharmonic_blend, spectral_rigid

import eigenshape as es

Method = Callable[[es.deformation.Binding, Sequence[es.Rotation | es.Translation]], np.ndarray]
PEER_ROUNDS = 100


def libigl(
    binding: es.deformation.Binding, handles: Sequence[es.Rotation | es.Translation]
) -> np.ndarray:
    """Bend as rigidly as possible by libigl, whose energy is that of spokes and rims, from the shape at rest."""
    mesh, free = binding.rig.mesh, np.zeros(binding.rig.mesh.n_vertices, dtype=bool)
    free[binding.part.free] = True
    held, goal = (
        np.flatnonzero(~free),
        as_rigid_as_possible(binding, handles, n_rounds=1),
    )
    data = igl.ARAPData()
    data.max_iter = PEER_ROUNDS
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    igl.arap_precomputation(vertices, faces, 3, held.astype(np.int32), data)
    start = vertices.copy()
    start[held] = goal[held]
    return np.asarray(igl.arap_solve(np.ascontiguousarray(goal[held]), data, start))


METHODS: dict[str, Method] = {
    "graded": lambda binding, handles: es.deformation.bend(binding, handles).vertices,
    "uncrossed": lambda binding, handles: (
        es.deformation.bend(binding, handles, mode="uncrossed").vertices
    ),
    "thesis": lambda binding, handles: (
        es.deformation.bend(binding, handles, mode="thesis").vertices
    ),
    "ARAP": lambda binding, handles: as_rigid_as_possible(binding, handles, n_rounds=PEER_ROUNDS),
    "ARAP (libigl)": libigl,
    "biharmonic": biharmonic_blend,
    "spectral": spectral_rigid,
}
