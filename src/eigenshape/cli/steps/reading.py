"""Reading the shapes that a verb is given, and repairing them."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from certeig.kit.errors import CerteigError, InvalidParameterError
from eigenshape.cli.console import err, escape_text, print_repairs
from eigenshape.cli.inputs import repair_names
from eigenshape.deformation.distortion import require_poses
from eigenshape.geometry.cloud import Shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair import repair
from eigenshape.geometry.repairs.repair_report import RepairedCloud, RepairedMesh
from eigenshape.geometry.repairs.shape_facts import shape_facts
from eigenshape.geometry.simplicial import Mesh
from eigenshape.io import shape_files
from eigenshape.io.attributes import MeshAttributes
from eigenshape.io.carrying import carry_attributes
from eigenshape.io.formats.registry import CellKind
from eigenshape.io.label_files import read_map
from eigenshape.io.labeled_shapes import find_labeled_shapes, read_labeled_shape
from eigenshape.io.mesh_files import read_mesh
from eigenshape.io.surface_files import read_surface
from eigenshape.retrieval.labels.labeled_shape import LabeledShape

__all__ = ["read_map", "shape_facts"]  # for the verbs, as they are, beside what is defined here


def load_surface(path: Path, repairs: str) -> TriangleMesh:
    """Read a surface, as `es.io.read_surface`, and print on stderr what was made of it or repaired."""
    done = read_surface(path, repair=repair_names(repairs))
    report = done.report
    if report and not np.array_equal(done.source_vertices, np.arange(done.mesh.n_vertices)):
        report += (f"vertices have new numbers, up to {done.mesh.n_vertices - 1:,}",)
    print_repairs(report)
    return done.mesh


def repair_worn(mesh: TriangleMesh, worn: MeshAttributes, repairs: str) -> MeshAttributes:
    """Repair a mesh, print on stderr what was done, and carry its attributes along."""
    done = repair(mesh, repair_names(repairs))
    print_repairs(done.report)
    return carry_attributes(worn, done.mesh)


def load_shape(
    path: Path,
    repairs: str,
    dim: int,
    cells: CellKind | None = None,
    scene: str | int | None = None,
) -> Shape:
    """Read a shape of any kind, apply the requested repairs, and print on stderr what they did."""
    done = shape_files.load_shape(path, repair_names(repairs), dim=dim, cells=cells, scene=scene)
    print_repairs(done.report)
    return done.cloud if isinstance(done, RepairedCloud) else done.mesh


def load_repaired(
    path: Path, repairs: str, cells: CellKind | None, scene: str | int | None
) -> tuple[Shape, RepairedMesh[Mesh]]:
    """Read a shape, make a surface of points, and repair it; return it as it was read and as it is now."""
    names = repair_names(repairs)
    at_once = ["drop_missing"] if {"auto", "drop_missing"} & {*names} else []
    found: Any = shape_files.load_shape(path, at_once, cells=cells, scene=scene)
    cloud = found.cloud if isinstance(found, RepairedCloud) else None
    if cloud or found.mesh.dim == found.mesh.points.shape[1] == 2:
        found = read_surface(path, scene=scene)
    if cloud:  # of which `read_surface` has left out equal points
        names = tuple(name for name in names if name != "drop_duplicate_points")
    done = repair(found.mesh, names)
    return cloud or found.mesh, replace(done, report=found.report + done.report)


def load_poses(before: Path, after: Path, repairs: str) -> tuple[TriangleMesh, TriangleMesh]:
    """Read two poses of one mesh; repair the first, and do the same to the faces of the second."""
    first, second = read_mesh(before), read_mesh(after)
    require_poses(first, second)
    done = repair(first, repair_names(repairs))
    print_repairs(done.report)
    return done.mesh, TriangleMesh(second.vertices[done.source_vertices], done.mesh.faces)


def read_examples(
    like: Sequence[Path], labels: Sequence[Path], library: Path | None, repairs: str
) -> tuple[dict[str, LabeledShape], list[str]]:
    """Read the labeled shapes of a verb by name.

    Last come the names of those of the library that cannot be described once they are repaired; they
    are left out, with a line on stderr.
    """
    if labels and len(labels) != len(like):
        raise InvalidParameterError(
            f"--labels must be given once for each --like; there are {len(labels)} for {len(like)}."
        )
    if not like and library is None:
        raise InvalidParameterError("Labels must come from --like or from --library; give one.")
    names = repair_names(repairs)
    found, left_out = {}, []
    for number, path in enumerate(like):
        found[str(path)] = _read_example(path, labels[number] if labels else None, names)
    for path in find_labeled_shapes(library) if library else ():
        try:
            example = _read_example(path, None, names)
            example.points  # noqa: B018 - described here, and kept, so that a failure has a name
        except (CerteigError, OSError) as error:
            err.print(f"[yellow]left out:[/] {escape_text(path.name)}: {escape_text(error)}")
            left_out.append(path.name)
        else:
            found[path.stem] = example
    if not found:
        raise InvalidParameterError(
            f"A library must hold a labeled shape that can be described; {library} holds none."
        )
    return found, left_out


def _read_example(path: Path, labels: Path | None, names: tuple[str, ...]) -> LabeledShape:
    """Read a labeled shape, and print on stderr what was repaired."""
    found = read_labeled_shape(path, labels, repair=names)
    print_repairs(tuple(f"{path.name}: {line}" for line in found.report))
    return found
