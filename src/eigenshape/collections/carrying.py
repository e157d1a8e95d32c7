"""Landmarks transferred from some specimens of a collection to all."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.files import as_path, replace_file
from certeig.kit.threads import one_blas_thread
from eigenshape._vectors import mean_radius
from eigenshape.collections.collection import Collection
from eigenshape.geometry.distances.closest import closest_points
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.samples.surface_points import SurfacePoints, place_points
from eigenshape.morphometrics.curves import space_curves
from eigenshape.morphometrics.landmark_files import csv_text
from eigenshape.morphometrics.landmarks import Landmarks, require_same_names, shared_curves
from eigenshape.morphometrics.placement import require_on_surfaces

# Expected error of a landmark from a single labelled specimen, where there is no second one to
# judge by, in root mean square radii: that of the tuning half of experiments/ch7_collection.
ERROR_OF_ONE = 0.038
# Labelled specimens that the mean error of all landmarks counts for in the error of each
N_PRIOR = 2.0
# Gap, or distance of a given landmark, from which a person should look, in root mean square radii
FAR = 0.05
# Confidence below which the specimen has no such place; on whole skulls it is 0.1 or more
NO_PLACE = 0.02
# Median distances between a given landmark and those of other specimens, on the mean, from which a
# person should look. The median counts as at most `ERROR_OF_ONE`, since many wrong ones raise it.
WRONG_LABEL = 5.0
COLUMNS = ["spread", "doubtful", "given", "distance", "disagreement", "confidence"]


@record
class CarriedLandmarks(ReadOnly):
    """Landmarks on all specimens of a collection.

    Attributes
    ----------
    specimens, names : tuple of str
        Of the s specimens and of the k landmarks.
    points : (s, k, 3) float
        In each specimen's own frame and unit: the given landmarks of labelled specimens, and those
        transferred to all others, on their surfaces.
    spread : (s, k) float
        Expected error of each, the root of its mean square, in length; 0 for given ones. It is what
        is found when the landmarks of each labelled specimen are transferred from all others.
    doubtful : (s, k) bool
        Where a person should look: the specimen has no such place; a given landmark lies far from
        the surface, from the map, or from where other specimens put it, or all of the specimen lie
        as landmarks of another one do; or nothing but doubtful ones was transferred there.
    given : (s, k) bool
        Which were given.
    distance : (s, k) float
        Of a given landmark from the surface; of a transferred one the distance by which it was
        moved to the surface. In length.
    disagreement : (s, k) float
        Distance of a given landmark, in length, within which half of the other labelled specimens
        put it. NaN where it is transferred, or no other specimen has it.
    confidence : (s, k) float
        That of the map at the landmark, 0 to 1, as of `Collection`.
    curves : tuple of tuples of int
        As `Landmarks.curves`, of all specimens.

    See Also
    --------
    carry_landmarks

    Examples
    --------
    >>> from pathlib import Path
    >>> import numpy as np
    >>> import eigenshape as es
    >>> found = es.collections.CarriedLandmarks(
    ...     ("hand",),
    ...     ("tip",),
    ...     np.zeros((1, 1, 3)),
    ...     np.zeros((1, 1)),
    ...     np.zeros((1, 1), dtype=bool),
    ...     np.ones((1, 1), dtype=bool),
    ...     np.zeros((1, 1)),
    ...     np.zeros((1, 1)),
    ...     np.ones((1, 1)),
    ... )
    >>> found.save("landmarks.csv")
    >>> print(Path("landmarks.csv").read_text().strip())
    specimen,landmark,x,y,z,spread,doubtful,given,distance,disagreement,confidence
    hand,tip,0.0,0.0,0.0,0.0,0,1,0.0,0.0,1.0
    """

    specimens: tuple[str, ...]
    names: tuple[str, ...]
    points: Float[np.ndarray, "s k 3"]
    spread: Float[np.ndarray, "s k"]
    doubtful: Bool[np.ndarray, "s k"]
    given: Bool[np.ndarray, "s k"]
    distance: Float[np.ndarray, "s k"]
    disagreement: Float[np.ndarray, "s k"]
    confidence: Float[np.ndarray, "s k"]
    curves: tuple[tuple[int, ...], ...] = ()

    @property
    def landmarks(self) -> dict[str, Landmarks]:
        """Landmarks of each specimen by name, which `write_landmarks` writes."""
        return {
            name: Landmarks(self.names, points, spread, self.curves)
            for name, points, spread in zip(self.specimens, self.points, self.spread, strict=True)
        }

    def save(self, path: str | Path) -> None:
        """Write a table of comma-separated values, a row for each landmark of each specimen.

        Its columns are specimen, landmark, x, y, z, spread, doubtful, given, distance,
        disagreement (NA where there is none) and confidence.

        Parameters
        ----------
        path : str or Path
            Where the table is written.

        Raises
        ------
        OSError
            If the system cannot write there.
        """
        rows: list[list[object]] = [["specimen", "landmark", "x", "y", "z", *COLUMNS]]
        for i, specimen in enumerate(self.specimens):
            for j, name in enumerate(self.names):
                # Whether something is so is written as 0 or 1.
                values = [+getattr(self, column)[i, j].item() for column in COLUMNS]
                cells = ["NA" if np.isnan(value) else value for value in values]
                rows.append([specimen, name, *self.points[i, j].tolist(), *cells])
        replace_file(as_path(path), csv_text(rows).encode())


@one_blas_thread()
def carry_landmarks(collection: Collection, labelled: Mapping[str, Landmarks]) -> CarriedLandmarks:
    """Carry the landmarks of some specimens to all.

    Each is taken to the mean shape, where those of all labelled specimens are averaged, and from
    there to the surface of each specimen. Doubtful ones are left out of the average where there are
    others. Points inside curves are then spaced evenly along the curve on each surface.

    Parameters
    ----------
    collection : Collection
    labelled : mapping of str to Landmarks
        By the name of the specimen, the same landmarks each, on its surface, in the frame and unit
        of its file; NaN where one is missing. `resample_curves` spaces the points of their curves.

    Returns
    -------
    CarriedLandmarks

    Raises
    ------
    InvalidParameterError
        If no specimen is labelled, a labelled one is not in the collection, landmarks have other
        names or curves, one is missing on all specimens, or some do not lie on the surface of their specimen,
        as in another unit or frame: the error names each specimen.

    See Also
    --------
    build_collection
    es.morphometrics.resample_curves : Space points of curves that were drawn on a template.

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> import numpy as np
    >>> import eigenshape as es
    >>> hands = {
    ...     f"hand {i}": es.make_creature("hand", individual=i, n_vertices=600) for i in range(3)
    ... }
    >>> collection = es.collections.build_collection(hands, mkdtemp())
    >>> tips = [hand.vertices[hand.vertices[:, 1].argmax()] for hand in hands.values()]
    >>> given = es.morphometrics.Landmarks(["tip of the middle finger"], tips[:1])
    >>> carried = es.collections.carry_landmarks(collection, {"hand 0": given})
    >>> bool(np.linalg.norm(carried.points[:, 0] - tips, axis=1).max() < 0.1)
    True
    """
    require_type(collection, Collection, "collection")
    require_type(labelled, Mapping, "labelled")
    names, curves, given = _points_to_carry(collection, labelled)
    mean, faces = collection.mean, collection.mean.faces
    rows = [collection.number(name) for name in labelled]
    placements = require_on_surfaces(
        (name, collection.read_specimen(name), labelled[name]) for name in labelled
    ).values()
    far = np.array([each.distances for each in placements])
    beside = np.array([each.is_beside for each in placements])
    radii = np.array([mean_radius(own) for own in collection.points])
    all_known = np.isfinite(given).all(axis=2)
    off_map, on_mean = np.full_like(far, np.nan), np.full_like(given, np.nan)
    for number, (row, known) in enumerate(zip(rows, all_known, strict=True)):
        there = closest_points(TriangleMesh(collection.points[row], faces), given[number, known])
        on_mean[number, known] = place_points(mean, there.simplices, there.weights).points
        off_map[number, known] = np.linalg.norm(there.points - given[number, known], axis=1)
    sound = (np.maximum(far, off_map) <= FAR * radii[rows, None]) & ~beside[:, None]
    apart = _disagreements(on_mean) / mean_radius(mean.vertices)
    if np.isfinite(apart).any():
        sound &= ~(apart > WRONG_LABEL * min(float(np.nanmedian(apart)), ERROR_OF_ONE))
    # Where all are doubtful, the average is of them, and doubtful itself.
    on_mean[~np.where(sound.any(axis=0), sound, all_known)] = np.nan

    places = closest_points(mean, np.nanmean(on_mean, axis=0))
    points = np.empty((len(collection.names), len(names), 3))
    carried = np.full_like(given, np.nan)  # to each labelled specimen, from all others
    for row, name in enumerate(collection.names):
        surface = collection.read_specimen(name)  # one at a time: together they may fill the memory
        on_surface = _carry(collection, row, surface, places)
        points[row] = space_curves(on_surface, curves, surface, name)
        if row in rows and len(rows) > 1:
            others = np.delete(on_mean, rows.index(row), axis=0)
            seen = np.isfinite(others).all(axis=2).any(axis=0)
            there = closest_points(mean, np.nanmean(others[:, seen], axis=0))
            carried[rows.index(row), seen] = _carry(collection, row, surface, there)

    # Errors that are made where the truth is known
    truth = np.where(np.isfinite(on_mean), given, np.nan)
    squares = np.sum((carried - truth) ** 2, axis=2) / radii[rows, None] ** 2
    n_known = np.isfinite(squares).sum(axis=0)
    common = float(np.nanmean(squares)) if n_known.any() else ERROR_OF_ONE**2
    errors = np.sqrt((np.nansum(squares, axis=0) + N_PRIOR * common) / (n_known + N_PRIOR))

    corners = faces[places.simplices]
    gaps, sure = (
        np.einsum("kc,skc->sk", places.weights, values[:, corners])
        for values in (collection.gaps, collection.confidence)
    )
    spread = np.hypot(radii[:, None] * errors, gaps)
    doubtful = (gaps > FAR * radii[:, None]) | (sure < NO_PLACE) | ~sound.any(axis=0)
    is_given, distance = np.zeros_like(doubtful), gaps.copy()
    disagreement = np.full_like(gaps, np.nan)
    own = np.nonzero(all_known)
    at = np.array(rows)[own[0]], own[1]
    is_given[at] = True
    points[at] = given[own]
    spread[at] = 0
    doubtful[at] = ~sound[own]
    distance[at] = far[own]
    disagreement[at] = apart[own] * radii[at[0]]
    return CarriedLandmarks(
        collection.names,
        names,
        points,
        spread,
        doubtful,
        is_given,
        distance,
        disagreement,
        sure,
        curves,
    )


def _disagreements(on_mean: Float[np.ndarray, "m k 3"]) -> Float[np.ndarray, "m k"]:
    """Return the distance of each place within which half of the others lie; NaN where there are none.

    So a place that more than half of the specimens agree on does not depend on those that are wrong.
    """
    found = np.full(on_mean.shape[:2], np.nan)
    for j, places in enumerate(on_mean.transpose(1, 0, 2)):
        n_known = np.isfinite(places[:, 0]).sum()
        if n_known > 1:
            apart = np.linalg.norm(places[:, None] - places, axis=2)
            # The first of each row is the distance of a place from itself; NaN are the last.
            found[:, j] = np.sort(apart, axis=1)[:, n_known // 2]
    return found


def _points_to_carry(
    collection: Collection, labelled: Mapping[str, Landmarks]
) -> tuple[tuple[str, ...], tuple[tuple[int, ...], ...], Float[np.ndarray, "m k 3"]]:
    """Return names and curves of the landmarks, and the points of each labelled specimen."""
    if not labelled:
        raise InvalidParameterError("At least one specimen must have landmarks; there are none.")
    require_same_names(labelled, "labelled")
    for specimen in labelled:
        collection.number(specimen)
    names = next(iter(labelled.values())).names
    given = np.stack([landmarks.points for landmarks in labelled.values()])
    missing = ~np.isfinite(given).all(axis=2).any(axis=0)
    if missing.any():
        raise InvalidParameterError(
            "Each landmark must be given on one specimen at least; "
            f"{names[np.argmax(missing)]!r} is missing on all."
        )
    return names, shared_curves(labelled, "labelled"), given


def _carry(
    collection: Collection, row: int, surface: TriangleMesh, places: SurfacePoints
) -> Float[np.ndarray, "k 3"]:
    """Return the points of a specimen's surface that correspond to places on the mean."""
    bent = TriangleMesh(collection.points[row], collection.mean.faces)
    there = place_points(bent, places.simplices, places.weights).points
    return closest_points(surface, there).points
