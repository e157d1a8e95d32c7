"""Values that laws share: they take seconds to make, and no call may change them."""

from contextlib import contextmanager

import numpy as np
import pytest
from thread_calls import Shared

from eigenshape.collections import alignment, building, surface_fit
from eigenshape.matching import match, target


@contextmanager
def few_points():
    """Align, bend and match by few starts, steps and points: a fifth of the time, and laws hold for any number."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(alignment, "N_TURNS", 4)
        patch.setattr(alignment, "FINE_REACH", np.geomspace(0.2, 0.05, 8))
        for module, name in ((surface_fit, "LEVELS"), (building, "SECOND_LEVELS")):
            few = tuple(level._replace(n_points=1000) for level in getattr(module, name))
            patch.setattr(module, name, few)
        patch.setattr(match, "N_PART", 100)
        patch.setattr(target, "N_WHOLE", 160)
        yield


@pytest.fixture(scope="module", autouse=True)
def by_few_points():
    """Laws take few points, and what the same process tests after them takes all."""
    with few_points():
        yield


@pytest.fixture(scope="session")
def shared(tmp_path_factory):
    """Return what all public functions are called with."""
    with few_points():
        return Shared(tmp_path_factory.mktemp("shared"))
