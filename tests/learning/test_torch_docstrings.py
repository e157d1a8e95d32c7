"""Docstrings of the room: their examples run, and pages mention each name."""

import doctest
import inspect
import re
from pathlib import Path

import pytest

pytest.importorskip("torch.nn", reason="torch is not installed: pip install 'eigenshape[torch]'")
pytest.importorskip(
    "torch_geometric", reason="torch_geometric is not installed: pip install 'eigenshape[torch]'"
)

import eigenshape as es
import eigenshape.torch as et

pytestmark = pytest.mark.filterwarnings("ignore::FutureWarning")  # of torch_geometric
ROOT = Path(__file__).resolve().parents[2]
THINGS = {name: getattr(et, name) for name in et.__all__}
FLAGS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS


@pytest.mark.parametrize("name", THINGS)
def test_examples_run(name):
    finder = doctest.DocTestFinder(exclude_empty=True)
    found = finder.find(inspect.unwrap(THINGS[name]), name, globs={"es": es})
    assert found
    for test in found:
        printed = []
        runner = doctest.DocTestRunner(optionflags=FLAGS)
        assert not runner.run(test, out=printed.append).failed, "".join(printed)


def test_pages_mention_each_name_and_no_other():
    page = (ROOT / "docs" / "learning.md").read_text()
    mentioned = set(re.findall(r"\bet\.(\w+)", page))
    assert mentioned == set(et.__all__)
