"""A shape and a changed shape: which faces correspond, and which regions are anomalous."""

import numpy as np
from jaxtyping import Int

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import face_labels
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.facets import facet_table
from eigenshape.geometry.simplicial import Mesh

OUTSIDE = -1  # label of a face that is in no anomalous region

Labels = Int[np.ndarray, " _"]


@record
class Perturbation(ReadOnly):
    """A shape M, a changed shape N, and the map Φ between them (thesis 4.1).

    Outside the anomalous regions, the faces of the two correspond in order, corner by corner, and Φ
    is linear on each. The regions X_0, X_1, ... of M and Y_0, Y_1, ... of N have only their
    boundaries in common.

    Attributes
    ----------
    one, two : TriangleMesh or SimplicialMesh
        M and N.
    regions_one : (s1,) int
        For each face or simplex of M, the number i of its region X_i; -1 outside.
    regions_two : (s2,) int
        The same for N and Y_i.

    See Also
    --------
    measure_perturbation : Check and label two shapes.
    measure_closeness : Compute how close the shapes are.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.shapes.grid(2, 1)
    >>> labels = [-1, -1, 0, 0]
    >>> perturbation = es.stability.measure_perturbation(
    ...     mesh, mesh, regions_one=labels, regions_two=labels
    ... )
    >>> perturbation.n_regions, perturbation.outside_one
    (1, array([0, 1]))
    """

    one: Mesh
    two: Mesh
    regions_one: Labels
    regions_two: Labels

    @property
    def n_regions(self) -> int:
        """Number of anomalous regions, r."""
        return int(self.regions_one.max()) + 1

    @property
    def outside_one(self) -> Int[np.ndarray, " f"]:
        """Faces of M outside the regions, ascending; they correspond to `outside_two` in order."""
        return np.flatnonzero(self.regions_one == OUTSIDE)

    @property
    def outside_two(self) -> Int[np.ndarray, " f"]:
        """Faces of N outside the regions, ascending."""
        return np.flatnonzero(self.regions_two == OUTSIDE)


def measure_perturbation(
    one: MeshLike,
    two: MeshLike,
    *,
    regions_one: ArrayLike | None = None,
    regions_two: ArrayLike | None = None,
) -> Perturbation:
    """Describe how one shape became another: by a map outside some regions, and arbitrarily inside.

    The faces outside the regions correspond in order. Surgery that removes some faces and appends
    others keeps that order. Without regions, all faces correspond (δ_H-closeness, thesis 3.1).

    Parameters
    ----------
    one, two : MeshLike
        Two meshes of the same dimensions.
    regions_one, regions_two : (s1,) and (s2,) int, optional
        For each face, the number of its anomalous region, from 0; -1 outside. Two regions must not
        share a vertex.

    Returns
    -------
    Perturbation

    Raises
    ------
    InvalidParameterError
        If the dimensions differ; if labels have another form, or the shapes have different regions;
        if two regions touch; if the numbers of faces outside differ; if Φ maps a vertex to two
        vertices, or two vertices to one; or if Φ does not map the boundary of X_i onto that of Y_i
        (condition C1).

    See Also
    --------
    measure_closeness : Compute how close the shapes are.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> longer = es.TriangleMesh(mesh.vertices * [1, 1, 1.1], mesh.faces)
    >>> perturbation = es.stability.measure_perturbation(mesh, longer)
    >>> perturbation.n_regions, len(perturbation.outside_one)
    (0, 320)
    """
    one = as_simplicial(one, "one")
    two = as_simplicial(two, "two")
    dims = [(mesh.dim, mesh.points.shape[1]) for mesh in (one, two)]
    if dims[0] != dims[1]:
        raise InvalidParameterError(
            "Two shapes must have the same dimensions to correspond; "
            f"these have (m, d) = {dims[0]} and {dims[1]}."
        )
    labels_one = _check_labels(regions_one, one, "regions_one")
    labels_two = _check_labels(regions_two, two, "regions_two")
    n_regions = max(labels_one.max(), labels_two.max()) + 1
    for name, labels in (("regions_one", labels_one), ("regions_two", labels_two)):
        missing = np.flatnonzero(np.bincount(labels[labels != OUTSIDE], minlength=n_regions) == 0)
        if missing.size:
            raise InvalidParameterError(
                f"Both shapes must have the same anomalous regions, numbered 0..{n_regions - 1}; "
                f"{name} has no face in region {missing[0]}."
            )
    outside = [int((labels == OUTSIDE).sum()) for labels in (labels_one, labels_two)]
    if outside[0] != outside[1]:
        raise InvalidParameterError(
            "The same number of faces of both shapes must lie outside the regions; "
            f"{outside[0]} and {outside[1]} do."
        )
    found = Perturbation(one, two, labels_one, labels_two)
    # Φ must map the boundary of each X_i onto that of Y_i (C1).
    pairs = vertex_pairs(found)
    image = np.full(one.n_points, OUTSIDE)
    image[pairs[:, 0]] = pairs[:, 1]
    here = _rims(one, labels_one)
    here[:, 1:] = np.sort(image[here[:, 1:]], axis=1)
    there = _rims(two, labels_two)
    different = set(map(tuple, here.tolist())) ^ set(map(tuple, there.tolist()))
    if different:
        region, *corners = min(different)
        raise InvalidParameterError(
            "The boundary of a region must be mapped onto that of its counterpart (C1); for region "
            f"{region} vertices {corners} of `two` span a side of only one of the two boundaries."
        )
    return found


