"""What the options of several verbs say and take. Nothing heavy is imported here, so that `--help` is quick."""

import re
from typing import Annotated, Literal

import typer

from certeig.kit.errors import InvalidParameterError
from eigenshape.geometry.repairs.repair_names import KNOWN_REPAIRS, require_repairs
from eigenshape.io.formats.registry import MESH_FORMATS, POINT_FORMATS, WRITTEN

# The repair of verbs that bend or cut a surface: it would come apart along the seams of a texture,
# where each vertex is there twice.
SEAMS = "weld_seams"
# What is said of a parameter of this name in each verb whose docstring says nothing else. After the
# colon stands what help calls the value.
SHARED_PARAMETERS = f"""\
as_json
    Print JSON instead of text.
mesh
    Mesh file: {", ".join(MESH_FORMATS)}.
shape
    Shape file: a mesh ({", ".join(MESH_FORMATS)}) or points
    ({", ".join(POINT_FORMATS)}, or a mesh file without faces).
output
    Write the mesh ({", ".join(WRITTEN)}).
index
    Folder of the index.
repair : NAMES
    Repairs to apply first, in this order, separated by commas: {", ".join(KNOWN_REPAIRS)}. auto does what is
    needed, but fills no hole and drops no component; weld_seams joins vertices that are double
    along seams, as those of textures; none does nothing, so that a shape that needs repair is
    refused.
cells
    Kind of cells to read, if the file holds several kinds or does not name the kind.
scene : NAME
    Scene to read of a glTF file that holds several. By default the one that the file names.
dim
    Dimension of the shape that a point cloud samples: 1 curve, 2 surface, 3 volume.
view : SIDE
    Side from which the picture shows the shape: front, back, left, right, top, bottom,
    front-left, front-right, back-left, back-right, or a direction to the viewer such as 1,0,2.
    By default the front left, as far as the front can be guessed.
up : AXIS
    Upward direction of the picture: x, y, z, -x, -y, -z, or a direction such as 0,1,1. By
    default it is guessed.
where : CONDITION
    Only shapes that meet a condition: label=cat, tag=scanned, or by an attribute height=1.5..3.
    label=cat,dog allows either, and label!=cat all others. Several filters must all be met.
sources
    Files of meshes or points, or folders to search for them.
workers
    Number of processes that describe shapes at the same time. By default one for each core.
timeout
    Seconds after which a file is named as failed.
memory
    Gigabytes that a process may use; a file that needs more is named as failed. By default each
    process has an equal share of the machine's memory.
scheduler : ADDRESS
    Describe on a cluster: the address of a Dask scheduler, such as tcp://10.0.0.5:8786. Needs
    pip install 'eigenshape[cluster]' on all machines, and files that all of them see.
host
    Address to listen on; one that other machines reach needs --allow-remote.
"""
# How a parameter is written whose name is not that of its option.
OPTION_NAMES = {"as_json": "json", "where": "filter", "settings": "set", "map_file": "map"}

# Of the verbs that describe shapes in processes
Workers = Annotated[int | None, typer.Option(min=1)]
Timeout = Annotated[float, typer.Option(min=1)]
Memory = Annotated[float | None, typer.Option(min=0.1)]

# Names in PRESETS of the heat recipes; a test compares the two.
HeatMethod = Literal["scale-free", "thesis"]
Method = Literal["patches", HeatMethod]


def read_parameters(text: str) -> dict[str, tuple[str | None, str]]:
    """Return what a section of a docstring says of each parameter: how the value is called, and the help."""
    explained = {}
    entry = r"^([\w, ]+?)(?: : (.+))?\n((?: {4}.+\n?)+)"  # one name or several, and indented lines
    for names, value, lines in re.findall(entry, text, re.MULTILINE):
        for name in names.split(", "):
            explained[name] = (value or None, " ".join(lines.split()))
    return explained


def option_spellings(name: str, default: object) -> tuple[str, ...]:
    """Return how an option is written on the command line, by the rule that all verbs follow.

    It is named as its parameter. The output is also `-o`, and a number of things (`n_parts`) also
    `-n`. A flag that is on by default has a form `--no-`.
    """
    if len(name) == 1:
        return (f"-{name}",)
    text = OPTION_NAMES.get(name, name.replace("_", "-"))
    if name == "output":
        return ("-o", "--output")
    if name.startswith("n_"):
        return ("-n", f"--{text}")
    return (f"--{text}/--no-{text}",) if default is True else (f"--{text}",)


def repair_names(text: str) -> tuple[str, ...]:
    """Split a comma-separated list of repairs. An unknown name is an error before any file is read."""
    if text == "none":
        return ()
    names = [name.strip() for name in text.split(",") if name.strip()]
    return require_repairs(names, KNOWN_REPAIRS, "Names of --repair")


def numbers_of(text: str) -> list[float]:
    """Return numbers that are separated by commas; none if the text holds anything else."""
    try:
        return [float(piece) for piece in text.split(",")]
    except ValueError:
        return []


def memory_bytes(gigabytes: float | None) -> float | None:
    """Return what --memory limits in bytes; None is no limit."""
    return None if gigabytes is None else gigabytes * 1e9


def require_one_rule(rules: dict[str, bool]) -> None:
    """Raise an error if more than one of the options is given that decide how many parts a mesh gets."""
    given = [name for name, is_given in rules.items() if is_given]
    if len(given) > 1:
        raise InvalidParameterError(
            f"The number of parts takes at most one of {', '.join(rules)}; it was given "
            f"{' and '.join(given)}."
        )
