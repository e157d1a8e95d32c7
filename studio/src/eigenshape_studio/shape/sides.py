"""Which way up shapes stand, as people have corrected it; remembered for each mesh."""

import json
from contextlib import suppress
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

import platformdirs

import eigenshape as es
from eigenshape.deformation.edits import mesh_fingerprint

MOST_SIDES = 1000  # the oldest are forgotten


def sides_file() -> Path:
    """Return the file that remembers them."""
    return platformdirs.user_cache_path("eigenshape") / "sides.json"


def recall_side(mesh: es.TriangleMesh) -> dict[str, list[float]] | None:
    """Return the corrected upward direction of a mesh, and where its viewer stands, if any."""
    side = _read().get(mesh_fingerprint(mesh).digest)
    return side if isinstance(side, dict) and {"up", "towards"} <= set(side) else None


def remember_side(mesh: es.TriangleMesh, up: list[float], towards: list[float]) -> None:
    """Remember how a mesh stands."""
    sides = _read()
    digest = mesh_fingerprint(mesh).digest
    sides.pop(digest, None)
    sides[digest] = {"up": up, "towards": towards}
    path = sides_file()
    path.parent.mkdir(parents=True, exist_ok=True)
    with NamedTemporaryFile("w", dir=path.parent, suffix=".json", delete=False) as file:
        json.dump(dict(list(sides.items())[-MOST_SIDES:]), file)
    Path(file.name).replace(path)


def _read() -> dict[str, Any]:
    with suppress(OSError, ValueError):  # none yet, or spoiled: the library's guess is shown
        found = json.loads(sides_file().read_text())
        if isinstance(found, dict):
            return found
    return {}
