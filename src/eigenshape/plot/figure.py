"""The figure that all pictures are drawn on, and its file."""

from io import BytesIO
from pathlib import Path
from typing import Any

from matplotlib import figure as matplotlib_figure
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from certeig.kit.arguments import require_type
from certeig.kit.errors import InvalidParameterError
from certeig.kit.files import as_path, replacing
from certeig.kit.text import printable

SUFFIXES = (".png", ".svg", ".pdf")


class Figure(matplotlib_figure.Figure):
    """A matplotlib figure that notebooks show, and whose text cannot break a file.

    matplotlib itself shows a figure in a notebook only if `pyplot` made it.
    """

    def __init__(self, width: float, height: float) -> None:
        super().__init__(figsize=(width, height), layout="constrained")

    def _repr_png_(self) -> bytes:
        """Return the picture that IPython shows for this figure."""
        file = BytesIO()
        self.savefig(file, format="png", facecolor="white")
        return file.getvalue()

    def draw(self, renderer: Any) -> None:
        """Draw, with control characters spelled out: no SVG may hold them."""
        for text in self.findobj(Text):
            plain = "\n".join(map(printable, text.get_text().split("\n")))
            if plain != text.get_text():
                text.set_text(plain)
        super().draw(renderer)


def open_frame(axes: Axes) -> None:
    """Draw the lines of a frame at the left and below only."""
    axes.spines[["top", "right"]].set_visible(False)


def require_picture_path(path: str | Path) -> Path:
    """Raise an error if no picture can be written to a path, before any work is done.

    The path must end in .png, .svg or .pdf, and its folder must exist.
    """
    path = as_path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise InvalidParameterError(
            f"A picture must end in {', '.join(SUFFIXES)}; {path} ends in {path.suffix!r}."
        )
    if not path.absolute().parent.is_dir():
        raise InvalidParameterError(
            f"A picture must be written to a folder that exists; {path.absolute().parent} does not."
        )
    return path


def save_figure(figure: matplotlib_figure.Figure, path: str | Path) -> None:
    """Write a figure to a PNG, SVG or PDF file.

    The file appears complete or not at all. The same figure gives the same bytes as PNG and as PDF;
    in SVG, Matplotlib gives elements random names.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    path : str or Path
        Must end in .png, .svg or .pdf.

    Raises
    ------
    InvalidParameterError
        If the path does not end in .png, .svg or .pdf, or its folder does not exist.

    Examples
    --------
    >>> import eigenshape as es
    >>> import tempfile, pathlib
    >>> mesh = es.icosphere(1)
    >>> figure = es.figure_field(mesh, mesh.vertices[:, 2])
    >>> path = pathlib.Path(tempfile.mkdtemp(), "height.png")
    >>> es.save_figure(figure, path)
    >>> path.read_bytes()[1:4]
    b'PNG'
    """
    require_type(figure, matplotlib_figure.Figure, "figure")
    path = require_picture_path(path)
    FigureCanvasAgg(figure)
    kind = path.suffix.lower()
    changing = {".png": "Software", ".svg": "Date", ".pdf": "CreationDate"}[kind]
    with replacing(path) as file:
        figure.savefig(file, format=kind[1:], metadata={changing: None}, facecolor="white")
