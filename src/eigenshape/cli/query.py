"""eigenshape query: which shapes of an index are most similar to a scan, and which features correspond."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from os.path import isdir, isfile
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

import typer

import eigenshape as es
from certeig.kit.errors import CerteigError, InvalidParameterError
from certeig.kit.text import literal
from eigenshape._errors import StoreError
from eigenshape.cli import steps
from eigenshape.cli.console import (
    SOME_FAILED,
    count_shapes,
    err,
    escape_text,
    out,
    print_json,
    print_table,
    print_written,
    progress_bar,
    result_facts,
)
from eigenshape.cli.inputs import Method, repair_names

N_VOTES = 5  # matches whose labels tell the class
COLUMNS = (
    "query",
    "rank",
    "name",
    "label",
    "source",
    "score",
    "chance",
    "mirrored",
    "corresponding points",
)


@dataclass(frozen=True)
class _Answer:
    """What was found for one query; a shape of the index is not drawn, so it has no mesh."""

    title: str
    descriptor: Any
    matches: es.retrieval.Matches
    seconds: dict[str, float]
    mesh: es.TriangleMesh | None = None


def query(
    index: Path,
    scan: str,
    *,
    n_matches: Annotated[int, typer.Option(min=1)] = 5,
    where: list[str] | None = None,
    exact: bool = False,
    classify: bool = False,
    method: Method | None = None,
    repair: str = "auto",
    output: Path | None = None,
    picture: Path | None = None,
    explain: Path | None = None,
    view: str = "auto",
    up: str = "auto",
    as_json: bool = False,
) -> None:
    """Find the shapes of an index that are most like a scan, and which features correspond.

    With a folder, every mesh in it is searched for; the exit code is 3 if some could not be read.

    Parameters
    ----------
    scan
        File to search for: a mesh, a point cloud or a depth scan (.pcd), of a whole
        shape or a part of one, in any pose; a folder of such files; or the name of a shape of the
        index, which is left out of the answer.
    n_matches
        Number of matches to show.
    exact
        Compare every shape of the index with the scan, instead of those that a coarse scan of all
        finds nearest.
    classify
        Print the probability of each class, by the labels of the first five matches, which are
        shown in any case.
    method
        Which descriptions to compare. By default the index's own, or patches if it has several.
    output
        Write a table of all matches, a line each (CSV).
    picture
        Draw the scan beside its matches, corresponding parts in one color (PNG, SVG or PDF).
    explain
        Draw the scan and the best match with the points that correspond (PNG, SVG or PDF).
    """
    side = steps.picture_side(view, up, picture, explain)
    steps.require_output(output, (".csv",), "A table")
    repairs, filters = repair_names(repair), steps.parse_filters(where)
    opened = es.ShapeIndex.open(index)
    recipe = steps.query_recipe(opened, method)
    # Unlike the methods of Path, these say no to a text that cannot be a path, too.
    is_file, is_folder = isfile(scan), isdir(scan)  # noqa: PTH112, PTH113
    is_drawn = picture is not None or explain is not None
    if is_drawn and not is_file:
        raise InvalidParameterError(
            f"A picture shows one scan, of a file; {scan} is none. Leave --picture and --explain out."
        )

    answers, failed = [], []
    with opened.reader() as reader:
        # Before scans are described, which takes seconds
        steps.choose_shapes(reader.state, filters)
        n_shown = max(n_matches, N_VOTES) if classify else n_matches
        options = {"n_matches": n_shown, "where": filters, "exact": exact}
        if is_file or is_folder:
            items = es.io.find_items(scan)
            with progress_bar("query") as progress:
                for number, item in enumerate(items):
                    progress(number / len(items), item.name)
                    title = item.name if is_folder else item.path.name
                    try:
                        mesh = steps.load_surface(item.path, repair)
                        answers.append(_ask(reader, title, mesh, recipe, options))
                    except (CerteigError, OSError) as error:
                        if not is_folder:
                            raise
                        failed.append((item.name, str(error)))
        else:
            answers.append(_ask_stored(reader, scan, recipe, options))
    for name, reason in failed:
        err.print(f"[yellow]not searched for:[/] {escape_text(name)}: {escape_text(reason)}")

    if output:
        _write(answers, output)
    if as_json:
        facts = [_facts(answer, classify=classify) for answer in answers]
        print_json(facts if is_folder else facts[0])
    else:
        _print(answers, classify=classify)
    if is_drawn:
        _draw(answers[0], index, repairs, side, picture, explain)
    if failed:
        raise typer.Exit(SOME_FAILED)


def _ask(
    reader: es.retrieval.IndexReader,
    title: str,
    mesh: es.TriangleMesh,
    recipe: Any,
    options: dict[str, Any],
) -> _Answer:
    """Describe a scan, and search for it."""
    began = perf_counter()
    descriptor = es.describe(mesh, recipe)
    described = perf_counter()
    matches = reader.query(descriptor, **options)
    seconds = {"describe": described - began, "query": perf_counter() - described}
    return _Answer(title, descriptor, matches, seconds, mesh)


def _ask_stored(
    reader: es.retrieval.IndexReader, name: str, recipe: Any, options: dict[str, Any]
) -> _Answer:
    """Search for the other shapes that are like one of the index, in the same state of the index."""
    state = reader.state
    facts = state.find(name)
    if facts is None:
        raise InvalidParameterError(
            f"A query is a mesh file, a folder or the name of a shape of the index; {name} is none "
            "of them. `eigenshape index ls` lists the names."
        )
    stored = [each for each in state.stored(state.descriptor_ids(facts)) if each.recipe == recipe]
    if not stored:
        raise StoreError(
            f"A shape must be described by the method of a query; {name} is not described by "
            f"{recipe.name}. Choose another --method."
        )
    descriptor = stored[0].restored()
    began = perf_counter()
    matches = reader.query(descriptor, without=name, **options)
    return _Answer(name, descriptor, matches, {"describe": 0.0, "query": perf_counter() - began})


def _write(answers: Sequence[_Answer], output: Path) -> None:
    """Write a table of all matches, as people open it in a spreadsheet."""
    with output.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(COLUMNS)
        for answer in answers:
            for rank, match in enumerate(answer.matches, start=1):
                facts = (
                    match.name,
                    match.label,
                    match.source,
                    match.score,
                    match.chance,
                    match.mirrored,
                )
                table.writerow((answer.title, rank, *facts, len(match.correspondences)))
    print_written(output)


def _facts(answer: _Answer, *, classify: bool) -> dict[str, Any]:
    """Return an answer for JSON; pairs of corresponding points name vertices."""
    matches = []
    for match in answer.matches:
        pairs = [
            {"query_vertex": answer.descriptor.vertices[one], "match_vertex": match.vertices[two]}
            for one, two in match.correspondences
        ]
        facts = result_facts(match, "query", "descriptor", "vertices")
        matches.append(facts | {"correspondences": pairs})
    return {
        "scan": answer.title,
        "seconds": answer.seconds,
        "method": answer.matches.method,
        "compared": answer.matches.n_compared,
        "nothing_alike": answer.matches.nothing_alike,
        **({"classes": answer.matches.classify()} if classify else {}),
        "matches": matches,
    }


def _print(answers: Sequence[_Answer], *, classify: bool) -> None:
    for answer in answers:
        title = "Most similar shapes"
        if len(answers) > 1:
            title = f"{title}: {answer.title}"
        if answer.matches:
            rows = []
            for match in answer.matches:
                chance = "" if match.chance is None else f"{100 * match.chance:.2g} %"
                n_points = str(len(match.correspondences))
                name = f"{match.name} (mirror image)" if match.mirrored else match.name
                rows.append([name, match.label or "", f"{match.score:.3f}", chance, n_points])
            print_table(title, ["shape", "label", "score", "chance", "corresponding points"], rows)
        else:
            out.print(
                f"{escape_text(title)}: none; the index holds no other shape, or none agrees with the filters"
            )
        if answer.matches.nothing_alike:
            out.print("nothing alike here: unrelated shapes would score as well")
        if classify:
            classes = answer.matches.classify()
            shares = [f"{escape_text(name)} {100 * share:.0f} %" for name, share in classes.items()]
            out.print(f"class: {', '.join(shares) or 'unknown, since no match has a label'}")
    found = [match for answer in answers for match in answer.matches]
    if any(match.chance is None for match in found):
        out.print("score: 0 for the same description, lower is more alike")
    elif found:
        out.print(
            "score: near 0 for the same shape, about 1 if nothing is alike; chance: the share of "
            "unrelated shapes that would score as well"
        )
    # One time for both: the first scan of a process waits for modules to be loaded, in either.
    seconds = sum(sum(answer.seconds.values()) for answer in answers)
    n_compared = max(answer.matches.n_compared for answer in answers)
    each = "" if len(answers) == 1 else f"{len(answers)} scans, each "
    out.print(
        f"{each}described, and compared with {count_shapes(n_compared)}, in {seconds:.1f} s "
        f"({answers[0].matches.method})"
    )


def _draw(
    answer: _Answer,
    index: Path,
    repairs: tuple[str, ...],
    side: steps.Side,
    picture: Path | None,
    explain: Path | None,
) -> None:
    if answer.mesh is None or not answer.matches:
        err.print("there is no match to draw")
        return
    draw = partial(
        es.plot.figure_matches,
        answer.mesh,
        repair=repairs,
        title=f"query: {literal(Path(answer.title).stem)}",
        **side,
    )
    if picture:
        caption = (
            f"{literal(answer.title)} and the {len(answer.matches)} most similar shapes in "
            f"{literal(index.name)}"
        )
        with progress_bar("draw") as progress:
            figure = draw(answer.matches, caption=caption, progress=progress)
        steps.save_picture(figure, picture)
    if explain:
        steps.save_picture(draw(answer.matches[0]), explain)
