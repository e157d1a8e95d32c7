"""Skins, skeletons, morph targets and animations of a glTF file, fitted to another shape."""

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.spatial.transform import Rotation

from eigenshape._vectors import Similarities, fit_similarities, nearest_rotations
from eigenshape.calculus.equations import solve_heat
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.io.attributes import MeshAttributes
from eigenshape.io.formats.gltf import (
    PLACES,
    SKINS,
    Entry,
    Gltf,
    Placement,
    Scene,
    decode,
    local_matrix,
    read_accessor,
    skin_weights,
    world_matrices,
)
from eigenshape.io.formats.gltf_document import Columns, Document
from eigenshape.operators.robust import robust_laplacian

# Around each vertex, turn and size of a shape are means within this share of the root of its area:
# wide enough that errors of single vertices cancel, and less than the width of a head.
WINDOW = 0.05
# Blend shapes of a part that is larger or smaller than elsewhere grow at most this much, so that errors
# of the map cannot tear a face apart.
MOST_GROWTH = 4.0
# A joint is placed by the surface around it: weights fall with distance⁴ from this share of the
# size of the shape, so that the nearest ring counts.
RING = 0.02
# Weight of vertices that neither the joint nor its parent moves: only where there are no others
STRANGERS = 1e-3
TINY = 1e-12  # where all around a vertex was contracted, it still has a mean


class Fit(NamedTuple):
    """How the content of a file is fitted to another shape."""

    before: dict[int, Placement]  # of nodes with a mesh
    after: dict[int, Placement]  # as the moved skeleton places them
    weights: csr_array  # (3 f, nodes) weight of each joint at each corner
    frames: np.ndarray  # (n, 3, 3) rotation about each vertex
    factors: np.ndarray  # (n,) change of size about each vertex

    def fit_columns(
        self,
        gltf: Gltf,
        node: int,
        columns: list[Columns],
        corners: np.ndarray,
        vertices: np.ndarray,
    ) -> Placement:
        """Fit weights of joints, and motions of morph targets, in the columns of corners of a mesh.

        Return how the node shows the mesh now.
        """
        table, *targets = columns
        before, after = self.before[node], self.after[node]
        poses = [place.matrix[None] for place in (before, after)]
        if before.skin is not None:
            joints = gltf.entry("skins", before.skin)["joints"]
            weights = csr_array(self.weights[corners][:, joints])
            bones = [np.asarray(place.bones).reshape(-1, 16) for place in (before, after)]
            poses = [(weights @ each).reshape(-1, 4, 4) for each in bones]
            table |= _largest_weights(weights, sum(name.startswith("JOINTS") for name in table))
        # From the file into the world, onto the other shape, and back into the file
        linear, linear_after = (pose[:, :3, :3] for pose in poses)
        turns = np.linalg.pinv(linear_after) @ self.frames[vertices] @ linear
        for target in targets:
            for name, column in target.items():
                moved = np.einsum("cij,cj->ci", turns, decode(*column))
                if name == "POSITION":
                    moved *= self.factors[vertices, None]
                target[name] = moved.astype("<f4"), False
        return after


def fit_scene(
    document: Document, gltf: Gltf, scene: Scene, attributes: MeshAttributes, mesh: TriangleMesh
) -> Fit:
    """Move the skeleton of a document to the corresponding places of a mesh; return how vertices follow."""
    places = TriangleMesh(np.asarray(attributes.places), mesh.faces)
    areas = dual_volumes(mesh)
    weights = csr_array(attributes.corners @ _file_weights(gltf, scene))
    used, corners = np.unique(mesh.faces, return_index=True)
    pairs = places.vertices[used], mesh.vertices[used], areas[used]
    matrices = _move_skeleton(document, gltf, scene, weights[corners], pairs)
    frames, factors = np.tile(np.eye(3), (mesh.n_vertices, 1, 1)), np.ones(mesh.n_vertices)
    if any(place.weights for place in scene.placements.values()):
        # Where the map has contracted a region, which was filled, what lies around decides.
        share = np.minimum(dual_volumes(places) / areas.clip(min=TINY), 1.0)[:, None] + TINY
        laplacian, time = robust_laplacian(mesh), WINDOW**2 * areas.sum()

        def average(values: np.ndarray) -> np.ndarray:
            sums = solve_heat(laplacian, np.column_stack([share * values, share]), time)
            return sums[:, :-1] / sums[:, -1:]

        around = fit_similarities(average, places.vertices, mesh.vertices)
        usual = float(np.median(around.factors))
        frames = around.rotations
        factors = around.factors.clip(usual / MOST_GROWTH, usual * MOST_GROWTH)
    after = _place_again(document.tree, scene, matrices)
    return Fit(scene.placements, after, weights, frames, factors)


