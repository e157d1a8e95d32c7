"""Keep an index of shapes: add meshes, list and remove shapes, check, compact, export and merge."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape.cli import steps
from eigenshape.cli.console import (
    SOME_FAILED,
    count_shapes,
    err,
    escape_text,
    out,
    print_failures,
    print_json,
    print_table,
    print_written,
    progress_bar,
    result_facts,
)
from eigenshape.cli.inputs import Memory, Method, Timeout, Workers, repair_names

Sides = Annotated[int | None, typer.Option(min=0, max=50)]

KILOBYTE = 1000  # bytes
DAMAGED = 1  # exit code of `verify`
MOST_NAMED = 5  # shapes that a message names


def add(
    index: Path,
    sources: list[Path],
    *,
    labels: Path | None = None,
    part: str | None = None,
    codebook: Path | None = None,
    prune: bool = False,
    method: Method = "patches",
    views: Sides = None,
    frames: Sides = None,
    repair: str = "auto",
    workers: Workers = None,
    timeout: Timeout = 300.0,
    memory: Memory = None,
    scheduler: str | None = None,
    as_json: bool = False,
) -> None:
    """Describe shapes and add them to an index; a file that fails is named, and the others are still added.

    A shape is named by its path below the given folder; its class is the folder that holds it.
    Shapes that the index has already are skipped, also if their folder has moved. After Ctrl-C or a
    crash, the same command continues where it stopped. Point clouds and depth scans
    (.pcd) become a surface first. The exit code is 3 if some files failed.

    Parameters
    ----------
    index
        Folder of the index. It is created if it does not exist.
    labels
        Table of comma-separated values with a column name, and columns label, tags (separated by
        semicolons) and any others, which become attributes. Without it, the class of a shape is the
        name of its folder.
    part : I/N
        Index only part I of N, such as 3/64, so that N jobs share the work, each with an index of
        its own; `eigenshape index merge` makes one index of them.
    codebook
        Codebook for a new index: a file that `eigenshape index learn` wrote, or another index. By
        default it is learned from the shapes if there are 40 or more, and with --part it is the one
        that comes with eigenshape.
    prune
        Remove shapes whose files lay in the given folders and are gone.
    method
        How shapes are described; patches is best for partial scans.
    views
        Number of sides from which closed shapes are also described, so that partial scans find
        them. By default 6 with patches, 4 with the other methods.
    frames
        Number of sides from which closed shapes are also described as a depth camera sees them, for
        an index that is asked with single frames; 6 are a good choice.
    """
    repairs = repair_names(repair)
    items = es.io.find_items(sources, labels=labels, part=steps.parse_part(part))
    opened = es.ShapeIndex.open_or_create(index)
    recipe = steps.index_recipe(
        opened, method, codebook, in_parts=part is not None, n_frames=frames
    )
    with steps.worker_processes(workers, timeout, memory, scheduler) as processes:
        if recipe is None and frames:
            learned = steps.learn_codebook(items, processes, repairs, opened)
            recipe = es.retrieval.PatchRecipe(learned, n_frames=frames)
        report = steps.describe_all(
            opened, items, recipe, processes, repairs=repairs, n_views=views
        )
    folders = [source for source in sources if source.is_dir()]
    pruned = opened.prune(*folders) if prune else []
    if as_json:
        facts = result_facts(report) | {"pruned": pruned}
        print_json({"index": index, "shapes": len(opened), **facts})
    else:
        for name, done in report.repaired:
            err.print(f"[yellow]repaired:[/] {escape_text(name)}: {escape_text('; '.join(done))}")
        counts = f"{len(report.added)} described, {len(report.skipped)} indexed already"
        if pruned:
            counts += f", {len(pruned)} removed"
        out.print(
            f"{counts}, {len(report.failed)} failed; the index holds {count_shapes(len(opened))}."
        )
        print_failures(report.failed)
    if report.failed:
        raise typer.Exit(SOME_FAILED)


def ls(index: Path, *, where: list[str] | None = None, as_json: bool = False) -> None:
    """List the shapes of an index, with their labels, tags and attributes."""
    records = es.ShapeIndex.open(index).records(where=steps.parse_filters(where))
    if as_json:
        # A recipe holds a codebook, and its name says which it is.
        names = [[recipe.name for recipe in record.recipes] for record in records]
        facts = [result_facts(record, "recipes") for record in records]
        print_json([fact | {"recipes": each} for fact, each in zip(facts, names, strict=True)])
        return
    rows = []
    for record in records:
        attributes = ", ".join(f"{key}={value}" for key, value in record.attributes.items())
        rows.append([record.name, record.label or "", ", ".join(record.tags), attributes])
    title = count_shapes(len(rows))
    print_table(title, ["shape", "label", "tags", "attributes"], rows)


def rm(
    index: Path,
    shapes: list[str] | None = None,
    *,
    where: list[str] | None = None,
    as_json: bool = False,
) -> None:
    """Remove shapes from an index.

    Give names, or a filter that chooses shapes. Their space serves shapes that are added later, or
    is given back by `eigenshape index compact`. A shape whose mesh stays in its folder comes back
    with the next `eigenshape index add`.

    Parameters
    ----------
    shapes
        Names of shapes.
    """
    opened = es.ShapeIndex.open(index)
    filters = steps.parse_filters(where)
    if bool(shapes) == bool(filters):
        raise InvalidParameterError(
            "Shapes are removed by their names or by --filter; give one of the two. "
            "`eigenshape index ls` lists the names."
        )
    chosen = shapes or [record.name for record in opened.records(where=filters)]
    opened.remove(*chosen)
    if as_json:
        print_json({"index": index, "removed": chosen, "shapes": len(opened)})
    else:
        out.print(f"{count_shapes(len(chosen))} removed; the index holds {len(opened)}.")


def stats(index: Path, *, as_json: bool = False) -> None:
    """Show how many shapes an index holds, how they are described, and the space they take."""
    opened = es.ShapeIndex.open(index)
    records = opened.records()
    labels = Counter(record.label for record in records)
    recipes = Counter(str(recipe.name) for record in records for recipe in record.recipes)
    n_bytes = sum(path.stat().st_size for path in index.rglob("*") if path.is_file())
    stage = opened.stage
    if as_json:
        print_json(
            {
                "index": index,
                "stage": stage,
                "shapes": len(records),
                "bytes": n_bytes,
                "recipes": dict(recipes),
                "labels": {label or "": count for label, count in labels.items()},
            }
        )
        return
    each = n_bytes / max(len(records), 1) / KILOBYTE
    out.print(f"{count_shapes(len(records))}, {n_bytes / KILOBYTE:,.0f} KB, {each:.1f} KB a shape")
    if stage is not None:
        out.print(f"{escape_text(stage)}; shapes are added after that")
    rows = [[name, str(count)] for name, count in recipes.most_common()]
    print_table("Descriptions", ["recipe", "shapes"], rows)
    rows = [[label or "(none)", str(count)] for label, count in labels.most_common()]
    print_table("Labels", ["label", "shapes"], rows)


def verify(index: Path, *, as_json: bool = False) -> None:
    """Read every byte of an index and name what is damaged.

    The exit code is 1 if anything is. Index the named shapes again, or merge the index into a new
    one, which keeps what is whole.
    """
    report = es.ShapeIndex.open(index).verify()
    if as_json:
        print_json({"shapes": report.n_shapes, "bytes": report.n_bytes, "damages": report.damages})
    else:
        for damage in report.damages:
            out.print(f"[red]damaged:[/] {escape_text(damage)}")
        verdict = "no damage" if not report.damages else f"{len(report.damages)} places damaged"
        out.print(
            f"{count_shapes(report.n_shapes)}, {report.n_bytes:,} bytes compared with their "
            f"checksums: {verdict}"
        )
    if report.damages:
        raise typer.Exit(DAMAGED)


def compact(index: Path, *, as_json: bool = False) -> None:
    """Give back the space of removed and replaced shapes.

    The last pages of the file move into free ones, so it takes as long as the removal. Queries go on
    meanwhile.
    """
    n_bytes = es.ShapeIndex.open(index).compact()
    if as_json:
        print_json({"index": index, "bytes": n_bytes})
    else:
        out.print(f"{n_bytes:,} bytes were given back")


def export(
    index: Path,
    *,
    output: Path,
    where: list[str] | None = None,
) -> None:
    """Write the descriptors of shapes, and what is known of them, for other programs.

    records.json lists the shapes, descriptors.npz holds their arrays.

    Parameters
    ----------
    output
        Write to this folder, a new or an empty one.
    """
    opened = es.ShapeIndex.open(index)
    filters = steps.parse_filters(where)
    names = None if not filters else [record.name for record in opened.records(where=filters)]
    opened.export(output, names)
    print_written(output)


def merge(
    index: Path,
    others: list[Path],
    *,
    replace: bool = False,
    as_json: bool = False,
) -> None:
    """Make one index of several, by copying them.

    What is damaged in the others is left out with a warning. Shapes with different codebooks do not
    compare: build the others with --codebook.

    Parameters
    ----------
    index
        Folder of the index. It is created if it does not exist.
    others
        Folders of the indexes to add to it.
    replace
        Let a shape replace one of the same name.
    """
    parts = [es.ShapeIndex.open(other) for other in others]
    opened = es.ShapeIndex.open_or_create(index)
    n_added = opened.merge(parts, replace=replace)
    recipe = opened.default_recipe()
    apart = [record.name for record in opened.records() if recipe not in record.recipes]
    if as_json:
        shapes = len(opened)
        print_json({"index": index, "added": n_added, "shapes": shapes, "not_compared": apart})
    else:
        out.print(f"{count_shapes(n_added)} added; the index holds {len(opened)}.")
    if apart:
        err.print(
            f"[yellow]not found by queries:[/] {count_shapes(len(apart))}, which "
            f"{recipe.name} does not describe: {escape_text(', '.join(apart[:MOST_NAMED]))}"
            f"{', ...' if len(apart) > MOST_NAMED else ''}. Index their files again, with "
            f"--codebook {escape_text(index)}"
        )


def duplicates(
    index: Path,
    *,
    score: Annotated[float, typer.Option(min=0)] = 0.1,
    as_json: bool = False,
) -> None:
    """List pairs of shapes that are nearly the same, wherever they lie and whatever their size.

    Parameters
    ----------
    score
        Largest score of two shapes that count as nearly the same. Below 0.01 they are a copy: the
        same shape, also moved or scaled, or a mirror image. From there on they are similar: another
        pose, noise, or a copy with other vertices.
    """
    opened = es.ShapeIndex.open(index)
    with progress_bar("duplicates") as progress:
        pairs = es.retrieval.find_duplicates(opened, most_score=score, progress=progress)
    columns = ["shape", "other", "score", "kind"]
    if as_json:
        rows = [dict(zip(columns, pair, strict=True)) for pair in pairs]
        print_json({"index": index, "shapes": len(opened), "pairs": rows})
    elif pairs:
        texts = [[one, two, f"{number:.3f}", kind] for one, two, number, kind in pairs]
        print_table("Nearly the same", columns, texts)
    else:
        out.print(f"none of {count_shapes(len(opened))} is nearly the same as another")


def learn(
    sources: list[Path],
    *,
    output: Path,
    repair: str = "auto",
    workers: Workers = None,
    timeout: Timeout = 300.0,
    memory: Memory = None,
    scheduler: str | None = None,
) -> None:
    """Learn a codebook from meshes, for indexes that are built in parts.

    At most 100 meshes are read. Shapes with different codebooks do not compare, so learn one and
    pass it to every `eigenshape index add --part` with --codebook.

    Parameters
    ----------
    output
        Write the codebook (NPZ).
    """
    repairs = repair_names(repair)
    steps.require_output(output, (".npz",), "A codebook")
    items = es.io.find_items(sources)
    with steps.worker_processes(workers, timeout, memory, scheduler) as processes:
        codebook = steps.learn_codebook(items, processes, repairs)
    if codebook == es.retrieval.default_codebook():
        err.print(
            "there are too few shapes to learn from; this is the codebook that comes with eigenshape"
        )
    output.write_bytes(es.retrieval.write_codebook(codebook))
    print_written(output)
