"""The pictures of the docs can be drawn again."""

import re
from pathlib import Path

import numpy as np
import pytest
from pictures import DIGEST, digest_of_window, main
from PIL import Image

DOCS = Path(__file__).parents[2] / "docs"
DRAW = (
    "The window has changed since its pictures were drawn. Run "
    "`python studio/hatch_build.py && python studio/tests/pictures.py docs/pictures`, and look at them."
)


def test_the_pictures_of_the_docs_are_as_new_as_the_window():
    drawn = DOCS / "pictures" / DIGEST
    assert drawn.is_file(), DRAW
    assert drawn.read_text().strip() == digest_of_window(), DRAW


@pytest.mark.long
@pytest.mark.sweep
def test_the_pictures_of_the_docs_can_be_drawn(browser, tmp_path):
    drawn = main(browser, tmp_path, n_vertices=2000)
    shown = re.findall(r"\(pictures/(studio_\S+?)\)", (DOCS / "studio.md").read_text())
    assert set(shown) <= {path.name for path in drawn}
    for path in drawn:
        colors = np.asarray(Image.open(path).convert("RGB"), dtype=int)
        assert (np.ptp(colors[:, :900], axis=2) > 60).mean() > 0.003  # region, function or parts
