"""Landmarks beside the specimens of a collection: which are given, and where a person should look."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from eigenshape._errors import InvalidParameterError
from eigenshape.collections.carrying import CarriedLandmarks
from eigenshape.collections.collection import Collection
from eigenshape.collections.spread_points import mean_radius
from eigenshape.geometry.distances.closest import closest_points
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.folders import find_items
from eigenshape.morphometrics.landmark_files import OF_ONE, read_landmarks, read_specimens
from eigenshape.morphometrics.landmarks import Landmarks, require_same_names

MOST_NAMED = 5  # specimens that a sentence names
OUTSIDE = 0.1  # distance of landmarks from their surface to be noted, in root mean square radii


def find_landmarks(folder: Path, landmarks: Path | None, output: Path) -> dict[str, Landmarks]:
    """Read the landmarks that are given: from a table, or from files beside meshes or in a folder.

    Raise InvalidParameterError if one is of no specimen of the folder, since its name may be
    misspelled.
    """
    if landmarks is not None and not landmarks.is_dir():
        found, source = read_specimens(landmarks), landmarks
    else:
        source = landmarks or folder
        found = {}
        for path in sorted(source.rglob("*")):
            suffix = next((each for each in OF_ONE if path.name.lower().endswith(each)), None)
            if suffix is None or output.absolute() in path.absolute().parents:
                continue
            name = path.relative_to(source).as_posix()[: -len(suffix)]
            if name in found:
                raise InvalidParameterError(
                    f"A specimen must have one file of landmarks; {name!r} has two in {source}."
                )
            found[name] = read_landmarks(path)
    names = {item.name for item in find_items(folder)}
    unknown = sorted(found.keys() - names)
    if unknown:
        raise InvalidParameterError(
            f"Landmarks must be of specimens in {folder}; {unknown[0]!r} of {source} is none. The "
            f"specimens are {', '.join(sorted(names)[:5])}{', ...' if len(names) > 5 else ''}"
        )
    if landmarks is not None and not found:
        raise InvalidParameterError(
            f"--landmarks takes a table, or a folder of files NAME.mrk.json or NAME.fcsv; {source} "
            "holds none."
        )
    if found:
        require_same_names(found)
    return found


def landmarks_outside(collection: Collection, labelled: Mapping[str, Landmarks]) -> list[str]:
    """Name the specimens whose landmarks do not lie on them, as in another frame or unit."""
    found = []
    for name, landmarks in labelled.items():
        own = collection.points[collection.number(name)]
        known = landmarks.points[np.isfinite(landmarks.points).all(axis=1)]
        if not len(known):
            continue
        nearest = closest_points(TriangleMesh(own, collection.mean.faces), known).points
        away = float(np.median(np.linalg.norm(nearest - known, axis=1)))
        if away > OUTSIDE * mean_radius(own):
            found.append(
                f"those of {name} lie {away:.3g} from its surface (median), so they are in another "
                "frame or unit than the mesh"
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
    return {
        specimen: [name for name, is_one in zip(carried.names, row, strict=True) if is_one]
        for specimen, row in zip(carried.specimens, carried.doubtful, strict=True)
        if row.any()
    }
