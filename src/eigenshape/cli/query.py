"""eigenshape query: which shapes of an index are most like a scan, and which features correspond."""

from collections.abc import Sequence
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

import numpy as np
import typer
from jaxtyping import Int
from matplotlib.figure import Figure

from eigenshape._errors import StoreError
from eigenshape.cli.console import (
    JsonOption,
    RepairOption,
    load_mesh,
    out,
    print_json,
    print_table,
    progress_bar,
    repair_names,
    save_picture,
)
from eigenshape.cli.features import PresetOption, preset
from eigenshape.figures.save import require_picture_path
from eigenshape.figures.sheet import Panel, figure_contact_sheet
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repair import repair as repair_mesh
from eigenshape.io.mesh_files import read_mesh
from eigenshape.retrieval.describe import DescribedShape, describe_mesh, described_view
from eigenshape.retrieval.descriptor import SCALE_FREE, Recipe
from eigenshape.retrieval.index import Match, ShapeIndex

CAPTION = "parts that correspond share a colour"


def query(
    db: Annotated[Path, typer.Argument(help="Folder of the index.")],
    scan: Annotated[Path, typer.Argument(help="Mesh to look for: whole, or a part of a shape, in any pose.")],
    *,
    n_matches: Annotated[int, typer.Option("-n", "--n-matches", min=1, help="Number of answers.")] = 5,
    preset_name: PresetOption = SCALE_FREE.name,
    repair: RepairOption = "",
    sheet: Annotated[
        Path | None, typer.Option(help="Draw the scan beside its matches, corresponding parts in one colour.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Find the shapes of an index that are most like a scan, and which features correspond."""
    if sheet:
        require_picture_path(sheet)
    shelf, recipe = ShapeIndex.open(db), preset(preset_name)
    surface = load_mesh(scan, repair)
    began = perf_counter()
    with progress_bar("describe") as progress:
        shape = describe_mesh(surface, recipe, progress=progress)
    described = perf_counter()
    matches = shelf.query(shape.descriptor, n_matches=n_matches)
    answered = perf_counter()
    if as_json:
        seconds = {"describe": described - began, "query": answered - described}
        print_json({"scan": str(scan), "seconds": seconds, "matches": [_facts(shape, match) for match in matches]})
    else:
        print_matches(matches)
        out.print(f"described in {described - began:.2f} s, answered in {1000 * (answered - described):.0f} ms")
    if sheet:
        caption = f"{scan.name} and the {len(matches)} most similar shapes in {db.name}: {CAPTION}"
        save_picture(contact_sheet(shape, scan.stem, matches, repairs=repair_names(repair), caption=caption), sheet)


def _facts(shape: DescribedShape, match: Match) -> dict[str, Any]:
    pairs = [
        {"query_vertex": int(shape.descriptor.vertices[one]), "match_vertex": int(match.vertices[two])}
        for one, two in match.correspondences
    ]
    return {
        "name": match.name,
        "class": match.label,
        "source": match.source,
        "score": match.score,
        "correspondences": pairs,
    }


def print_matches(matches: Sequence[Match]) -> None:
    """Print matches, best first, with the vertices that correspond best."""
    rows = [[match.name, match.label or "", f"{match.score:.4g}", str(len(match.correspondences))] for match in matches]
    print_table("Most similar shapes", ["shape", "class", "score", "corresponding features"], rows)


def contact_sheet(
    shape: DescribedShape, title: str, matches: Sequence[Match], *, repairs: tuple[str, ...] = (), caption: str = ""
) -> Figure:
    """Draw a described shape beside its matches, whose parts are found again from their files.

    The parts of the query have colours of their own; a part of a match has the colour of the query's part that its
    feature corresponds to, and is grey where there is none.
    """
    query_panel = Panel(shape.mesh, f"query: {title}", shape.parts.labels, shape.parts.features.vertices)
    with progress_bar("draw") as progress:
        panels = []
        for done, match in enumerate(matches):
            progress(done / len(matches), match.name)
            panels.append(_panel(shape, match, repairs))
    return figure_contact_sheet(query_panel, panels, caption=caption)


def _panel(query_shape: DescribedShape, match: Match, repairs: tuple[str, ...]) -> Panel:
    if match.source is None:
        raise StoreError(f"A match needs its file to be drawn; {match.name!r} was added without one.")
    mesh = repair_mesh(read_mesh(match.source), repairs).mesh
    labels = _labels(mesh, query_shape.descriptor.recipe, match)
    ours, theirs = match.correspondences.T
    colors = np.full(len(match.vertices) + 1, -1)  # the last one is for what no view of the match shows
    colors[theirs] = ours
    return Panel(mesh, f"{match.name}\nscore {match.score:.4g}", colors[labels], match.vertices[theirs])


def _labels(mesh: TriangleMesh, recipe: Recipe, match: Match) -> Int[np.ndarray, " f"]:
    """Find the parts of a match again, -1 where the view that matched does not see its surface."""
    if match.view == 0:
        return describe_mesh(mesh, recipe).parts.labels
    part, seen = described_view(mesh, recipe, match.view - 1)
    labels = np.full(mesh.n_faces, -1)
    labels[part.source_faces] = seen.parts.labels
    return labels