def vertex_pairs(perturbation: Perturbation) -> Int[np.ndarray, "v 2"]:
    """List the vertices outside the anomalous regions and their images under Φ.

    Parameters
    ----------
    perturbation : Perturbation

    Returns
    -------
    (v, 2) int
        Vertices of M, ascending, and the corresponding vertices of N.

    Raises
    ------
    InvalidParameterError
        If Φ maps a vertex to two vertices, or two vertices to one.

    Examples
    --------
    >>> import eigenshape as es
    >>> one = es.shapes.grid(2, 1)
    >>> two = es.TriangleMesh(one.vertices[::-1], 5 - one.faces)
    >>> perturbation = es.stability.measure_perturbation(one, two)
    >>> es.stability.vertex_pairs(perturbation).tolist()
    [[0, 5], [1, 4], [2, 3], [3, 2], [4, 1], [5, 0]]
    """
    require_type(perturbation, Perturbation, "perturbation")
    here, there = (
        mesh.simplices[outside].ravel()
        for mesh, outside in (
            (perturbation.one, perturbation.outside_one),
            (perturbation.two, perturbation.outside_two),
        )
    )
    pairs = np.unique(np.column_stack([here, there]), axis=0)
    for column, (name, other) in enumerate([("one", "two"), ("two", "one")]):
        places = pairs[np.argsort(pairs[:, column], kind="stable")]
        twice = np.flatnonzero(places[1:, column] == places[:-1, column])
        if twice.size:
            ends = sorted(places[twice[0] : twice[0] + 2, 1 - column].tolist())
            raise InvalidParameterError(
                "Faces outside the regions must correspond corner by corner; vertex "
                f"{places[twice[0], column]} of `{name}` would be vertices {ends[0]} and {ends[1]} "
                f"of `{other}`. Keep the order of faces and corners."
            )
    return pairs


def _check_labels(regions: ArrayLike | None, mesh: Mesh, name: str) -> Labels:
    n = len(mesh.simplices)
    if regions is None:
        return np.full(n, OUTSIDE)
    labels = face_labels(regions, name, mesh).astype(np.int64)
    wrong = np.flatnonzero((labels < OUTSIDE) | (labels >= n))
    if wrong.size:
        raise InvalidParameterError(
            f"{name} must number regions from 0, with -1 outside; "
            f"face {wrong[0]} has {labels[wrong[0]]}."
        )
    corners, at = mesh.simplices[labels != OUTSIDE], labels[labels != OUTSIDE]
    least, most = np.full(mesh.n_points, len(labels)), np.full(mesh.n_points, OUTSIDE)
    np.minimum.at(least, corners, at[:, None])
    np.maximum.at(most, corners, at[:, None])
    shared = np.flatnonzero(least < most)
    if shared.size:
        vertex = shared[0]
        raise InvalidParameterError(
            f"Anomalous regions must not touch; in {name}, vertex {vertex} is in regions "
            f"{least[vertex]} and {most[vertex]}. Make them one region."
        )
    return labels


def _rims(mesh: Mesh, labels: Labels) -> Int[np.ndarray, "k _"]:
    """List the facets between regions and the outside: number of the region, then corners."""
    table = facet_table(mesh)
    at, label = table.simplex_facets.ravel(), np.repeat(labels, mesh.dim + 1)
    outside = np.zeros(len(table.facets), dtype=bool)
    outside[at[label == OUTSIDE]] = True
    rim = (label != OUTSIDE) & outside[at]
    return np.column_stack([label[rim], table.facets[at[rim]]])
