"""Reading the shapes that a verb is given, and repairing them."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from scipy.spatial import cKDTree

from eigenshape._errors import EigenshapeError, InvalidParameterError
from eigenshape.cli.console import err, escape_text, print_repairs
from eigenshape.cli.inputs import SEAMS, drops_missing, repair_names
from eigenshape.deformation.distortion import require_poses
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair import repair
from eigenshape.geometry.repairs.repair_report import RepairedCloud, RepairedMesh
from eigenshape.geometry.simplicial import Mesh
from eigenshape.io import mesh_files, shape_files
from eigenshape.io.formats.registry import CellKind
from eigenshape.io.labeled_shapes import (
    find_labeled_shapes,
    read_labeled_shape,
    read_map,
)
from eigenshape.io.surface_files import read_surface
from eigenshape.retrieval.labels.labeled_shape import LabeledShape

__all__ = ["read_map"]  # for the verbs, as it is, beside what is defined here


def load_mesh(path: Path, repairs: str) -> TriangleMesh:
    """Read a mesh, apply the requested repairs, and print on stderr what they did."""
    names = repair_names(repairs)
    mesh, left_out = mesh_files.load_mesh(path, drop_missing=drops_missing(names))
    return _repaired(mesh, names, left_out)


def load_surface(path: Path, repairs: str) -> TriangleMesh:
    """Read a mesh, or make a surface of points; repair it, and print on stderr what was done."""
    names = repair_names(repairs)
    made = read_surface(path)
    return _repaired(made.mesh, names, made.report)


def _repaired(mesh: TriangleMesh, names: tuple[str, ...], before: tuple[str, ...]) -> TriangleMesh:
    done = repair(mesh, names)
    report = before + done.report
    if done.mesh.n_vertices == mesh.n_vertices and names == (SEAMS,):
        # Verbs look for seams by themselves: that there are none is not worth a line.
        report = before
    elif done.mesh.n_vertices < mesh.n_vertices:
        report += (f"vertices have new numbers, up to {done.mesh.n_vertices - 1:,}",)
    print_repairs(report)
    return done.mesh


def load_shape(path: Path, repairs: str, dim: int, cells: CellKind | None = None) -> Shape:
    """Read a shape of any kind, apply the requested repairs, and print on stderr what they did."""
    names = repair_names(repairs)
    shape, left_out = shape_files.load_shape(
        path, dim=dim, drop_missing=drops_missing(names), cells=cells
    )
    done = repair(shape, names)
    print_repairs(left_out + done.report)
    return done.cloud if isinstance(done, RepairedCloud) else done.mesh


def load_repaired(
    path: Path, repairs: str, cells: CellKind | None
) -> tuple[Mesh, RepairedMesh[Mesh]]:
    """Read a mesh of any dimension and repair it; return it as it was read and as it is now."""
    names = repair_names(repairs)
    found, left_out = shape_files.load_shape(path, drop_missing=drops_missing(names), cells=cells)
    if isinstance(found, PointCloud):  # for the error that says what reads points
        found, left_out = mesh_files.load_mesh(path)
    elif found.dim == 2 and not isinstance(found, TriangleMesh):  # in the plane
        made = read_surface(path)
        found, left_out = made.mesh, made.report
    mesh: Mesh = found
    done = repair(mesh, names)
    return mesh, replace(done, report=left_out + done.report)


def load_poses(before: Path, after: Path, repairs: str) -> tuple[TriangleMesh, TriangleMesh]:
    """Read two poses of one mesh; repair the first, and do the same to the faces of the second."""
    first, second = mesh_files.read_mesh(before), mesh_files.read_mesh(after)
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
        except (EigenshapeError, OSError) as error:
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
    """Read a labeled shape and repair it; faces keep their labels."""
    given = read_labeled_shape(path, labels)
    done = repair(given.mesh, names)
    if not done.report:
        return given
    print_repairs(tuple(f"{path.name}: {line}" for line in done.report))
    # Repairs remove and split faces: each takes the label of the nearest one before.
    middles = [mesh.vertices[mesh.faces].mean(axis=1) for mesh in (given.mesh, done.mesh)]
    nearest = cKDTree(middles[0]).query(middles[1])[1]
    return LabeledShape(done.mesh, given.labels[nearest])
