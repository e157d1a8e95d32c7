"""Eight bends on which nothing was chosen: the default binding beside as-rigid-as-possible at equal handles.

Handles are what does not move freely: what a binding holds (`Binding.held`). As-rigid-as-possible
is given those of the default binding, and those of a binding whose fixed vertices are named by hand
far from the region, so that nearly everything may move.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from peers import as_rigid_as_possible
from scenes import about_rim, around, box_surface

sys.path.append(str(Path(__file__).resolve().parents[1]))
from frame import rounded
from outputs import give_out, options_of
from real_shapes import DATA, require_data
from rich.progress import track

import eigenshape as es

ROUNDS = 100  # of as-rigid-as-possible
COLUMNS = (
    "default",
    "ARAP, same held",
    "fixed by hand",
    "ARAP, fixed by hand",
    "over ARAP, same held",
    "over ARAP, fixed by hand",
    "fixed by hand over ARAP",
)


@dataclass(frozen=True)
class OtherScene:
    """A shape, what is moved, and what a person would hold."""

    mesh: es.TriangleMesh
    move: es.deformation.Move
    fixed: es.deformation.BoxRegion


def real(name: str) -> es.TriangleMesh:
    """Return a shape of the retrieval set."""
    return es.read_mesh(DATA / "retrieval" / name)


def slab(
    mesh: es.TriangleMesh, axis: int, low: float, high: float, *, right: bool = False
) -> es.deformation.BoxRegion:
    """Return what lies between two shares of the box, or only its right half (x above the middle)."""
    start, size = mesh.vertices.min(axis=0), np.ptp(mesh.vertices, axis=0)
    ends = np.array([np.full(3, -np.inf), np.full(3, np.inf)])
    ends[:, axis] = start[axis] + np.array([low, high]) * size[axis]
    if right:
        ends[0, 0] = start[0] + 0.5 * size[0]
    return es.deformation.BoxRegion(*ends)


def knee() -> OtherScene:
    """Bend a knee of a man by 70°."""
    man = real("human/tosca_david0.ply")
    shank = slab(man, 2, -0.1, 0.27, right=True)
    return OtherScene(man, about_rim(man, shank, [1, 0, 0], 70), slab(man, 2, 0.6, 1.1))


def arm() -> OtherScene:
    """Stretch a forearm of a man by a tenth of his height."""
    man = real("human/tosca_david0.ply")
    length = 0.1 * float(np.ptp(man.vertices[:, 2]))
    move = es.deformation.Move(slab(man, 0, 0.8, 1.1), es.Translation([length, 0, 0]))
    return OtherScene(man, move, slab(man, 0, -0.1, 0.5))


def waist() -> OtherScene:
    """Bend the waist of a man by 80°."""
    man = real("human/tosca_david0.ply")
    return OtherScene(
        man, about_rim(man, slab(man, 2, 0.6, 1.1), [1, 0, 0], 80), slab(man, 2, -0.1, 0.3)
    )


def neck() -> OtherScene:
    """Lower the head of a cat by 50°."""
    cat = real("cat/tosca_cat0.ply")
    return OtherScene(
        cat, about_rim(cat, slab(cat, 1, -0.1, 0.15), [1, 0, 0], 50), slab(cat, 1, 0.5, 1.1)
    )


def tentacle() -> OtherScene:
    """Bend an arm of an octopus by 60°."""
    octopus = real("octopus/psb122.ply")
    tip = around(octopus, [1.0, 0.0, 0.0], 0.5)
    return OtherScene(octopus, about_rim(octopus, tip, [0, 0, 1], 60), slab(octopus, 0, -0.1, 0.5))


def vase() -> OtherScene:
    """Tilt the neck of a vase by 45°."""
    vessel = real("vase/psb362.ply")
    return OtherScene(
        vessel,
        about_rim(vessel, slab(vessel, 1, 0.6, 1.1), [1, 0, 0], 45),
        slab(vessel, 1, -0.1, 0.25),
    )


def twist(level: int = 5) -> OtherScene:
    """Twist an ellipsoid four times as long as wide by 120°."""
    ball = es.icosphere(level)
    egg = es.TriangleMesh(ball.vertices * [1, 1, 4], ball.faces)
    return OtherScene(
        egg, about_rim(egg, slab(egg, 2, 0.5, 1.1), [0, 0, 1], 120), slab(egg, 2, -0.1, 0.25)
    )


def bar(n: int = 16) -> OtherScene:
    """Bend a thick bar by 90° within one width."""
    beam = box_surface((n, n, 4 * n), (1.5, 1.5, 6.0))
    return OtherScene(
        beam, about_rim(beam, slab(beam, 2, 0.5, 1.1), [1, 0, 0], 90), slab(beam, 2, -0.1, 0.2)
    )


SCENES: dict[str, Callable[[], OtherScene]] = {
    "knee 70°": knee,
    "arm stretched": arm,
    "waist 80°": waist,
    "neck 50°": neck,
    "tentacle 60°": tentacle,
    "vase 45°": vase,
    "egg twisted 120°": twist,
    "thick bar bent 90°": bar,
}
QUICK: dict[str, Callable[[], OtherScene]] = {
    "egg twisted 120°": lambda: twist(3),
    "thick bar bent 90°": lambda: bar(6),
}


def compared(scene: OtherScene) -> dict[str, float]:
    """Return the edge errors of both methods with both sets of handles, and their ratios."""
    rig = es.rig_shape(scene.mesh)

    def errors(binding: es.deformation.Binding) -> tuple[float, float]:
        ours = es.deformation.bend(binding, [scene.move.handle]).vertices
        peer = as_rigid_as_possible(binding, [scene.move.handle], n_rounds=ROUNDS)
        found = [
            es.deformation.measure_distortion(scene.mesh, es.TriangleMesh(some, scene.mesh.faces))
            for some in (ours, peer)
        ]
        return found[0].edge_error, found[1].edge_error

    default, same = errors(es.deformation.bind(rig, [scene.move.region]))
    free, wide = errors(es.deformation.bind(rig, [scene.move.region], fixed=scene.fixed))
    values = (default, same, free, wide, default / same, default / wide, free / wide)
    return dict(zip(COLUMNS, values, strict=True))


def main() -> None:
    """Measure, print and save."""
    parser = options_of(__doc__, quick=", ".join(QUICK), out="ch6-other.json")
    chosen = parser.parse_args()
    if not chosen.quick:
        require_data()
    scenes = QUICK if chosen.quick else SCENES
    results = {name: compared(make()) for name, make in track(scenes.items(), "bending")}
    give_out(rounded(results), chosen.out)


if __name__ == "__main__":
    main()
