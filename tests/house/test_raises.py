"""Every message that the package raises is looked for by a test."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ERRORS = {
    "InvalidShapeError",
    "InvalidParameterError",
    "FileFormatError",
    "ConvergenceError",
    "StoreError",
}
HOLE = "\0"
RUN = 10  # characters of a message that a test must ask for


def raised_messages():
    sources = (ROOT / folder for folder in ("src", "certeig/src"))
    for path in sorted(path for source in sources for path in source.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            call = node.exc if isinstance(node, ast.Raise) else None
            if isinstance(call, ast.Call) and getattr(call.func, "id", "") in ERRORS and call.args:
                yield f"{path.name}:{node.lineno}", text_of(call.args[0])


def text_of(node):
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(
            text_of(part) if isinstance(part, ast.Constant) else HOLE for part in node.values
        )
    return HOLE


def expectations():
    folders = (ROOT / folder for folder in ("tests", "certeig/tests"))
    for path in sorted(path for folder in folders for path in folder.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if (
                isinstance(node, ast.Constant)
                and isinstance(node.value, str)
                and len(node.value) >= RUN
            ):
                yield node.value


def runs(text):
    return (text[start : start + RUN] for start in range(len(text) - RUN + 1))


def test_every_raise_is_expected_somewhere():
    wanted = {run for text in expectations() for run in runs(re.sub(r"\\(.)", r"\1", text))}
    missing = [
        f"{where} {message.replace(HOLE, '…')[:80]}"
        for where, message in raised_messages()
        if message.strip(HOLE)
        and not any(run in wanted for piece in message.split(HOLE) for run in runs(piece))
    ]
    assert not missing, "\n".join(missing)
