"""Quick forms of experiments: each that has its turn is run once in a session, for all tests and all workers."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from filelock import FileLock

EXPERIMENTS = Path(__file__).resolve().parents[2] / "experiments"


SCRIPTS = sorted(str(path.relative_to(EXPERIMENTS)) for path in EXPERIMENTS.glob("*/*.py"))


@pytest.fixture(scope="session")
def quick_form(tmp_path_factory, worker_id, in_turn):
    """Return a function that runs an experiment in its quick form, and gives the figures that it wrote."""
    chosen = in_turn(SCRIPTS)
    # workers of pytest-xdist have a folder each, side by side
    own = tmp_path_factory.getbasetemp()
    shared = own if worker_id == "master" else own.parent

    def run(script):
        if script not in chosen:
            pytest.skip("This experiment has another turn.")
        folder = shared / script.replace("/", "-").removesuffix(".py")
        out = folder / "figures.json"
        with FileLock(f"{folder}.lock"):
            if not out.exists():
                folder.mkdir(exist_ok=True)
                command = [sys.executable, EXPERIMENTS / script, "--quick", "--out", out]
                done = subprocess.run(
                    command, cwd=folder, capture_output=True, text=True, check=False
                )
                assert done.returncode == 0, done.stderr[-3000:]
        figures = json.loads(out.read_text(encoding="utf-8"))
        assert figures.pop("source")["command"].startswith(f"python experiments/{script} --quick")
        return figures

    return run
