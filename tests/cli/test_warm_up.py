"""`eigenshape warm-up`: everything runs once, and the folder that is printed holds compiled loops."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from eigenshape._compile import cache_folder
from eigenshape.cli import app


@pytest.mark.long
def test_warm_up_fills_the_folder_that_it_names():
    done = CliRunner().invoke(app, ["warm-up", "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert {"spectrum", "index add", "query", "match", "deform"} <= found["seconds"].keys()
    assert all(seconds > 0 for seconds in found["seconds"].values())
    assert Path(found["folder"]) == cache_folder()
    assert any(Path(found["folder"]).rglob("*.nbi"))
