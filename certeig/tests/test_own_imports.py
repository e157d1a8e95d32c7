"""certeig stands alone: it loads NumPy, SciPy, jaxtyping, threadpoolctl and typing_extensions, and no more."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import certeig

ALLOWED = {"certeig", "numpy", "scipy", "jaxtyping", "threadpoolctl", "typing_extensions"}
SOURCE = Path(certeig.__file__).parent


def imported(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert not node.level
            yield node.module


@pytest.mark.parametrize(
    "path", sorted(SOURCE.rglob("*.py")), ids=lambda path: str(path.relative_to(SOURCE))
)
def test_a_module_imports_nothing_else(path):
    roots = {name.split(".")[0] for name in imported(path)}
    assert roots <= ALLOWED | sys.stdlib_module_names


def test_the_door_alone_loads_neither_numpy_nor_scipy():
    code = "import sys, certeig; print(sorted({'numpy', 'scipy'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_public_name_is_there_and_says_what_it_does():
    assert dir(certeig) == certeig.__all__
    for name in certeig.__all__:
        assert getattr(certeig, name).__doc__.strip()
