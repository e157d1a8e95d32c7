"""Transfer labels from labeled shapes to another shape (thesis 7)."""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from certeig.kit.arguments import require_each
from certeig.kit.arrays import ReadOnly, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.progress import Progress
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import label_components, point_functions
from eigenshape._errors import InvalidShapeError
from eigenshape.calculus.linear_solver import factor_definite
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.normalize import normalize_mesh
from eigenshape.geometry.orientation import orient_closed_outward
from eigenshape.geometry.requirements import require_describable
from eigenshape.geometry.topology import edge_table
from eigenshape.operators.anisotropic import anisotropic_laplacian, curvature_tensors
from eigenshape.retrieval.labels.labeled_shape import LabeledShape, LabelPoints, label_points
from eigenshape.retrieval.labels.transport import transport_points
from eigenshape.retrieval.patches.mirror_images import is_mirror_image

# Heat time in which votes spread, as a share of the area. It bridges the gaps between points and
# drowns single wrong votes. The best of 0.01, 0.03 and 0.1 on the tuning half of
# experiments/ch7_labels.
SPREAD_TIME = 0.03
# Strength of concave creases, across which votes spread slowly; as in `find_parts`.
CONCAVITY = 10.0
# Difference of the mean costs of two sources at which the votes of the dearer one count e times
# less. The best of 0.2, 0.5 and 1 on the tuning half of experiments/ch7_labels.
COST_SCALE = 0.5
# Offset and slope of the logistic curve from the logit of the share of the votes to the probability
# that a label is right; fitted on the tuning half of experiments/ch7_labels, with one source and
# with four. Sources that agree are right more often than the partners of one source that agree.
CURVE_OF_ONE = (0.46, 0.63)
CURVE_OF_SEVERAL = (0.70, 1.26)
# Shares of votes are kept this far from 0 and 1, so that their logits are finite.
LEAST_SHARE = 1e-6
# Pieces of one label with less than this share of the area join a neighbor.
LEAST_PIECE = 1e-3


@record
class LabelTransfer(ReadOnly):
    """Labels that a shape was given, and how reliable they are.

    Attributes
    ----------
    labels : (f,) int
        Label of each face.
    confidence : (f,) float
        Probability that the label of each face is right, as measured on held-out shapes.
    parts : (f,) int
        For each face, the number of its part: a connected piece of one label.
    part_labels : (m,) int
        Label of each part.
    part_confidence : (m,) float
        Share of the area of each part whose label is probably right: the mean confidence.
    part_vertices : (m,) int
        A vertex of each part, where the votes for its label are clearest.
    weights : (s,) float
        Weight of each labeled shape; they sum to 1. A shape that is more alike weighs more, and one
        that was left out 0.
    mirrored : tuple of bool or None
        For each labeled shape, whether the target is rather like its mirror image, so that what is left on
        one is right on the other; None if that cannot be told, as of `Match.mirrored`.

    See Also
    --------
    transfer_labels, labels_from_votes, figure_label_transfer

    Examples
    --------
    >>> import eigenshape as es
    >>> fish, other = (es.make_creature("fish", pose, n_vertices=500) for pose in (0, 1))
    >>> labeled = es.retrieval.LabeledShape(fish, es.find_parts(fish).parts.labels)
    >>> found = es.transfer_labels(labeled, other)
    >>> found.labels.shape == (other.n_faces,)
    True
    """

    labels: Int[np.ndarray, " f"]
    confidence: Float[np.ndarray, " f"]
    parts: Int[np.ndarray, " f"]
    part_labels: Int[np.ndarray, " m"]
    part_confidence: Float[np.ndarray, " m"]
    part_vertices: Int[np.ndarray, " m"]
    weights: Float[np.ndarray, " s"]
    mirrored: tuple[bool | None, ...] = ()


