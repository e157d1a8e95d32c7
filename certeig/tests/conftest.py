"""Options of the tests of certeig."""

import jaxtyping
import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    parser.addoption(
        "--types",
        action="store_true",
        help="check the shapes of arrays at run time, which takes four times as long",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Check types, if that is asked for; certeig must not be loaded yet."""
    if config.getoption("--types"):
        jaxtyping.install_import_hook("certeig", "checked_types.checked")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out values of a wrong type where types are checked, which would speak before our errors."""
    if config.getoption("--types"):
        items[:] = [item for item in items if not item.get_closest_marker("wrong_type")]
