"""Ten small shapes, as plain lists that every program can be told, and what each must look like when it is read.

A shape is a dictionary. `points`, and `polygons` or `cells`, are what a program stores; `texture`, `colors` and
`fields` belong to them. `triangles` are the polygons, cut by hand. `truth` is the surface that the whole scene shows,
if nodes, joints or weights move, copy or bend what is stored.
"""

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import eigenshape as es

Shape = dict[str, Any]
IN_UTM = np.array([500000.0, 4000000.0, 0.0])  # east and north in metres, as surveyors write them
CENTIMETRES = 0.01  # the scale of the armature above most characters of Mixamo


def make_shapes() -> dict[str, Shape]:
    """Return the shapes by name."""
    return {
        "prism": prism(),
        "hole": plate_with_hole(),
        "seam": sphere_with_seam(),
        "skin": skinned_bar(),
        "copies": copied_boxes(),
        "colors": colored_ball(),
        "fields": prism_with_fields(),
        "far": ball_in_utm(),
        "morph": morphed_ball(),
        "solids": mixed_solids(),
        "curves": two_curves(),
    }


def prism() -> Shape:
    """Return an L-shaped prism of area 14 and volume 3; fans around a first corner would leave it."""
    base = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], dtype=np.float64)
    points = np.vstack([np.column_stack([base, np.full(6, height)]) for height in (0.0, 1.0)])
    sides = [[i, (i + 1) % 6, (i + 1) % 6 + 6, i + 6] for i in range(6)]
    cut_base = [[0, 1, 3], [1, 2, 3], [0, 3, 5], [3, 4, 5]]
    triangles = [list(reversed(corners)) for corners in cut_base]
    triangles += [[i + 6 for i in corners] for corners in cut_base]
    for a, b, c, d in sides:
        triangles += [[a, b, c], [a, c, d]]
    polygons = [[5, 4, 3, 2, 1, 0], [6, 7, 8, 9, 10, 11], *sides]
    owners = [0] * 4 + [1] * 4 + [face for face in range(2, 8) for _ in range(2)]
    return {
        "points": points.tolist(),
        "polygons": polygons,
        "triangles": triangles,
        "owners": owners,  # the polygon that each triangle is cut from
        "closed": True,
    }


def plate_with_hole() -> Shape:
    """Return a plate of area 12 with a square hole, which a bridge joins to the outline."""
    outer = [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]]
    inner = [[1, 1, 0], [3, 1, 0], [3, 3, 0], [1, 3, 0]]
    triangles = []
    for i in range(4):
        j = (i + 1) % 4
        triangles += [[i, j, 4 + j], [i, 4 + j, 4 + i]]
    polygons = [[0, 1, 2, 3, 0, 4, 7, 6, 5, 4]]
    points = np.array(outer + inner, dtype=np.float64).tolist()
    return {
        "points": points,
        "polygons": polygons,
        "triangles": triangles,
        "owners": [0] * 8,
        "closed": False,
    }


def sphere_with_seam(n_around: int = 8, n_up: int = 5) -> Shape:
    """Return a globe whose points are double along one meridian, where the texture begins and ends."""
    u, v = np.meshgrid(np.arange(n_around + 1) / n_around, np.arange(n_up) / (n_up - 1))
    angles, heights = 2 * np.pi * (u % 1.0), np.pi * (v - 0.5)
    points = np.stack(
        [np.cos(heights) * np.cos(angles), np.cos(heights) * np.sin(angles), np.sin(heights)],
        axis=-1,
    )
    points[0], points[-1] = [0, 0, -1], [0, 0, 1]
    row = n_around + 1
    triangles = []
    for j in range(n_up - 1):
        for i in range(n_around):
            a = j * row + i
            if j > 0:
                triangles.append([a, a + 1, a + row])
            if j < n_up - 2:
                triangles.append([a + 1, a + row + 1, a + row])
    return triangle_shape(points.reshape(-1, 3), triangles) | {
        "texture": np.stack([u, v], axis=-1).reshape(-1, 2).tolist()
    }


