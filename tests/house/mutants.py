"""Change the package at random, one place at a time, and tell which changes no test notices.

    python tests/house/mutants.py --seed 1 --count 50           by the quick tests
    python tests/house/mutants.py --seed 1 --count 50 --all     by the long ones too

A mutant is one place of a central room whose comparison, arithmetic, sign, boolean, order of arguments or named
argument is changed. It is made in a copy of the tree. First the tests run once to record which files call which
function. Then each mutant is given to the files that call its function, those that call it most first, until one fails.
Loops that are compiled take the files of the modules that import them, and of tests that do. A run without an end
counts as a failure.
"""

import argparse
import ast
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ROOMS = (
    "certeig/src/certeig",
    "src/eigenshape/calculus",
    "src/eigenshape/deformation",
    "src/eigenshape/features",
    "src/eigenshape/matching",
    "src/eigenshape/operators",
    "src/eigenshape/retrieval",
    "src/eigenshape/spectral",
)
PACKAGES = ("certeig/src/certeig", "src/eigenshape")
NOT_COPIED = (".git", "studio", ".mypy_cache", ".ruff_cache", ".pytest_cache", ".hypothesis")
FIRST_FILES = 4  # that are asked first
LONGEST = (
    1800  # seconds that the tests of one mutant may take; fewer would count slow tests as failures
)
SWAPS: dict[type[ast.AST], str] = {
    ast.Lt: ">=",
    ast.LtE: ">",
    ast.Gt: "<=",
    ast.GtE: "<",
    ast.Eq: "!=",
    ast.NotEq: "==",
    ast.Is: "is not",
    ast.IsNot: "is",
    ast.In: "not in",
    ast.NotIn: "in",
    ast.Add: "-",
    ast.Sub: "+",
    ast.Mult: "/",
    ast.Div: "*",
    ast.And: "or",
    ast.Or: "and",
}
SYMMETRIC = ("min", "max", "minimum", "maximum")  # in their first two arguments
SIGNS: dict[type[ast.AST], str] = {ast.USub: "-", ast.Not: "not ", ast.Invert: "~"}


@dataclass(frozen=True)
class Mutant:
    """A place of a module, from one byte to another, and what stands there instead."""

    module: str  # its path in the repository
    function: str
    line: int
    start: int
    stop: int
    text: str

    def applied(self) -> bytes:
        """Return the text of the changed module."""
        text = source(self.module)
        return text[: self.start] + self.text.encode() + text[self.stop :]

    def __str__(self) -> str:
        text = source(self.module)
        begin, end = text.rfind(b"\n", 0, self.start) + 1, text.find(b"\n", self.stop)
        before, after = text[begin : self.start].decode(), text[self.stop : end].decode()
        changed = text[self.start : self.stop].decode()
        line = " ".join(f"{before}⟦{changed} → {self.text}⟧{after}".split())
        return f"{self.module}:{self.line} {self.function}: {line}"


def source(module: str) -> bytes:
    """Return the text of a module."""
    return (ROOT / module).read_bytes()


def import_name(module: str) -> str:
    """Return the name by which a module is imported."""
    return module.partition("src/")[2].removesuffix(".py").replace("/", ".")


def mutants_of(module: str) -> Iterator[Mutant]:
    """Yield every mutant of a module."""
    text = source(module)
    begins = [0]
    for line in text.splitlines(keepends=True):
        begins.append(begins[-1] + len(line))

    def first(node: ast.AST) -> int:
        return begins[node.lineno - 1] + node.col_offset  # type: ignore[attr-defined]

    def last(node: ast.AST) -> int:
        return begins[node.end_lineno - 1] + node.end_col_offset  # type: ignore[attr-defined]

    def written(node: ast.AST) -> str:
        return text[first(node) : last(node)].decode()

    def changes(node: ast.AST) -> Iterator[tuple[int, int, str]]:
        """Yield where a node may be changed, and to what."""
        match node:
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in SWAPS:
                yield first(node), last(node), f"{written(left)} {SWAPS[type(op)]} {written(right)}"
            case ast.BinOp(left=left, op=op, right=right) if type(op) in SWAPS:
                # What stands between both holds brackets too.
                between = text[last(left) : first(right)].decode()
                sign = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}[type(op)]
                yield last(left), first(right), between.replace(sign, SWAPS[type(op)], 1)
            case ast.BoolOp(op=op, values=[one, other, *_]):
                between = text[last(one) : first(other)].decode()
                word = "and" if isinstance(op, ast.And) else "or"
                yield last(one), first(other), between.replace(word, SWAPS[type(op)], 1)
            case ast.UnaryOp(op=op) if type(op) in SIGNS:
                yield first(node), first(node) + len(SIGNS[type(op)]), ""
            case ast.Constant(value=bool()):
                yield first(node), last(node), str(not node.value)
            case ast.Call(func=func, args=[ast.Name() as one, ast.Name() as other, *_]) if (
                one.id != other.id and written(func).split(".")[-1] not in SYMMETRIC
            ):
                yield first(one), last(other), f"{written(other)}, {written(one)}"
            case ast.Call(keywords=[_, *_]):
                for keyword in (each for each in node.keywords if each.arg):
                    end = last(keyword)
                    comma = text[end : last(node)].lstrip().startswith(b",")
                    stop = text.index(b",", end) + 1 if comma else end
                    yield first(keyword), stop, ""

    def walk(node: ast.AST, function: str) -> Iterator[Mutant]:
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "decorator_list", "type_params"):
                continue
            for child in value if isinstance(value, list) else [value]:
                # What messages say is tested by their words.
                if not isinstance(child, ast.AST) or isinstance(child, ast.Raise | ast.JoinedStr):
                    continue
                inside = function
                if isinstance(child, ast.FunctionDef | ast.ClassDef):
                    inner = isinstance(node, ast.FunctionDef)
                    inside = function if inner else f"{function}.{child.name}".lstrip(".")
                if inside and isinstance(child, ast.expr):
                    for start, stop, new in changes(child):
                        line = child.lineno
                        yield Mutant(module, inside, line, start, stop, new)
                yield from walk(child, inside)

    yield from walk(ast.parse(text), "")


