"""Skin that bends smoothly around joints."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from scipy.sparse.linalg import splu

from eigenshape._threads import one_blas_thread
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import adjacency_matrix, edge_table

# Implicit diffusion steps of the narrowest bend; wider bends take more steps of the same length.
# Three steps are close to a Gaussian profile.
STEPS = 3


@dataclass(frozen=True, eq=False)
class Joints:
    """The joints of a creature, the outermost first.

    Attributes
    ----------
    pivots, axes : (j, 3) float
        A point and the unit direction of the axis of each joint.
    limits : (j, 2) float
        Smallest and largest angle of each joint, in radians.
    follows : (n, j) float
        Share of the angle by which each vertex turns: 1 beyond the joint, 0 before it.
    """

    pivots: Float[np.ndarray, "j 3"]
    axes: Float[np.ndarray, "j 3"]
    limits: Float[np.ndarray, "j 2"]
    follows: Float[np.ndarray, "n j"]


def diffuse(
    mesh: TriangleMesh, values: Float[np.ndarray, "n j"], widths: Float[np.ndarray, " j"]
) -> Float[np.ndarray, "n j"]:
    """Diffuse functions on a mesh of even triangles, each by a given standard deviation in length.

    Diffusion stays on the skin, so nothing leaks to another limb that is only near in space.
    """
    edges = edge_table(mesh).edges
    ends = mesh.vertices[edges]
    length2 = np.square(ends[:, 0] - ends[:, 1]).sum(axis=1).mean()
    links = adjacency_matrix(edges, np.ones(len(edges)), mesh.n_vertices)
    step = widths.min() ** 2 / STEPS
    # With six neighbors at equal distance the sum of differences is 3/2 length² times the
    # Laplacian, and the variance of diffused heat is twice the time.
    pencil = sp.eye_array(mesh.n_vertices) + step / (3 * length2) * (
        sp.diags_array(links.sum(axis=1)) - links
    )
    spread, n_steps = values.copy(), np.rint(widths**2 / step)
    with one_blas_thread():
        factor = splu(pencil.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        for step_number in range(int(n_steps.max())):
            unfinished = n_steps > step_number
            spread[:, unfinished] = factor.solve(spread[:, unfinished])
    return spread


def bend_at_joints(
    points: Float[np.ndarray, "n 3"], joints: Joints, angles: Float[np.ndarray, " j"]
) -> Float[np.ndarray, "n 3"]:
    """Rotate each point about each joint by its share of the angle (Rodrigues' formula)."""
    for pivot, axis, angle, share in zip(
        joints.pivots, joints.axes, angles, joints.follows.T, strict=True
    ):
        arm = points - pivot
        cosine, sine = np.cos(angle * share)[:, None], np.sin(angle * share)[:, None]
        points = (
            pivot
            + cosine * arm
            + sine * np.cross(axis, arm)
            + (1 - cosine) * np.einsum("ni,i->n", arm, axis)[:, None] * axis
        )
    return points
