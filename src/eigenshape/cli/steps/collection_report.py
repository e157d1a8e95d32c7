"""The report of a collection: one page with its mean, modes, specimens and landmarks."""

import html
import json
from base64 import b64encode
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.image import imsave

from certeig.kit.files import replace_file
from eigenshape._vectors import mean_radius
from eigenshape.cli.steps.collecting import unsure_sides
from eigenshape.collections.carrying import CarriedLandmarks
from eigenshape.collections.collection import Collection
from eigenshape.geometry.distances.closest import closest_points
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.samples.surface_points import place_points
from eigenshape.morphometrics.procrustes import fit_procrustes
from eigenshape.morphometrics.variation import principal_components
from eigenshape.plot.camera import Camera, aim_camera
from eigenshape.plot.render import draw

N_MODES = 5  # sliders
PICTURE = 160  # pixels of a specimen's picture
STEPS = 32_000  # of a coordinate, in 16 bits: finer than a pixel of any screen
GRAY = (0.8, 0.78, 0.74)  # color of a scan, as the page has the mean


def write_collection_report(
    collection: Collection,
    carried: CarriedLandmarks | None,
    path: Path,
    title: str,
    progress: Callable[[float, str], None],
) -> None:
    """Write one page that any browser opens without a server."""
    unreflected = collection.unreflected
    together = fit_procrustes(unreflected)
    size = float(np.median(together.sizes))
    components = principal_components(together.shapes)
    deviations = np.sqrt(components.variances[:N_MODES])
    mean = TriangleMesh(size * components.mean, collection.mean.faces)
    camera = aim_camera(mean, size=PICTURE)
    scores = components.scores[:, : len(deviations)] / deviations

    specimens = []
    for number, name in enumerate(collection.names):
        progress(number / len(collection.names), name)
        specimens.append(
            {
                "name": name,
                "side": collection.sides[number],
                "method": collection.methods[number],
                "notes": collection.notes[name],
                "picture": _picture(collection, name, mean.vertices, camera),
                "scores": scores[number].tolist(),
            }
        )
    modes = components.modes[: len(deviations)] * (size * deviations)[:, None, None]
    data = {
        "template": collection.template,
        "specimens": specimens,
        "failures": collection.failures,
        "unsure": unsure_sides(collection),
        "mean": _numbers(mean.vertices),
        "modes": [_numbers(mode) for mode in modes],
        "faces": _text(mean.faces.astype("<u4"), None),
        "shares": components.shares[: len(deviations)].tolist(),
        "deviations": deviations.tolist(),
        # The page has the upward direction where pictures have the downward one.
        "turn": (camera.rotation * [[1], [-1], [1]]).tolist(),
        "landmarks": [] if carried is None else _landmarks(collection, carried, mean),
    }
    page = Path(__file__).with_suffix(".html").read_text(encoding="utf-8")
    page = page.replace("@TITLE@", html.escape(title))
    # In a script element only < could begin what ends it.
    page = page.replace("@DATA@", json.dumps(data).replace("<", "\\u003c"))
    replace_file(path, page.encode())


def _picture(
    collection: Collection, name: str, mean: Float[np.ndarray, "n 3"], camera: Camera
) -> str:
    """Return the picture of a scan, placed by its own points on the mean, as the address of an image."""
    mesh = collection.read_placed(name, mean)
    colors = np.broadcast_to(GRAY, (mesh.n_faces, 3))
    image = draw(mesh, camera, face_colors=colors).image
    file = BytesIO()
    imsave(file, image, format="png")
    return f"data:image/png;base64,{b64encode(file.getvalue()).decode()}"


def _landmarks(
    collection: Collection, carried: CarriedLandmarks, mean: TriangleMesh
) -> list[dict[str, Any]]:
    """Return where each landmark lies on the mean, and its spread at the size of the mean."""
    places, spreads = [], []
    for points, own, spread in zip(carried.points, collection.points, carried.spread, strict=True):
        found = closest_points(TriangleMesh(own, mean.faces), points)
        places.append(place_points(mean, found.simplices, found.weights).points)
        spreads.append(spread * (mean_radius(mean.vertices) / mean_radius(own)))
    on_mean = closest_points(mean, np.median(places, axis=0))
    # Given landmarks have no spread of their own.
    typical = np.ma.median(np.ma.masked_equal(spreads, 0), axis=0).filled(0)
    specimens = np.array(carried.specimens)
    return [
        {
            "name": name,
            "corners": mean.faces[on_mean.simplices[row]].tolist(),
            "weights": on_mean.weights[row].tolist(),
            "spread": float(typical[row]),
            "doubtful": specimens[carried.doubtful[:, row]].tolist(),
        }
        for row, name in enumerate(carried.names)
    ]


def _numbers(values: np.ndarray) -> dict[str, Any]:
    """Return numbers as whole multiples of a step."""
    step = float(np.abs(values).max()) / STEPS or 1.0
    return _text(np.round(values / step).astype("<i2"), step)


def _text(values: np.ndarray, step: float | None) -> dict[str, Any]:
    return {"kind": values.dtype.name, "step": step, "text": b64encode(values.tobytes()).decode()}
