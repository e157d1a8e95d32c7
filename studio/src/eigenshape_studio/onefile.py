"""The page of a report: one HTML file that has the studio and all its arrays in itself."""

import base64
import gzip
import html
from collections.abc import Mapping
from typing import Any

import numpy as np

from eigenshape_studio.bundle import bundle_text
from eigenshape_studio.wire import encode_halves

N_MODES = 20  # eigenfunctions; with 20,000 vertices each takes about 50 kB of the file
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
    state: dict[str, Any], arrays: Mapping[str, np.ndarray], modes: np.ndarray
) -> bytes:
    """Return the page that shows a state with its arrays; modes become numbers of two bytes."""
    message = encode_halves(state, arrays, {"modes": np.asarray(modes, dtype=np.float64)})
    data = base64.b64encode(gzip.compress(message, 9))
    # In a script element only this sequence would end the script.
    bundle = bundle_text().replace("</script", "<\\/script")
    title = html.escape(state["name"])
    return PAGE.format(policy=POLICY, title=title, data=data.decode(), bundle=bundle).encode()
