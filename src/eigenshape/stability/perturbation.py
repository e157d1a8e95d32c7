"""One shape and a changed one: which faces correspond, and where anything may have happened."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from eigenshape._arguments import require_type
from eigenshape._arrays import as_array, frozen
from eigenshape._errors import InvalidParameterError
from eigenshape._typing import ArrayLike
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.facets import facet_table
from eigenshape.geometry.simplicial import Mesh

OUTSIDE = -1

Labels = Int[np.ndarray, " _"]


@dataclass(frozen=True, eq=False)
class Perturbation:
    """A shape M, a changed shape N, and a map Φ between what is outside their anomalous regions (thesis 4.1).

    Outside, the faces of the two correspond in order, corner by corner; Φ is linear on each. Inside, M has the
    regions X_0, X_1, ... and N the regions Y_0, Y_1, ..., which have nothing in common but their boundaries.

    Attributes
    ----------
    one, two : TriangleMesh or SimplicialMesh
        M and N.
    regions_one : (s1,) int
        For each face of M, or simplex, the i of the region X_i that it is in; -1 outside.
    regions_two : (s2,) int
        The same for N and Y_i.
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
        """The faces of M outside, ascending; each corresponds to that of `outside_two` in the same place."""
        return np.flatnonzero(self.regions_one == OUTSIDE)

    @property
    def outside_two(self) -> Int[np.ndarray, " f"]:
        """The faces of N outside, ascending."""
        return np.flatnonzero(self.regions_two == OUTSIDE)


def measure_perturbation(
    one: MeshLike,
    two: MeshLike,
    *,
    regions_one: ArrayLike | None = None,
    regions_two: ArrayLike | None = None,
) -> Perturbation:
    """Say how one shape became another: by a map, and by anything at all in some regions.

    Surgery that cuts faces out and adds others leaves the rest in order: that is what corresponds. Without regions all
    faces do, as for shapes that are δ_H-close (thesis 3.1).

    Parameters
    ----------
    one, two : MeshLike
        Of the same dimensions.
    regions_one, regions_two : (s1,) and (s2,) int, optional
        For each face the number of its anomalous region, from 0; -1 outside. Closures of two regions are disjoint: no
        vertex is in both.

    Returns
    -------
    Perturbation

    Raises
    ------
    InvalidParameterError
        If dimensions differ; labels are not as said, or differ between the shapes; two regions touch; the numbers of
        faces outside differ; a vertex would go to two places, or two to one; or the boundary of a region X_i does not
        go to that of Y_i (condition C1).
    """
    one = as_simplicial(one, "one")
    two = as_simplicial(two, "two")
    dims = [(mesh.dim, mesh.points.shape[1]) for mesh in (one, two)]
    if dims[0] != dims[1]:
        raise InvalidParameterError(
            f"Two shapes must have the same dimensions to correspond; these have (m, d) = {dims[0]} and {dims[1]}."
        )
    labels_one, labels_two = (
        _labels(regions_one, one, "regions_one"),
        _labels(regions_two, two, "regions_two"),
    )
    _require_same_regions(labels_one, labels_two)
    found = Perturbation(one, two, frozen(labels_one), frozen(labels_two))
    _require_rims(found, vertex_pairs(found))
    return found


def vertex_pairs(perturbation: Perturbation) -> Int[np.ndarray, "v 2"]:
    """List the vertices of the faces outside: that of M, ascending, and the one of N that Φ takes it to.

    Raises
    ------
    InvalidParameterError
        If a vertex would go to two places, or two vertices to one.
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
                f"Faces outside the regions must correspond corner by corner; vertex {places[twice[0], column]} of "
                f"`{name}` would be vertices {ends[0]} and {ends[1]} of `{other}`. Keep the order of faces and corners."
            )
    return pairs


def _labels(regions: ArrayLike | None, mesh: Mesh, name: str) -> Labels:
    n = len(mesh.simplices)
    if regions is None:
        return np.full(n, OUTSIDE)
    labels = as_array(regions, name)
    if labels.shape != (n,) or labels.dtype.kind not in "iu":
        raise InvalidParameterError(
            f"{name} must hold one whole number a face, shape ({n},); it has shape {labels.shape} and type "
            f"{labels.dtype}."
        )
    labels = labels.astype(np.int64)
    wrong = np.flatnonzero((labels < OUTSIDE) | (labels >= n))
    if wrong.size:
        raise InvalidParameterError(
            f"{name} must number regions from 0, with -1 outside; face {wrong[0]} has {labels[wrong[0]]}."
        )
    _require_apart(mesh, labels, name)
    return labels


def _require_apart(mesh: Mesh, labels: Labels, name: str) -> None:
    corners, at = mesh.simplices[labels != OUTSIDE], labels[labels != OUTSIDE]
    least, most = np.full(mesh.n_points, len(labels)), np.full(mesh.n_points, OUTSIDE)
    np.minimum.at(least, corners, at[:, None])
    np.maximum.at(most, corners, at[:, None])
    shared = np.flatnonzero(least < most)
    if shared.size:
        vertex = shared[0]
        raise InvalidParameterError(
            f"Anomalous regions must not touch; in {name}, vertex {vertex} is in regions {least[vertex]} and "
            f"{most[vertex]}. Make them one region."
        )


def _require_same_regions(one: Labels, two: Labels) -> None:
    n_regions = max(one.max(), two.max()) + 1
    for name, labels in (("regions_one", one), ("regions_two", two)):
        missing = np.flatnonzero(np.bincount(labels[labels != OUTSIDE], minlength=n_regions) == 0)
        if missing.size:
            raise InvalidParameterError(
                f"Both shapes must have the same anomalous regions, numbered 0..{n_regions - 1}; {name} has no face in "
                f"region {missing[0]}."
            )
    left = [int((labels == OUTSIDE).sum()) for labels in (one, two)]
    if left[0] != left[1]:
        raise InvalidParameterError(
            f"As many faces of one shape as of the other must lie outside the regions; {left[0]} and {left[1]} do."
        )


def _require_rims(perturbation: Perturbation, pairs: Int[np.ndarray, "v 2"]) -> None:
    """Refuse a region X_i whose boundary Φ does not take to that of Y_i (C1)."""
    image = np.full(perturbation.one.n_points, OUTSIDE)
    image[pairs[:, 0]] = pairs[:, 1]
    here = _rims(perturbation.one, perturbation.regions_one)
    here[:, 1:] = np.sort(image[here[:, 1:]], axis=1)
    there = _rims(perturbation.two, perturbation.regions_two)
    different = set(map(tuple, here.tolist())) ^ set(map(tuple, there.tolist()))
    if different:
        region, *corners = min(different)
        raise InvalidParameterError(
            f"The boundary of a region must be mapped onto that of its counterpart (C1); for region {region} vertices "
            f"{corners} of `two` span a side of only one of the two boundaries."
        )


def _rims(mesh: Mesh, labels: Labels) -> Int[np.ndarray, "k _"]:
    """List the facets between a region and the outside: the region's number, then the corners, ascending."""
    table = facet_table(mesh)
    at, label = table.simplex_facets.ravel(), np.repeat(labels, mesh.dim + 1)
    outside = np.zeros(len(table.facets), dtype=bool)
    outside[at[label == OUTSIDE]] = True
    rim = (label != OUTSIDE) & outside[at]
    return np.column_stack([label[rim], table.facets[at[rim]]])
