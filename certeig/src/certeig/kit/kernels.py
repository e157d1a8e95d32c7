"""Kernels: loops in C, each declared in Python by a function without a body.

    @kernel("n", "k")
    def add_rows(
        rows: Float64[np.ndarray, "n k"], share: float, sums: Out[Float64[np.ndarray, " k"]]
    ) -> bool:
        '''Add the rows to `sums`.'''

declares `bool add_rows(const double *rows, double share, double *sums, int64_t n, int64_t k)`: after
the arguments follow the lengths that the decorator names. In C

    Float64[np.ndarray, "n k"]   is the address of the first entry, of constants if not in `Out`,
    int, float, bool             are int64_t, double, bool,
    tuple[...]                   is the address of a struct of addresses,
    list[Float64[...]]           is the address of the addresses of its arrays,
    -> tuple[int, float]         is a struct, returned by value.

A length is a name, a number, or an expression such as `n+1` of lengths and of arguments; `_` is any
length. Each call checks types, order and lengths of its arrays, which C cannot, and that
what is in `Out` may be written to. It copies nothing, and lets other threads run.
"""

import ctypes
import os
import sys
from collections.abc import Callable
from functools import cache
from inspect import get_annotations
from operator import index
from pathlib import Path
from typing import Annotated, Any, NoReturn, TypeVar, get_args, get_origin

import numpy as np

FOLDER = "_libraries"  # of a package, with its kernels compiled for several levels of processors
# The path of a library to use in place of those, such as one with the checks of a sanitizer
VARIABLE = "CERTEIG_KERNELS"
REMEDY = (
    "run `python certeig/hatch_build.py` in the folder of the sources, or install the package again"
)
NUMBERS = {int: ctypes.c_int64, float: ctypes.c_double, bool: ctypes.c_bool, None: None}

A = TypeVar("A")
Out = Annotated[A, "is written to"]
Stub = TypeVar("Stub", bound=Callable[..., Any])


def kernel(*lengths: str) -> Callable[[Stub], Stub]:
    """Bind a declaration to the C function of its name, which takes these lengths last."""

    def bind(stub: Stub) -> Stub:
        kinds: dict[str, Any] = get_annotations(stub)
        result = kinds.pop("return")
        function = _find(stub)
        function.argtypes = [NUMBERS.get(kind, ctypes.c_void_p) for kind in kinds.values()]
        function.argtypes += [ctypes.c_int64] * len(lengths)
        writer = _CallWriter(stub.__name__, kinds)
        passed = [writer.pass_on(name, kind) for name, kind in kinds.items()]
        returned = f"_function({', '.join([*passed, *lengths])})"
        if get_origin(result) is tuple:
            function.restype = _structure(get_args(result))
            returned += ".values()"
        else:
            function.restype = NUMBERS[result]
        # Written out, as dataclasses do it: checks in a loop take 1.5 times as long.
        head = f"def {stub.__name__}({', '.join(kinds)}):"
        lines = [head, *writer.types, *writer.shapes, f"return {returned}"]
        scope = writer.scope | {"_function": function}
        exec("\n    ".join(lines), scope)
        call = scope[stub.__name__]
        call.__module__, call.__doc__ = stub.__module__, stub.__doc__
        call.declaration = stub, lengths
        return call

    return bind


class _CallWriter:
    """Write the lines of a call that check its arguments."""

    def __init__(self, kernel: str, kinds: dict[str, Any]) -> None:
        self.kernel = kernel
        self.types: list[str] = []  # these lines also give the lengths their values
        self.shapes: list[str] = []
        self.scope: dict[str, Any] = {
            "_ndarray": np.ndarray,
            "_index": index,
            "_refuse": _refuse,
            "_address": _choose_address(),
            "_addresses": lambda found: (ctypes.c_void_p * len(found))(*found),
        }
        # Names that lengths can be computed from
        self.known = {name for name, kind in kinds.items() if kind is int}

    def pass_on(self, name: str, kind: Any) -> str:
        """Write the checks of an argument, and return what is passed on to C."""
        if kind is int:
            return f"_index({name})"
        if kind in NUMBERS:
            return name
        if get_origin(kind) is tuple:
            return self._pass_tuple(name, get_args(kind))
        if get_origin(kind) is list:
            return self._pass_list(name, get_args(kind)[0])
        if get_origin(kind) is Annotated:
            return self._pass_array(name, get_args(kind)[0], is_written=True)
        return self._pass_array(name, kind, is_written=False)

    def _pass_tuple(self, name: str, kinds: tuple[Any, ...]) -> str:
        parts = [f"{name}_{place}" for place in range(len(kinds))]
        wanted = f"{self.kernel}: {name} must be a tuple of {len(kinds)}"
        self.types += [
            f"if len({name}) != {len(kinds)}: _refuse({wanted!r}, {name})",
            f"{', '.join(parts)}, = {name}",
        ]
        passed = [self.pass_on(part, kind) for part, kind in zip(parts, kinds, strict=True)]
        self.scope[f"_struct_{name}"] = ctypes.c_void_p * len(kinds)
        return f"_struct_{name}({', '.join(passed)})"

    def _pass_list(self, name: str, kind: Any) -> str:
        each, kept = f"each_of_{name}", (self.types, self.shapes)
        self.types, self.shapes = [], []
        passed = self._pass_array(each, kind, is_written=False)
        checks = [*self.types, *self.shapes, f"_{name}.append({passed})"]
        self.types, self.shapes = kept
        # All lengths are known there.
        self.shapes += [f"_{name} = []", f"for {each} in {name}:", *(f"    {c}" for c in checks)]
        return f"_addresses(_{name})"

    def _pass_array(self, name: str, kind: Any, *, is_written: bool) -> str:
        dtype, lengths = kind.dtypes[-1].rstrip("_"), kind.dim_str.split()
        wanted = (
            f"{self.kernel}: {name} must be a contiguous array of {dtype} "
            f"with {len(lengths)} dimensions, {kind.dim_str.strip()}"
        )
        if is_written:
            wanted += ", that can be written to"
        self.scope[f"_{dtype}"] = np.dtype(dtype)
        flag = "carray" if is_written else "c_contiguous"
        self.types.append(
            f"if not isinstance({name}, _ndarray) or {name}.dtype != _{dtype} "
            f"or {name}.ndim != {len(lengths)} or not {name}.flags.{flag}: "
            f"_refuse({wanted!r}, {name})"
        )
        expected = []
        for axis, length in enumerate(lengths):
            found = f"{name}.shape[{axis}]"
            if length == "_":
                expected.append(found)
                continue
            expected.append(length)
            first, _, more = length.partition("+")  # n+1 gives n its value, too
            if first.isidentifier() and first not in self.known:
                self.known.add(first)
                self.types.append(f"{first} = {found} - {more or 0}")
        shape = f"({', '.join(expected)},)"
        self.shapes.append(f"if {name}.shape != {shape}: _refuse({wanted!r}, {name}, {shape})")
        return f"_address({name})"


