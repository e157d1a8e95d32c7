"""What a repair returns: the repaired shape, a report in sentences, and where its points come from."""

from typing import Generic, TypeVar

import numpy as np
from jaxtyping import Int

from certeig.kit.arrays import ReadOnly, record
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.simplices import MEASURES
from eigenshape.geometry.simplicial import Mesh

MeshT = TypeVar("MeshT", bound=Mesh)


@record
class RepairedMesh(ReadOnly, Generic[MeshT]):
    """A mesh after one or more repairs, and a report of what they changed.

    Attributes
    ----------
    mesh : TriangleMesh or SimplicialMesh
        The mesh after the repairs.
    report : tuple of str
        One sentence for each repair, such as "drop_degenerate removed 2 faces without area".
    source_vertices : (n,) int
        For each vertex of `mesh`, its index in the original mesh.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.TriangleMesh([[9, 9, 9], [0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 2, 3]])
    >>> done = es.repair(mesh, ["drop_unreferenced"])
    >>> done.report
    ('drop_unreferenced removed 1 vertex without a face',)
    >>> done.source_vertices
    array([1, 2, 3])
    """

    mesh: MeshT
    report: tuple[str, ...]
    source_vertices: Int[np.ndarray, " n"]


@record
class RepairedCloud(ReadOnly):
    """A point cloud after one or more repairs, and a report of what they changed.

    Attributes
    ----------
    cloud : PointCloud
        The cloud after the repairs.
    report : tuple of str
        One sentence for each repair, such as "drop_duplicate_points removed 2 points at the places
        of others".
    source_points : (n,) int
        For each point of `cloud`, its index in the original cloud.

    Examples
    --------
    >>> import eigenshape as es
    >>> cloud = es.PointCloud([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]], dim=1)
    >>> done = es.repair(cloud, ["drop_duplicate_points"])
    >>> done.source_points
    array([0, 1])
    """

    cloud: PointCloud
    report: tuple[str, ...]
    source_points: Int[np.ndarray, " n"]


def simplex_noun(mesh: Mesh) -> str:
    """Return what a simplex of a mesh is called, such as "face"."""
    return MEASURES[mesh.dim][1] if mesh.dim in MEASURES else "simplex"
