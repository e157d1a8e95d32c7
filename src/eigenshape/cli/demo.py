"""eigenshape demo: index synthetic creatures, scan one, and search for it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape.cli.console import escape_text, out, progress_bar
from eigenshape.cli.index import add
from eigenshape.cli.inputs import Workers
from eigenshape.cli.query import query
from eigenshape.shapes.creature_plans import CREATURES

FOLDER = Path("eigenshape-demo")
POSES = 3  # of each kind in the index; more would make the demo slower
UNSEEN = 11  # number of the scanned pose, which is not one of those in the index
N_VERTICES = 2000  # of each creature: enough for fingers, and described in a second or two
NEXT = """
Read next:
  eigenshape features {scan} --picture parts.png      feature points of that scan, and the parts around them
  eigenshape spectrum {scan} -k 20 --picture spectrum.png  its eigenvalues, and the proof that none is missing
  eigenshape index add my-index FOLDER                the same for a folder of your own meshes
  eigenshape query my-index SCAN --picture sheet.png  and a scan of yours
  eigenshape studio {scan} --index {index}            a window in the browser: bend it, and search
  docs/first_steps.md, docs/glossary.md               the same steps in Python, and the terms
"""


def demo(
    *,
    output: Path = FOLDER,
    kind: Annotated[
        str, typer.Option("--kind", help=f"Creature to scan: {', '.join(CREATURES)}.")
    ] = "biped",
    workers: Workers = None,
) -> None:
    """Try everything: make creatures, index them, scan one from one side in a new pose, and find its kind.

    Parameters
    ----------
    output
        Write meshes, index and picture to this folder.
    """
    if kind not in CREATURES:
        raise InvalidParameterError(f"--kind takes {', '.join(CREATURES)}; it is {kind!r}.")
    creatures, index, scan = output / "creatures", output / "index", output / "scan.ply"
    paths = {
        creatures / name / f"{name}-{pose}.ply": (name, pose)
        for name in CREATURES
        for pose in range(POSES)
    }
    # Each step is printed before it begins: in a file there is no bar that moves.
    out.print(
        f"making {len(CREATURES)} kinds of creatures in {POSES} poses each: {escape_text(creatures)}"
    )
    with progress_bar("creatures") as progress:
        for done, (path, (name, pose)) in enumerate(paths.items()):
            progress(done / len(paths), path.stem)
            if not path.exists():
                path.parent.mkdir(parents=True, exist_ok=True)
                es.write_mesh(es.make_creature(name, pose, n_vertices=N_VERTICES), path)
    out.print(f"describing and indexing them, which takes some ten seconds: {escape_text(index)}")
    add(index, [creatures], workers=workers)

    out.print(
        f"scanning a {kind} from one side, in a pose that the index has not seen: {escape_text(scan)}"
    )
    whole = es.make_creature(kind, UNSEEN, n_vertices=N_VERTICES)
    es.write_mesh(es.partial_scan(whole, [0.9, 0.25, 0.45]).mesh, scan)
    out.print("searching for the shapes that are most like the scan, and drawing them")
    query(index, str(scan), n_matches=6, picture=output / "sheet.png")
    out.print(NEXT.format(scan=escape_text(scan), index=escape_text(index)))
