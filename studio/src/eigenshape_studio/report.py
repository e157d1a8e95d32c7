"""A report: one HTML file with a shape, its spectrum, heat and parts, which opens without a server."""

import secrets
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import eigenshape as es
from eigenshape.plot.camera import Up, View
from eigenshape_studio.onefile import N_MODES
from eigenshape_studio.tab.workspace import Workspace


def write_report(  # noqa: PLR0913  one for each option of the command
    mesh: es.types.MeshLike,
    path: str | Path,
    *,
    name: str = "shape",
    values: Mapping[str, Any] | None = None,
    n_modes: int = N_MODES,
    view: View = "auto",
    up: Up = "auto",
    progress: Callable[[float, str], None] | None = None,
) -> None:
    """Write a report on a shape.

    The file appears complete or not at all. Eigenfunctions are in half precision, with three
    digits.

    Parameters
    ----------
    mesh : MeshLike
    path : path
        Ends in .html.
    name : str
        Title of the page.
    values : {title: (n,) float}, optional
        Functions on the vertices to choose from.
    n_modes : int
        Number of eigenfunctions.
    view : str or (3,) float
        The side from which the shape is shown at first, as in `es.plot.aim_camera`.
    up : str or (3,) float
        The upward direction, as in `es.plot.aim_camera`.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Raises
    ------
    InvalidParameterError
        If `view` or `up` is neither a name nor a direction.
    InvalidShapeError, ConvergenceError
        If the spectrum of the shape cannot be computed. A shape whose parts cannot be found has a
        report without parts.
    """
    workspace = Workspace(mesh, name, values=values, n_modes=n_modes)
    workspace.analysis.look_from(view, up)
    page = workspace.report(progress)
    path = Path(path)
    # A temporary file of `tempfile` may be read by nobody else, and a web server would refuse it.
    beside = path.with_name(f".{secrets.token_hex(8)}.tmp")
    try:
        beside.write_bytes(page)
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)
