"""Kernels: what declarations say agrees with the sources in C, and wrong calls are named."""

import ctypes
import importlib
import os
import re
import subprocess
import tempfile
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, get_args, get_origin

import hatch_build
import numpy as np
import pytest
from jaxtyping import Float64

import certeig
import eigenshape
from certeig.kit import kernels
from certeig.sparse import basis_loops as basis
from certeig.sparse import dissection_loops as dissection
from certeig.sparse import symbolic_loops as symbolic

PACKAGES = [Path(package.__file__).parent for package in (certeig, eigenshape)]
FOLDERS = [PACKAGES[0] / "kit", *PACKAGES]  # where sources look for headers
SOURCES = [source for package in PACKAGES for source in sorted(package.rglob("*_loops.c"))]
NUMBERS = {int: "int64_t", float: "double", bool: "bool", None: "void"}
ENTRIES = {"float64": "double", "float32": "float", "bool": "bool"}


def module_of(source):
    package = next(each for each in PACKAGES if source.is_relative_to(each))
    name = ".".join(source.relative_to(package.parent).with_suffix("").parts)
    return importlib.import_module(name)


def text_of(source):
    """Return the text of a source and of the headers that it includes, without comments."""
    names = re.findall(r'#include "(.*)"', source.read_text())
    headers = [next(f / name for f in FOLDERS if (f / name).exists()) for name in names]
    texts = [*map(text_of, headers), source.read_text()]
    return re.sub(r"/\*.*?\*/", "", "\n".join(texts), flags=re.DOTALL)


def prototypes(text):
    """Return what each kernel returns and takes, one space between words."""
    found = {}
    for kind, name, arguments in re.findall(
        r"^KERNEL\s+([\w ]+?)\s+\**(\w+)\(([^{]*?)\)\s*\{", text, re.MULTILINE
    ):
        parts = re.split(r",(?![^()]*\))", arguments)
        found[name] = kind, [" ".join(part.split()) for part in parts]
    return found


def members(text, struct):
    """Return the types of the members of a struct; that of a function is its result's."""
    body = re.search(rf"struct {struct} \{{(.*?)\}};", text, re.DOTALL)[1]
    found = []
    for line in filter(None, map(str.strip, body.split(";"))):
        kind = re.match(r"(const )?\w+", line)[0]
        found += [kind] if "(*" in line else [kind] * (line.count(",") + 1)
    return found


def type_of_entries(kind):
    """Return the type of entries in C."""
    written = get_origin(kind) is Annotated
    dtype = str(np.dtype((get_args(kind)[0] if written else kind).dtypes[-1]))
    return ("" if written else "const ") + ENTRIES.get(dtype, f"{dtype}_t")


def agrees(kind, declared, text):
    if kind in NUMBERS:
        return re.fullmatch(rf"{NUMBERS[kind]} \w+", declared)
    if get_origin(kind) is tuple:
        struct = re.fullmatch(r"const struct (\w+) \*\w+", declared)
        in_c = members(text, struct[1])
        # A number is the address of a function
        wanted = [in_c[i] if k is int else type_of_entries(k) for i, k in enumerate(get_args(kind))]
        return in_c == wanted
    if get_origin(kind) is list:
        name = type_of_entries(get_args(kind)[0])
        return re.fullmatch(rf"{name} \*const \*\w+", declared)
    name = type_of_entries(kind)
    # Rows of eight numbers have a type of their own
    name = name.replace("double", "(?:double|eight)")
    return re.fullmatch(rf"{name} (?:\*\w+|\(\*\w+\)(?:\[\w+\])+)", declared)


@pytest.mark.parametrize("source", SOURCES, ids=lambda source: source.stem)
def test_declarations_are_those_of_the_sources(source):
    module, text = module_of(source), text_of(source)
    declared = {
        name: value.declaration
        for name, value in vars(module).items()
        if hasattr(value, "declaration") and value.__module__ == module.__name__
    }
    found = prototypes(text)
    assert set(declared) == set(found)
    for name, (stub, lengths) in declared.items():
        kinds = dict(stub.__annotations__)
        result = kinds.pop("return")
        returned, arguments = found[name]
        if get_origin(result) is tuple:
            kinds_in_c = members(text, re.fullmatch(r"struct (\w+)", returned)[1])
            assert kinds_in_c == [NUMBERS[kind] for kind in get_args(result)], name
        else:
            assert returned == NUMBERS[result], name
        assert len(arguments) == len(kinds) + len(lengths), name
        for (argument, kind), in_c in zip(kinds.items(), arguments[: len(kinds)], strict=True):
            assert in_c.endswith(argument) or f"*{argument})" in in_c, (name, argument, in_c)
            assert agrees(kind, in_c, text), (name, argument, in_c)
        assert arguments[len(kinds) :] == [f"int64_t {length}" for length in lengths], name


