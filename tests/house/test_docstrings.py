"""Docstrings of public names: their examples run, and the short door has one for each name."""

import ast
import doctest
import inspect
import pydoc
import re
from pathlib import Path

import pytest
from public_names import public_things

import eigenshape as es

THINGS = {
    name: thing
    for name, thing in public_things().items()
    if inspect.isclass(thing) or inspect.isfunction(inspect.unwrap(thing))
}
FLAGS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS


def examples(name):
    """Return the docstring's examples, those of methods included."""
    finder = doctest.DocTestFinder(exclude_empty=True)
    found = finder.find(inspect.unwrap(THINGS[name]), name, globs={"es": es})
    return [test for test in found if test.examples]


WITH_EXAMPLES = [name for name in THINGS if examples(name)]
SLOW_ROOMS = (
    "eigenshape.collections",
    "eigenshape.matching",
    "eigenshape.plot",
    "eigenshape.retrieval",
)


def marked(name):
    """Return the name as a parameter; examples of some rooms take a second each."""
    slow = THINGS[name].__module__.startswith(SLOW_ROOMS)
    return pytest.param(name, marks=[pytest.mark.long] if slow else [])


@pytest.mark.parametrize("name", [marked(name) for name in WITH_EXAMPLES])
def test_examples_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for test in examples(name):
        runner = doctest.DocTestRunner(optionflags=FLAGS)
        printed = []
        assert not runner.run(test, out=printed.append).failed, "".join(printed)


def is_error(thing):
    return isinstance(thing, type) and issubclass(thing, Exception)


def test_every_public_name_has_an_example():
    wanted = {name for name, thing in THINGS.items() if not is_error(thing)}
    assert not sorted(wanted - set(WITH_EXAMPLES))


def documented_names(text):
    """Return the names in the sections of parameters and attributes of a docstring."""
    found, section = set(), ""
    lines = text.splitlines()
    for line, next_line in zip(lines, [*lines[1:], ""], strict=True):
        if next_line and set(next_line) == {"-"}:
            section = line
        elif section in ("Parameters", "Attributes") and line and not line[0].isspace():
            found |= {name.strip().lstrip("*") for name in line.split(" : ")[0].split(",")}
    return found


def test_every_parameter_is_documented():
    callables = {name: thing for name, thing in THINGS.items() if not is_error(thing)}
    methods = {
        f"{name}.{each}": getattr(thing, each)
        for name, thing in callables.items()
        if inspect.isclass(thing)
        for each in vars(thing)
        if not each.startswith("_") and callable(getattr(thing, each))
    }
    missing = {}
    for name, thing in (callables | methods).items():
        asked = set(inspect.signature(inspect.unwrap(thing)).parameters) - {"self", "cls"}
        asked = {each for each in asked if not each.startswith("_")}
        if left := asked - documented_names(inspect.getdoc(thing)):
            missing[name] = sorted(left)
    assert not missing


def test_every_public_function_and_class_has_a_docstring_of_one_sentence_first():
    for name, thing in THINGS.items():
        first = inspect.getdoc(thing).split("\n\n")[0]
        assert first.rstrip().endswith("."), name


SOURCE = Path(es.__file__).parent
# The public names of the room that can be imported only where torch is installed.
TORCH_NAMES = re.findall(
    r"as (\w+)$", (SOURCE / "torch" / "__init__.pyi").read_text(), re.MULTILINE
)


def docstrings(node, module, outer=""):
    """Yield the name and docstring of each function and class, and whether somebody outside calls it."""
    for inner in ast.iter_child_nodes(node):
        if isinstance(inner, ast.FunctionDef | ast.ClassDef):
            name = f"{outer}{inner.name}"
            top = name.split(".", maxsplit=1)[0]
            thing = THINGS.get(top)
            home = getattr(inspect.unwrap(thing), "__module__", None) if thing else None
            in_torch = module.startswith("eigenshape.torch.") and top in TORCH_NAMES
            is_public = home == module or in_torch
            is_public = is_public and not any(part[0] == "_" for part in name.split("."))
            yield name, ast.get_docstring(inner) or "", is_public
            yield from docstrings(inner, module, f"{name}.")


def test_only_what_is_public_has_a_block_of_errors():
    long_ones, n_public = [], 0
    for path in sorted(SOURCE.rglob("*.py")):
        place = path.relative_to(SOURCE.parent).with_suffix("")
        for name, text, is_public in docstrings(ast.parse(path.read_text()), ".".join(place.parts)):
            if "Raises\n------" in text:
                n_public += is_public
                if not is_public:
                    long_ones.append(f"{place}: {name}")
    assert n_public > 100
    assert not long_ones, "say the error in a clause: " + ", ".join(long_ones)


# Five lines of a terminal. A signature is the first thing that `help` shows; what makes one longer,
# a union or a list of names, has a name of its own (TypeAliasType), which its docstring explains.
LONGEST_SIGNATURE = 450


def test_signatures_can_be_read():
    functions = {name: thing for name, thing in THINGS.items() if inspect.isroutine(thing)}
    methods = {
        f"{name}.{each}": getattr(thing, each)
        for name, thing in THINGS.items()
        if inspect.isclass(thing)
        for each in vars(thing)
        if not each.startswith("_")
    }
    lengths = {
        name: len(str(inspect.signature(thing)))
        for name, thing in (functions | methods).items()
        if inspect.isfunction(inspect.unwrap(thing)) or inspect.ismethod(thing)
    }
    assert {"solve_spectrum", "ShapeIndex.add", "ShapeIndex.create"} <= lengths.keys()
    assert not {name: n for name, n in lengths.items() if n > LONGEST_SIGNATURE}


@pytest.mark.parametrize("name", es.types.__all__)
def test_help_says_what_a_type_stands_for(name):
    text = pydoc.plain(pydoc.render_doc(getattr(es.types, name)))
    first = text.splitlines()[3].strip()
    assert first.endswith("."), text
    assert "alias" not in text.split("\n", 1)[1]
