"""--view and --up: names and directions, and what is refused."""

import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape.cli.steps.writing import picture_side


def test_names_and_directions():
    assert picture_side("auto", "auto") == {"view": "auto", "up": "auto"}
    assert picture_side("back-left", "-z") == {"view": "back-left", "up": "-z"}
    assert picture_side("1,0,2.5", "0,-1,1") == {"view": [1.0, 0.0, 2.5], "up": [0.0, -1.0, 1.0]}


@pytest.mark.parametrize("bad", ["behind", "1,2", "0,0,0", "1,a,2", ""])
def test_anything_else_is_named(bad):
    with pytest.raises(InvalidParameterError, match="--view takes auto, front, back"):
        picture_side(bad, "auto")
    with pytest.raises(InvalidParameterError, match="--up takes auto, x, y, z"):
        picture_side("auto", bad)
