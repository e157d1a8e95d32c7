"""Landmarks beside the specimens of a collection: which are given, and where a person should look."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from certeig.kit.errors import CerteigError, InvalidParameterError
from eigenshape.collections.carrying import CarriedLandmarks
from eigenshape.collections.collection import Collection, read_specimen
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.folders import find_items
from eigenshape.morphometrics.curves import resample_curves
from eigenshape.morphometrics.landmark_files import read_folder, read_specimens
from eigenshape.morphometrics.landmarks import Landmarks
from eigenshape.morphometrics.placement import require_on_surfaces

MOST_NAMED = 5  # specimens that a sentence names


def find_landmarks(
    folder: Path, landmarks: Path | None, output: Path, unit: str, curve_points: int | None
) -> dict[str, Landmarks]:
    """Read the landmarks that are given: from a table, or from files beside meshes or in a folder.

    Points of curves are replaced by that many, spaced evenly, if a number is given. Raise
    InvalidParameterError if one is of no specimen of the folder, since its name may be misspelled, or
    does not lie on its surface.
    """
    found = (
        read_folder(folder, unit, output)
        if landmarks is None
        else read_specimens(landmarks, unit=unit)
    )
    paths = {item.name: item.path for item in find_items(folder)}
    unknown = sorted(found.keys() - paths.keys())
    if unknown:
        raise InvalidParameterError(
            f"Landmarks must be of specimens in {folder}; {unknown[0]!r} of {landmarks or folder} is "
            f"none. The specimens are {', '.join(sorted(paths)[:MOST_NAMED])}"
            f"{', ...' if len(paths) > MOST_NAMED else ''}"
        )
    require_on_surfaces(_readable(found, paths))
    if curve_points is None:
        return found
    return {
        name: resample_curves(own, curve_points, mesh=mesh)
        for name, mesh, own in _readable(found, paths)
    }


def _readable(
    landmarks: Mapping[str, Landmarks], paths: Mapping[str, Path]
) -> Iterator[tuple[str, TriangleMesh, Landmarks]]:
    """Give the surfaces with landmarks one by one; what cannot be read is named as a failure later."""
    for name, own in landmarks.items():
        try:
            mesh, _ = read_specimen(paths[name])
        except (CerteigError, OSError):
            continue
        yield name, mesh, own


def mostly_doubtful(carried: CarriedLandmarks) -> list[str]:
    """Name the specimens whose given landmarks are doubtful for the most part, with what is known."""
    found = []
    for row, name in enumerate(carried.specimens):
        given = carried.given[row]
        n_given, n_doubtful = given.sum(), carried.doubtful[row, given].sum()
        if 2 * n_doubtful > n_given:
            away, apart = carried.distance[row, given], carried.disagreement[row, given]
            others = f" and {np.nanmedian(apart):.3g} from where others put them"
            found.append(
                f"{n_doubtful} of {n_given} of {name} are doubtful: they lie {np.median(away):.3g} from "
                f"its surface{others if np.isfinite(apart).any() else ''} (medians). They may be of "
                "another specimen, moved, turned or mirrored."
            )
    return found


def unsure_sides(collection: Collection) -> list[str]:
    """Say, in one message or none, of which specimens it cannot be told whether they are mirrored."""
    unsure = [
        name
        for name, side in zip(collection.names, collection.sides, strict=True)
        if side == "cannot be told"
    ]
    if not unsure:
        return []
    n_all = len(collection.names)
    who = ", ".join(unsure) if len(unsure) <= MOST_NAMED else f"{len(unsure)} of {n_all} specimens"
    return [
        f"mirror images: of {who} it cannot be told whether they are mirrored, since both sides of "
        "the form are alike. Where one is, left and right are exchanged. The same landmarks on it "
        "and on another specimen tell; if none is mirrored, say so with --unmirrored."
    ]


def doubtful_landmarks(carried: CarriedLandmarks) -> dict[str, list[str]]:
    """Return the names of the doubtful landmarks of each specimen that has some."""
    names = np.array(carried.names)
    pairs = zip(carried.specimens, carried.doubtful, strict=True)
    return {specimen: names[row].tolist() for specimen, row in pairs if row.any()}
