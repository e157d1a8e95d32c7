"""Labels of one shape's parts, given to the parts of another: label one horse, get the camel (thesis 7)."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from eigenshape._arrays import frozen
from eigenshape._errors import InvalidParameterError
from eigenshape._progress import Progress
from eigenshape._threads import one_blas_thread
from eigenshape.features.boundaries import smooth_boundaries
from eigenshape.features.parts import FoundParts, find_parts
from eigenshape.features.segmentation import FeaturePoints, Segmentation, segment
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.retrieval.heat.descriptor import SCALE_FREE
from eigenshape.retrieval.heat.features import heat_descriptor
from eigenshape.retrieval.heat.score import matching_scores, shifted
from eigenshape.spectral.bounds.nonconforming import partly
from eigenshape.spectral.signatures.heat import positive_eigenvalues
from eigenshape.spectral.solver.solve import solve_spectrum

LESS = 1e-12  # of the price: what a swap must save to be made


@dataclass(frozen=True, eq=False)
class LabelTransfer:
    """What labels a shape was given, and how surely.

    Attributes
    ----------
    labels : (f,) int
        For each face of the target, the label of its part.
    source, target : Segmentation
        The parts of both shapes.
    matches : (m,) int
        For each part of the target the one of the source that it is matched with.
    part_labels : (m,) int
        Label of each part of the target.
    confidence : (m,) float
        How much better the matched part fits, in descriptor and place among the others, than the best of another
        label, as a share: 0 where another label would fit as well, near 1 where no other comes close.
    """

    labels: Int[np.ndarray, " f"]
    source: Segmentation
    target: Segmentation
    matches: Int[np.ndarray, " m"]
    part_labels: Int[np.ndarray, " m"]
    confidence: Float[np.ndarray, " m"]


@one_blas_thread()
def transfer_labels(
    source: MeshLike,
    labels: Int[np.ndarray, " f"],
    target: MeshLike,
    *,
    n_parts: int | None = None,
    progress: Progress | None = None,
) -> LabelTransfer:
    """Give the parts of a shape the labels of the parts of another that they match.

    Both shapes are cut into equally many parts (`find_parts`), of which those of the source take the label that most of
    their area has. A part is described by the mean over its surface of the logarithm of heat (`describe`, scale-free),
    and the shapes are compared at the relative size of their best score (`matching_score`). Parts are matched one to
    one: so that descriptors differ least and parts lie as far from each other as their partners do, in biharmonic
    distances (Lipman, Rustamov and Funkhouser 2010) over their mean, from the best assignment (Kuhn 1955) by swaps that
    pay. A target with fewer parts leaves some of the source's without partner; one with more, which happens where it
    has more components, gives the rest their nearest. Left and right cannot be told: heat is blind to reflection.

    Parameters
    ----------
    source : MeshLike
    labels : (f,) int
        Of each face of the source.
    target : MeshLike
    n_parts : int, optional
        Parts to cut both shapes into, at most; by default as many as `find_parts` finds on the source.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    LabelTransfer

    Raises
    ------
    InvalidParameterError
        If there is not one label a face, or fewer than one part is asked for.
    InvalidShapeError
        If a mesh has a face without area or a vertex without face.
    """
    source = as_mesh(source, "source")
    target = as_mesh(target, "target")
    if labels.shape != (source.n_faces,):
        raise InvalidParameterError(
            f"There must be one label a face, {source.n_faces}; there are {len(labels)}."
        )
    found = find_parts(source, progress=partly(progress, 0, 0.25))
    ours = found.parts if n_parts is None else _cut(found, n_parts)
    theirs = _cut(
        find_parts(target, progress=partly(progress, 0.25, 0.5)), len(ours.features.vertices)
    )
    one = _described(target, theirs.labels, partly(progress, 0.5, 0.75))
    two = _described(source, ours.labels, partly(progress, 0.75, 1))
    prices = _prices(one, two)
    matches = _matched(prices, one.apart, two.apart)
    named = _majority(labels, ours.labels, face_areas(source))
    return LabelTransfer(
        labels=frozen(named[matches][theirs.labels]),
        source=ours,
        target=theirs,
        matches=frozen(matches),
        part_labels=frozen(named[matches]),
        confidence=frozen(
            _confidence(prices + _displaced(one.apart, two.apart, matches), matches, named)
        ),
    )


def _cut(found: FoundParts, count: int) -> Segmentation:
    return smooth_boundaries(found.mesh, segment(found.tree, n_regions=count))


@dataclass(frozen=True, eq=False)
class _DescribedParts:
    """Mean descriptor of each part (m, q), and how far parts are apart (m, m), in mean distances."""

    vectors: Float[np.ndarray, "m q"]
    apart: Float[np.ndarray, "m m"]


def _described(
    mesh: TriangleMesh, parts: Int[np.ndarray, " f"], progress: Progress | None
) -> _DescribedParts:
    k = min(SCALE_FREE.n_modes, mesh.n_vertices)
    spectrum = solve_spectrum(cotangent_laplacian(mesh), k, progress=progress)
    ones = np.ones(mesh.n_vertices)
    everywhere = FeaturePoints(np.arange(mesh.n_vertices), ones, ones)
    recipe = replace(SCALE_FREE, n_features=mesh.n_vertices)
    vectors = heat_descriptor(spectrum, everywhere, recipe).vectors
    positive = spectrum.eigenvalues >= positive_eigenvalues(spectrum)[0]
    relative = spectrum.eigenvalues[positive] / spectrum.eigenvalues[positive][0]
    places = _means(mesh, parts, spectrum.eigenvectors[:, positive] / relative)
    apart = cdist(places, places)
    return _DescribedParts(_means(mesh, parts, vectors), apart / (apart.mean() or 1.0))


def _means(
    mesh: TriangleMesh, parts: Int[np.ndarray, " f"], values: Float[np.ndarray, "n q"]
) -> np.ndarray:
    """Average functions over each part, by area."""
    areas = face_areas(mesh)
    places = np.repeat(parts, 3), mesh.faces.ravel()
    shape = (int(parts.max()) + 1, mesh.n_vertices)
    weights = sp.coo_array((np.repeat(areas / areas.max(), 3), places), shape=shape).tocsr()
    return np.asarray(weights @ values / weights.sum(axis=1)[:, None])


def _majority(
    labels: Int[np.ndarray, " f"], parts: Int[np.ndarray, " f"], areas: Float[np.ndarray, " f"]
) -> Int[np.ndarray, " m"]:
    """Return the label that most of each part's area has, of equals the lower."""
    names, numbers = np.unique(labels, return_inverse=True)
    shares = sp.coo_array(
        (areas / areas.max(), (parts, numbers)), shape=(int(parts.max()) + 1, len(names))
    )
    return names[shares.toarray().argmax(axis=1)]


