"""Decimation: the same surface by fewer faces, and what lay on the many transferred to the few."""

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import ReadOnly, as_array, record, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._errors import InvalidShapeError, count_nouns
from eigenshape._extras import import_extra
from eigenshape._vectors import size_one
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.distances.closest import closest_points
from eigenshape.geometry.face_turns import orient_consistently
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.one_sided import cut_edges, cut_one_sided
from eigenshape.geometry.repairs.repair_steps import drop_unreferenced
from eigenshape.geometry.requirements import require_oriented, require_sound
from eigenshape.geometry.samples.surface_points import SurfacePoints
from eigenshape.geometry.topology import edge_table, non_manifold_vertices

FEWEST_FACES = 4  # of a closed surface


@record
class DecimatedMesh(ReadOnly):
    """A mesh after `decimate`, and where it lies on the original.

    Attributes
    ----------
    mesh : TriangleMesh
        With n vertices and f faces.
    report : tuple of str
        Sentences that say what was done.
    places : SurfacePoints
        For each vertex, the nearest point of the original.
    source_faces : (f,) int
        For each face, the face of the original that is nearest to its middle.
    original : TriangleMesh

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> ball = es.icosphere(3)
    >>> done = es.geometry.decimate(ball, 320)
    >>> heights = done.carry_values(ball.vertices[:, 2])
    >>> bool(np.abs(heights - done.mesh.vertices[:, 2]).max() < 0.05)
    True
    >>> done.carry_labels(ball.vertices[ball.faces].mean(axis=1)[:, 2] > 0).shape
    (320,)
    """

    mesh: TriangleMesh
    report: tuple[str, ...]
    places: SurfacePoints
    source_faces: Int[np.ndarray, " f"]
    original: TriangleMesh

    def carry_values(self, values: ArrayLike) -> Float[np.ndarray, "n ..."]:
        """Interpolate values on the vertices of the original, linearly in the face of each place.

        Parameters
        ----------
        values : (N,) or (N, d) float
            On the N vertices of the original.

        Returns
        -------
        (n,) or (n, d) float

        Raises
        ------
        InvalidShapeError
            If there are not N values.
        """
        rows = as_array(values, "values")
        _require_rows(rows, self.original.n_vertices, "values", "vertices")
        corners = rows[self.original.faces[self.places.simplices]]
        return np.einsum("pc,pc...->p...", self.places.weights, corners)

    def carry_labels(self, labels: ArrayLike) -> np.ndarray:
        """Return, for each face, the label of the face of the original that is nearest to its middle.

        Parameters
        ----------
        labels : (F,) array
            On the F faces of the original, of any type.

        Returns
        -------
        (f,) array

        Raises
        ------
        InvalidShapeError
            If there are not F labels.
        """
        rows = np.asarray(labels)
        _require_rows(rows, self.original.n_faces, "labels", "faces")
        return rows[self.source_faces]


def decimate(
    mesh: MeshLike, n_faces: Integer | None = None, *, ratio: float | None = None
) -> DecimatedMesh:
    """Describe a surface by fewer faces, by collapsing edges (quadric errors; Garland and Heckbert 1997).

    Edges collapse in the order of the squared distances to the planes of the faces that they stand
    for, and only where the topology stays: components, holes and handles are those of the original.
    Computed by `libigl <https://libigl.github.io>`_, deterministically.

    An edge with more than two faces cannot collapse. The surface is first cut open along such edges
    and at vertices where pieces only touch, and the report says so.

    Parameters
    ----------
    mesh : MeshLike
        Triangles, turned alike.
    n_faces : int, optional
        Number of faces to keep, 4 at least. A little fewer can remain, since a collapse removes two,
        and more where no further edge may collapse, which the report says.
    ratio : float, optional
        Instead of `n_faces`, the share of faces to keep, between 0 and 1.

    Returns
    -------
    DecimatedMesh
        The new mesh, and its places on the original, by which values and labels are transferred.

    Raises
    ------
    InvalidParameterError
        If not exactly one of `n_faces` and `ratio` is given, or it is out of range: below 4 faces,
        or not fewer than there are.
    InvalidShapeError
        If a face has no area or the same corners as another, neighbors are turned against each
        other, or no face can be removed.
    MissingExtraError
        If libigl is not installed.

    See Also
    --------
    subdivide : More faces.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.decimate(es.icosphere(3), ratio=0.25).report
    ('decimate kept 320 of 1,280 faces and 162 of 642 vertices',)
    """
    mesh = as_mesh(mesh)
    if (n_faces is None) == (ratio is None):
        raise InvalidParameterError(
            f"Exactly one of n_faces and ratio must be given; they are {n_faces} and {ratio}."
        )
    if mesh.n_faces <= FEWEST_FACES:
        raise InvalidShapeError(
            f"A mesh must have more than {FEWEST_FACES} faces to be decimated; it has {mesh.n_faces}."
        )
    if n_faces is not None:
        wanted = whole_number(n_faces, "n_faces", FEWEST_FACES, mesh.n_faces - 1)
    elif ratio is None or not 0 < ratio < 1:
        raise InvalidParameterError(f"ratio must lie between 0 and 1; it is {ratio}.")
    else:
        wanted = min(max(FEWEST_FACES, round(ratio * mesh.n_faces)), mesh.n_faces - 1)
    require_sound(mesh)
    require_oriented(mesh)
    qslim = import_extra("igl", "'eigenshape[decimate]'").qslim
    crowded, touching = edge_table(mesh).n_faces > 2, non_manifold_vertices(mesh)
    report = []
    opened = mesh
    if crowded.any() or len(touching):
        # Two faces that met at such an edge may be left alone there, turned against each other.
        opened = orient_consistently(cut_edges(mesh, crowded, touching).mesh)
        opened = cut_one_sided(opened).mesh
        report = [
            f"decimate cut {count_nouns(int(crowded.sum()), 'edge')} with more than two faces and "
            f"{count_nouns(len(touching), 'vertex')} where pieces touch"
        ]
    points, scale = size_one(opened.vertices)
    center = points.mean(axis=0)
    kept, faces, _, _ = qslim(
        np.asfortranarray(points - center), np.asfortranarray(opened.faces), wanted
    )
    if not len(faces):
        raise InvalidShapeError(
            "Edges must be able to collapse; libigl refuses this mesh. Try repair(mesh, "
            '["auto", "largest_component"]), or --repair auto,largest_component on the command line.'
        )
    thinned = drop_unreferenced(TriangleMesh((kept + center) * scale, faces)).mesh
    report.append(
        f"decimate kept {thinned.n_faces:,} of {mesh.n_faces:,} faces and "
        f"{thinned.n_vertices:,} of {mesh.n_vertices:,} vertices"
    )
    if thinned.n_faces > wanted:
        report.append(f"fewer faces, such as {wanted:,}, would change the topology")
    middles = thinned.vertices[thinned.faces].mean(axis=1)
    return DecimatedMesh(
        mesh=thinned,
        report=tuple(report),
        places=closest_points(mesh, thinned.vertices),
        source_faces=closest_points(mesh, middles).simplices,
        original=mesh,
    )


def _require_rows(rows: np.ndarray, count: int, name: str, noun: str) -> None:
    if rows.ndim < 1 or len(rows) != count:
        raise InvalidShapeError(
            f"{name} must have a row for each of the {count} {noun} of the original; the shape is "
            f"{rows.shape}."
        )