def _refuse(wanted: str, value: Any, shape: tuple[int, ...] | None = None) -> NoReturn:
    """Raise an error that says what came in place of what is wanted."""
    if not isinstance(value, np.ndarray):
        raise TypeError(f"{wanted}; it is {value!r:.80}.")
    if shape:
        raise ValueError(f"{wanted}, here {shape}; its shape is {value.shape}.")
    order = "" if value.flags.c_contiguous else ", not contiguous"
    lock = "" if value.flags.writeable else ", read-only"
    raise TypeError(f"{wanted}; it is {value.dtype} of shape {value.shape}{order}{lock}.")


def _structure(kinds: tuple[Any, ...]) -> type[ctypes.Structure]:
    """Return the struct of several results."""
    fields = [(f"result_{place}", NUMBERS[kind]) for place, kind in enumerate(kinds)]

    def values(self: ctypes.Structure) -> tuple[Any, ...]:
        return tuple(getattr(self, name) for name, _ in fields)

    return type("Results", (ctypes.Structure,), {"_fields_": fields, "values": values})


@cache
def _choose_address() -> Callable[[np.ndarray], int]:
    """Return a function that tells where an array keeps its entries.

    Reading the first field of the array's structure, as extensions in C do, takes a fifth of the time
    of `.ctypes.data`.
    """
    read, offset = ctypes.c_void_p.from_address, object.__basicsize__

    def read_field(array: np.ndarray) -> Any:
        return read(id(array) + offset).value

    def ask(array: np.ndarray) -> int:
        return array.ctypes.data

    probes = np.zeros(5), np.zeros((2, 3), np.int32)[1:]
    return read_field if all(read_field(probe) == ask(probe) for probe in probes) else ask


@cache
def math_functions(*names: str) -> Any:  # a tuple of as many addresses as names
    """Return the addresses of functions of the C library, such as exp, for kernels that take them.

    A kernel that called them itself would be tied to one C library.
    """
    libraries = {"nt": "ucrtbase", "posix": None}  # None is what this process has loaded
    library = ctypes.CDLL(libraries[os.name])
    addresses = [ctypes.cast(library[name], ctypes.c_void_p).value for name in names]
    return tuple(address for address in addresses if address)


def _find(stub: Callable[..., Any]) -> Any:
    """Return the C function of a declaration."""
    package = Path(str(sys.modules[stub.__module__.partition(".")[0]].__file__)).parent
    library, path = load_library(package)
    # In an editable install the sources may have changed since the library was built.
    folder = Path(str(sys.modules[stub.__module__].__file__)).parent
    newest = _newest_source(package, folder)
    is_stale = newest is not None and newest.stat().st_mtime > path.stat().st_mtime
    if is_stale and VARIABLE not in os.environ:
        raise ImportError(f"The kernels in {path} are older than their source {newest}; {REMEDY}.")
    try:
        return library[stub.__name__]
    except AttributeError as err:
        raise ImportError(f"{path} has no kernel {stub.__name__}; {REMEDY}.") from err


@cache
def _newest_source(package: Path, folder: Path) -> Path | None:
    """Return the newest file that kernels of a folder are compiled from; wheels hold none."""
    sources = [*folder.glob("*.[ch]"), *package.glob("*.h"), *Path(__file__).parent.glob("*.h")]
    return max(sources, key=lambda file: file.stat().st_mtime, default=None)


@cache
def load_library(package: Path) -> tuple[ctypes.CDLL, Path]:
    """Load the library of a package for this processor; a call of `CDLL` lets other threads run."""
    if VARIABLE in os.environ:
        path = Path(os.environ[VARIABLE])
        return ctypes.CDLL(str(path)), path
    folder = package / FOLDER
    libraries = {int(path.stem.rpartition("-")[2]): path for path in folder.glob("kernels-*")}
    if not libraries:
        raise ImportError(f"There are no kernels in {folder}; {REMEDY}.")
    lowest = ctypes.CDLL(str(libraries[min(libraries)]))
    level = lowest.processor_level()
    path = libraries[max(each for each in libraries if each <= level or each == min(libraries))]
    return ctypes.CDLL(str(path)), path
