"""What every verb shares: options, tables, JSON, progress bars, and how an error reaches a person."""

import json
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import typer
from matplotlib.figure import Figure
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table
from typer.core import TyperGroup

from eigenshape._errors import EigenshapeError, InvalidParameterError
from eigenshape._text import printable
from eigenshape.cli.interrupt import interruptible
from eigenshape.geometry.cloud import Shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repair import CLOUD_REPAIRS, REPAIRS, RepairedCloud, repair
from eigenshape.io.cells import CellKind
from eigenshape.io.mesh_files import read_mesh
from eigenshape.io.shape_files import read_shape
from eigenshape.plot.save import save_figure

out = Console(highlight=False, soft_wrap=True)
err = Console(stderr=True, highlight=False, soft_wrap=True)

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
        "--drop-missing", help="Leave out points of a point cloud whose coordinates are not finite."
    ),
]
CellsOption = Annotated[
    CellKind | None,
    typer.Option(
        help="Kind of cells to read from a file that holds several kinds, or does not say which."
    ),
]
DimOption = Annotated[
    int,
    typer.Option(
        help="Dimension of what a point cloud samples: 1 a curve, 2 a surface, 3 a volume."
    ),
]


UsageError: Any = (
    typer.BadParameter.__base__
)  # of typer's own copy of click, or of click, by typer's version


class Verbs(TyperGroup):
    """Turn errors, ours and the system's, into a line and exit code 1, Ctrl-C into 130, warnings into lines."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the words before the verb."""
        with _printable_usage():
            return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Run the verb."""
        try:
            with interruptible(), _printable_usage(), warnings.catch_warnings():
                warnings.simplefilter("always", UserWarning)
                warnings.showwarning = _say_warning
                return super().invoke(ctx)
        except (EigenshapeError, OSError) as error:
            err.print(f"[bold red]error:[/] {shown(error)}")
            raise typer.Exit(1) from error
        except KeyboardInterrupt as error:
            err.print("stopped; what was finished is kept")
            raise typer.Exit(130) from error


@contextmanager
def _printable_usage() -> Iterator[None]:
    """Spell out the control characters of words that the command does not know."""
    try:
        yield
    except UsageError as error:
        error.message = printable(error.message)
        raise


def shown(text: object) -> str:
    """Return text from outside, such as a file's name, as a terminal can show it: no control codes and no markup."""
    return escape(printable(str(text)))


def _say_warning(message: Warning | str, *_: object, **__: object) -> None:
    err.print(f"[yellow]warning:[/] {shown(message)}")


def load_mesh(path: Path, repairs: str) -> TriangleMesh:
    """Read a mesh, apply the requested repairs, and print on stderr what they did."""
    done = repair(read_mesh(path), repair_names(repairs))
    _print_repairs(done.report)
    return done.mesh


def load_shape(
    path: Path, repairs: str, dim: int, *, drop_missing: bool, cells: CellKind | None = None
) -> Shape:
    """Read a shape of any kind, apply the requested repairs, and print on stderr what they did."""
    names = repair_names(repairs)
    done = repair(read_shape(path, dim=dim, drop_missing=drop_missing, cells=cells), names)
    _print_repairs(done.report)
    return done.cloud if isinstance(done, RepairedCloud) else done.mesh


def _print_repairs(report: tuple[str, ...]) -> None:
    for line in report:
        err.print(f"[yellow]repair:[/] {shown(line)}")


def read_repaired(path: Path, names: tuple[str, ...]) -> TriangleMesh:
    """Read a mesh and apply repairs without a word, as for one of many."""
    return repair(read_mesh(path), names).mesh


def repair_names(text: str) -> tuple[str, ...]:
    """Split a comma-separated list of repairs, refusing an unknown name before any file is read."""
    names = tuple(name.strip() for name in text.split(",") if name.strip())
    for name in names:
        if name not in KNOWN_REPAIRS:
            raise InvalidParameterError(
                f"--repair takes {', '.join(KNOWN_REPAIRS)}; it was given {name!r}."
            )
    return names


def print_json(value: Any) -> None:
    """Print a value as JSON on stdout; arrays become lists, and what is not finite null."""
    typer.echo(json.dumps(_plain(value), indent=2, allow_nan=False))


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


LONGEST_NUMBER = 16  # letters of a column that stay however narrow the terminal is


def print_table(title: str, columns: list[str], rows: list[list[str]]) -> None:
    """Print rows under their headings, numbers to the right."""
    table = Table(title=title, title_justify="left", title_style="bold", header_style="bold")
    for index, column in enumerate(columns):
        # long names give way in a narrow terminal, numbers do not
        widest = max([len(column), *(len(row[index]) for row in rows)])
        justify: Literal["left", "right"] = "left" if index == 0 else "right"
        table.add_column(
            column, justify=justify, no_wrap=True, min_width=min(widest, LONGEST_NUMBER)
        )
    for row in rows:
        table.add_row(*map(shown, row))
    out.print(table)


@contextmanager
def progress_bar(title: str) -> Iterator[Callable[[float, str], None]]:
    """Show a bar on stderr, if that is a terminal, while the block runs; tell it the share done and what goes on."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as bar:
        task = bar.add_task(title, total=1.0)

        def update(share: float, what: str) -> None:
            description = f"{title}: {shown(what)}" if what else title
            bar.update(task, completed=share, description=description)

        yield update


def told_by(progress: Callable[[float, str], None]) -> Callable[[int, int, str, str | None], None]:
    """Return what a batch tells of each file: the bar moves, and what cannot be taken is named."""

    def told(n_done: int, n_items: int, name: str, error: str | None) -> None:
        progress(n_done / n_items, f"{n_done} of {n_items}, {name}")
        if error is not None:
            err.print(f"[yellow]not taken:[/] {shown(name)}: {shown(error)}")

    return told


def said(path: Path) -> None:
    """Tell on stderr that a file was written."""
    err.print(f"wrote {shown(path)}")


def save_picture(figure: Figure, path: Path) -> None:
    """Write a figure, and tell so."""
    save_figure(figure, path)
    said(path)
