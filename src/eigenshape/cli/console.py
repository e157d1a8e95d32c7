"""What every verb shares: options, tables, JSON, progress bars, and how an error reaches a person."""

import json
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from matplotlib.figure import Figure
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table
from typer.core import TyperGroup

from eigenshape._errors import EigenshapeError, InvalidParameterError
from eigenshape.figures.save import save_figure
from eigenshape.geometry.cloud import Shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repair import REPAIRS, repair
from eigenshape.io.mesh_files import read_mesh
from eigenshape.io.shape_files import read_shape

out = Console(highlight=False, soft_wrap=True)
err = Console(stderr=True, highlight=False, soft_wrap=True)

JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON instead of text.")]
RepairOption = Annotated[
    str,
    typer.Option(
        "--repair",
        metavar="NAMES",
        help=f"Repairs to apply in this order, separated by commas: {', '.join(REPAIRS)}. None unless asked for.",
    ),
]
MeshArgument = Annotated[Path, typer.Argument(help="Mesh file: OFF, OBJ, PLY, STL or GLB.")]
ShapeArgument = Annotated[
    Path,
    typer.Argument(help="OFF, OBJ, PLY, STL, GLB; .mesh, .msh, .vtk, .vtu; points as .pts, .xyz, .pcd or PLY."),
]
DropMissingOption = Annotated[
    bool, typer.Option("--drop-missing", help="Leave out points of a cloud that are not finite.")
]
DimOption = Annotated[int, typer.Option(help="Dimension of what a cloud of points samples.")]


class Verbs(TyperGroup):
    """Turn errors, ours and the system's, into a line and exit code 1, Ctrl-C into 130, warnings into lines."""

    def invoke(self, ctx: Any) -> Any:
        """Run the verb."""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("always", UserWarning)
                warnings.showwarning = _say_warning
                return super().invoke(ctx)
        except (EigenshapeError, OSError) as error:
            err.print(f"[bold red]error:[/] {escape(str(error))}")
            raise typer.Exit(1) from error
        except KeyboardInterrupt as error:
            err.print("stopped; what was finished is kept")
            raise typer.Exit(130) from error


def _say_warning(message: Warning | str, *_: object, **__: object) -> None:
    err.print(f"[yellow]warning:[/] {escape(str(message))}")


def load_mesh(path: Path, repairs: str) -> TriangleMesh:
    """Read a mesh, apply the repairs that were asked for, and say on stderr what they did."""
    return _repaired(read_mesh(path), repair_names(repairs))


def load_shape(path: Path, repairs: str, dim: int, *, drop_missing: bool) -> Shape:
    """Read a shape of any kind and apply repairs, which are for triangle meshes."""
    names = repair_names(repairs)
    shape = read_shape(path, dim=dim, drop_missing=drop_missing)
    if not names:
        return shape
    if not isinstance(shape, TriangleMesh):
        raise InvalidParameterError(f"--repair is for triangle meshes; {path} holds a {shape!r}.")
    return _repaired(shape, names)


def _repaired(mesh: TriangleMesh, names: tuple[str, ...]) -> TriangleMesh:
    done = repair(mesh, names)
    for line in done.report:
        err.print(f"[yellow]repair:[/] {line}")
    return done.mesh


def read_repaired(path: Path, names: tuple[str, ...]) -> TriangleMesh:
    """Read a mesh and apply repairs without a word, as for one of many."""
    return repair(read_mesh(path), names).mesh


def repair_names(text: str) -> tuple[str, ...]:
    """Split a comma-separated list of repairs, refusing an unknown name before any file is read."""
    names = tuple(name.strip() for name in text.split(",") if name.strip())
    for name in names:
        if name not in REPAIRS:
            raise InvalidParameterError(f"--repair takes {', '.join(REPAIRS)}; it was given {name!r}.")
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


def print_table(title: str, columns: list[str], rows: list[list[str]]) -> None:
    """Print rows under their headings, numbers to the right."""
    table = Table(title=title, title_justify="left", title_style="bold", header_style="bold")
    for index, column in enumerate(columns):
        table.add_column(column, justify="left" if index == 0 else "right", no_wrap=True)
    for row in rows:
        table.add_row(*(escape(cell) for cell in row))
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
        yield lambda share, what: bar.update(task, completed=share, description=f"{title}: {what}" if what else title)


def told_by(progress: Callable[[float, str], None]) -> Callable[[int, int, str, str | None], None]:
    """Return what a batch tells of each file: the bar moves, and what cannot be taken is named."""

    def told(n_done: int, n_items: int, name: str, error: str | None) -> None:
        progress(n_done / n_items, f"{n_done} of {n_items}, {name}")
        if error is not None:
            err.print(f"[yellow]not taken:[/] {escape(name)}: {escape(error)}")

    return told


def said(path: Path) -> None:
    """Tell on stderr that a file was written."""
    err.print(f"wrote {escape(str(path))}")


def save_picture(figure: Figure, path: Path) -> None:
    """Write a figure, and tell so."""
    save_figure(figure, path)
    said(path)
