"""eigenshape index merge: one index of several."""

from __future__ import annotations

from pathlib import Path

import eigenshape as es
from eigenshape.cli.console import count_shapes, err, escape_text, out, print_json

MOST_NAMED = 5  # shapes that a message names


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
    shelf = es.ShapeIndex.open_or_create(index)
    n_added = shelf.merge(parts, replace=replace)
    recipe = shelf.default_recipe()
    apart = [record.name for record in shelf.records() if recipe not in record.recipes]
    if as_json:
        facts = {"index": str(index), "added": n_added, "shapes": len(shelf)}
        print_json(facts | {"not_compared": apart})
    else:
        out.print(f"{count_shapes(n_added)} added; the index holds {len(shelf)}.")
    if apart:
        err.print(
            f"[yellow]not found by queries:[/] {count_shapes(len(apart))}, which "
            f"{recipe.name} does not describe: {escape_text(', '.join(apart[:MOST_NAMED]))}"
            f"{', ...' if len(apart) > MOST_NAMED else ''}. Index their files again, with "
            f"--codebook {escape_text(index)}"
        )
