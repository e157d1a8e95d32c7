"""The pictures of the docs can be drawn again."""

import re

import numpy as np
import pytest
from pictures import DOCS, digests, main
from PIL import Image

DRAW = (
    "What they show has changed since the pictures were drawn. Run "
    "`python studio/hatch_build.py && python studio/tests/pictures.py docs/pictures`, and look at them."
)


def test_the_pictures_of_the_docs_are_as_new_as_what_they_show():
    for name, digest in digests().items():
        drawn = DOCS / "pictures" / name
        assert drawn.is_file(), DRAW
        assert drawn.read_text().strip() == digest, DRAW


@pytest.mark.long
@pytest.mark.sweep
def test_the_pictures_of_the_docs_can_be_drawn(browser, tmp_path):
    drawn = main(browser, tmp_path, n_vertices=2000)
    shown = re.findall(r"\(pictures/(studio_\S+?)\)", (DOCS / "studio.md").read_text())
    assert set(shown) <= {path.name for path in drawn}
    for path in drawn:
        colors = np.asarray(Image.open(path).convert("RGB"), dtype=int)
        assert (np.ptp(colors[:, :900], axis=2) > 60).mean() > 0.003  # region, function or parts
