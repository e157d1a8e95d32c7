"""Collections whose true maps are known: a creature in several poses, each with triangles of its own."""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.spatial.transform import Rotation

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from frame import rounded
from outputs import give_out, options_of

KINDS = ("hand", "biped", "quadruped", "bird", "lizard")
N_POSES = 4  # the first is the rest pose
N_VERTICES = 8000  # of the poses, whose vertices correspond
FACES = 5000, 6000, 7000, 8000  # of the specimens


def judge(kind: str, n_poses: int) -> dict[str, object]:
    """Build a collection of a creature's poses; errors are in hundredths of √area."""
    poses = [es.make_creature(kind, pose, n_vertices=N_VERTICES) for pose in range(n_poses)]
    scans = {}
    for number, pose in enumerate(poses):
        turn = Rotation.random(rng=np.random.default_rng(number)).as_matrix()
        poses[number] = es.TriangleMesh(pose.vertices @ turn.T, pose.faces)
        scans[f"pose {number}"] = es.geometry.decimate(poses[number], FACES[number]).mesh
    with TemporaryDirectory() as folder:
        collection = es.collections.build_collection(scans, folder, template="pose 0")
    unit = np.sqrt(es.geometry.surface_area(poses[0]))
    rows = [collection.number(name) for name in scans if name in collection.names]
    first = es.geometry.closest_points(poses[0], collection.points[collection.number("pose 0")])
    errors = []
    for row in rows[1:]:
        pose = poses[list(scans).index(collection.names[row])]
        truth = np.einsum("nc,ncd->nd", first.weights, pose.vertices[pose.faces[first.simplices]])
        errors.append(100 * np.linalg.norm(collection.points[row] - truth, axis=1) / unit)
    return {
        "poses": n_poses,
        "refused": len(collection.failures),
        "by position": collection.methods.count("position"),
        "intrinsic": collection.methods.count("intrinsic"),
        "cannot be told": collection.sides.count("cannot be told"),
        "mirrored": collection.sides.count("mirrored"),
        "mean": float(np.mean(errors)) if errors else None,
        "median": float(np.median(errors)) if errors else None,
        "worst pose": float(max(each.mean() for each in errors)) if errors else None,
    }


def main() -> None:
    """Judge creatures."""
    parser = options_of(__doc__, quick="two poses of a hand")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS, help="creatures")
    parser.add_argument("--poses", type=int, default=N_POSES, help="of each, with the rest pose")
    arguments = parser.parse_args()
    kinds, n_poses = arguments.kinds, arguments.poses
    if arguments.quick:
        kinds, n_poses = KINDS[:1], 2
    found = {}
    for kind in kinds:
        found[kind] = judge(kind, n_poses)
        # Each takes minutes, and an interruption loses only the last one.
        give_out({"quick" if arguments.quick else "full": rounded(found)}, arguments.out)


if __name__ == "__main__":
    main()
