"""Maps between shapes: what is printed of them, and their files."""

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from eigenshape._errors import InvalidParameterError
from eigenshape._files import replace_file
from eigenshape.cli.console import print_written
from eigenshape.matching.shape_match import ShapeMatch

MAP_FILES = (".csv", ".npz", ".txt")
COLUMNS = "vertex,whole_vertex,face,weight_1,weight_2,weight_3,confidence"


def parse_scale(text: str) -> Any:
    """Return "auto", "known" and "unknown" as they are, and a number as a number.

    Raises
    ------
    InvalidParameterError
        If it is neither.
    """
    if text in ("auto", "known", "unknown"):
        return text
    try:
        return float(text)
    except ValueError as err:
        raise InvalidParameterError(
            f"--scale takes auto, known, unknown or a number; it is {text!r}."
        ) from err


def match_facts(match: ShapeMatch) -> dict[str, Any]:
    """Return what is printed of a map."""
    return {
        "n_vertices": match.n_vertices,
        "score": match.score,
        "orientation": match.orientation,
        "coverage": match.coverage,
        "handed": match.handed,
        "n_equally_good": match.n_equally_good,
        "scale": match.scale,
        "report": match.report,
        "mean_confidence": float(match.confidence.mean()),
        "share_sure": float(match.sure().mean()),
    }


def match_sentence(facts: dict[str, Any]) -> str:
    """Return the facts in words."""
    text = (
        f"{facts['n_vertices']} vertices; {facts['share_sure']:.0%} have a confidence of at least "
        f"0.5, the mean is {facts['mean_confidence']:.2f}."
    )
    if not facts["handed"]:
        text += " Nothing tells outside from inside: left and right may be exchanged."
    if facts["n_equally_good"] > 1:
        text += (
            f" At least {facts['n_equally_good']} maps that differ fit equally well, since the shape "
            "can be turned into itself; this is one of them."
        )
    return "\n".join([text, *(f"{sentence}." for sentence in facts["report"])])


def save_match(match: ShapeMatch, path: Path) -> None:
    """Write a map as a table, as arrays, or as one vertex a line, and print so."""
    suffix = path.suffix.lower()
    if suffix == ".txt":
        data = "".join(f"{vertex}\n" for vertex in match.vertices).encode()
    elif suffix == ".csv":
        numbers = zip(
            match.vertices.tolist(),
            match.faces.tolist(),
            match.weights.tolist(),
            match.confidence.tolist(),
            strict=True,
        )
        rows = [
            f"{number},{vertex},{face},{a:.6g},{b:.6g},{c:.6g},{sure:.4g}"
            for number, (vertex, face, (a, b, c), sure) in enumerate(numbers)
        ]
        data = "\n".join([COLUMNS, *rows, ""]).encode()
    else:
        file = BytesIO()
        np.savez_compressed(
            file,
            vertices=match.vertices,
            faces=match.faces,
            corners=match.corners,
            weights=match.weights,
            confidence=match.confidence,
        )
        data = file.getvalue()
    replace_file(path, data)
    print_written(path)
