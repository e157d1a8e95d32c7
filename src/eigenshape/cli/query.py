"""eigenshape query: which shapes of an index are most similar to a scan, and which features correspond."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from os.path import isdir, isfile
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

import typer

import eigenshape as es
from eigenshape._errors import EigenshapeError, InvalidParameterError, StoreError
from eigenshape._text import literal
from eigenshape.cli import steps
from eigenshape.cli.console import (
    SOME_FAILED,
    err,
    escape_text,
    out,
    print_json,
    print_table,
    print_written,
    progress_bar,
)
from eigenshape.cli.inputs import (
    FilterOption,
    IndexArgument,
    IndexRepairOption,
    JsonOption,
    StoredMethodOption,
    UpOption,
    ViewOption,
    repair_names,
    require_method,
)

# The types of the library are not named here, so that `--help` loads nothing heavy.
AnyRecipe = Any
Descriptor = Any
N_VOTES = 5  # matches whose labels tell the class
Ask = Callable[..., Any]  # returns the matches of a descriptor
COLUMNS = (
    "query",
    "rank",
    "name",
    "label",
    "source",
    "score",
    "chance",
    "corresponding points",
)


@dataclass(frozen=True)
class _Answer:
    """What was found for one query; the mesh is None for a shape of the index."""

    title: str
    descriptor: Descriptor
    matches: Any
    seconds: dict[str, float]
    colored: steps.ColoredQuery | None = None


def query(
    index: IndexArgument,
    # Text, because the name of a shape is not a path: "a//b" and "a/b" are two shapes.
    scan: Annotated[
        str,
        typer.Argument(
            help="File to search for: a mesh, a point cloud or a frame of a depth camera (.pcd), of a "
            "whole shape or a part of one, in any pose; a folder of such files; or the name of a "
            "shape of the index, which is left out of the answer."
        ),
    ],
    *,
    n_matches: Annotated[
        int, typer.Option("-n", "--n-matches", min=1, help="Number of matches to show.")
    ] = 5,
    where: FilterOption = None,
    exact: Annotated[
        bool,
        typer.Option(
            "--exact",
            help="Compare every shape of the index with the scan, instead of those that a coarse "
            "scan of all finds nearest.",
        ),
    ] = False,
    classify: Annotated[
        bool,
        typer.Option(
            "--classify",
            help="Print the probability of each class, by the labels of the first five matches, "
            "which are shown in any case.",
        ),
    ] = False,
    method: StoredMethodOption = None,
    repair: IndexRepairOption = "auto",
    picture: Annotated[
        Path | None,
        typer.Option(
            help="Draw the scan beside its matches, corresponding parts in one color (PNG, SVG or "
            "PDF)."
        ),
    ] = None,
    explain: Annotated[
        Path | None,
        typer.Option(
            help="Draw the scan and the best match with the points that correspond (PNG, SVG or "
            "PDF)."
        ),
    ] = None,
    view: ViewOption = "auto",
    up: UpOption = "auto",
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Table of all matches to write, a line each (.csv)."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Find the shapes of an index that are most like a scan, and which features correspond.

    With a folder, every mesh in it is searched for; the exit code is 3 if some could not be read.
    """
    steps.require_picture(picture)
    steps.require_picture(explain)
    steps.require_output(output, (".csv",), "A table")
    if method is not None:
        require_method(method)
    side = steps.parse_side(view, up)
    repairs, filters = repair_names(repair), steps.parse_filters(where)
    drawn = picture is not None or explain is not None
    if classify:
        n_matches = max(n_matches, N_VOTES)
    shelf = es.ShapeIndex.open(index)
    recipe = steps.query_recipe(shelf, method)
    # Unlike the methods of Path, these say no to a text that cannot be a path, too.
    is_file, is_folder = isfile(scan), isdir(scan)  # noqa: PTH112, PTH113
    if drawn and not is_file:
        raise InvalidParameterError(
            f"A picture shows one scan, of a file; {scan} is none. Leave --picture and --explain out."
        )
    with shelf.reader() as reader:
        # Before scans are described, which takes seconds
        steps.choose_shapes(reader.state, filters)
        ask_index = partial(reader.query, where=filters, exact=exact)
        if is_file or is_folder:
            items = es.io.find_items(scan)
            ask = partial(
                _answer_file, ask_index, recipe=recipe, n_matches=n_matches, repair=repair
            )
            if is_folder:
                answers, failed = _answer_each(items, ask)
            else:
                answers, failed = [ask(replace(items[0], name=items[0].path.name))], []
        else:
            stored = _stored_descriptor(reader, scan, recipe)
            answers, failed = [_answer_stored(ask_index, scan, stored, n_matches)], []
    for name, reason in failed:
        err.print(f"[yellow]not searched for:[/] {escape_text(name)}: {escape_text(reason)}")
    _write(answers, output)
    if as_json:
        facts = [_facts(answer, classify=classify) for answer in answers]
        print_json(facts if is_folder else facts[0])
    else:
        _print(answers, classify=classify)
    if drawn:
        _draw(answers[0], index, repairs, side, picture, explain)
    if failed:
        raise typer.Exit(SOME_FAILED)


