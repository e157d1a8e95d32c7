"""The options that several verbs have. Nothing heavy is imported here, so that `--help` is quick."""

from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import Annotated, Literal

import typer

from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.repairs.repair_names import CLOUD_REPAIRS, MESH_REPAIRS, require_repairs
from eigenshape.io.formats.registry import MESH_FORMATS, POINT_FORMATS, WRITTEN, CellKind
from eigenshape.retrieval.heat.recipe import PRESETS

JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON instead of text.")]
NO_REPAIR = "none"
KNOWN_REPAIRS = tuple(dict.fromkeys((*MESH_REPAIRS, *CLOUD_REPAIRS)))
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
AUTO_REPAIRS = (
    "Repairs to apply to each mesh first, in this order, separated by commas: "
    f"{', '.join(MESH_REPAIRS)}. auto does what is needed, but fills no hole and "
    "drops no component; none refuses meshes that need repair. "
)
IndexRepairOption = Annotated[
    str,
    typer.Option(
        "--repair",
        metavar="NAMES",
        help=f"{AUTO_REPAIRS}Clouds and frames of a depth camera become a surface first. "
        "By default auto.",
    ),
]
AutoRepairOption = Annotated[
    str, typer.Option("--repair", metavar="NAMES", help=f"{AUTO_REPAIRS}By default auto.")
]
MESHES_TO_WRITE = ", ".join(WRITTEN)  # suffixes, for the help of `--output`
MeshArgument = Annotated[
    Path,
    typer.Argument(help=f"Mesh file: {', '.join(MESH_FORMATS)}."),
]
ShapeArgument = Annotated[
    Path,
    typer.Argument(
        help=f"Shape file: a mesh ({', '.join(MESH_FORMATS)}) or points "
        f"({', '.join(POINT_FORMATS)}, or a mesh file without faces)."
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
ViewOption = Annotated[
    str,
    typer.Option(
        "--view",
        metavar="SIDE",
        help=(
            "Side from which the picture shows the shape: front, back, left, right, top, bottom, "
            "front-left, front-right, back-left, back-right, or a direction to the viewer such as "
            "1,0,2. By default the front left, as far as the front can be guessed."
        ),
    ),
]
UpOption = Annotated[
    str,
    typer.Option(
        "--up",
        metavar="AXIS",
        help=(
            "Upward direction of the picture: x, y, z, -x, -y, -z, or a direction such as 0,1,1. "
            "By default it is guessed."
        ),
    ),
]
Scale = Literal["none", "area", "diameter"]
PATCHES = "patches"  # a method of `index` and `query`
PARTS = "parts"  # a method of `segment`
METHODS = (PATCHES, *PRESETS)

HeatMethodOption = Annotated[
    str, typer.Option("--method", help=f"How shapes are described: {' or '.join(PRESETS)}.")
]
MethodOption = Annotated[
    str,
    typer.Option(
        "--method",
        help=f"How shapes are described: {', '.join(METHODS)}. patches is best for partial scans.",
    ),
]
StoredMethodOption = Annotated[
    str | None,
    typer.Option(
        "--method",
        help=(
            f"Which descriptions to compare: {', '.join(METHODS)}. By default the index's "
            "own, or patches if it has several."
        ),
    ),
]
IndexArgument = Annotated[Path, typer.Argument(help="Folder of the index.")]
HostOption = Annotated[
    str,
    typer.Option(help="Address to listen on; one that other machines reach needs --allow-remote."),
]
FilterOption = Annotated[
    list[str] | None,
    typer.Option(
        "--filter",
        metavar="CONDITION",
        help="Only shapes that meet a condition: label=cat, tag=scanned, or by an attribute "
        "height=1.5..3. label=cat,dog allows either, and label!=cat all others. Several filters must "
        "all be met.",
    ),
]
REGIONS = (
    "'y>0.5' or 'y>0.5, x<0' (coordinates, or percent of the bounding box: 'y>60%'); 'vertex 17 within 0.2' "
    "(distance along the surface, or percent of the square root of the area: 'within 10%'); 'part 3' (a number that "
    "`eigenshape segment` prints); or a file with one vertex index a line."
)


def repair_names(text: str) -> tuple[str, ...]:
    """Split a comma-separated list of repairs. An unknown name is an error before any file is read."""
    if text == NO_REPAIR:
        return ()
    names = [name.strip() for name in text.split(",") if name.strip()]
    return require_repairs(names, KNOWN_REPAIRS, "Names of --repair")


def drops_missing(names: Sequence[str]) -> bool:
    """Tell whether points that are not finite are to be left out when a file is read."""
    return "auto" in names or "drop_missing" in names


def memory_bytes(gigabytes: float | None) -> float | None:
    """Return what --memory limits in bytes; None is no limit."""
    return None if gigabytes is None else gigabytes * 1e9


def require_one_rule(n_parts: int | None, persistence: float | None, *, largest_gap: bool) -> None:
    """Raise an error if more than one option decides how many parts a mesh gets."""
    rules = {
        "--n-parts": n_parts is not None,
        "--persistence": persistence is not None,
        "--largest-gap": largest_gap,
    }
    given = [name for name, is_given in rules.items() if is_given]
    if len(given) > 1:
        raise InvalidParameterError(
            f"The number of parts takes at most one of {', '.join(rules)}; it was given "
            f"{' and '.join(given)}."
        )


def require_level(
    level: float,
    method: str,
    n_parts: int | None,
    persistence: float | None,
    *,
    largest_gap: bool,
) -> None:
    """Raise an error if a level has no meaning for a method, or other options contradict it."""
    if method != PARTS:
        raise InvalidParameterError(
            f"--level is for --method {PARTS}; the method is {method}. Use --n-parts."
        )
    if not isfinite(level):
        raise InvalidParameterError(f"--level must be finite; it is {level}.")
    if n_parts is not None or persistence is not None or largest_gap:
        raise InvalidParameterError(
            "--level determines the number of parts, as --n-parts, --persistence and --largest-gap "
            "do; give only one of them."
        )


def require_method(name: str, names: Sequence[str] = METHODS) -> None:
    """Raise an error if the name is not one of the allowed names."""
    if name not in names:
        raise InvalidParameterError(f"--method takes {', '.join(names)}; it is {name!r}.")
