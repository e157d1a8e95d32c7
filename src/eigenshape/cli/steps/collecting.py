"""Landmarks beside the specimens of a collection: which are given, and where a person should look."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from eigenshape._errors import EigenshapeError, InvalidParameterError
from eigenshape.collections.carrying import CarriedLandmarks
from eigenshape.collections.collection import Collection, read_specimen
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.folders import find_items
from eigenshape.morphometrics.landmark_files import read_folder, read_specimens
from eigenshape.morphometrics.landmarks import Landmarks
from eigenshape.morphometrics.placement import require_on_surfaces

MOST_NAMED = 5  # specimens that a sentence names


def find_landmarks(
    folder: Path, landmarks: Path | None, output: Path, unit: str
) -> dict[str, Landmarks]:
    """Read the landmarks that are given: from a table, or from files beside meshes or in a folder.

    Raise InvalidParameterError if one is of no specimen of the folder, since its name may be
    misspelled, or does not lie on its surface.
    """
    source = landmarks or folder
    if source == folder or source.is_dir():
        found = read_folder(source, unit, output)
    else:
        found = read_specimens(source, unit=unit)
    paths = {item.name: item.path for item in find_items(folder)}
    unknown = sorted(found.keys() - paths.keys())
    if unknown:
        raise InvalidParameterError(
            f"Landmarks must be of specimens in {folder}; {unknown[0]!r} of {source} is none. The "
            f"specimens are {', '.join(sorted(paths)[:5])}{', ...' if len(paths) > 5 else ''}"
        )
    if landmarks is not None and not found:
        raise InvalidParameterError(
            f"--landmarks takes a table, or a folder of files such as NAME.mrk.json; {source} holds "
            "none."
        )
    require_on_surfaces(_readable(found, paths))
    return found


def _readable(
    landmarks: Mapping[str, Landmarks], paths: Mapping[str, Path]
) -> Iterator[tuple[str, TriangleMesh, Landmarks]]:
    """Give the surfaces with landmarks one by one; what cannot be read is named as a failure later."""
    for name, own in landmarks.items():
        try:
            mesh, _ = read_specimen(paths[name])
        except (EigenshapeError, OSError):
            continue
        yield name, mesh, own


def given_landmarks(carried: CarriedLandmarks) -> dict[str, dict[str, dict[str, float | None]]]:
    """Return the distance and the disagreement of each given landmark, by specimen and name."""
    found: dict[str, dict[str, dict[str, float | None]]] = {}
    for i, j in np.argwhere(carried.given):
        apart = float(carried.disagreement[i, j])
        found.setdefault(carried.specimens[i], {})[carried.names[j]] = {
            "distance": float(carried.distance[i, j]),
            "disagreement": None if np.isnan(apart) else apart,
        }
    return found


def mostly_doubtful(carried: CarriedLandmarks) -> list[str]:
    """Name the specimens whose given landmarks are doubtful for the most part, with what is known."""
    found = []
    for row, name in enumerate(carried.specimens):
        given = carried.given[row]
        n_given, n_doubtful = int(given.sum()), int(carried.doubtful[row, given].sum())
        if 2 * n_doubtful > n_given:
            apart = carried.disagreement[row, given]
            others = f" and {np.nanmedian(apart):.3g} from where others put them"
            found.append(
                f"{n_doubtful} of {n_given} of {name} are doubtful: they lie "
                f"{np.median(carried.distance[row, given]):.3g} from its surface"
                f"{others if np.isfinite(apart).any() else ''} (medians). They may be of another "
                "specimen, moved, turned or mirrored."
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