def _prices(one: _DescribedParts, two: _DescribedParts) -> Float[np.ndarray, "m r"]:
    """Return the mean difference of descriptors, at the relative size of the best score."""
    _, shifts = matching_scores(one.vectors, two.vectors, np.array([0]), SCALE_FREE)
    ours, theirs = shifted(one.vectors, two.vectors, int(shifts[0]), SCALE_FREE)
    return cdist(ours, theirs, "cityblock") / ours.shape[1]


def _matched(
    prices: Float[np.ndarray, "m r"],
    apart: Float[np.ndarray, "m m"],
    other_apart: Float[np.ndarray, "r r"],
) -> Int[np.ndarray, " m"]:
    """Assign parts one to one, at first by their sorted distances to all others; then swap partners while it pays."""
    rows, columns = linear_sum_assignment(prices + _profiles_differ(apart, other_apart))
    inside = apart[np.ix_(rows, rows)]

    def price(partners: Int[np.ndarray, " p"]) -> float:
        bent = np.abs(inside - other_apart[np.ix_(partners, partners)]).sum() / len(rows)
        return float(prices[rows, partners].sum() + bent)

    best, settled = price(columns), False
    while not settled:
        settled = True
        for one, two in np.transpose(np.triu_indices(len(rows), 1)):
            swapped = columns.copy()
            swapped[[one, two]] = columns[[two, one]]
            if price(swapped) < best * (1 - LESS):
                columns, best, settled = swapped, price(swapped), False
    matches = prices.argmin(axis=1)
    matches[rows] = columns
    return matches


def _profiles_differ(
    one: Float[np.ndarray, "m m"], two: Float[np.ndarray, "r r"]
) -> Float[np.ndarray, "m r"]:
    """Return the mean difference of sorted distances, read at equally many ranks."""
    ranks = np.linspace(0, 1, min(len(one), len(two)))
    return cdist(
        np.quantile(one, ranks, axis=1).T, np.quantile(two, ranks, axis=1).T, "cityblock"
    ) / len(ranks)


def _displaced(
    one: Float[np.ndarray, "m m"], two: Float[np.ndarray, "r r"], matches: Int[np.ndarray, " m"]
) -> Float[np.ndarray, "m r"]:
    """Return how wrongly each pair would lie among the others as they are matched."""
    return cdist(one, two[:, matches], "cityblock") / len(matches)


def _confidence(
    prices: Float[np.ndarray, "m r"], matches: Int[np.ndarray, " m"], labels: Int[np.ndarray, " r"]
) -> Float[np.ndarray, " m"]:
    own = prices[np.arange(len(matches)), matches]
    others = np.where(labels == labels[matches][:, None], np.inf, prices).min(axis=1)
    share = np.divide(own, others, out=np.ones_like(own), where=others > 0)
    return np.clip(1 - share, 0, 1)
