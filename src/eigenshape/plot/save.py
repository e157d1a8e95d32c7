"""Figures on disk."""

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from eigenshape._arguments import require_type
from eigenshape._errors import InvalidParameterError
from eigenshape._files import replacing

SUFFIXES = (".png", ".svg", ".pdf")


def require_picture_path(path: str | Path) -> Path:
    """Refuse a path that no picture can be written to, before any work is done.

    Raises
    ------
    InvalidParameterError
        If the suffix is none of `SUFFIXES` or the folder is not there.
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise InvalidParameterError(
            f"A picture must end in {', '.join(SUFFIXES)}; {path} ends in {path.suffix!r}."
        )
    if not path.absolute().parent.is_dir():
        raise InvalidParameterError(
            f"A picture needs a folder to lie in; {path.absolute().parent} is not there."
        )
    return path


def save_figure(figure: Figure, path: str | Path) -> None:
    """Write a figure as PNG, SVG or PDF, whole or not at all.

    Figures made alike give the same bytes as PNG and as PDF; in SVG, Matplotlib gives parts random names.

    Raises
    ------
    InvalidParameterError
        If the suffix is unknown or the folder is not there.
    """
    require_type(figure, Figure, "figure")
    path = require_picture_path(path)
    FigureCanvasAgg(figure)
    kind = path.suffix.lower()
    metadata = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}[
        kind
    ]
    with replacing(path) as file:
        figure.savefig(file, format=kind[1:], metadata=metadata, facecolor="white")
