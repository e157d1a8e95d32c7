"""The factor by which lengths of a part are multiplied: given, known, from areas, or searched for."""

from collections.abc import Sequence

import numpy as np

from certeig.kit.errors import InvalidParameterError
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.topology import boundary_loops
from eigenshape.matching.evidence import rate_map
from eigenshape.matching.fitting import plan_fit
from eigenshape.matching.growth import fitted_maps
from eigenshape.matching.pairs import patch_differences
from eigenshape.matching.pieces import Piece
from eigenshape.matching.surface import describe_surface
from eigenshape.matching.target import LEAST_AREA, MatchTarget

N_PART = 300  # points of the part
# A part with this many times the area of the whole is not a part of it in the same unit.
MOST_AREA = 1.5
# Two complete shapes whose lengths differ by less, by the root of their areas, are taken as one
# individual in one unit: poses of one cat differ by up to 5 %, those of a centaur by 6 %.
SAME_SIZE = 1.1
# Spreads along the longest axis that differ by more, as a logarithm, are of other proportions: that of
# a bone without 30 % of its length is 0.2 smaller.
OTHER_PROPORTIONS = 0.1
# A shape is complete if its boundaries are as long as the boundaries of discs with this share of its
# area in all.
LARGEST_HOLES = 0.05
# Sizes of the part that are tried, as shares of the longest side of the whole's box
SIZES = 1.25 ** np.arange(1, -6, -1.0)
# Quantile of the ratios of distances on the whole to those on the part that stands for its size.
# Ways around what was cut off are longer on the part, so that the median is 4 to 15 % too small; on
# eight cuts and scans of the tuning half this quantile was 10 % too small to 6 % too large.
UNCUT = 0.7
WORDS = ("auto", "known", "unknown")


def require_scale(scale: object) -> str | float:
    """Return a scale as a word or a float, or raise an error."""
    if isinstance(scale, str) and scale in WORDS:
        return scale
    numbers = np.asarray(scale)
    if numbers.dtype.kind not in "iuf" or numbers.shape != () or not 0 < float(numbers) < np.inf:
        raise InvalidParameterError(
            f'scale must be "auto", "known", "unknown" or a positive number; it is {scale!r}.'
        )
    return float(numbers)


def choose_factors(
    mesh: TriangleMesh, pieces: Sequence[Piece], target: MatchTarget, scale: str | float
) -> list[tuple[float, tuple[str, ...]]]:
    """Return the factors for lengths of a part to try, each with a sentence if it was chosen.

    They are two if both shapes look complete but one may be broken.
    """
    area = sum(piece.clean_area() for piece in pieces)
    ratio = target.area / area
    if scale == "auto" and is_complete(mesh) and is_complete(target.mesh):
        reason = "areas: both shapes are complete"
        if len(pieces) != len(target.pieces):
            # Not all pieces have a counterpart, so the nearest in size is taken for that of the largest.
            ratios = [piece.area / pieces[0].clean_area() for piece in target.pieces]
            nearest = int(np.argmin(np.abs(np.log(ratios))))
            ratio = ratios[nearest]
            reason = f"the areas of piece 0 of the part and piece {nearest} of the whole"
        factor = float(np.sqrt(ratio))
        if 1 / SAME_SIZE < factor < SAME_SIZE:
            return [(1.0, ())]
        chosen = f"lengths of the part were multiplied by {factor:.3g}"
        scaled = factor, (f"{chosen}, the root of the ratio of {reason}",)
        # A broken bone has other proportions; the area without noise of a coarse mesh is too small.
        lengths = [_relative_length(shape) for shape in (mesh, target.mesh)]
        change = abs(np.log(lengths[0] / lengths[1]))
        given = surface_area(target.mesh) / surface_area(mesh)
        is_same = 1 / SAME_SIZE**2 < given < SAME_SIZE**2
        if ratio * MOST_AREA > 1 and (change > OTHER_PROPORTIONS or is_same):
            known = "both shapes are in one unit: they look complete, but that map is surer"
            return [scaled, (1.0, (known,))]
        return [scaled]
    is_small = max(piece.area for piece in pieces) < LEAST_AREA * surface_area(target.mesh)
    if scale == "unknown" or (scale == "auto" and (is_small or ratio * MOST_AREA < 1)):
        factor = _find_factor(pieces[0], target)
        return [
            (factor, (f"lengths of the part were multiplied by {factor:.3g}, which fits best",))
        ]
    factor = 1.0 if isinstance(scale, str) else scale
    # Noise must not refuse a whole, but an area with noise is enough to accept it.
    if min(area, surface_area(mesh)) * factor**2 > MOST_AREA * surface_area(target.mesh):
        raise InvalidParameterError(
            f"A part must not have more than {MOST_AREA} times the area of the whole; it has "
            f'{factor**2 / ratio:.3g} times. Exchange the two shapes, or pass scale="unknown" '
            "(--scale unknown on the command line)."
        )
    return [(factor, ())]


def _relative_length(mesh: TriangleMesh) -> float:
    """Return the spread along the longest axis, in roots of the area."""
    areas = dual_volumes(mesh)
    points = mesh.vertices - areas @ mesh.vertices / areas.sum()
    spreads = np.linalg.eigvalsh((points * areas[:, None]).T @ points)
    return float(np.sqrt(spreads[-1])) / float(areas.sum())


def is_complete(mesh: TriangleMesh) -> bool:
    """Tell whether a surface has no boundaries, or so short ones that little of it is missing."""
    rims = [mesh.vertices[loop] for loop in boundary_loops(mesh)]
    lengths = [float(np.linalg.norm(rim - np.roll(rim, 1, axis=0), axis=1).sum()) for rim in rims]
    area_of_discs = sum(length**2 for length in lengths) / (4 * np.pi)
    return area_of_discs <= LARGEST_HOLES * surface_area(mesh)


def _find_factor(part: Piece, target: MatchTarget) -> float:
    """Return the factor at which the largest piece of a part fits that of the whole best."""
    mesh, whole = part.copy.mesh, target.pieces[0]
    copies = mesh, whole.piece.copy.mesh
    size, whole_size = (float(np.ptp(copy.vertices, axis=0).max()) for copy in copies)
    factors = SIZES * whole_size / size
    share = part.area / whole.piece.area
    factors = factors[factors**2 * share <= MOST_AREA]
    best, highest = 1.0, -1.0
    for factor in factors.tolist():
        surface = describe_surface(part.copy.clean, whole.unit / factor, N_PART)
        differences = patch_differences(surface, whole.surface)
        maps = fitted_maps(plan_fit(surface, whole.surface), differences)
        score = 0.0
        if maps:
            one = maps[0]
            quality = rate_map(surface, whole.surface, differences, one.pairs, one.fit.places)
            score = quality.score * np.sqrt(surface.area)
        if score <= highest:
            continue
        best, highest = factor, score
        if maps:
            # Between the sizes that are tried, distances between pairs say how large the part is.
            points, partners = maps[0].pairs.points, maps[0].pairs.partners
            ours = surface.between[np.ix_(points, points)].astype(np.float64)
            theirs = whole.surface.between[np.ix_(partners, partners)]
            known = (ours > 0) & (theirs > 0)
            if known.any():
                best *= float(np.quantile(theirs[known] / ours[known], UNCUT))
    return best
