"""What every program of the exchange does alike: it is asked by lines of JSON, and answers by lines.

This module needs NumPy alone, since each program runs in a Python of its own. A job is
`{"act": "write", "format": ..., "shape": ..., "path": ...}` or `{"act": "read", "path": ...}`.
The first answer says what the program is and can do.
"""

import json
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

Shape = dict[str, Any]
SURFACES = ("prism", "hole", "seam", "colors", "far")


@dataclass(frozen=True)
class Writer:
    """A way to write files: their suffix, the call, and the names of the shapes that it can express."""

    suffix: str
    write: Callable[[Shape, Path], None]
    shapes: tuple[str, ...]


def serve(
    version: str, writers: dict[str, Writer], readers: dict[str, Callable[[Path], Shape]]
) -> None:
    """Answer all jobs of the file that the command line names; each answer is one line.

    A reader is named by the suffix of its files.
    """
    jobs, answers = map(Path, sys.argv[1:3])
    with answers.open("a", encoding="utf-8") as file:

        def answer(content: dict[str, Any]) -> None:
            file.write(json.dumps(content, default=as_list) + "\n")
            file.flush()

        writes = {name: [writer.suffix, *writer.shapes] for name, writer in writers.items()}
        answer({"version": version, "writes": writes, "reads": list(readers)})
        for line in jobs.read_text(encoding="utf-8").splitlines():
            job = json.loads(line)
            path = Path(job["path"])
            try:
                if job["act"] == "write":
                    writers[job["format"]].write(job["shape"], path)
                    answer({"key": job["key"]})
                else:
                    answer({"key": job["key"], "found": readers[path.suffix](path)})
            except (Exception, SystemExit) as err:  # noqa: BLE001 meshio ends the process, others raise anything
                place = traceback.extract_tb(err.__traceback__)[-1]
                text = f"{type(err).__name__}: {str(err)[:300]} ({Path(place.filename).name})"
                answer({"key": job["key"], "error": text})


def as_list(value: Any) -> Any:
    """Return arrays and numbers of NumPy as JSON knows them."""
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else list(value)


def field_arrays(fields: dict[str, Any]) -> dict[str, np.ndarray]:
    """Return the fields of a shape as arrays of their types."""
    return {name: np.array(each["values"], dtype=each["type"]) for name, each in fields.items()}


def plain_fields(arrays: Any) -> dict[str, Any]:
    """Return arrays by name as fields of an answer."""
    found = {}
    for name, values in arrays.items():
        array = np.asarray(values)
        if array.dtype.kind in "buif":
            found[name] = {"type": array.dtype.name, "values": array}
    return found
