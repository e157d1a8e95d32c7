"""What bending does to edges and faces, by several methods at equal handles: table 6.2 of the thesis, and more."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
from bends import METHODS
from peers import as_rigid_as_possible
from scenes import QUICK, SCENES, Scene

sys.path.append(str(Path(__file__).resolve().parents[1]))
from frame import rounded
from outputs import give_out, options_of
from real_shapes import require_data
from rich.progress import track

import eigenshape as es


def bound(scene: Scene) -> tuple[es.deformation.Binding, list[es.Rotation | es.Translation]]:
    """Rig a scene, and bind its regions."""
    regions = [move.region for move in scene.moves]
    binding = es.deformation.bind(
        es.rig_shape(scene.mesh), regions, fixed=scene.fixed, n_modes=scene.n_modes
    )
    return binding, [move.handle for move in scene.moves]


def measures(
    scene: Scene, vertices: np.ndarray, held: np.ndarray, goal: np.ndarray
) -> dict[str, float]:
    """Return what a method did to a shape."""
    bent = es.TriangleMesh(vertices, scene.mesh.faces)
    found = es.deformation.measure_distortion(scene.mesh, bent)
    diagonal = np.linalg.norm(np.ptp(scene.mesh.vertices, axis=0))
    away = np.linalg.norm((vertices - goal)[held], axis=1)
    height = scene.mesh.vertices[:, "xyz".index(scene.up)]
    foot = height < height.min() + 0.1 * np.ptp(height)
    step = np.linalg.norm((vertices - scene.mesh.vertices)[foot], axis=1).max()
    return {
        "edges": found.edge_error,
        "of the box": found.edge_error_of_box,
        "least area": float(found.area_ratios.min()),
        "flipped": len(found.flipped),
        "crossing": len(es.geometry.self_intersections(bent)),
        "handles": float(np.sqrt(np.mean(away**2)) / diagonal),
        "feet": float(step / diagonal),
    }


def compared(scene: Scene) -> dict[str, Any]:
    """Return the measures of all methods on a scene."""
    binding, handles = bound(scene)
    goal = as_rigid_as_possible(binding, handles, n_rounds=1)
    held = np.setdiff1d(np.arange(scene.mesh.n_vertices), binding.part.free)
    rows: dict[str, Any] = {"vertices": scene.mesh.n_vertices, "modes": binding.n_modes.tolist()}
    rows["held"] = len(held) / scene.mesh.n_vertices
    for name, method in METHODS.items():
        rows[name] = measures(scene, method(binding, handles), held, goal)
    return rows


def main() -> None:
    """Measure, print and save."""
    parser = options_of(__doc__, quick=", ".join(QUICK), out="ch6-results.json")
    parser.add_argument("--only", nargs="*", choices=list(SCENES), help="scenes")
    chosen = parser.parse_args()
    scenes = QUICK if chosen.quick else {name: SCENES[name] for name in chosen.only or SCENES}
    if not chosen.quick:
        require_data()
    results = {name: compared(make()) for name, make in track(scenes.items(), "bending")}
    give_out(rounded(results), chosen.out)


if __name__ == "__main__":
    main()
