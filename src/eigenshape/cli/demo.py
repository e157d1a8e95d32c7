"""eigenshape demo: index synthetic creatures, scan one, and search for it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape._errors import InvalidParameterError
from eigenshape.cli import steps
from eigenshape.cli.console import escape_text, out, progress_bar
from eigenshape.cli.index.add import WorkersOption
from eigenshape.cli.query import explain_scores, print_matches
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
  README.md, docs/glossary.md                         the same steps in Python, and the terms
"""


def demo(
    *,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="Folder for meshes, index and picture.")
    ] = FOLDER,
    kind: Annotated[str, typer.Option(help=f"Creature to scan: {', '.join(CREATURES)}.")] = "biped",
    workers: WorkersOption = None,
) -> None:
    """Try everything: make creatures, index them, scan one from one side in a new pose, and find its kind."""
    if kind not in CREATURES:
        raise InvalidParameterError(f"--kind takes {', '.join(CREATURES)}; it is {kind!r}.")
    processes = es.retrieval.Workers() if workers is None else es.retrieval.Workers(workers)
    items = _make(output / "creatures")
    shelf = es.ShapeIndex.open_or_create(output / "index")
    report = steps.describe_all(shelf, items, None, processes)
    out.print(f"indexed {len(shelf)} shapes ({len(report.skipped)} indexed already)")

    scan_path = output / "scan.ply"
    scan = es.partial_scan(
        es.make_creature(kind, UNSEEN, n_vertices=N_VERTICES), [0.9, 0.25, 0.45]
    ).mesh
    es.write_mesh(scan, scan_path)
    out.print(
        f"scanned a {kind} from one side, in a pose that the index has not seen: {escape_text(scan_path)}"
    )
    shape = steps.color_query(scan, shelf.default_recipe())
    matches = shelf.query(shape.descriptor, n_matches=6)
    print_matches(matches)
    explain_scores(matches)

    sheet = output / "sheet.png"
    caption = (
        f"A partial scan of a {kind} in a new pose, and the most similar shapes ({steps.CAPTION})"
    )
    steps.save_picture(steps.contact_sheet(shape, "partial scan", matches, caption=caption), sheet)
    out.print(NEXT.format(scan=escape_text(scan_path), index=escape_text(output / "index")))


def _make(folder: Path) -> list[es.retrieval.Item]:
    """Write each kind in some poses, those that are not there yet."""
    items = [
        es.retrieval.Item(f"{kind}/{kind}-{pose}", folder / kind / f"{kind}-{pose}.ply", kind)
        for kind in CREATURES
        for pose in range(POSES)
    ]
    with progress_bar("creatures") as progress:
        for done, item in enumerate(items):
            progress(done / len(items), item.name)
            if not item.path.exists():
                item.path.parent.mkdir(parents=True, exist_ok=True)
                es.write_mesh(
                    es.make_creature(item.label or "", done % POSES, n_vertices=N_VERTICES),
                    item.path,
                )
    out.print(
        f"made {len(CREATURES)} kinds of creatures in {POSES} poses each: {escape_text(folder)}"
    )
    return items
