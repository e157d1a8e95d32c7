"""Let heat flow from a fingertip, and read area and handles of a torus off its eigenvalues.

python examples/heat.py docs/pictures/heat.png
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import eigenshape as es

TIMES = np.array([0.002, 0.02, 0.2])  # over the area of the hand


def warm_hand(path: Path, n_vertices: int = 4000) -> np.ndarray:
    """Draw how heat spreads from the tip of a finger, and return its share at each time: (n, 3)."""
    hand = es.make_creature("hand", n_vertices=n_vertices)
    laplacian = es.cotangent_laplacian(hand)
    area = es.geometry.surface_area(hand)
    tip = np.zeros(hand.n_vertices)
    tip[hand.vertices[:, 1].argmax()] = 1
    heat = es.spectral.apply_heat(laplacian, tip, TIMES * area)
    even = laplacian.mass.diagonal() @ tip / area  # what is left everywhere in the end

    camera = es.plot.aim_camera(hand)
    across = hand.vertices @ camera.rotation[0]
    step = 1.1 * np.ptp(across) * camera.rotation[0]
    copies = [
        es.TriangleMesh(hand.vertices + place * step, hand.faces) for place in range(len(TIMES))
    ]
    levels = np.log10(np.maximum(heat / even, 0.01)).T.ravel()
    label = "heat over its mean, log10, after t = 0.002, 0.02, 0.2 area"
    row = es.geometry.disjoint_union(*copies)
    es.save_figure(es.figure_field(row, levels, label, camera=camera), path)
    return heat


def main(folder: Path) -> es.spectral.RecoveredGeometry:
    """Draw the hand, and recover the geometry of a torus from 200 eigenvalues."""
    warm_hand(folder / "heat.png", 1500)
    torus = es.shapes.torus(36, 18)
    spectrum = es.solve_spectrum(es.operators.fem_laplacian(torus, 3), 200)
    trace = es.spectral.heat_trace(spectrum, [0.5, 1.0])
    print(f"heat trace {trace.values.round(4)}, at most {trace.remainders.max():.1e} missing")
    return es.spectral.recover_geometry(spectrum)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        warm_hand(Path(sys.argv[1]))
    else:
        with tempfile.TemporaryDirectory() as temporary:
            print(main(Path(temporary)).explain())
