"""Values that laws share: they take seconds to make, and no call may change them."""

import numpy as np
import pytest
from thread_calls import Shared

from eigenshape.collections import alignment


@pytest.fixture(scope="session", autouse=True)
def few_starts():
    """Align surfaces from few starts in few steps: a fifth of the time, and laws hold for any number."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(alignment, "N_TURNS", 4)
        patch.setattr(alignment, "FINE_REACH", np.geomspace(0.2, 0.05, 8))
        yield


@pytest.fixture(scope="session")
def shared(few_starts, tmp_path_factory):
    """Return what all public functions are called with."""
    return Shared(tmp_path_factory.mktemp("shared"))
