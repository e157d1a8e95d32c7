"""Figures of the gallery: those that a notebook would show."""

from typing import Any

from sphinx_gallery.scrapers import figure_rst

from eigenshape.plot.figure import Figure


def save_shown_figure(_block: object, variables: dict[str, Any], conf: dict[str, Any]) -> str:
    """Save the figure that is the last value of a block. The usual scraper knows pyplot's alone."""
    shown = variables["example_globals"].get("___")
    if not isinstance(shown, Figure) or hasattr(shown, "in_gallery"):
        return ""
    shown.in_gallery = True  # type: ignore[attr-defined]  # the value stays until the next one
    path = next(variables["image_path_iterator"])
    shown.savefig(path)
    return str(figure_rst([path], conf["src_dir"]))