def triangle_shape(points: np.ndarray, triangles: Any) -> Shape:
    """Return a closed shape of triangles."""
    triangles = np.asarray(triangles).tolist()
    return {
        "points": np.asarray(points, dtype=np.float64).tolist(),
        "polygons": triangles,
        "triangles": triangles,
        "owners": list(range(len(triangles))),
        "closed": True,
    }


def box() -> tuple[np.ndarray, np.ndarray]:
    """Return a box of sides 1, 2 and 3 that faces outward."""
    points = np.array([[x, y, z] for z in (0.0, 3.0) for y in (0.0, 2.0) for x in (0.0, 1.0)])
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    return points, np.array([t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])])


def skinned_bar() -> Shape:
    """Return a bar on two joints, below an armature that scales by 0.01; the upper joint is bent.

    The mesh hangs below the armature, as exporters place it. By the format (glTF 2.0, 3.7.3.3) the
    skin alone says where it is.
    """
    levels = np.linspace(0.0, 400.0, 5)  # in centimetres
    ring = np.array([[-50, -50], [50, -50], [50, 50], [-50, 50]], dtype=np.float64)
    points = np.vstack([np.column_stack([ring, np.full(4, level)]) for level in levels])
    triangles = [[0, 2, 1], [0, 3, 2], [16, 17, 18], [16, 18, 19]]
    for low in range(0, 16, 4):
        for i in range(4):
            j = (i + 1) % 4
            triangles += [
                [low + i, low + j, low + 4 + j],
                [low + i, low + 4 + j, low + 4 + i],
            ]
    upper = np.clip((levels - 100.0) / 200.0, 0.0, 1.0).repeat(4)
    turn = Rotation.from_rotvec([0.0, np.pi / 3, 0.0])
    armature = np.diag([CENTIMETRES] * 3 + [1.0])
    armature[:3, 3] = [5.0, 0.0, 0.0]
    at_rest, bent = np.eye(4), np.eye(4)
    at_rest[:3, 3] = bent[:3, 3] = [0.0, 0.0, 200.0]
    bent[:3, :3] = turn.as_matrix()
    inverse_binds = [np.linalg.inv(armature), np.linalg.inv(armature @ at_rest)]
    # The bind pose is that of the file: joints take the points to where the armature's scale puts them.
    joints = [armature, armature @ bent]
    stored = points @ armature[:3, :3].T + armature[:3, 3]
    weights = np.column_stack([1.0 - upper, upper])
    posed = sum(
        weights[:, [j]]
        * (
            (stored @ (joints[j] @ inverse_binds[j])[:3, :3].T)
            + (joints[j] @ inverse_binds[j])[:3, 3]
        )
        for j in range(2)
    )
    return triangle_shape(stored, triangles) | {
        "weights": weights.tolist(),
        "inverse_binds": [matrix.tolist() for matrix in inverse_binds],
        "armature": {"translation": [5.0, 0.0, 0.0], "scale": [CENTIMETRES] * 3},
        "joint_nodes": [
            {"translation": [0.0, 0.0, 0.0], "rotation": [0.0, 0.0, 0.0, 1.0]},
            {"translation": [0.0, 0.0, 200.0], "rotation": turn.as_quat().tolist()},
        ],
        "truth": triangle_shape(posed, triangles),
    }


def copied_boxes() -> Shape:
    """Return a box and three places of it: one is turned, one is larger and one is mirrored."""
    points, triangles = box()
    turn = Rotation.from_rotvec([0.0, 0.0, np.pi / 2]).as_quat().tolist()
    none = [0.0, 0.0, 0.0, 1.0]
    copies = [
        {"translation": [10.0, 0.0, 0.0], "rotation": turn, "scale": [1.0, 1.0, 1.0]},
        {"translation": [20.0, 5.0, 0.0], "rotation": none, "scale": [2.0, 2.0, 2.0]},
        {"translation": [30.0, 0.0, 7.0], "rotation": none, "scale": [-1.0, 1.0, 2.0]},
    ]
    pieces, corners = [], []
    for number, copy in enumerate(copies):
        moved = Rotation.from_quat(copy["rotation"]).apply(points * copy["scale"])
        pieces.append(moved + copy["translation"])
        is_mirrored = np.prod(copy["scale"]) < 0
        corners.append((triangles[:, ::-1] if is_mirrored else triangles) + number * len(points))
    truth = triangle_shape(np.vstack(pieces), np.vstack(corners))
    return triangle_shape(points, triangles) | {"copies": copies, "truth": truth}