def _file_weights(gltf: Gltf, scene: Scene) -> csr_array:
    """Return the weight of each joint, a node, at each corner of the triangles of a scene."""
    rows = scene.piece.rows[scene.piece.faces]
    n_nodes = len(gltf.tree.get("nodes", []))
    entries: list[tuple[np.ndarray, ...]] = []
    parts, owners = scene.parts()
    for number, (node, primitive) in enumerate(parts):
        place = scene.placements[node]
        if place.skin is None:
            continue
        names = np.array(gltf.entry("skins", place.skin)["joints"])
        part = gltf.entry("meshes", place.mesh)["primitives"][primitive]
        chosen = np.flatnonzero(owners == number)
        columns = {
            name: read_accessor(gltf, index, 4)
            for name, index in part["attributes"].items()
            if name.startswith(SKINS)
        }
        joints, weights, _ = skin_weights(columns, columns.__getitem__, len(names))
        of_corners = rows[chosen].ravel()
        corners = np.repeat((3 * chosen[:, None] + [0, 1, 2]).ravel(), joints.shape[1])
        entries.append((weights[of_corners].ravel(), corners, names[joints[of_corners]].ravel()))
    entries.append((np.empty(0), *np.empty((2, 0), dtype=np.int64)))
    values, corners, nodes = (np.concatenate(column) for column in zip(*entries, strict=True))
    return csr_array(coo_array((values, (corners, nodes)), shape=(rows.size, n_nodes)))