def _answer_each(
    items: Sequence[es.retrieval.Item], ask: Callable[[es.retrieval.Item], _Answer]
) -> tuple[list[_Answer], list[tuple[str, str]]]:
    """Search for each of several meshes; return the answers, and the name and fault of the others."""
    answers, failed = [], []
    with progress_bar("query") as progress:
        for number, item in enumerate(items):
            progress(number / len(items), item.name)
            try:
                answers.append(ask(item))
            except (EigenshapeError, OSError) as error:
                failed.append((item.name, str(error)))
    return answers, failed


def _answer_file(
    ask: Ask,
    item: es.retrieval.Item,
    *,
    recipe: AnyRecipe,
    n_matches: int,
    repair: str,
) -> _Answer:
    mesh = steps.load_surface(item.path, repair)
    began = perf_counter()
    with progress_bar("describe") as progress:
        colored = steps.color_query(mesh, recipe, progress)
    described = perf_counter()
    matches = ask(colored.descriptor, n_matches=n_matches)
    seconds = {"describe": described - began, "query": perf_counter() - described}
    return _Answer(item.name, colored.descriptor, matches, seconds, colored)


def _stored_descriptor(
    reader: es.retrieval.IndexReader, name: str, recipe: AnyRecipe
) -> Descriptor:
    """Return the descriptor of a whole shape, from the state of the index that is then searched."""
    state = reader.state
    facts = state.find(name)
    if facts is None:
        raise InvalidParameterError(
            f"A query is a mesh file, a folder or the name of a shape of the index; {name} is none "
            "of them. `eigenshape index ls` lists the names."
        )
    for stored in state.stored(state.descriptor_ids(facts)):
        if stored.recipe == recipe:
            return stored.restored()
    raise StoreError(
        f"A shape must be described by the method of a query; {name} is not described by "
        f"{recipe.name}. Choose another --method."
    )


def _answer_stored(ask: Ask, name: str, descriptor: Descriptor, n_matches: int) -> _Answer:
    """Search for the other shapes that are like one of the index."""
    began = perf_counter()
    matches = ask(descriptor, n_matches=n_matches, without=name)
    seconds = {"describe": 0.0, "query": perf_counter() - began}
    return _Answer(name, descriptor, matches, seconds)


def _write(answers: Sequence[_Answer], output: Path | None) -> None:
    """Write a table of all matches, as people open it in a spreadsheet."""
    if output is None:
        return
    with output.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(COLUMNS)
        for answer in answers:
            for rank, match in enumerate(answer.matches, start=1):
                facts = (match.name, match.label, match.source, match.score, match.chance)
                table.writerow((answer.title, rank, *facts, len(match.correspondences)))
    print_written(output)