@pytest.mark.parametrize("source", SOURCES, ids=lambda source: source.stem)
def test_constants_of_both_languages_are_equal(source):
    module = module_of(source)
    for name, value in re.findall(r"\b([A-Z][A-Z_]+) = ([\d.e-]+)", text_of(source)):
        assert getattr(module, name, float(value)) == float(value), name


KERNELS = [
    value
    for source in SOURCES
    for value in vars(module_of(source)).values()
    if hasattr(value, "declaration")
]


def example(kind, sizes):
    """Return an argument of a kind: arrays of zeros, with lengths by name."""
    if get_origin(kind) in (tuple, list):
        return get_origin(kind)(example(part, sizes) for part in get_args(kind))
    if kind in NUMBERS:
        return kind(20)
    if get_origin(kind) is Annotated:
        kind = get_args(kind)[0]
    shape = [5 if name == "_" else eval(name, {}, sizes) for name in kind.dim_str.split()]
    return np.zeros(shape, np.dtype(kind.dtypes[-1]))


class Sizes(dict):
    """Lengths of examples: another one for each name."""

    def __missing__(self, name):
        return self.setdefault(name, 16 + len(self))


def damaged(array):
    """Return arrays that differ from one in type, in the number of dimensions and in order."""
    yield array.astype(np.complex128)
    yield array[None]
    if array.size:  # without entries there is no order
        yield np.zeros([*array.shape[:-1], 2 * array.shape[-1]], array.dtype)[..., ::2]


@pytest.mark.parametrize("kernel", KERNELS, ids=lambda kernel: kernel.__name__)
def test_every_kernel_refuses_wrong_arrays(kernel, monkeypatch):
    calls = []
    monkeypatch.setitem(
        kernel.__globals__,
        "_function",
        lambda *passed: calls.append(passed) or SimpleNamespace(values=tuple),
    )
    stub, lengths = kernel.declaration
    kinds = {name: kind for name, kind in stub.__annotations__.items() if name != "return"}
    # Ascending, so that a length such as end-begin is one of several entries
    wholes = [name for name, kind in kinds.items() if kind is int]
    sizes = Sizes({name: 4 * place for place, name in enumerate(wholes, 1)})
    right = [
        sizes[name] if name in wholes else example(kind, sizes) for name, kind in kinds.items()
    ]
    kernel(*right)
    assert calls.pop()[len(kinds) :] == tuple(sizes[length] for length in lengths)

    for place, argument in enumerate(right):
        together = isinstance(argument, tuple | list)
        parts = list(argument) if together else [argument]
        for part, array in enumerate(parts):
            for wrong in damaged(array) if isinstance(array, np.ndarray) else ():
                others = [*parts[:part], wrong, *parts[part + 1 :]]
                changed = type(argument)(others) if together else wrong
                with pytest.raises(TypeError, match=rf"{kernel.__name__}: .* must be a contiguous"):
                    kernel(*right[:place], changed, *right[place + 1 :])
    assert not calls


def whole(n):
    return np.zeros(n, dtype=np.int64)


def join_runs(**changed):
    """Call a kernel with arguments of which one is wrong."""
    right = {
        "parent": np.array([1, 2, -1]),
        "first": whole(3),
        "heights": whole(3),
        "widths": whole(3),
        "zeros": np.zeros(3),
        "keep": np.ones(3, dtype=bool),
    }
    symbolic.join_runs(**(right | changed))


READ_ONLY = whole(3)
READ_ONLY.flags.writeable = False


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"zeros": np.zeros(3, np.float32)}, "zeros must be a contiguous array of float64 .*; it is float32"),
        ({"first": [0, 1, 2]}, r"join_runs: first must .*; it is \[0, 1, 2\]"),
        ({"first": None}, "join_runs: first must .*; it is None"),
        ({"first": np.zeros(3, np.int32)}, "first must be a contiguous array of int64 .*; it is int32"),
        ({"first": whole(6)[::2]}, r"first must .*; it is int64 of shape \(3,\), not contiguous"),
        ({"first": whole((3, 1))}, r"first must .* with 1 dimensions, size; it is int64 of shape \(3, 1\)"),
        ({"heights": READ_ONLY}, r"heights must .* be written to; it is .*, read-only"),
        ({"widths": whole(4)}, r"widths must .*, here \(3,\); its shape is \(4,\)"),
        ({"keep": np.ones(2, dtype=bool)}, r"keep must .*, here \(3,\); its shape is \(2,\)"),
        ({"keep": whole(3)}, "keep must be a contiguous array of bool .*; it is int64"),
        ({"more": 3}, "join_runs.* got an unexpected keyword argument 'more'"),
    ],
)  # fmt: skip
def test_wrong_arguments_are_named(changed, message):
    with pytest.raises((TypeError, ValueError), match=message):
        join_runs(**changed)


