"""Write what the front end and its tests take from the library: color tables and small results."""

import base64
import json
from pathlib import Path

import matplotlib as mpl
import numpy as np

import eigenshape as es
from eigenshape.plot.render import palette

FRONT = Path(__file__).parents[1] / "front"
TABLES = FRONT / "src" / "core" / "color_tables.json"
CASES = FRONT / "test" / "cases.json"
N_PART_COLORS = 18  # palette() repeats after them
DIGITS = 12  # of stored numbers, so that the file does not depend on the last digits of a CPU


def color_tables() -> dict:
    """Return the color maps and the part palette, base64 of red, green and blue."""
    steps = np.linspace(0, 1, 256)
    maps = {name: _pack(mpl.colormaps[name](steps)) for name in ("viridis", "inferno", "RdBu_r")}
    return {"maps": maps, "parts": _pack(palette(np.arange(N_PART_COLORS)))}


def _pack(colors: np.ndarray) -> str:
    return base64.b64encode(np.round(255 * colors[:, :3]).astype(np.uint8).tobytes()).decode()


def cases() -> dict:
    """Return heat and drags of small shapes, as the library computes them."""
    mesh = _bumpy_sphere()
    spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 12)
    times = es.spectral.default_times(spectrum, 2)
    heat = es.heat_kernel_signature(spectrum, times)
    source = 17
    kernel = spectrum.eigenvectors @ (
        np.exp(-times[0] * spectrum.eigenvalues) * spectrum.eigenvectors[source]
    )
    weights = spectrum.eigenvectors[:, :5].T @ (spectrum.mass @ mesh.vertices)
    return {
        "heat": {
            "modes": _plain(spectrum.eigenvectors.T.ravel()),
            "eigenvalues": _plain(spectrum.eigenvalues),
            "areas": _plain(spectrum.mass.diagonal()),
            "vertices": _plain(mesh.vertices.ravel()),
            "times": _plain(times),
            "signatures": [_plain(column) for column in heat.T],
            "source": source,
            "kernel": _plain(kernel),
            "lowpass5": _plain((spectrum.eigenvectors[:, :5] @ weights).ravel()),
        },
        "deformation": _deformation_case(),
    }


def _deformation_case() -> dict:
    """Return drags, and the smallest rotations that turn their starts towards their ends."""
    drags = np.random.default_rng(2).standard_normal((4, 3, 3))
    turns = []
    for pivot, start, end in drags:
        before, after = start - pivot, end - pivot
        axis = np.cross(before, after)
        angle = np.arctan2(np.linalg.norm(axis), before @ after)
        turns.append(es.Rotation(pivot, axis, float(angle)))
    return {
        "drags": [
            {"points": drag.tolist(), "axis": _plain(turn.axis), "angle": _plain([turn.angle])[0]}
            for drag, turn in zip(drags, turns, strict=True)
        ],
    }


def _bumpy_sphere() -> es.TriangleMesh:
    ball = es.icosphere(2)
    x, y, z = ball.vertices.T
    bumps = 1 + 0.35 * np.cos(4 * np.arctan2(y, x)) * (x**2 + y**2) + 0.3 * x * z
    return es.TriangleMesh(ball.vertices * bumps[:, None], ball.faces)


def _plain(numbers: np.ndarray) -> list[float]:
    return [float(f"{number:.{DIGITS}g}") for number in numbers]


def main() -> None:
    """Write both files."""
    TABLES.write_text(json.dumps(color_tables(), indent=2) + "\n", encoding="utf-8")
    CASES.parent.mkdir(exist_ok=True)
    CASES.write_text(json.dumps(cases()) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
