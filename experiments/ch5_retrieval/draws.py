"""Which shapes are asked for among which: two halves of all individuals, random versions of poses (thesis 5.4)."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from perturbing import CLEAN, SCANS, changed_part, changed_whole
from real_shapes import DATA, manifest

import eigenshape as es

HALVES = ("tuning", "reporting")
KINDS = ("complete", "partial", "incomplete")
SPLIT_SEED = 5
KEPT = (0.5, 0.85)  # of the area, in the largest piece that planes leave
TRIALS = 200  # of planes, before a shape is given up
LEFT = 2  # shapes of a class that must stay in the database for one of it to be asked for


@dataclass(frozen=True)
class Shape:
    """A row of the manifest: its number there, its file, its class, and whose pose it is."""

    number: int
    path: str
    label: str
    identity: str


@dataclass(frozen=True)
class Version:
    """A shape as one draw sees it: complete, a partial scan, or incomplete; and what was done to it."""

    shape: Shape
    kind: str
    seed: int
    change: str = CLEAN

    @property
    def name(self) -> str:
        """Return class, file, kind and change."""
        change = "" if self.change == CLEAN else f", {self.change}"
        return f"{self.shape.label}/{Path(self.shape.path).stem}, {self.kind}{change}"


@dataclass(frozen=True)
class Draw:
    """Queries, and the database in two forms: each pose in one version, or all of them complete."""

    seed: int
    queries: tuple[Version, ...]
    mixed: tuple[Version, ...]
    complete: tuple[Version, ...]


def shapes() -> list[Shape]:
    """List all shapes; the poses of one individual of TOSCA or Sumner share an identity, all others have their own."""
    return [
        Shape(number, row["path"], row["cls"], f"{row['cls']}/{individual(Path(row['path']).stem)}")
        for number, row in enumerate(manifest())
    ]


def individual(stem: str) -> str:
    """Return the name of a file without its pose."""
    return stem if stem.startswith("psb") else re.sub(r"-?(\d+|reference)$", "", stem)


def half_of(everything: Sequence[Shape], half: str) -> list[Shape]:
    """Return the shapes of one half; no individual is in both, and each class is as even as individuals allow.

    In an order that a fixed seed draws, the individuals of each class go where fewer shapes of it are, largest first.
    """
    rng = np.random.default_rng(SPLIT_SEED)
    sizes = Counter(shape.identity for shape in everything)
    total = Counter[str]()
    side: dict[str, str] = {}
    for label in sorted({shape.label for shape in everything}):
        names = sorted({shape.identity for shape in everything if shape.label == label})
        in_class = Counter[str]()
        for name in sorted(
            (names[place] for place in rng.permutation(len(names))), key=lambda name: -sizes[name]
        ):
            side[name] = min(HALVES, key=lambda half: (in_class[half], total[half]))
            in_class[side[name]] += sizes[name]
            total[side[name]] += sizes[name]
    return [shape for shape in everything if side[shape.identity] == half]


def draw(some: Sequence[Shape], seed: int, n_complete: int = 18, n_others: int = 32) -> Draw:
    """Choose a version of each shape, and which shapes are asked for.

    Each shape draws its version and its turn by itself. In the order of turns they become queries while there are too
    few of their kind and enough others of their class.
    """
    drawn = [own_choice(shape, seed) for shape in some]
    left = Counter(shape.label for shape in some)
    wanted = Counter(complete=n_complete, other=n_others)
    asked = set()
    for _, version in sorted(drawn, key=lambda pair: pair[0]):
        kind = "complete" if version.kind == "complete" else "other"
        if wanted[kind] and left[version.shape.label] > LEFT:
            wanted[kind] -= 1
            left[version.shape.label] -= 1
            asked.add(version)
    kept = [version for _, version in drawn if version not in asked]
    queries = tuple(version for _, version in drawn if version in asked)
    return Draw(seed, queries, tuple(kept), tuple(complete(version.shape) for version in kept))


def own_choice(shape: Shape, seed: int) -> tuple[float, Version]:
    """Return a shape's turn, in 0..1, and its version."""
    rng = np.random.default_rng([seed, shape.number])
    kind = KINDS[rng.integers(len(KINDS))]
    return rng.random(), complete(shape) if kind == "complete" else Version(shape, kind, seed)


def complete(shape: Shape) -> Version:
    """Return the complete version, which is the same in every draw."""
    return Version(shape, "complete", 0)


def make(version: Version, *, turned: bool = True) -> es.TriangleMesh:
    """Read a shape and make a version of it, in a unit box, then turned at random; pictures do not turn it.

    Whatever the change, the sides, planes and turns that it draws are the same.

    Raises
    ------
    eigenshape.InvalidShapeError
        If no planes leave a piece of the wanted size.
    """
    rng = np.random.default_rng([version.seed, version.shape.number, 1 + KINDS.index(version.kind)])
    own = np.random.default_rng([version.seed, version.shape.number, 1 + len(KINDS)])
    mesh = changed_whole(es.read_mesh(DATA / version.shape.path), version.change)
    if version.change in SCANS:
        view, all_pieces = rng.standard_normal(3), SCANS[version.change]
        mesh = es.scans.simulate_scan(mesh, own, view=view, all_pieces=all_pieces).mesh
    elif version.kind == "partial":
        mesh = es.partial_scan(mesh, rng).mesh
    elif version.kind == "incomplete":
        mesh = incomplete(mesh, rng)
    boxed = es.geometry.normalize_mesh(changed_part(mesh, version.change, own), "box")
    if not turned:
        return boxed
    return es.TriangleMesh(boxed.vertices @ rotation(rng).T, boxed.faces)


def incomplete(whole: es.TriangleMesh, rng: np.random.Generator) -> es.TriangleMesh:
    """Cut by one to three planes until the largest piece has a share of the area within `KEPT`."""
    area = es.geometry.surface_area(whole)
    for _ in range(TRIALS):
        planes = es.scans.random_planes(
            whole, rng, n_planes=int(rng.integers(1, 4)), share=rng.uniform(0.05, 0.4)
        )
        try:
            piece = es.repair(
                es.scans.cut_by_planes(whole, planes).mesh, ["largest_component"]
            ).mesh
        except es.InvalidShapeError:
            continue
        if KEPT[0] <= es.geometry.surface_area(piece) / area <= KEPT[1]:
            return piece
    raise es.InvalidShapeError(
        f"An incomplete version must keep {KEPT} of the area; {TRIALS} trials left none such."
    )


def rotation(rng: np.random.Generator) -> np.ndarray:
    """Return a random rotation: that of a random unit quaternion."""
    quaternion = rng.standard_normal(4)
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
