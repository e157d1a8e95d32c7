"""Values that laws share: they take seconds to make, and no call may change them."""

import pytest
from thread_calls import Shared


@pytest.fixture(scope="session")
def shared(tmp_path_factory):
    """Return what all public functions are called with."""
    return Shared(tmp_path_factory.mktemp("shared"))