def _move_skeleton(
    document: Document,
    gltf: Gltf,
    scene: Scene,
    influence: csr_array,
    pairs: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> dict[int, np.ndarray]:
    """Move the joints of all skins in a document; return the matrices of all nodes.

    `influence` is the weight of each node at each pair of places, and pairs are places before and
    after, and areas.
    """
    tree = document.tree
    old = world_matrices(gltf, scene.number)[0]
    joints = {joint for skin in tree.get("skins", []) for joint in skin["joints"]} & old.keys()
    above = {child: node for node in old for child in tree["nodes"][node].get("children", [])}
    whole = _weighted_fit(pairs, pairs[2])
    new: dict[int, np.ndarray] = {}
    turns: dict[int, np.ndarray] = {}
    steps = {}  # rest translations of joints, before and after
    for node, matrix in old.items():
        entry = tree["nodes"][node]
        parent = above.get(node)
        base, base_new = (np.eye(4) if parent is None else table[parent] for table in (old, new))
        turn = turned = np.eye(3) if parent is None else turns[parent]
        local = local_matrix(entry)
        if node in joints:
            before = whole.rotations[0] if parent not in joints else turn
            turned, place = _fit_joint(node, parent, matrix[:3, 3], influence, pairs, before)
            axes = nearest_rotations(base[None, :3, :3])[0]
            spin = axes.T @ turn.T @ turned @ axes  # what turns the joint within its parent
            shift = np.linalg.pinv(base_new[:3, :3]) @ (place - base_new[:3, 3])
            steps[node] = local[:3, 3].copy(), shift
            local[:3, :3] = spin @ local[:3, :3]
            local[:3, 3] = shift
            if "matrix" in entry:
                entry["matrix"] = local.T.ravel().tolist()
            else:
                quaternion = Rotation.from_quat(entry.get("rotation", PLACES["ROTATION"]))
                entry["rotation"] = (Rotation.from_matrix(spin) * quaternion).as_quat().tolist()
                entry["translation"] = shift.tolist()
        turns[node] = turned
        new[node] = base_new @ local
    for skin in tree.get("skins", []):
        # The shape as it is becomes the rest pose. A joint of scale 0 has no inverse.
        binds = np.tile(np.eye(4), (len(skin["joints"]), 1, 1))
        for bind, joint in zip(binds, skin["joints"], strict=True):
            if joint in new:
                bind[:3] = np.linalg.pinv(new[joint])[:3]
        rows = binds.transpose(0, 2, 1).reshape(-1, 16).astype("<f4")
        skin["inverseBindMatrices"] = document.add_rows(rows)
    _scale_motions(document, gltf, steps, float(whole.factors[0]))
    return new


def _fit_joint(
    node: int,
    parent: int | None,
    point: np.ndarray,
    influence: csr_array,
    pairs: tuple[np.ndarray, np.ndarray, np.ndarray],
    before: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return how a joint is turned in the world, and where it comes to lie."""
    places, _, areas = pairs
    own = influence[:, [node]].toarray()[:, 0]
    other = 0.0 if parent is None else influence[:, [parent]].toarray()[:, 0]
    size = np.sqrt(areas.sum())
    distances = np.sum((places - point) ** 2, axis=1) / size**2
    near = areas * (own + other + STRANGERS) / (distances + RING**2) ** 2
    place = _weighted_fit(pairs, near).move(point[None])[0]
    if not own.any():
        return before, place
    limb = _weighted_fit(pairs, own * areas, follow=before)
    return limb.rotations[0], place


def _weighted_fit(
    pairs: tuple[np.ndarray, np.ndarray, np.ndarray],
    weights: np.ndarray,
    follow: np.ndarray | None = None,
) -> Similarities:
    shares = weights / weights.sum()
    return fit_similarities(lambda values: shares[None] @ values, *pairs[:2], follow)


def _scale_motions(
    document: Document, gltf: Gltf, steps: dict[int, tuple[np.ndarray, np.ndarray]], factor: float
) -> None:
    """Let animations move joints about their new places, as far as the size of the shape asks.

    Rotations stay: those of a joint are from its parent, which was turned as it was.
    """
    for animation in document.tree.get("animations", []):
        samplers: list[Entry] = []
        for channel in animation["channels"]:
            sampler = dict(animation["samplers"][channel["sampler"]])
            channel["sampler"] = len(samplers)
            samplers.append(sampler)
            node = channel["target"].get("node")
            if channel["target"]["path"] != "translation" or node not in steps:
                continue
            rows = read_accessor(gltf, sampler["output"], 3)
            before, after = steps[node]
            # Between its tangents, each third row of a cubic spline is a place.
            is_place = np.ones(len(rows), dtype=bool)
            if sampler.get("interpolation") == "CUBICSPLINE":
                is_place = np.arange(len(rows)) % 3 == 1
            moved = factor * rows
            moved[is_place] += after - factor * before
            sampler["output"] = document.add_rows(moved.astype("<f4"))
        animation["samplers"] = samplers


def _place_again(
    tree: Entry, scene: Scene, matrices: dict[int, np.ndarray]
) -> dict[int, Placement]:
    """Return how nodes show their meshes once joints were moved."""
    found = {}
    for node, place in scene.placements.items():
        bones = None
        if place.skin is not None:
            joints = [matrices[joint] for joint in tree["skins"][place.skin]["joints"]]
            bones = np.array([joint @ np.linalg.pinv(joint) for joint in joints])
        found[node] = place._replace(matrix=matrices[node], bones=bones)
    return found


def _largest_weights(weights: csr_array, n_sets: int) -> Columns:
    """Return attributes with the largest weights of each row, four in a set, that sum to 1."""
    count = weights.shape[0]
    weights.sum_duplicates()
    rows = weights.tocoo().row
    order = np.lexsort([weights.indices, -weights.data, rows])
    ranks = np.arange(len(order)) - weights.indptr[rows[order]]
    kept = order[ranks < 4 * n_sets]
    ranks = ranks[ranks < 4 * n_sets]
    joints = np.zeros((count, 4 * n_sets), dtype="<u2")
    shares = np.zeros((count, 4 * n_sets))
    shares[rows[kept], ranks] = weights.data[kept]
    joints[rows[kept], ranks] = np.where(weights.data[kept] > 0, weights.indices[kept], 0)
    shares /= shares.sum(axis=1, keepdims=True)
    found: Columns = {}
    for number in range(n_sets):
        block = slice(4 * number, 4 * number + 4)
        values = joints[:, block], shares[:, block].astype("<f4")
        found |= {
            f"{kind}_{number}": (rows, False) for kind, rows in zip(SKINS, values, strict=True)
        }
    return found
