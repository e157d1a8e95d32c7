"""Landmarks carried from some specimens of a collection to all."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from eigenshape._arguments import require_type
from eigenshape._arrays import ReadOnly, record
from eigenshape._errors import InvalidParameterError
from eigenshape._files import as_path, replace_file
from eigenshape._threads import one_blas_thread
from eigenshape.collections.collection import Collection
from eigenshape.collections.spread_points import mean_radius
from eigenshape.geometry.distances.closest import closest_points
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.samples.surface_points import SurfacePoints, place_points
from eigenshape.morphometrics.landmark_files import csv_text
from eigenshape.morphometrics.landmarks import Landmarks, require_same_names

# Expected error of a landmark from a single labelled specimen, where there is no second one to
# judge by, in root mean square radii: that of the tuning half of experiments/ch7_collection.
ERROR_OF_ONE = 0.038
# Labelled specimens that the mean error of all landmarks counts for in the error of each
N_PRIOR = 2.0
FAR = 0.05  # gap from which a person should look, in root mean square radii
# Confidence below which the specimen has no such place; on whole skulls it is 0.1 or more
NO_PLACE = 0.02
# Median errors between a given landmark and its carried place, from which a person should look
WRONG_LABEL = 5.0


@record
class CarriedLandmarks(ReadOnly):
    """Landmarks on all specimens of a collection.

    Attributes
    ----------
    specimens, names : tuple of str
        Of the s specimens and of the k landmarks.
    points : (s, k, 3) float
        In each specimen's own frame and unit: the given landmarks of labelled specimens, and those
        carried to all others, on their surfaces.
    spread : (s, k) float
        Expected error of each, the root of its mean square, in length; 0 for given ones. It is what
        is found when the landmarks of each labelled specimen are carried from all others.
    doubtful : (s, k) bool
        Where a person should look: the specimen has no such place, or a given landmark lies far
        from where the others put it.

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
    ... )
    >>> found.save("landmarks.csv")
    >>> print(Path("landmarks.csv").read_text().strip())
    specimen,landmark,x,y,z,spread,doubtful
    hand,tip,0.0,0.0,0.0,0.0,0
    """

    specimens: tuple[str, ...]
    names: tuple[str, ...]
    points: Float[np.ndarray, "s k 3"]
    spread: Float[np.ndarray, "s k"]
    doubtful: Bool[np.ndarray, "s k"]

    def save(self, path: str | Path) -> None:
        """Write a table of comma-separated values: specimen, landmark, x, y, z, spread, doubtful.

        Parameters
        ----------
        path : str or Path
            Where the table is written.

        Raises
        ------
        OSError
            If the system cannot write there.
        """
        rows: list[list[object]] = [["specimen", "landmark", "x", "y", "z", "spread", "doubtful"]]
        for i, specimen in enumerate(self.specimens):
            for j, name in enumerate(self.names):
                numbers = [*self.points[i, j].tolist(), float(self.spread[i, j])]
                rows.append([specimen, name, *numbers, int(self.doubtful[i, j])])
        replace_file(as_path(path), csv_text(rows).encode())


@one_blas_thread()
def carry_landmarks(collection: Collection, labelled: Mapping[str, Landmarks]) -> CarriedLandmarks:
    """Carry the landmarks of some specimens to all.

    Each is taken to the mean shape, where those of all labelled specimens are averaged, and from
    there to the surface of each specimen.

    Parameters
    ----------
    collection : Collection
    labelled : mapping of str to Landmarks
        By the name of the specimen, the same landmarks each; NaN where one is missing.

    Returns
    -------
    CarriedLandmarks

    Raises
    ------
    InvalidParameterError
        If no specimen is labelled, a labelled one is not in the collection, landmarks have other
        names, or one is missing on all specimens.

    See Also
    --------
    build_collection

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
    names, given = _points_to_carry(collection, labelled)
    mean, faces = collection.mean, collection.mean.faces
    rows = [collection.number(name) for name in labelled]
    on_mean = np.full_like(given, np.nan)
    for number, row in enumerate(rows):
        known = np.isfinite(given[number]).all(axis=1)
        own = TriangleMesh(collection.points[row], faces)
        there = closest_points(own, given[number, known])
        on_mean[number, known] = place_points(mean, there.simplices, there.weights).points

    places = closest_points(mean, np.nanmean(on_mean, axis=0))
    points = np.empty((len(collection.names), len(names), 3))
    radii = np.array([mean_radius(own) for own in collection.points])
    carried = np.full_like(given, np.nan)  # to each labelled specimen, from all others
    for row, name in enumerate(collection.names):
        surface = collection.read_specimen(name)  # one at a time: together they may fill the memory
        points[row] = _carry(collection, row, surface, places)
        if row in rows and len(rows) > 1:
            others = np.delete(on_mean, rows.index(row), axis=0)
            seen = np.isfinite(others).all(axis=2).any(axis=0)
            there = closest_points(mean, np.nanmean(others[:, seen], axis=0))
            carried[rows.index(row), seen] = _carry(collection, row, surface, there)

    # Errors that are made where the truth is known
    squares = np.sum((carried - given) ** 2, axis=2) / radii[rows, None] ** 2
    n_known = np.isfinite(squares).sum(axis=0)
    common = float(np.nanmean(squares)) if n_known.any() else ERROR_OF_ONE**2
    errors = np.sqrt((np.nansum(squares, axis=0) + N_PRIOR * common) / (n_known + N_PRIOR))

    corners = faces[places.simplices]
    gaps, sure = (
        np.einsum("kc,skc->sk", places.weights, values[:, corners])
        for values in (collection.gaps, collection.confidence)
    )
    spread = np.hypot(radii[:, None] * errors, gaps)
    doubtful = (gaps > FAR * radii[:, None]) | (sure < NO_PLACE)
    for number, row in enumerate(rows):
        known = np.isfinite(given[number]).all(axis=1)
        away = np.linalg.norm(carried[number] - given[number], axis=1)
        usual = radii[row] * np.sqrt(np.nanmedian(squares)) if n_known.any() else np.inf
        doubtful[row, known] = (away > WRONG_LABEL * usual)[known]
        points[row, known] = given[number, known]
        spread[row, known] = 0
    return CarriedLandmarks(collection.names, names, points, spread, doubtful)


def _points_to_carry(
    collection: Collection, labelled: Mapping[str, Landmarks]
) -> tuple[tuple[str, ...], Float[np.ndarray, "m k 3"]]:
    """Return the names of the landmarks, and the points of each labelled specimen."""
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
    return names, given


def _carry(
    collection: Collection, row: int, surface: TriangleMesh, places: SurfacePoints
) -> Float[np.ndarray, "k 3"]:
    """Return the points of a specimen's surface that correspond to places on the mean."""
    bent = TriangleMesh(collection.points[row], collection.mean.faces)
    there = place_points(bent, places.simplices, places.weights).points
    return closest_points(surface, there).points
