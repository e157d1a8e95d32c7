"""Made-up creatures as parameters of tests: of the dozen kinds two stand for all in the quick part."""

import pytest

from eigenshape.shapes.creatures import CREATURES

QUICK = ("octopus", "quadruped")
KINDS = [
    kind if kind in QUICK else pytest.param(kind, marks=pytest.mark.long) for kind in CREATURES
]
