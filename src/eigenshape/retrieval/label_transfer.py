"""Transfer labels from the parts of one shape to the parts of another (thesis 7)."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from eigenshape._arrays import face_labels, freeze, whole_number
from eigenshape._progress import Progress
from eigenshape._text import html_repr, short_repr
from eigenshape._threads import one_blas_thread
from eigenshape._typing import ArrayLike
from eigenshape.features.boundaries import smooth_boundaries
from eigenshape.features.parts import PartDecomposition, find_parts
from eigenshape.features.segmentation import FeaturePoints, Segmentation, segment
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.retrieval.heat.features import heat_descriptor
from eigenshape.retrieval.heat.recipe import SCALE_FREE
from eigenshape.retrieval.heat.score import matching_scores, shift_columns
from eigenshape.spectral.bounds.nonconforming import partly
from eigenshape.spectral.signatures.heat import positive_eigenvalues
from eigenshape.spectral.solve import solve_spectrum

# Share of the cost that a swap of partners must save to be made, so that rounding makes none.
LEAST_GAIN = 1e-12


@dataclass(frozen=True, eq=False)
class LabelTransfer:
    """Labels that a shape was given by `transfer_labels`, and how reliable they are.

    Attributes
    ----------
    labels : (f,) int
        For each face of the target, the label of its part.
    source, target : Segmentation
        The parts of both shapes.
    matches : (m,) int
        For each part of the target, the number of the part of the source that it is matched with.
    part_labels : (m,) int
        Label of each part of the target.
    confidence : (m,) float
        How much better the matched part fits than the best part of another label, in descriptor and
        in place among the others, as a share: 0 if another label would fit as well, near 1 if none
        comes close.

    See Also
    --------
    transfer_labels, figure_label_transfer

    Examples
    --------
    >>> import eigenshape as es
    >>> fish, other = (es.make_creature("fish", pose, n_vertices=500) for pose in (0, 1))
    >>> found = es.transfer_labels(fish, es.find_parts(fish).parts.labels, other)
    >>> found.part_labels, bool((found.confidence > 0.5).all())
    (array([0, 1, 2, 3]), True)
    """

    labels: Int[np.ndarray, " f"]
    source: Segmentation
    target: Segmentation
    matches: Int[np.ndarray, " m"]
    part_labels: Int[np.ndarray, " m"]
    confidence: Float[np.ndarray, " m"]

    __repr__ = short_repr
    _repr_html_ = html_repr


@one_blas_thread()
def transfer_labels(
    source: MeshLike,
    labels: ArrayLike,
    target: MeshLike,
    *,
    n_parts: int | None = None,
    progress: Progress | None = None,
) -> LabelTransfer:
    """Label the parts of a shape like the parts of another that they match.

    Both shapes are cut into equally many parts (`find_parts`). A part of the source takes the label
    that covers most of its area. A part is described by the mean over its surface of the logarithm
    of heat (`heat_descriptor`, scale-free), and the shapes are compared at the relative size of
    their best score (`matching_score`).

    Parts are matched one to one, so that descriptors differ least and parts lie as far from each
    other as their partners do, in biharmonic distances (Lipman, Rustamov and Funkhouser 2010) over
    their mean: first by the best assignment (Kuhn 1955), then by swaps that lower the cost. If the
    target has fewer parts, some of the source have no partner. If it has more, as with more
    components, the rest take the nearest descriptor. Left and right are not distinguished, since
    heat is blind to reflection.

    Parameters
    ----------
    source : MeshLike
        A mesh with f faces.
    labels : (f,) int
        Label of each face of the source.
    target : MeshLike
    n_parts : int, optional
        Parts to cut both shapes into, at most. By default as many as `find_parts` finds on the
        source.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    LabelTransfer

    Raises
    ------
    InvalidParameterError
        If `labels` are not f integers, or `n_parts` is less than 1.
    InvalidShapeError
        If a face of a mesh has no area, or a vertex has no face.

    See Also
    --------
    find_parts, figure_label_transfer

    Examples
    --------
    >>> import eigenshape as es
    >>> fish, other = (es.make_creature("fish", pose, n_vertices=500) for pose in (0, 1))
    >>> labels = es.find_parts(fish).parts.labels
    >>> found = es.transfer_labels(fish, labels, other)
    >>> len(found.labels) == other.n_faces
    True
    """
    source = as_mesh(source, "source")
    target = as_mesh(target, "target")
    labels = face_labels(labels, "labels", source.n_faces)
    if n_parts is not None:
        n_parts = whole_number(n_parts, "n_parts", 1)
    found = find_parts(source, progress=partly(progress, 0, 0.25))
    source_parts = found.parts if n_parts is None else _cut_into_parts(found, n_parts)
    found = find_parts(target, progress=partly(progress, 0.25, 0.5))
    target_parts = _cut_into_parts(found, len(source_parts.features.vertices))

    one = _describe_parts(target, target_parts.labels, partly(progress, 0.5, 0.75))
    two = _describe_parts(source, source_parts.labels, partly(progress, 0.75, 1))
    differences = _descriptor_differences(one, two)
    matches = _match_parts(differences, one.distances, two.distances)
    source_labels = _majority_labels(labels, source_parts.labels, face_areas(source))

    # What matching each pair would cost with all other partners as they are
    displacements = cdist(one.distances, two.distances[:, matches], "cityblock") / len(matches)
    confidence = _confidence(differences + displacements, matches, source_labels)
    return LabelTransfer(
        labels=freeze(source_labels[matches][target_parts.labels]),
        source=source_parts,
        target=target_parts,
        matches=freeze(matches),
        part_labels=freeze(source_labels[matches]),
        confidence=freeze(confidence),
    )


def _cut_into_parts(found: PartDecomposition, count: int) -> Segmentation:
    return smooth_boundaries(found.mesh, segment(found.tree, n_regions=count))


@dataclass(frozen=True, eq=False)
class _DescribedParts:
    """Mean descriptor of each part (m, q), and distances between parts (m, m) over their mean."""

    vectors: Float[np.ndarray, "m q"]
    distances: Float[np.ndarray, "m m"]


def _describe_parts(
    mesh: TriangleMesh, parts: Int[np.ndarray, " f"], progress: Progress | None
) -> _DescribedParts:
    k = min(SCALE_FREE.n_modes, mesh.n_vertices)
    spectrum = solve_spectrum(cotangent_laplacian(mesh), k, progress=progress)

    # Every vertex is a feature, so that means can be taken over parts.
    ones = np.ones(mesh.n_vertices)
    every_vertex = FeaturePoints(np.arange(mesh.n_vertices), ones, ones)
    recipe = replace(SCALE_FREE, n_features=mesh.n_vertices)
    vectors = heat_descriptor(spectrum, every_vertex, recipe).vectors

    # In the coordinates φ_i / λ_i, distances are biharmonic ones.
    positive = spectrum.eigenvalues >= positive_eigenvalues(spectrum)[0]
    relative = spectrum.eigenvalues[positive] / spectrum.eigenvalues[positive][0]
    places = _means_over_parts(mesh, parts, spectrum.eigenvectors[:, positive] / relative)
    distances = cdist(places, places)
    return _DescribedParts(
        _means_over_parts(mesh, parts, vectors), distances / (distances.mean() or 1.0)
    )


def _means_over_parts(
    mesh: TriangleMesh, parts: Int[np.ndarray, " f"], values: Float[np.ndarray, "n q"]
) -> np.ndarray:
    """Average functions over each part, by area."""
    areas = face_areas(mesh)
    places = np.repeat(parts, 3), mesh.faces.ravel()
    shape = (int(parts.max()) + 1, mesh.n_vertices)
    weights = sp.coo_array((np.repeat(areas / areas.max(), 3), places), shape=shape).tocsr()
    return np.asarray(weights @ values / weights.sum(axis=1)[:, None])


def _majority_labels(
    labels: Int[np.ndarray, " f"], parts: Int[np.ndarray, " f"], areas: Float[np.ndarray, " f"]
) -> Int[np.ndarray, " m"]:
    """Return the label that covers most of the area of each part; of equals, the lower."""
    names, numbers = np.unique(labels, return_inverse=True)
    shape = (int(parts.max()) + 1, len(names))
    shares = sp.coo_array((areas / areas.max(), (parts, numbers)), shape=shape)
    return names[shares.toarray().argmax(axis=1)]


def _descriptor_differences(one: _DescribedParts, two: _DescribedParts) -> Float[np.ndarray, "m r"]:
    """Return the mean difference of descriptors, at the relative size of the best score."""
    _, shifts = matching_scores(one.vectors, two.vectors, np.array([0]), SCALE_FREE)
    ours, theirs = shift_columns(one.vectors, two.vectors, int(shifts[0]), SCALE_FREE)
    return cdist(ours, theirs, "cityblock") / ours.shape[1]


def _match_parts(
    differences: Float[np.ndarray, "m r"],
    distances: Float[np.ndarray, "m m"],
    other_distances: Float[np.ndarray, "r r"],
) -> Int[np.ndarray, " m"]:
    """Assign parts one to one by descriptors and distances, and swap partners while it pays."""
    # At first partners are unknown, so compare the sorted distances of each part to all others,
    # read at equally many ranks.
    ranks = np.linspace(0, 1, min(len(distances), len(other_distances)))
    profiles = [np.quantile(each, ranks, axis=1).T for each in (distances, other_distances)]
    start = differences + cdist(*profiles, "cityblock") / len(ranks)
    rows, columns = linear_sum_assignment(start)
    inside = distances[np.ix_(rows, rows)]

    def cost(partners: Int[np.ndarray, " p"]) -> float:
        distortion = np.abs(inside - other_distances[np.ix_(partners, partners)]).sum() / len(rows)
        return float(differences[rows, partners].sum() + distortion)

    lowest, improved = cost(columns), True
    while improved:
        improved = False
        for one, two in np.transpose(np.triu_indices(len(rows), 1)):
            swapped = columns.copy()
            swapped[[one, two]] = columns[[two, one]]
            if cost(swapped) < lowest * (1 - LEAST_GAIN):
                columns, lowest, improved = swapped, cost(swapped), True
    matches = differences.argmin(axis=1)
    matches[rows] = columns
    return matches


def _confidence(
    costs: Float[np.ndarray, "m r"], matches: Int[np.ndarray, " m"], labels: Int[np.ndarray, " r"]
) -> Float[np.ndarray, " m"]:
    """Return by what share the match of each part costs less than the best of another label."""
    own = costs[np.arange(len(matches)), matches]
    others = np.where(labels == labels[matches][:, None], np.inf, costs).min(axis=1)
    share = np.divide(own, others, out=np.ones_like(own), where=others > 0)
    return np.clip(1 - share, 0, 1)