def colored_ball() -> Shape:
    """Return a ball with a color at each point, dark and light."""
    ball = es.icosphere(1)
    colors = np.random.default_rng(0).integers(0, 256, (ball.n_vertices, 3))
    return triangle_shape(ball.vertices, ball.faces) | {"colors": colors.tolist()}


def prism_with_fields() -> Shape:
    """Return the prism with masks and numbers of several types at its points and on its polygons."""
    shape = prism()
    n, f = len(shape["points"]), len(shape["polygons"])
    places = np.arange(n)
    point_fields = {
        "mask": ("bool", places % 3 == 0),
        "is seen": ("bool", places % 2 == 0),
        "level": ("uint8", 20 * places),
        "step": ("int16", 1000 * (places - 5)),
        "label": ("int32", 70000 * places),
        "count": ("int64", 2**40 + places),
        "low": ("float32", places / 7),
        "height": ("float64", places / 7),
        "vector": ("float64", np.sin(np.arange(3.0 * n)).reshape(n, 3)),
    }
    cells = np.arange(f)
    cell_fields = {
        "chosen": ("bool", cells % 2 == 0),
        "part": ("int32", cells // 2),
        "weight": ("float64", (1 + cells) / 9),
    }
    for key, fields in (("point_fields", point_fields), ("cell_fields", cell_fields)):
        shape[key] = {
            name: {"type": kind, "values": np.asarray(values).astype(kind).tolist()}
            for name, (kind, values) in fields.items()
        }
    return shape


def ball_in_utm() -> Shape:
    """Return a ball of 1 m that lies where a survey found it: single precision ends at 0.25 m there."""
    ball = es.icosphere(2)
    return triangle_shape(ball.vertices + IN_UTM, ball.faces)


def morphed_ball() -> Shape:
    """Return a ball and two targets with weights: what viewers show is longer and moved."""
    ball = es.icosphere(1)
    longer = ball.vertices * [0.0, 0.0, 1.0]
    moved = np.broadcast_to([2.0, 0.0, 0.0], ball.vertices.shape)
    truth = triangle_shape(ball.vertices + 0.5 * longer + 0.25 * moved, ball.faces)
    targets = [longer.tolist(), moved.tolist()]
    return triangle_shape(ball.vertices, ball.faces) | {
        "targets": targets,
        "weights": [0.5, 0.25],
        "truth": truth,
    }


def mixed_solids() -> Shape:
    """Return a solid of one hexahedron, one wedge, one pyramid and two tetrahedra."""
    points = [
        [0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1],
        [2, 0, 0], [2, 0, 1],  # a wedge beside the cube
        [0.5, 0.5, 2],  # the tip of a pyramid on the cube
        [3, 0, 0], [2, 1, 0], [2, 0, -1],  # tetrahedra that touch the wedge in a point
    ]  # fmt: skip
    cells = {
        "hexahedron": [[0, 1, 2, 3, 4, 5, 6, 7]],
        "wedge": [[1, 8, 2, 5, 9, 6]],
        "pyramid": [[4, 5, 6, 7, 10]],
        "tetra": [[8, 11, 12, 9], [8, 12, 11, 13]],
    }
    n_cells = sum(map(len, cells.values()))
    numbers = {"type": "int32", "values": list(range(n_cells))}
    heights = {"type": "float64", "values": [float(point[2]) for point in points]}
    return {
        "points": np.array(points, dtype=np.float64).tolist(),
        "cells": cells,
        "volume": 1.0 + 0.5 + 1 / 3 + 2 / 6,
        "point_fields": {"height": heights},
        "cell_fields": {"number": numbers},
    }


def two_curves() -> Shape:
    """Return two polylines of lengths 2 and 3."""
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 5], [0, 3, 5]]
    heights = {"type": "float64", "values": [float(point[2]) for point in points]}
    return {
        "points": np.array(points, dtype=np.float64).tolist(),
        "lines": [[0, 1, 2], [3, 4]],
        "length": 5.0,
        "point_fields": {"height": heights},
    }
