"""What a shape wears, such as its texture, skin and blend shapes, transferred to another shape."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.progress import Progress
from certeig.kit.threads import one_blas_thread
from eigenshape._arrays import label_components
from eigenshape._vectors import fit_similarities
from eigenshape.calculus.energies import solve_harmonic
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.distances.closest import closest_points
from eigenshape.geometry.measure import edge_lengths, surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.samples.surface_points import SurfacePoints, place_points
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.topology import edge_table, join_places, vertex_components
from eigenshape.io.attributes import MeshAttributes
from eigenshape.io.carrying import wear_attributes
from eigenshape.matching.match import match_shapes
from eigenshape.matching.shape_match import ShapeMatch
from eigenshape.morphometrics.landmarks import Landmarks
from eigenshape.morphometrics.placement import require_on_surfaces
from eigenshape.operators.robust import robust_laplacian

# Confidence below which a place is taken from the map around it. That of a map that fits as well as
# another one is halved, without being worse than it.
DOUBTFUL = 0.3
# Largest share of the area in doubt that is filled: a few sure vertices do not say where a body lies
MOST_FILLED = 0.5
# Root mean square gap, in mean edge lengths of the coarser shape, below which two shapes are one
# surface with other triangles. A triangle leaves its surface by edge² / (8 radius): on creatures of
# 600 vertices by 0.1 edges, and individuals whose limbs differ by 10 % are 0.3 edges apart.
SAME_SURFACE = 0.15
# Surface about a loose piece that decides where it goes, as a share of the root of the area: weights fall
# with distance⁴ beyond it.
NEARBY = 0.02
TINY = 1e-9  # share of a vertex of no confidence, so that shares have a sum


@record
class Outfit(ReadOnly):
    """What a shape wears, made to measure for another one.

    Attributes
    ----------
    mesh : TriangleMesh
        The target, with n vertices.
    attributes : MeshAttributes
        Of `mesh`: ``write_mesh(outfit.mesh, "a.glb", attributes=outfit.attributes)`` writes it with skin,
        skeleton, blend shapes and animations of the source.
    places : (n, 3) float
        The point of the source that each vertex takes its values from, in length.
    confidence : (n,) float
        0 to 1, as of `ShapeMatch`; also the field "confidence" of the attributes. 1 where the source
        and the target are one surface.
    filled : (n,) bool
        Where the map is in doubt, and the place was interpolated from the vertices around.
    landmarks : Landmarks, optional
        Those of the source on the target.
    report : tuple of str
        What was found and filled, in sentences.

    See Also
    --------
    transfer

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> mesh = es.icosphere(1)
    >>> es.io.write_fields(mesh, "ball.vtp", {"height": mesh.vertices[:, 2]})
    >>> _, worn = es.read_mesh("ball.vtp", attributes=True)
    >>> outfit = es.matching.transfer(worn, es.icosphere(2))
    >>> outfit.attributes.fields["height"].shape
    (162,)
    """

    mesh: TriangleMesh
    attributes: MeshAttributes
    places: Float[np.ndarray, "n 3"]
    confidence: Float[np.ndarray, " n"]
    filled: Bool[np.ndarray, " n"]
    landmarks: Landmarks | None
    report: tuple[str, ...]


@one_blas_thread()
def transfer(
    source: MeshAttributes,
    target: MeshLike,
    *,
    match: ShapeMatch | None = None,
    landmarks: Landmarks | None = None,
    progress: Progress | None = None,
) -> Outfit:
    """Transfer what a shape wears to another shape, of other triangles and proportions.

    Each vertex of the target takes the values of the corresponding point of the source: texture
    coordinates, colors, fields, groups, materials, weights of joints. Each face looks into one chart
    of the texture, so that none spans a seam. Where the map is in doubt, its places are interpolated
    (harmonic functions) from those around.

    When a GLB file is written, joints move as the surface around them does, by a least-squares
    similarity (Umeyama 1991). Each turns with the limb that it moves. Blend shapes turn and grow
    with the surface within 0.05 √area, and animations move joints about their new places.

    Parameters
    ----------
    source : MeshAttributes
        What ``read_mesh(path, attributes=True)`` returns beside the mesh.
    target : MeshLike
        With n vertices, in the pose that is to be its rest pose.
    match : ShapeMatch, optional
        Of ``match_shapes(target, source.mesh)``. By default vertices of one number correspond if both
        have the same faces, nearest points if the two are one surface with other triangles, perhaps
        moved and scaled, and else the match is computed.
    landmarks : Landmarks, optional
        On the source.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    Outfit

    Raises
    ------
    InvalidParameterError
        If the source has nothing to transfer, or the match is one of other shapes.
    InvalidShapeError
        If a mesh cannot be matched; see `match_shapes`.

    See Also
    --------
    eigenshape.io.carry_attributes : To a repaired or decimated mesh of the same shape.
    eigenshape.collections.carry_landmarks : Landmarks of some specimens on all of a collection.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh, finer = es.icosphere(1), es.icosphere(2)
    >>> colors = es.plot.value_colors(mesh.vertices[:, 2])
    >>> es.write_mesh(mesh, "ball.ply", colors=colors)
    >>> _, worn = es.read_mesh("ball.ply", attributes=True)
    >>> outfit = es.matching.transfer(worn, finer)
    >>> es.write_mesh(finer, "finer.glb", attributes=outfit.attributes)
    >>> outfit.report
    ('the target is the surface of the source with other triangles: nearest points correspond',)
    """
    require_type(source, MeshAttributes, "source")
    target = as_mesh(target, "target")
    if landmarks is not None:
        require_type(landmarks, Landmarks, "landmarks")
    contents = source.contents
    has_some = any(contents[kind] for kind in contents if kind != "normals") or source.others
    if not has_some and landmarks is None:
        lacks = ", ".join(kind for kind in contents if kind != "normals")
        raise InvalidParameterError(
            f"The source must have something to transfer; it has no {lacks}, skins or morph targets. "
            "Read it by read_mesh(path, attributes=True) from a file that holds some, such as GLB."
        )
    # Vertices that are double along seams of a texture are one place of the surface.
    (ours, _), (theirs, numbers) = join_places(source.mesh), join_places(target)
    firsts = np.unique(numbers, return_index=True)[1]
    if match is None and np.array_equal(source.mesh.faces, target.faces):
        found, sure = closest_points(ours, source.mesh.vertices[firsts]), np.ones(len(firsts))
        report: tuple[str, ...] = ("both have the same faces: vertices of one number correspond",)
    elif match is None:
        found, sure, report = _correspond(ours, theirs, progress)
    else:
        _require_match(match, target, source.mesh, ours)
        found = place_points(ours, match.faces[firsts], match.weights[firsts])
        sure, report = _sureness(match)[firsts], match.report
    found, filled, sentences = _fill_doubtful(ours, theirs, found, sure, firsts)
    places = found.points[numbers]
    worn = wear_attributes(source, target, places, found.simplices[numbers])
    carried = None
    if landmarks is not None:
        # By its places the target lies on the source, where each landmark has a nearest point.
        require_on_surfaces([("source", source.mesh, landmarks)])
        known = np.isfinite(landmarks.points).all(axis=1)
        there = closest_points(TriangleMesh(places, target.faces), landmarks.points[known])
        points = np.full_like(landmarks.points, np.nan)
        points[known] = place_points(target, there.simplices, there.weights).points
        carried = Landmarks(landmarks.names, points, curves=landmarks.curves)
    return Outfit(
        target,
        replace(worn, fields={**worn.fields, "confidence": sure[numbers]}),
        places,
        sure[numbers],
        filled[numbers],
        carried,
        report + sentences,
    )


def _require_match(
    match: ShapeMatch, target: TriangleMesh, source: TriangleMesh, joined: TriangleMesh
) -> None:
    """Raise an error if a match is not of the target onto the source, with or without its seams joined."""
    require_type(match, ShapeMatch, "match")
    rule = "The match must be of the target onto the source"
    remedy = "Pass match_shapes(target, source.mesh)."
    if match.n_vertices != target.n_vertices:
        raise InvalidParameterError(
            f"{rule}; it has {match.n_vertices} vertices, and the target has {target.n_vertices}. "
            f"{remedy}"
        )
    inside = match.faces < source.n_faces
    faces = np.where(inside, match.faces, 0)
    wrong = [
        ~inside | (mesh.faces[faces] != match.corners).any(axis=1) for mesh in (source, joined)
    ]
    if all(each.any() for each in wrong):
        vertex = int(np.argmax(wrong[0]))
        raise InvalidParameterError(
            f"{rule}; it puts vertex {vertex} into face {match.faces[vertex]} with the corners "
            f"{match.corners[vertex].tolist()}, and the source has no such face. {remedy}"
        )


def _sureness(match: ShapeMatch) -> Float[np.ndarray, " n"]:
    """Return the confidence of a map, of several that fit equally well: any of them will do."""
    return (match.confidence * match.n_equally_good).clip(max=1.0)


def _correspond(
    source: TriangleMesh, target: TriangleMesh, progress: Progress | None
) -> tuple[SurfacePoints, Float[np.ndarray, " n"], tuple[str, ...]]:
    """Return the place of each vertex of the target on the source, its confidence, and a report."""
    nearest = _nearest_places(source, target)
    report: tuple[str, ...] = ()
    if nearest is None:
        factor = float(np.sqrt(surface_area(source) / surface_area(target)))
        match = match_shapes(target, source, scale=factor, progress=progress)
        found, sure = place_points(source, match.faces, match.weights), _sureness(match)
        # The same surface may have been moved and scaled; then nearest points are exact again.
        shares = dual_volumes(target) * (sure + TINY)
        shares /= shares.sum()
        whole = fit_similarities(lambda rows: shares[None] @ rows, target.vertices, found.points)
        moved = TriangleMesh(whole.move(target.vertices), target.faces)
        nearest = _nearest_places(source, moved)
        if nearest is None:
            return found, sure, match.report
        report = match.report
    sentence = (
        "the target is the surface of the source with other triangles: nearest points correspond"
    )
    return nearest, np.ones(target.n_vertices), (*report, sentence)


def _nearest_places(source: TriangleMesh, target: TriangleMesh) -> SurfacePoints | None:
    """Return the nearest points of a source if it is one surface with the target, else None."""
    there, back = closest_points(source, target.vertices), closest_points(target, source.vertices)
    farthest = SAME_SURFACE * max(edge_lengths(mesh).mean() for mesh in (source, target))
    for found, points in ((there, target.vertices), (back, source.vertices)):
        gaps = np.linalg.norm(found.points - points, axis=1)
        if np.sqrt(np.mean(gaps**2)) > farthest:
            return None
    return there


def _fill_doubtful(
    source: TriangleMesh,
    target: TriangleMesh,
    found: SurfacePoints,
    sure: Float[np.ndarray, " n"],
    numbers: Int[np.ndarray, " n"],
) -> tuple[SurfacePoints, Bool[np.ndarray, " n"], tuple[str, ...]]:
    """Interpolate places with little confidence from those around; return also which, and a report.

    The report names vertices by given numbers.
    """
    doubtful = sure < DOUBTFUL
    if not doubtful.any():
        return found, doubtful, ()
    areas = dual_volumes(target)
    share = areas[doubtful].sum() / areas.sum()
    if share > MOST_FILLED:
        sentence = (
            f"{share:.0%} of the area is in doubt, with a mean confidence of {sure[doubtful].mean():.2f}: "
            "all is left as mapped, since too little is sure. Look at the result, or pass another match"
        )
        return found, np.zeros_like(doubtful), (sentence,)
    pieces = vertex_components(target)[1]
    filled = doubtful & np.isin(pieces, pieces[~doubtful])
    points, faces, weights = (
        values.copy() for values in (found.points, found.simplices, found.weights)
    )
    points[filled] = solve_harmonic(
        robust_laplacian(target), np.flatnonzero(~filled), points[~filled]
    )[filled]
    # A piece without one sure vertex, such as an eye, goes along with the surface that is nearest.
    sure_rows = np.flatnonzero(~doubtful)
    for piece in np.unique(pieces[doubtful & ~filled]):
        rows = np.flatnonzero(pieces == piece)
        center = target.vertices[rows].mean(axis=0)
        away = np.sum((target.vertices[sure_rows] - center) ** 2, axis=1) / areas.sum()
        near = areas[sure_rows] / (away + NEARBY**2) ** 2
        near = near[None] / near.sum()

        def average(values: np.ndarray, near: np.ndarray = near) -> np.ndarray:
            means: np.ndarray = near @ values
            return means

        along = fit_similarities(average, target.vertices[sure_rows], points[sure_rows])
        points[rows] = along.move(target.vertices[rows])
        filled[rows] = True
    nearest = closest_points(source, points[filled])
    points[filled], faces[filled], weights[filled] = (
        nearest.points,
        nearest.simplices,
        nearest.weights,
    )
    edges = edge_table(target).edges
    inside = edges[doubtful[edges].all(axis=1)]
    regions = label_components(target.n_vertices, *inside.T)[1]
    report = []
    for region in np.unique(regions[doubtful]):
        rows = np.flatnonzero(regions == region)
        lowest = rows[np.argmin(sure[rows])]
        report.append(
            f"{len(rows)} vertices ({areas[rows].sum() / areas.sum():.2%} of the area) about vertex "
            f"{numbers[lowest]} at {target.vertices[lowest].round(4).tolist()} are in doubt, with a mean "
            f"confidence of {sure[rows].mean():.2f}: taken from the surface around"
        )
    return SurfacePoints(points, faces, weights), filled, tuple(report)