@one_blas_thread()
def transfer_labels(
    labeled: LabeledShape | Sequence[LabeledShape],
    target: MeshLike,
    *,
    progress: Progress | None = None,
) -> LabelTransfer:
    """Label a shape like one or several labeled shapes.

    Points of the target are matched with points of each labeled shape, softly, so that patches of
    surface look alike and distances along the surface agree (`transport_points`). Each point
    receives the labels of its partners as votes. Labeled shapes that match better weigh more. The
    votes are turned into labels of faces by `labels_from_votes`.

    Left and right are not distinguished, since distances along the surface do not distinguish them:
    `LabelTransfer.mirrored` says whether a labeled shape is a mirror image.

    Parameters
    ----------
    labeled : LabeledShape or sequence of LabeledShape
        Shapes of the same kind as the target. Equal labels must mean the same on all of them. One
        of several whose mesh is refused is left out, and a warning says which and why.
        `es.io.read_labeled_shape` repairs meshes that are read.
    target : MeshLike
        The mesh to label.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    LabelTransfer

    Raises
    ------
    InvalidParameterError
        If there is no labeled shape.
    InvalidShapeError
        If a face of the target, or of each labeled mesh, has no area or occurs twice, a vertex has
        no face, or neighboring faces are oriented against each other.

    See Also
    --------
    labels_from_votes, LabeledShape, es.io.read_labeled_shapes, figure_label_transfer

    Examples
    --------
    >>> import eigenshape as es
    >>> fish, other = (es.make_creature("fish", pose, n_vertices=500) for pose in (0, 1))
    >>> labeled = es.retrieval.LabeledShape(fish, es.find_parts(fish).parts.labels)
    >>> found = es.transfer_labels(labeled, other)
    >>> len(found.labels) == other.n_faces
    True
    """
    sources = [labeled] if isinstance(labeled, LabeledShape) else labeled
    require_each(sources, LabeledShape, "labeled")
    sources = list(sources)
    target = as_mesh(target, "target")
    if not sources:
        raise InvalidParameterError(
            "labeled must hold at least one labeled shape; it is empty. "
            "Pass es.retrieval.LabeledShape(mesh, labels)."
        )
    vocabulary = np.unique(np.concatenate([np.unique(source.labels) for source in sources]))
    n_steps = len(sources) + 2
    points = _target_points(target)
    votes, costs = [], []
    mirrored: list[bool | None] = []
    failures: dict[int, InvalidShapeError] = {}
    for number, source in enumerate(sources):
        if progress:
            progress((1 + number) / n_steps, f"matching labeled shape {number + 1}")
        try:
            described = source.points
        except InvalidShapeError as error:
            # One broken shape of many must not keep the others from voting.
            failures[number] = error
            votes.append(np.zeros((len(points.vertices), len(vocabulary))))
            costs.append(np.inf)
            mirrored.append(None)
            continue
        shares, cost = transport_points(points, described)
        # The share of each label in the area of the faces around each point of the source
        columns = np.searchsorted(vocabulary, source.labels)
        around = np.zeros((source.mesh.n_vertices, len(vocabulary)))
        areas = face_areas(source.mesh)
        for corner in source.mesh.faces.T:
            np.add.at(around, (corner, columns), areas / areas.max())
        chosen = around[described.vertices]
        votes.append(shares @ (chosen / chosen.sum(axis=1, keepdims=True)))
        costs.append(cost)
        mirrored.append(is_mirror_image(points.patches, described.patches))
    if len(failures) == len(sources):
        raise failures[0]
    for number, failure in failures.items():
        warnings.warn(f"labeled[{number}] was left out: {failure}", stacklevel=3)
    weights = np.exp((min(costs) - np.array(costs)) / COST_SCALE)
    weights /= weights.sum()

    # Each point votes for its share of the area.
    at_vertices = np.zeros((target.n_vertices, len(vocabulary)))
    mean = np.einsum("s,sml->ml", weights, np.array(votes))
    at_vertices[points.vertices] = points.shares[:, None] * mean
    if progress:
        progress((n_steps - 1) / n_steps, "spreading votes")
    return replace(_settle(target, at_vertices, vocabulary, weights), mirrored=tuple(mirrored))


@lru_cache(maxsize=1)
def _target_points(target: TriangleMesh) -> LabelPoints:
    """Describe the target; the last one is kept, since other sources are often tried on it."""
    return label_points(target)


def labels_from_votes(target: MeshLike, votes: ArrayLike, labels: ArrayLike) -> LabelTransfer:
    """Turn votes at vertices into labels of faces.

    Votes come from any correspondence: of a map that gives each vertex of the target a vertex of a
    labeled shape, or of points that are matched here and there. Votes spread for a short time as
    heat does, slowly across concave creases, so that labels end where parts do and single wrong
    votes drown. Each face takes the label with most votes. Pieces of less than a thousandth of the
    area join the neighbor with the longest common boundary.

    Parameters
    ----------
    target : MeshLike
        The mesh to label.
    votes : (n, l) float
        For each vertex, the votes for each label, at least 0. A row of zeros is no vote. The sum
        of a row is its weight, for example the confidence of the map there, times the area that the
        vertex stands for.
    labels : (l,) int
        The label of each column.

    Returns
    -------
    LabelTransfer

    Raises
    ------
    InvalidParameterError
        If votes are negative or all zero, or labels are not l different integers.
    InvalidShapeError
        As for `transfer_labels`.

    See Also
    --------
    transfer_labels

    Examples
    --------
    Two votes at the ends of a capsule label half of it each:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> capsule = es.TriangleMesh(ball.vertices * [3, 1, 1], ball.faces)
    >>> x = capsule.vertices[:, 0]
    >>> votes = np.zeros((capsule.n_vertices, 2))
    >>> votes[x.argmin(), 0] = 1
    >>> votes[x.argmax(), 1] = 1
    >>> found = es.retrieval.labels_from_votes(capsule, votes, [7, 9])
    >>> centers = x[capsule.faces].mean(axis=1)
    >>> np.unique(found.labels[centers > 0.5]), np.unique(found.labels[centers < -0.5])
    (array([9]), array([7]))
    """
    target = as_mesh(target, "target")
    counts = point_functions(votes, "votes", target.n_vertices)
    if counts.ndim != 2 or (counts < 0).any() or not counts.any():
        raise InvalidParameterError(
            "votes must have a column for each label, no entry below 0, and one above; "
            f"the shape is {counts.shape} and the entries lie from {counts.min(initial=0)} to "
            f"{counts.max(initial=0)}."
        )
    names = np.asarray(labels)
    if names.dtype.kind not in "iu" or names.shape != counts.shape[1:]:
        raise InvalidParameterError(
            f"labels must be whole numbers, one for each of the {counts.shape[1:]} columns of "
            f"votes; the shape is {names.shape} and the type {names.dtype}."
        )
    different, occurrences = np.unique(names, return_counts=True)
    if len(different) < len(names):
        double = different[occurrences > 1][0]
        one, two = np.flatnonzero(names == double)[:2]
        raise InvalidParameterError(
            f"labels must differ; label {double} stands in columns {one} and {two}. "
            "Add the votes of the two."
        )
    require_describable(target)
    return _settle(target, counts, names.astype(np.int64), np.ones(1))


