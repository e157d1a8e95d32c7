"""Every message that the package raises is looked for by a test."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ERRORS = {
    "InvalidShapeError",
    "InvalidParameterError",
    "FileFormatError",
    "ConvergenceError",
    "StoreError",
}
HOLE = "\0"


def raised_messages(package):
    for path in sorted((ROOT / package / "src").rglob("*.py")):
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
    for path in [*ROOT.glob("tests/**/*.py"), *ROOT.glob("certeig/tests/**/*.py")]:
        for node in ast.walk(ast.parse(path.read_text())):
            if (
                isinstance(node, ast.Constant)
                and isinstance(node.value, str)
                and len(node.value) >= 10
            ):
                yield node.value


def is_expected(message, wanted):
    """Say whether a run of ten characters of the message is asked for."""
    plain = re.sub(r"\\(.)", r"\1", wanted)
    windows = {plain[start : start + 10] for start in range(len(plain) - 9)}
    return any(window in piece for piece in message.split(HOLE) for window in windows)


@pytest.mark.parametrize("package", [".", "certeig"])
def test_every_raise_is_expected_somewhere(package):
    wanted = list(expectations())
    missing = [
        f"{where} {message.replace(HOLE, '…')[:80]}"
        for where, message in raised_messages(package)
        if message.strip(HOLE) and not any(is_expected(message, text) for text in wanted)
    ]
    assert not missing, "\n".join(missing)
