"""The pictures of the docs can be drawn again."""

import re
from pathlib import Path

import numpy as np
import pytest
from pictures import main
from PIL import Image

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.long
@pytest.mark.sweep
def test_the_pictures_of_the_docs_can_be_drawn(browser, tmp_path):
    drawn = main(browser, tmp_path, n_vertices=2000)
    shown = re.findall(r"\(pictures/(studio_\S+?)\)", (DOCS / "studio.md").read_text())
    assert set(shown) <= {path.name for path in drawn}
    for path in drawn:
        colors = np.asarray(Image.open(path).convert("RGB"), dtype=int)
        assert (np.ptp(colors[:, :900], axis=2) > 60).mean() > 0.003  # region, function or parts