def _print(answers: Sequence[_Answer], *, classify: bool) -> None:
    for answer in answers:
        title = "Most similar shapes"
        print_matches(answer.matches, title if len(answers) == 1 else f"{title}: {answer.title}")
        if answer.matches.nothing_alike:
            out.print("nothing alike here: unrelated shapes would score as well")
        if classify:
            classes = answer.matches.classify()
            shares = [f"{escape_text(name)} {100 * share:.0f} %" for name, share in classes.items()]
            out.print(f"class: {', '.join(shares) or 'unknown, since no match has a label'}")
    explain_scores([match for answer in answers for match in answer.matches])
    describe = sum(answer.seconds["describe"] for answer in answers)
    found = 1000 * sum(answer.seconds["query"] for answer in answers)
    n_compared = sum(answer.matches.n_compared for answer in answers)
    out.print(
        f"described in {describe:.2f} s, {n_compared} shapes compared in {found:.0f} ms "
        f"({answers[0].matches.method})"
    )


def _draw(
    answer: _Answer,
    index: Path,
    repairs: tuple[str, ...],
    side: Any,
    picture: Path | None,
    explain: Path | None,
) -> None:
    if answer.colored is None or not answer.matches:
        err.print("there is no match to draw")
        return
    title = literal(Path(answer.title).stem)
    if picture is not None:
        caption = (
            f"{literal(answer.title)} and the {len(answer.matches)} most similar shapes in "
            f"{literal(index.name)} ({steps.CAPTION})"
        )
        sheet = steps.contact_sheet(
            answer.colored, title, answer.matches, repairs=repairs, caption=caption, **side
        )
        steps.save_picture(sheet, picture)
    if explain is not None:
        figure = steps.explanation(
            answer.colored, title, answer.matches[0], repairs=repairs, **side
        )
        steps.save_picture(figure, explain)


def _facts(answer: _Answer, *, classify: bool) -> dict[str, Any]:
    classes = {"classes": answer.matches.classify()} if classify else {}
    return {
        "scan": answer.title,
        "seconds": answer.seconds,
        "method": answer.matches.method,
        "compared": answer.matches.n_compared,
        "nothing_alike": answer.matches.nothing_alike,
        **classes,
        "matches": [_match_facts(answer.descriptor, match) for match in answer.matches],
    }


def _match_facts(descriptor: Descriptor, match: es.retrieval.Match) -> dict[str, Any]:
    pairs = [
        {
            "query_vertex": int(descriptor.vertices[one]),
            "match_vertex": int(match.vertices[two]),
        }
        for one, two in match.correspondences
    ]
    return {
        "name": match.name,
        "label": match.label,
        "source": match.source,
        "score": match.score,
        "chance": match.chance,
        "correspondences": pairs,
    }


def print_matches(
    matches: Sequence[es.retrieval.Match], title: str = "Most similar shapes"
) -> None:
    """Print matches, best first."""
    if not matches:
        out.print(
            f"{escape_text(title)}: none; the index holds no other shape, or none agrees with the filters"
        )
        return
    rows = [
        [
            match.name,
            match.label or "",
            f"{match.score:.3f}",
            "" if match.chance is None else f"{100 * match.chance:.2g} %",
            str(len(match.correspondences)),
        ]
        for match in matches
    ]
    columns = ["shape", "label", "score", "chance", "corresponding points"]
    print_table(title, columns, rows)


def explain_scores(matches: Sequence[es.retrieval.Match]) -> None:
    """Print what the scores of matches mean."""
    if any(match.chance is None for match in matches):
        out.print("score: 0 for the same description, lower is more alike")
    elif matches:
        out.print(
            "score: near 0 for the same shape, about 1 if nothing is alike; chance: the share of "
            "unrelated shapes that would score as well"
        )
