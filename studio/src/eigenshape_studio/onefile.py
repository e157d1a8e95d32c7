"""The page of a report: one HTML file that has the studio and all its arrays in itself."""

from __future__ import annotations

import base64
import gzip
import html
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from eigenshape_studio.bundle import bundle_text
from eigenshape_studio.shape.jobs import Job
from eigenshape_studio.wire import encode_halves

if TYPE_CHECKING:
    from eigenshape_studio.tab.workspace import Workspace

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


def report_page(
    workspace: Workspace, progress: Callable[[float, str], None] | None = None
) -> bytes:
    """Return the page of the shape of a workspace, when its spectrum and parts are there."""
    data = base64.b64encode(gzip.compress(_message(workspace, progress), 9))
    # In a script element only this sequence would end the script.
    bundle = bundle_text().replace("</script", "<\\/script")
    title = html.escape(workspace.analysis.name)
    return PAGE.format(policy=POLICY, title=title, data=data.decode(), bundle=bundle).encode()


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
