"""The figure that all pictures are drawn on."""

from io import BytesIO
from typing import Any

from matplotlib import figure as matplotlib_figure
from matplotlib.text import Text

from eigenshape._text import printable


class Figure(matplotlib_figure.Figure):
    """A matplotlib figure that notebooks show, and whose text cannot break a file.

    matplotlib itself shows a figure in a notebook only if `pyplot` made it.
    """

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