def _settle(
    target: TriangleMesh,
    votes: Float[np.ndarray, "n l"],
    vocabulary: Int[np.ndarray, " l"],
    weights: Float[np.ndarray, " s"],
) -> LabelTransfer:
    # Spread the votes by one implicit step of heat.
    mesh = normalize_mesh(orient_closed_outward(target), "box")
    laplacian = anisotropic_laplacian(mesh, curvature_tensors(mesh, CONCAVITY, concave=True))
    area = float(face_areas(mesh).sum())
    step = laplacian.mass + SPREAD_TIME * area * laplacian.stiffness
    spread = np.maximum(factor_definite(step).solve(votes / votes.sum()), 0)
    # A component without votes takes those of the nearest point that has some.
    reached = spread.sum(axis=1) > 0
    if not reached.all():
        tree = cKDTree(mesh.vertices[reached])
        _, nearest = tree.query(mesh.vertices[~reached])
        spread[~reached] = spread[reached][nearest]
    shares = spread / spread.sum(axis=1)[:, None]

    face_shares = shares[target.faces].mean(axis=1)
    chosen = _join_small_pieces(target, face_shares.argmax(axis=1))
    areas = face_areas(target)
    areas = areas / areas.max()

    # Confidence: the calibrated share of the votes for the label of each face.
    rows = np.arange(target.n_faces)
    share = np.clip(face_shares[rows, chosen], LEAST_SHARE, 1 - LEAST_SHARE)
    offset, slope = CURVE_OF_ONE if np.count_nonzero(weights) == 1 else CURVE_OF_SEVERAL
    confidence = 1 / (1 + np.exp(-offset - slope * np.log(share / (1 - share))))

    parts = _pieces(target, chosen)
    count = int(parts.max()) + 1
    part_areas = np.bincount(parts, weights=areas, minlength=count)
    part_confidence = np.bincount(parts, weights=areas * confidence, minlength=count) / part_areas
    # Of the faces of each part, the first with the largest share.
    order = np.lexsort((rows, -share, parts))
    clearest = order[np.searchsorted(parts[order], np.arange(count))]
    return LabelTransfer(
        labels=vocabulary[chosen],
        confidence=confidence,
        parts=parts,
        part_labels=vocabulary[chosen[clearest]],
        part_confidence=part_confidence,
        part_vertices=target.faces[clearest, 0],
        weights=weights,
    )


def _pieces(mesh: TriangleMesh, labels: Int[np.ndarray, " f"]) -> Int[np.ndarray, " f"]:
    """Find the connected pieces of equal labels."""
    pairs, _ = edge_table(mesh).face_pairs
    same = labels[pairs[:, 0]] == labels[pairs[:, 1]]
    return label_components(mesh.n_faces, *pairs[same].T)[1]


def _join_small_pieces(mesh: TriangleMesh, labels: Int[np.ndarray, " f"]) -> Int[np.ndarray, " f"]:
    """Give each small piece the label with which it has most boundary in common."""
    table = edge_table(mesh)
    pairs, edges = table.face_pairs
    ends = mesh.vertices[table.edges[edges]]
    lengths = np.linalg.norm(np.diff(ends, axis=1)[:, 0], axis=1)
    areas = face_areas(mesh)
    labels = labels.copy()
    pieces = _pieces(mesh, labels)
    piece_areas = np.bincount(pieces, weights=areas / areas.sum())
    # The smallest first, so that a speck in a small piece joins that before it joins another.
    for piece in np.argsort(piece_areas, kind="stable"):
        if piece_areas[piece] >= LEAST_PIECE:
            break
        inside = pieces == piece
        rim = inside[pairs[:, 0]] != inside[pairs[:, 1]]
        if rim.any():
            outer = np.where(inside[pairs[rim, 0]], pairs[rim, 1], pairs[rim, 0])
            common = np.bincount(labels[outer], weights=lengths[rim])
            labels[inside] = common.argmax()
    return labels