def sample(seed: int, count: int) -> list[Mutant]:
    """Draw mutants, no two of one function; each room gives its share."""
    modules = sorted(
        path.relative_to(ROOT).as_posix() for room in ROOMS for path in (ROOT / room).rglob("*.py")
    )
    found = [mutant for module in modules for mutant in mutants_of(module)]
    random.Random(seed).shuffle(found)
    chosen: dict[tuple[str, str], Mutant] = {}
    for mutant in found:
        chosen.setdefault((mutant.module, mutant.function), mutant)
    return list(chosen.values())[:count]


def run_tests(tree: Path, options: list[str], **variables: str) -> int | None:
    """Run tests in a copy of the tree; return the exit code, or None if they do not end."""
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join([str(tree / "certeig" / "src"), str(tree / "src")]),
        "EIGENSHAPE_DATA": os.environ.get("EIGENSHAPE_DATA", str(ROOT.parent / "shared" / "data")),
        **variables,
    }
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--turn", "0"]
    with subprocess.Popen(
        [*command, *options],
        cwd=tree,
        env=environment,
        stdout=subprocess.DEVNULL,
        start_new_session=True,
    ) as process:
        try:
            return process.wait(None if "CALLS" in "".join(variables) else LONGEST)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, 9)
            return None


def record_calls(tree: Path, chosen: list[str]) -> dict[str, Counter[str]]:
    """Return, for each function, how many tests of each file call it."""
    calls: dict[str, Counter[str]] = {}
    with tempfile.TemporaryDirectory() as folder:
        run_tests(tree, ["-n", "2", "--dist", "loadfile", *chosen], EIGENSHAPE_CALLS=folder)
        for path in Path(folder).glob("*.json"):
            for function, files in json.loads(path.read_text()).items():
                calls.setdefault(function, Counter()).update(files)
    return calls


def files_for(mutant: Mutant, calls: dict[str, Counter[str]]) -> list[str]:
    """Return the test files that import the mutant's module or call its function, those of its own name first."""
    module = import_name(mutant.module)
    found = calls.get(f"{module}:{mutant.function}", Counter())
    if (
        not found
    ):  # a compiled loop, a constant or a class: the files of its module, or of what imports it
        name = module.rsplit(".", 1)[1]
        users = {
            import_name(path.relative_to(ROOT).as_posix())
            for package in PACKAGES
            for path in (ROOT / package).rglob("*.py")
            if name in path.read_text()
        }
        for function, files in calls.items():
            if function.split(":")[0] in users | {module}:
                found += files
    # Tests that import the module are asked first: what they call of compiled loops nothing records.
    importing = {
        str(path.relative_to(ROOT))
        for path in (ROOT / "tests").rglob("test_*.py")
        if re.search(rf"\b{module}\b", path.read_text())
    }
    own = f"test_{Path(mutant.module).stem.removesuffix('_loops')}.py"
    return sorted(
        {*found, *importing},
        key=lambda file: (not file.endswith(own), file not in importing, -found[file], file),
    )


def main() -> None:
    """Make mutants, test them, and print which survive."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1, help="of the random choice")
    parser.add_argument("--count", type=int, default=50, help="of mutants")
    parser.add_argument("--all", action="store_true", help="run the long tests too")
    parser.add_argument("--list", action="store_true", help="print the mutants and stop")
    parser.add_argument("--calls", type=Path, help="a file that keeps which tests call what")
    parser.add_argument("--only", help="mutants whose text holds this")
    options = parser.parse_args()
    mutants = [
        each for each in sample(options.seed, options.count) if (options.only or "") in str(each)
    ]
    if options.list:
        sys.stdout.writelines(f"{mutant}\n" for mutant in mutants)
        return
    chosen = [] if options.all else ["-m", "not long"]
    survivors = 0
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder, "tree")
        shutil.copytree(ROOT, tree, symlinks=True, ignore=shutil.ignore_patterns(*NOT_COPIED))
        if options.calls and options.calls.exists():
            calls = {
                name: Counter(files)
                for name, files in json.loads(options.calls.read_text()).items()
            }
        else:
            calls = record_calls(tree, [*chosen, "--ignore", "tests/house"])
            if options.calls:
                options.calls.write_text(json.dumps(calls))
        for number, mutant in enumerate(mutants):
            path = tree / mutant.module
            path.write_bytes(mutant.applied())
            files = files_for(mutant, calls)
            # To collect all files takes longer than the first few take to fail.
            code: int | None = 0
            for part in (files[:FIRST_FILES], files[FIRST_FILES:]):
                if part and code in (0, 5):  # all passed, or there was none
                    code = run_tests(tree, ["-x", *chosen, *part])
            shutil.copy2(ROOT / mutant.module, path)
            survives = code in (0, 5)
            survivors += survives
            verdict = "SURVIVES" if survives else "killed" if code else "killed (no end)"
            sys.stdout.write(f"{number + 1:3} {verdict:16} {mutant}\n")
            sys.stdout.flush()
    sys.stdout.write(f"{len(mutants) - survivors} of {len(mutants)} were killed\n")


if __name__ == "__main__":
    main()
