"""A report: one HTML file with a shape, its spectrum, heat and parts, which opens without a server."""

import base64
import gzip
import html
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

import numpy as np

import eigenshape as es
from eigenshape.plot.camera import Up, View
from eigenshape_studio.bundle import bundle_text
from eigenshape_studio.jobs import Job
from eigenshape_studio.wire import encode_halves
from eigenshape_studio.workspace import Workspace

N_MODES = 20  # eigenfunctions; with 20,000 vertices each takes about 50 kB of the file
POLL = 0.1  # seconds between reports of progress
# Nothing may be loaded from elsewhere: what the page needs is in it.
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data: blob:; connect-src data:"
)
PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<title>{title}</title>
<link rel="icon" href="data:,">
</head>
<body>
<noscript>The report needs JavaScript.</noscript>
<script id="eigenshape-data" type="application/octet-stream">{data}</script>
<script type="module">{bundle}</script>
</body>
</html>
"""


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
    title = html.escape(name)
    workspace = Workspace(mesh, name, values=values, n_modes=n_modes)
    workspace.analysis.look_from(view, up)
    data = base64.b64encode(gzip.compress(_message(workspace, progress), 9))
    # In a script element only this sequence would end the script.
    bundle = bundle_text().replace("</script", "<\\/script")
    page = PAGE.format(policy=POLICY, title=title, data=data.decode(), bundle=bundle)
    path = Path(path)
    with NamedTemporaryFile(dir=path.parent, suffix=".html", delete=False) as file:
        file.write(page.encode())
    Path(file.name).replace(path)


def _message(workspace: Workspace, progress: Callable[[float, str], None] | None) -> bytes:
    """Return the message that the page takes its state and all its arrays from."""
    analysis = workspace.analysis
    analysis.find_parts()
    for job in (analysis.spectrum, analysis.parts, analysis.health):
        _wait(job, progress)
    if analysis.spectrum.error is not None:
        raise analysis.spectrum.error
    state = workspace.state() | {"capabilities": []}
    state["deformation"] |= {"status": "none", "message": ""}
    names = ["vertices", "faces", "eigenvalues", "coefficients", "areas"]
    names += [f"values/{name}" for name in workspace.fields]
    if state["parts"]["status"] == "ready":
        names += ["parts/labels", "parts/cuts", "diagram"]
    arrays = {name: workspace.array(name) for name in names}
    modes = {"modes": np.asarray(workspace.array("modes"), dtype=np.float64)}
    return encode_halves(state, arrays, modes)


def _wait(job: Job[Any] | None, progress: Callable[[float, str], None] | None) -> None:
    while job is not None and not job.wait(POLL):
        if progress is not None:
            progress(job.progress, job.message)
