"""The options that name a shape and its repairs, and reading what they name."""

from pathlib import Path
from typing import Annotated

import typer

from eigenshape._errors import InvalidParameterError
from eigenshape.cli.console import print_repairs
from eigenshape.geometry.cloud import Shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repair import CLOUD_REPAIRS, REPAIRS, RepairedCloud, repair
from eigenshape.io.cells import CellKind
from eigenshape.io.mesh_files import read_mesh
from eigenshape.io.shape_files import read_shape

JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON instead of text.")]
KNOWN_REPAIRS = tuple(dict.fromkeys((*REPAIRS, *CLOUD_REPAIRS)))
RepairOption = Annotated[
    str,
    typer.Option(
        "--repair",
        metavar="NAMES",
        help=(
            "Repairs to apply to the mesh first, in this order, separated by commas: "
            f"{', '.join(KNOWN_REPAIRS)}. auto does what is needed, but fills no hole and "
            "drops no component. By default none."
        ),
    ),
]
MeshArgument = Annotated[
    Path,
    typer.Argument(
        help="Mesh file: OFF, OBJ, PLY, STL, GLB, glTF, or a surface in .mesh, .msh, .vtk, .vtu."
    ),
]
ShapeArgument = Annotated[
    Path,
    typer.Argument(
        help="Shape file: a mesh (OFF, OBJ, PLY, STL, GLB, glTF, .mesh, .msh, .vtk, .vtu) or points "
        "(.pts, .xyz, .pcd, PLY)."
    ),
]
DropMissingOption = Annotated[
    bool,
    typer.Option(
        "--drop-missing",
        help="Leave out points whose coordinates are not finite, from a point cloud.",
    ),
]
CellsOption = Annotated[
    CellKind | None,
    typer.Option(
        help="Kind of cells to read, if the file holds several kinds or does not name the kind."
    ),
]
DimOption = Annotated[
    int,
    typer.Option(
        help="Dimension of the shape that a point cloud samples: 1 curve, 2 surface, 3 volume."
    ),
]


def load_mesh(path: Path, repairs: str) -> TriangleMesh:
    """Read a mesh, apply the requested repairs, and print on stderr what they did."""
    done = repair(read_mesh(path), repair_names(repairs))
    print_repairs(done.report)
    return done.mesh


def load_shape(
    path: Path, repairs: str, dim: int, *, drop_missing: bool, cells: CellKind | None = None
) -> Shape:
    """Read a shape of any kind, apply the requested repairs, and print on stderr what they did."""
    names = repair_names(repairs)
    done = repair(read_shape(path, dim=dim, drop_missing=drop_missing, cells=cells), names)
    print_repairs(done.report)
    return done.cloud if isinstance(done, RepairedCloud) else done.mesh


def read_repaired(path: Path, names: tuple[str, ...]) -> TriangleMesh:
    """Read a mesh and apply repairs without printing, as for one of many."""
    return repair(read_mesh(path), names).mesh


def repair_names(text: str) -> tuple[str, ...]:
    """Split a comma-separated list of repairs. An unknown name is an error before any file is read."""
    names = tuple(name.strip() for name in text.split(",") if name.strip())
    for name in names:
        if name not in KNOWN_REPAIRS:
            raise InvalidParameterError(
                f"--repair takes {', '.join(KNOWN_REPAIRS)}; {name!r} is none of them."
            )
    return names