def test_lengths_may_be_expressions():
    space, columns, parts = np.zeros((2, 5, 8)), np.zeros((1, 5, 8)), np.zeros((1, 15, 8))
    with pytest.raises(ValueError, match=r"parts must .*slots\*8 8.*, here \(1, 16, 8\);"):
        basis.add_products(space, columns, parts, 0, 2)


def test_numbers_must_be_whole():
    with pytest.raises(TypeError, match="'float' object cannot be interpreted as an integer"):
        dissection.cheapest_cut(2.5, whole(2), whole(2), whole(2))


def test_several_results_are_a_tuple():
    counts = np.array([0, 1, 1]), np.array([1, 0, 0]), np.array([1, 1, 0])
    assert dissection.cheapest_cut(2, *counts) == (1, True, 2.0)


def test_kernels_that_are_missing_or_old_say_what_to_run(tmp_path, monkeypatch):
    with pytest.raises(
        ImportError, match=r"no kernels in .*; run `python certeig/hatch_build\.py`"
    ):
        kernels.load_library.__wrapped__(tmp_path)
    monkeypatch.setattr(kernels, "load_library", lambda package: (None, tmp_path))
    os.utime(tmp_path, (1, 1))
    monkeypatch.delenv(kernels.VARIABLE, raising=False)
    with pytest.raises(ImportError, match=r"older than their source .*\.[ch]; run"):
        kernels._find(dissection.order_leaf)


def test_a_kernel_that_is_missing_is_named(monkeypatch):
    def unknown_kernel(): ...

    unknown_kernel.__module__ = dissection.__name__
    with pytest.raises(
        ImportError, match=r"has no kernel unknown_kernel; run `python certeig/hatch_build\.py`"
    ):
        kernels._find(unknown_kernel)


def test_a_new_kernel_is_compiled_declared_and_called(tmp_path, monkeypatch):
    pytest.importorskip("ziglang")
    source = tmp_path / "new_loops.c"
    source.write_text(
        '#include "kernels.h"\n'
        "KERNEL bool add_rows(const double (*rows)[3], double share, double *sums, int64_t n) {\n"
        "    for (int64_t i = 0; i < n; i++)\n"
        "        for (int c = 0; c < 3; c++) sums[c] += share * rows[i][c];\n"
        "    return n > 0;\n}\n"
    )
    target = hatch_build.TARGETS[hatch_build.target_name()]
    library = tmp_path / "new.so"
    hatch_build.compile_library(target, min(target.processors), library, [tmp_path])
    monkeypatch.setattr(
        kernels, "load_library", lambda package: (ctypes.CDLL(str(library)), library)
    )

    @kernels.kernel("n")
    def add_rows(
        rows: Float64[np.ndarray, "n 3"],
        share: float,
        sums: kernels.Out[Float64[np.ndarray, " 3"]],
    ) -> bool: ...

    rows, sums = np.random.default_rng(0).random((7, 3)), np.zeros(3)
    assert add_rows(rows, 0.5, sums)
    np.testing.assert_allclose(sums, rows.sum(axis=0) / 2)


@pytest.mark.long
@pytest.mark.parametrize("name", hatch_build.TARGETS)
def test_the_kernels_compile_for_every_platform(name, tmp_path):
    pytest.importorskip("ziglang")
    target = hatch_build.TARGETS[name]
    library = tmp_path / "kernels.so"
    hatch_build.compile_library(target, min(target.processors), library, hatch_build.PACKAGES)
    content = library.read_bytes()
    assert len(content) > 10_000
    assert f"{tempfile.gettempdir()}{os.sep}".encode() not in content  # where it was linked


def test_a_kernel_has_a_frame_of_less_than_a_page(tmp_path):
    pytest.importorskip("ziglang")
    source = tmp_path / "large_loops.c"
    source.write_text(
        '#include "kernels.h"\n'
        "KERNEL void reverse(int64_t *numbers) {\n"
        "    volatile int64_t all[513];\n"
        "    for (int i = 0; i < 513; i++) all[i] = numbers[i];\n"
        "    for (int i = 0; i < 513; i++) numbers[i] = all[512 - i];\n}\n"
    )
    target = hatch_build.TARGETS[hatch_build.target_name()]
    with pytest.raises(SystemExit, match="kernels cannot be compiled"):
        hatch_build.compile_library(
            target, min(target.processors), tmp_path / "large.so", [tmp_path]
        )


def test_sources_have_one_layout():
    clang_format = pytest.importorskip("clang_format")
    root = Path(hatch_build.__file__).parents[1]
    sources = [path for package in PACKAGES for path in package.rglob("*.[ch]")]
    command = [clang_format.get_executable("clang-format"), "--dry-run", "--Werror", *sources]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
