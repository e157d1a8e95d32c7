"""What every test may lean on: the real data where it is there, and shapes checked at run time."""

import os
from pathlib import Path

import pytest
from jaxtyping import install_import_hook

install_import_hook("eigenshape", "runtime_types.checked")

ROOT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("EIGENSHAPE_DATA", ROOT.parent / "shared" / "data"))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip what reads real shapes where they are absent, unless CI asks for them to be there."""
    if DATA.is_dir() or os.environ.get("EIGENSHAPE_REQUIRE_DATA"):
        return
    skip = pytest.mark.skip(reason=f"real shapes are absent: {DATA} is not a folder (set EIGENSHAPE_DATA)")
    for item in items:
        if "data" in item.keywords:
            item.add_marker(skip)


@pytest.fixture(scope="session")
def data() -> Path:
    """Folder of real shapes; a test that uses it is marked `data`."""
    return DATA
