"""Reading the shapes that a verb is given, and repairing them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Int
from scipy.spatial import cKDTree

from eigenshape._errors import EigenshapeError, InvalidParameterError
from eigenshape.cli.console import err, escape_text, print_repairs
from eigenshape.cli.inputs import repair_names
from eigenshape.deformation.distortion import require_poses
from eigenshape.geometry.cloud import Shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repair import repair
from eigenshape.geometry.repair_report import RepairedCloud
from eigenshape.io.cell_kinds import CellKind
from eigenshape.io.labeled_shapes import (
    find_labeled_shapes,
    read_label_names,
    read_labeled_shape,
)
from eigenshape.io.labels import read_map
from eigenshape.io.mesh_files import read_mesh
from eigenshape.io.shape_files import read_shape
from eigenshape.io.surfaces import read_surface
from eigenshape.retrieval.labels.labeled_shape import LabeledShape


def load_mesh(path: Path, repairs: str) -> TriangleMesh:
    """Read a mesh, apply the requested repairs, and print on stderr what they did."""
    done = repair(read_mesh(path), repair_names(repairs))
    print_repairs(done.report)
    return done.mesh


def load_poses(before: Path, after: Path, repairs: str) -> tuple[TriangleMesh, TriangleMesh]:
    """Read two poses of one mesh; repair the first, and do the same to the faces of the second."""
    first, second = read_mesh(before), read_mesh(after)
    require_poses(first, second)
    done = repair(first, repair_names(repairs))
    print_repairs(done.report)
    return done.mesh, TriangleMesh(second.vertices[done.source_vertices], done.mesh.faces)


def load_surface(path: Path, repairs: str) -> TriangleMesh:
    """Read a mesh, or make a surface of points; repair it, and print on stderr what was done."""
    made = read_surface(path)
    done = repair(made.mesh, repair_names(repairs))
    print_repairs(made.report + done.report)
    return done.mesh


def load_shape(
    path: Path, repairs: str, dim: int, *, drop_missing: bool, cells: CellKind | None = None
) -> Shape:
    """Read a shape of any kind, apply the requested repairs, and print on stderr what they did."""
    names = repair_names(repairs)
    done = repair(read_shape(path, dim=dim, drop_missing=drop_missing, cells=cells), names)
    print_repairs(done.report)
    return done.cloud if isinstance(done, RepairedCloud) else done.mesh


def read_examples(
    like: Sequence[Path], labels: Sequence[Path], library: Path | None, repairs: str
) -> tuple[dict[str, LabeledShape], list[str], list[str]]:
    """Read the labeled shapes of a verb by name, and the names of labels that a library has.

    Last come the names of those of the library that cannot be described once they are repaired; they
    are left out, with a line on stderr.
    """
    if labels and len(labels) != len(like):
        raise InvalidParameterError(
            f"--labels must be given once for each --like; there are {len(labels)} for {len(like)}."
        )
    if not like and library is None:
        raise InvalidParameterError("Labels must come from --like or from --library; give one.")
    beside: Sequence[Path | None] = labels or [None] * len(like)
    steps = repair_names(repairs)
    found = {
        str(path): _read_example(path, given, steps)
        for path, given in zip(like, beside, strict=True)
    }
    if library is None:
        return found, [], []
    left_out = []
    for path in find_labeled_shapes(library):
        try:
            example = _read_example(path, None, steps)
            example.points  # noqa: B018 - described here, and kept, so that a failure has a name
        except (EigenshapeError, OSError) as error:
            err.print(f"[yellow]left out:[/] {escape_text(path.name)}: {escape_text(error)}")
            left_out.append(path.name)
        else:
            found[path.stem] = example
    if not found:
        raise InvalidParameterError(
            f"A library must hold a labeled shape that can be described; {library} holds none."
        )
    return found, read_label_names(library), left_out


def _read_example(path: Path, labels: Path | None, repairs: tuple[str, ...]) -> LabeledShape:
    """Read a labeled shape and repair it; faces keep their labels."""
    given = read_labeled_shape(path, labels)
    done = repair(given.mesh, repairs)
    if not done.report:
        return given
    print_repairs(tuple(f"{path.name}: {line}" for line in done.report))
    # Repairs remove and split faces: each takes the label of the nearest one before.
    middles = [mesh.vertices[mesh.faces].mean(axis=1) for mesh in (given.mesh, done.mesh)]
    nearest = cKDTree(middles[0]).query(middles[1])[1]
    return LabeledShape(done.mesh, given.labels[nearest])


def read_partners(path: Path | None) -> Int[np.ndarray, " n"] | None:
    """Read the partner of each vertex, or return None if no file is given."""
    return None if path is None else read_map(path)


def read_repaired(path: Path, names: tuple[str, ...]) -> TriangleMesh:
    """Read a surface and apply repairs without printing, as for one of many."""
    return repair(read_surface(path).mesh, names).mesh
