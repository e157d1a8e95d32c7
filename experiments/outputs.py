"""The options of experiments, where they write, checked before their work begins, and figures as JSON with a source."""

import argparse
import datetime
import json
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))

from machine import command, commit, describe


def options_of(
    text: str | None, *, quick: str | None = "a smaller form, in seconds", out: str | None = None
) -> argparse.ArgumentParser:
    """Return a parser with --out, and with --quick if there is a quick form; the text's first line is its help."""
    parser = argparse.ArgumentParser(description=(text or "").splitlines()[0])
    if quick is not None:
        parser.add_argument("--quick", action="store_true", help=quick)
    parser.add_argument("--out", type=output_file, default=out, help="write the figures as JSON")
    return parser


def output_folder(text: str) -> Path:
    """Return a folder to write to, a type for argparse: it is made where it is missing."""
    folder = Path(text)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as err:
        raise argparse.ArgumentTypeError(
            f"the folder {folder} cannot be made: {err.strerror}"
        ) from err
    if not os.access(folder, os.W_OK):
        raise argparse.ArgumentTypeError(f"the folder {folder} cannot be written to")
    return folder


def output_file(text: str) -> Path:
    """Return a file to write, a type for argparse: its folder is made where it is missing."""
    path = Path(text)
    output_folder(str(path.parent))
    if path.is_dir():
        raise argparse.ArgumentTypeError(f"{path} is a folder, not a file")
    return path


def save_figures(results: Mapping[str, Any], path: Path | None) -> None:
    """Write figures as JSON, where there is a path, with the run that they come from: its `"source"`."""
    if path:
        figures = {"source": source(), **results}
        path.write_text(json.dumps(figures, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def source() -> dict[str, Any]:
    """Return the command, the day, the commit and the machine of this run."""
    return {
        "command": command("--out"),
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "commit": commit(),
        "machine": describe(["eigenshape", "numpy", "scipy"]),
    }


def give_out(results: Mapping[str, Any], path: Path | None) -> None:
    """Print figures as JSON, and write them where there is a path."""
    sys.stdout.write(json.dumps(results, indent=2) + "\n")
    save_figures(results, path)
