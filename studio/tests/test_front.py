"""The front end by itself: its types, and its mathematics under Node."""

import runpy
from pathlib import Path

import pytest

BUILD = runpy.run_path(str(Path(__file__).parents[1] / "hatch_build.py"))


@pytest.mark.parametrize(
    "command",
    [("typescript/bin/tsc", "--noEmit"), ("vitest/vitest.mjs", "run")],
    ids=["types", "mathematics"],
)
def test_front_end_checks_pass(command):
    if not (BUILD["FRONT"] / "node_modules").is_dir():
        BUILD["install_packages"]()
    BUILD["run_node"](*command)  # raises if the check fails
