"""Landmarks that are given for specimens of a folder: read, and checked before anything is fitted."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from certeig.kit.errors import CerteigError, InvalidParameterError
from eigenshape.collections.collection import read_specimen
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
