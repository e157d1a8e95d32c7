"""Experiments check where they write before they work."""

import argparse
import subprocess
import sys
from pathlib import Path

import pytest

EXPERIMENTS = Path(__file__).resolve().parents[2] / "experiments"


@pytest.fixture
def outputs(monkeypatch):
    monkeypatch.syspath_prepend(EXPERIMENTS)
    import outputs

    return outputs


def test_a_missing_folder_is_made(outputs, tmp_path):
    assert outputs.output_folder(f"{tmp_path}/one/two").is_dir()
    assert outputs.output_file(f"{tmp_path}/three/figures.json").parent.is_dir()


def test_what_cannot_be_written_is_refused(outputs, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(argparse.ArgumentTypeError, match="cannot be made: "):
        outputs.output_folder(f"{tmp_path}/file")
    with pytest.raises(argparse.ArgumentTypeError, match="cannot be made: "):
        outputs.output_file(f"{tmp_path}/file/figures.json")
    with pytest.raises(argparse.ArgumentTypeError, match="is a folder, not a file"):
        outputs.output_file(str(tmp_path))


def test_a_closed_folder_is_refused(outputs, tmp_path, monkeypatch):
    monkeypatch.setattr(outputs.os, "access", lambda *_: False)  # the superuser may write anywhere
    with pytest.raises(argparse.ArgumentTypeError, match="cannot be written to"):
        outputs.output_folder(str(tmp_path))


@pytest.mark.long
def test_an_experiment_refuses_before_it_works(tmp_path):
    (tmp_path / "file").write_text("")
    command = [
        sys.executable,
        EXPERIMENTS / "ch5_repeatability" / "run.py",
        "--pictures",
        tmp_path / "file",
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "argument --pictures: the folder" in done.stderr
    assert not done.stdout


def test_every_path_of_an_experiment_is_checked():
    for path in EXPERIMENTS.rglob("*.py"):
        assert "type=Path" not in path.read_text(), path.name
