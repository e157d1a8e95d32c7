"""Shapes and edits after the figures of chapter 6."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1]))
from real_shapes import DATA

import eigenshape as es


@dataclass(frozen=True)
class Scene:
    """A shape and what is done to it."""

    name: str
    mesh: es.TriangleMesh
    moves: tuple[es.deformation.Move, ...]
    up: str = "y"
    n_modes: int | None = None
    fixed: es.deformation.BoxRegion | None = None


def box_surface(counts: tuple[int, int, int], sides: tuple[float, float, float]) -> es.TriangleMesh:
    """Return the surface of a box, its sides divided into squares and these into two triangles each."""
    size, grids = np.array(counts), []
    for axis in range(3):
        one, two = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, size[axis]):
            i, j = np.meshgrid(np.arange(size[one] + 1), np.arange(size[two] + 1), indexing="ij")
            nodes = np.zeros((*i.shape, 3), dtype=np.int64)
            nodes[..., one], nodes[..., two], nodes[..., axis] = i, j, side
            quads = np.stack(
                [nodes[:-1, :-1], nodes[1:, :-1], nodes[1:, 1:], nodes[:-1, 1:]], axis=2
            ).reshape(-1, 4, 3)
            grids.append(quads if side else quads[:, ::-1])
    corners = np.concatenate(grids)
    nodes, numbers = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    quads = numbers.reshape(-1, 4)
    odd = (corners.sum(axis=(1, 2)) // 4 % 2).astype(bool)
    quads[odd] = np.roll(
        quads[odd], 1, axis=1
    )  # so that diagonals alternate and prefer no way to turn
    return es.TriangleMesh(
        nodes / size * sides, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    )


def bumpy_plane(n: int) -> es.TriangleMesh:
    """Return a square of side 2 with smooth bumps on it."""
    flat = es.shapes.grid(n, n, width=2.0, height=2.0)
    x, y, _ = flat.vertices.T
    return es.TriangleMesh(
        np.column_stack([x, y, 0.03 * np.sin(6 * np.pi * x) * np.sin(6 * np.pi * y)]), flat.faces
    )


@cache
def real(name: str) -> es.TriangleMesh:
    """Return one of the classics."""
    return es.read_mesh(DATA / "classics" / name)


def about_rim(
    mesh: es.TriangleMesh,
    region: es.deformation.BoxRegion | es.deformation.BrushRegion,
    axis: list[float],
    degrees: float,
) -> es.deformation.Move:
    """Turn a region about the middle of its boundary."""
    rim = es.deformation.region_boundary(mesh, es.deformation.region_mask(mesh, region))
    return es.deformation.Move(
        region, es.Rotation(mesh.vertices[rim].mean(axis=0), axis, np.deg2rad(degrees))
    )


def around(
    mesh: es.TriangleMesh, direction: list[float], radius: float
) -> es.deformation.BrushRegion:
    """Return what lies along the surface within a length of the vertex farthest in a direction."""
    return es.deformation.BrushRegion(mesh.vertices[np.argmax(mesh.vertices @ direction)], radius)


def above(mesh: es.TriangleMesh, axis: int, share: float) -> es.deformation.BoxRegion:
    """Return all that lies above a share of the box."""
    low, high = np.full(3, -np.inf), np.full(3, np.inf)
    low[axis] = mesh.vertices[:, axis].min() + share * np.ptp(mesh.vertices[:, axis])
    return es.deformation.BoxRegion(low, high)


def knee(mesh: es.TriangleMesh) -> es.deformation.Move:
    """Bend the armadillo's right knee."""
    return about_rim(mesh, around(mesh, [-1.0, -10.0, 0.0], 0.33), [1, 0, 0], 60)


def arm(mesh: es.TriangleMesh) -> es.deformation.Move:
    """Stretch the armadillo's right arm by a tenth of its height, away from the body."""
    region = around(mesh, [-1.0, 0.0, 0.0], 0.30)
    mask = es.deformation.region_mask(mesh, region)
    out = mesh.vertices[mask].mean(axis=0) - mesh.vertices[
        es.deformation.region_boundary(mesh, mask)
    ].mean(axis=0)
    return es.deformation.Move(region, es.Translation(0.1 * out / np.linalg.norm(out)))


def _armadillo(name: str, *edits: Callable[[es.TriangleMesh], es.deformation.Move]) -> Scene:
    mesh = real("armadillo.obj")
    return Scene(name, mesh, tuple(edit(mesh) for edit in edits))


def _bar(name: str, axis: list[float], degrees: float, n: int, *, fixed: bool = False) -> Scene:
    mesh = box_surface((n, n, 5 * n), (1.0, 1.0, 5.0))
    region = es.deformation.BoxRegion([-np.inf, -np.inf, 4.0 if fixed else 2.5], [np.inf] * 3)
    foot = es.deformation.BoxRegion([-np.inf] * 3, [np.inf, np.inf, 1.0]) if fixed else None
    return Scene(
        name,
        mesh,
        (es.deformation.Move(region, es.Rotation([0.5, 0.5, 2.5], axis, np.deg2rad(degrees))),),
        "z",
        None,
        foot,
    )


def _plane(name: str, n: int) -> Scene:
    mesh = bumpy_plane(n)
    return Scene(name, mesh, (about_rim(mesh, above(mesh, 0, 0.5), [0, 1, 0], 90),), "z")


def _waist() -> Scene:
    mesh = real("armadillo.obj")
    return Scene("waist 90°", mesh, (about_rim(mesh, above(mesh, 1, 0.52), [1, 0, 0], 90),))


def _elk() -> Scene:
    mesh = real("elk.off")
    return Scene(
        "elk", mesh, (about_rim(mesh, around(mesh, [1.0, -0.5, -1.0], 75.0), [1, 0, 1], -40),)
    )


def _dragon() -> Scene:
    mesh = real("dragon.off")
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    back = es.deformation.BoxRegion([-np.inf] * 3, [np.inf, low[1] + 0.4 * (high - low)[1], np.inf])
    return Scene("dragon", mesh, (about_rim(mesh, back, [0, 0, 1], 50),), "z", 8)


SCENES: dict[str, Callable[[], Scene]] = {
    "knee 60°": lambda: _armadillo("knee 60°", knee),
    "arm stretched": lambda: _armadillo("arm stretched", arm),
    "combined": lambda: _armadillo("combined", knee, arm),
    "waist 90°": _waist,
    "plane 90°": lambda: _plane("plane 90°", 101),
    "coarse plane 90°": lambda: _plane("coarse plane 90°", 41),
    "bar bent 90°": lambda: _bar("bar bent 90°", [1, 0, 0], 90, 24),
    "bar twisted 180°": lambda: _bar("bar twisted 180°", [0, 0, 1], 180, 24),
    "bar twisted 180°, ends held": lambda: _bar(
        "bar twisted 180°, ends held", [0, 0, 1], 180, 24, fixed=True
    ),
    "elk": _elk,
    "dragon": _dragon,
}
QUICK: dict[str, Callable[[], Scene]] = {
    "coarse plane 90°": SCENES["coarse plane 90°"],
    "bar twisted 180°": lambda: _bar("bar twisted 180°", [0, 0, 1], 180, 12),
}
