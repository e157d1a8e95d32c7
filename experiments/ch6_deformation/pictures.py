"""Pictures after the figures of chapter 6: bent shapes by all methods, skeletons, and how details come back."""

import argparse
import sys
from pathlib import Path

import numpy as np
from bends import METHODS
from run import bound
from scenes import SCENES, Scene, real

sys.path.append(str(Path(__file__).resolve().parents[1]))
from outputs import output_folder
from real_shapes import require_data
from rich.progress import track

import eigenshape as es

FROM_THE_SIDE = {"waist 90°", "knee 60°", "combined"}
SIDE = np.array([[0.0, 0.0, -1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])  # from +x, y upward


def view(scene: Scene) -> es.plot.Camera:
    """Return where a scene is looked at from."""
    usual = es.plot.aim_camera(scene.mesh, up=scene.up)
    return es.plot.Camera(SIDE, usual.size) if scene.name in FROM_THE_SIDE else usual


def by_all_methods(scene: Scene, path: Path) -> None:
    """Draw a scene bent by each method."""
    binding, handles = bound(scene)
    poses = {"at rest": scene.mesh}
    for name, method in METHODS.items():
        bent = es.TriangleMesh(method(binding, handles), scene.mesh.faces)
        error = es.deformation.measure_distortion(scene.mesh, bent).edge_error
        poses[f"{name}: edges off by {100 * error:.1f} %"] = bent
    es.save_figure(
        es.plot.figure_poses(poses, binding.shares.sum(axis=0), camera=view(scene)), path
    )


def skeletons(folder: Path) -> None:
    """Draw the dragon's skeleton, cut and fitted (figures 6.5, 6.6), and ways to put details back (6.7, 6.9)."""
    scene = SCENES["dragon"]()
    binding, handles = bound(scene)
    response, faces = es.deformation.skeleton_response(binding), scene.mesh.faces
    cut = response.skeleton.copy()
    whole = binding.regions[0].astype(float)
    cut += handles[0].carry(cut, whole)
    moved = es.deformation.move_skeleton(response, handles)
    poses = {
        "shape": scene.mesh.vertices,
        "skeleton, 8 modes": response.skeleton,
        "region turned": cut,
        "fitted": moved,
    }
    meshes = {title: es.TriangleMesh(points, faces) for title, points in poses.items()}
    es.save_figure(
        es.plot.figure_poses(meshes, whole, camera=view(scene)), folder / "figure_6_6.png"
    )
    once = es.deformation.detailed_skeleton(binding, second_pass=False)
    ways = {
        "details by local frames": es.deformation.eigen_deformation(
            once, handles, details="frames"
        ),
        "details by the handle": es.deformation.eigen_deformation(once, handles, details="handle"),
        "blended (6.3.1)": es.deformation.eigen_deformation(once, handles),
        "blended, in two passes (6.3.3)": es.deformation.eigen_deformation(
            es.deformation.detailed_skeleton(binding), handles
        ),
    }
    meshes = {title: es.TriangleMesh(points, faces) for title, points in ways.items()}
    es.save_figure(
        es.plot.figure_poses(meshes, whole, camera=view(scene)), folder / "figure_6_7_and_6_9.png"
    )


def heads(path: Path) -> None:
    """Draw what 8, 50 and 300 modes know of a camel (figure 6.8)."""
    mesh = real("camel.off")
    rig = es.rig_shape(mesh)
    poses = {"shape": mesh}
    for n_modes in (300, 50, 8):
        poses[f"skeleton, {n_modes} modes"] = es.TriangleMesh(
            es.deformation.eigen_skeleton(rig, n_modes), mesh.faces
        )
    es.save_figure(es.plot.figure_poses(poses), path)


def main() -> None:
    """Draw all, or some scenes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="*", choices=list(SCENES), help="scenes")
    parser.add_argument("--folder", type=output_folder, default="ch6-pictures")
    chosen = parser.parse_args()
    require_data()
    for name in track(chosen.only or list(SCENES), "drawing"):
        file = "".join(letter if letter.isalnum() else "_" for letter in name.replace("°", ""))
        by_all_methods(SCENES[name](), chosen.folder / f"{file}.png")
    if not chosen.only:
        skeletons(chosen.folder)
        heads(chosen.folder / "figure_6_8.png")


if __name__ == "__main__":
    main()
