"""Whatever is public may be used by many threads at once, on the same values, and answers as it does to one."""

import dataclasses
import hashlib
import inspect
import sys
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from threading import Barrier, Event, Thread, local
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from public_names import public_things
from thread_calls import CALLS, LEFT_OUT
from threadpoolctl import threadpool_limits

import eigenshape as es
from certeig.kit.threads import _blas_libraries, one_blas_thread

N_THREADS = 4


# What stands for files and engines is told by its text.
HANDLES = es.retrieval.IndexReader | es.retrieval.FaissEngine


def digest(value: object) -> str:
    """Return a hash of a value to the last bit."""
    return hashlib.sha256(repr(bits(value)).encode()).hexdigest()


def bits(value: Any) -> object:
    """Return what tells a value from any other: all its numbers, and what its properties and `explain` say."""
    told: object
    if isinstance(value, np.ndarray | np.generic):
        told = value.dtype.str, value.shape, np.ascontiguousarray(value).tobytes()
    elif sp.issparse(value):
        rows = value.tocsr()
        told = [bits(part) for part in (rows.indptr, rows.indices, rows.data)]
    elif dataclasses.is_dataclass(value):
        said = value.explain() if hasattr(value, "explain") else ""
        told = type(value).__name__, [bits(getattr(value, name)) for name in names_of(value)], said
    elif isinstance(value, dict):
        told = [(bits(key), bits(entry)) for key, entry in value.items()]
    elif isinstance(value, list | tuple):
        told = [bits(entry) for entry in value]
    elif isinstance(value, frozenset):
        told = sorted(map(repr, value))
    else:
        assert value is None or isinstance(
            value,
            bool | int | float | str | bytes | slice | Path | HANDLES,
        ), type(value)
        told = repr(value)
    return told


def names_of(value: Any) -> list[str]:
    """Return the fields and the public properties of a value."""
    fields = [field.name for field in dataclasses.fields(value)]
    shown = inspect.getmembers(
        type(value), lambda member: isinstance(member, property | cached_property)
    )
    return fields + [name for name, _ in shown if not name.startswith("_")]


@contextmanager
def many_threads() -> Iterator[None]:
    """Let threads change often, and BLAS have several threads of its own."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-3)
    try:
        with threadpool_limits(3, user_api="blas"):
            yield
    finally:
        sys.setswitchinterval(interval)


def in_threads(calls: list[Callable[[], object]]) -> list[object]:
    """Return what each call gives, all of them begun at once."""
    together = Barrier(len(calls))

    def run(call: Callable[[], object]) -> object:
        together.wait()
        return call()

    with ThreadPoolExecutor(len(calls)) as pool:
        return list(pool.map(run, calls))


def test_every_public_function_is_called_or_has_a_reason():
    things = public_things()
    functions = {
        name for name, thing in things.items() if inspect.isfunction(inspect.unwrap(thing))
    }
    assert functions <= CALLS.keys() | LEFT_OUT.keys()
    assert {name.split(".")[0] for name in CALLS} | LEFT_OUT.keys() <= things.keys()


def test_every_method_that_takes_something_is_called():
    # What takes nothing, `explain` and properties, is called for each value that comes up.
    classes = {
        name: thing
        for name, thing in public_things().items()
        if inspect.isclass(thing) and not issubclass(thing, Exception)
    }
    methods = {
        f"{name}.{method}"
        for name, kind in classes.items()
        for method, function in vars(kind).items()
        if not method.startswith("_")
        and not isinstance(function, property | cached_property)
        and callable(getattr(kind, method))
    }
    grouped = CALLS.keys() & classes.keys()  # one call for all methods
    left = {name for name in methods - CALLS.keys() if name.split(".")[0] not in grouped}
    assert {name.split(".")[1] for name in left} <= {"explain"}


def test_four_threads_get_what_one_gets_bit_for_bit(shared, monkeypatch, in_turn):
    monkeypatch.setattr(
        "eigenshape.plot.render.FINER", 1
    )  # pictures without smooth edges, in a quarter of the time
    before = {name: digest(value) for name, value in vars(shared).items()}
    names, wrong = in_turn(CALLS), set()
    with threadpool_limits(1, user_api="blas"):
        alone = {name: digest(CALLS[name](shared)) for name in names}
    with many_threads():
        # Two threads do one thing, and two what comes next in the table.
        for place in range(0, len(names), N_THREADS // 2):
            chosen = [names[(place + thread // 2) % len(names)] for thread in range(N_THREADS)]
            found = in_threads([lambda name=name: digest(CALLS[name](shared)) for name in chosen])
            wrong |= {name for name, seen in zip(chosen, found, strict=True) if seen != alone[name]}
    assert not wrong
    assert {name: digest(value) for name, value in vars(shared).items()} == before


# What decides whether work is worth threads; with these small values it is for every small shape.
SMALL_WORK = {
    "certeig.sparse.tasks.FEWEST_ENTRIES": 500,
    "certeig.sparse.basis.FEWEST_MULTIPLICATIONS": 1,
    "certeig.sparse.basis.COMBINED_ROWS": 64,
    "eigenshape.spectral.multilevel.aggregation.ROWS_A_THREAD": 64,
    "eigenshape.spectral.multilevel.vcycle.ROWS_A_THREAD": 64,
    "eigenshape.spectral.multilevel.residuals.CHUNK_ROWS": 64,
}


def test_the_number_of_threads_changes_no_digit(shared, monkeypatch, in_turn):
    monkeypatch.setattr("eigenshape.plot.render.FINER", 1)
    for place, value in SMALL_WORK.items():
        monkeypatch.setattr(place, value)
    names, found = in_turn(CALLS), []
    try:
        for n in (1, 2, 4):
            es.set_threads(n)
            found.append({name: digest(CALLS[name](shared)) for name in names})
    finally:
        es.set_threads(None)
    wrong = [name for name in names if len({each[name] for each in found}) > 1]
    assert not wrong


def test_two_threads_bend_one_binding(shared):
    handles = [
        es.Rotation(shared.handle.pivot, [0, 0, 1], 0.05 * number) for number in range(1, 21)
    ]
    alone = [es.deformation.bend(shared.binding, [handle]).vertices for handle in handles]
    with many_threads(), ThreadPoolExecutor(2) as pool:
        together = list(
            pool.map(lambda handle: es.deformation.bend(shared.binding, [handle]).vertices, handles)
        )
    np.testing.assert_array_equal(together, alone)


def blas_threads() -> set[int]:
    """Return the numbers of threads of NumPy's and SciPy's BLAS; FAISS brings one of its own."""
    return {library.get_num_threads() for library in _blas_libraries()}


def test_the_first_computation_to_end_leaves_the_others_their_one_blas_thread():
    with threadpool_limits(3, user_api="blas"):
        begun, end = Event(), Event()

        def compute() -> None:
            with one_blas_thread():
                begun.set()
                end.wait()

        with one_blas_thread():
            other = Thread(target=compute)
            other.start()
            begun.wait()
        assert blas_threads() == {1}  # one has ended, the other has not
        end.set()
        other.join()
        assert blas_threads() == {3}


class FakeLibrary:
    """A BLAS that has one number of threads for the process, or one for each thread of Python."""

    def __init__(self, layer: str) -> None:
        self.threading_layer = layer
        self._number = local() if layer == "openmp" else SimpleNamespace()

    def get_num_threads(self) -> int:
        return getattr(self._number, "value", 3)

    def set_num_threads(self, number: int) -> None:
        self._number.value = number


@pytest.mark.parametrize("layer", ["pthreads", "openmp"])
def test_each_thread_has_its_limit_whatever_the_library_and_gets_its_number_back(
    monkeypatch, layer
):
    library = FakeLibrary(layer)
    monkeypatch.setattr("certeig.kit.threads._blas_libraries", lambda: [library])
    entered = Barrier(2)

    def compute(_: int) -> tuple[int, int]:
        with one_blas_thread(), one_blas_thread():
            entered.wait()
            inside = library.get_num_threads()
            entered.wait()
        entered.wait()
        return inside, library.get_num_threads()

    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(compute, range(2))) == [(1, 3), (1, 3)]
    assert library.get_num_threads() == 3


def test_a_computation_that_fails_gives_blas_its_threads_back():
    @one_blas_thread()
    def fail() -> None:
        assert blas_threads() == {1}
        raise KeyError

    with threadpool_limits(3, user_api="blas"):
        with pytest.raises(KeyError):
            fail()
        assert blas_threads() == {3}


def test_threads_that_read_files_leave_the_streams_alone(shared, capsys):
    streams = sys.stdout, sys.stderr

    def print_and_read(number: int) -> None:
        sys.stdout.write(f"line {number}\n")
        es.read_shape(shared.folder / "square.mesh")

    with many_threads(), ThreadPoolExecutor(N_THREADS) as pool:
        list(pool.map(print_and_read, range(60)))
    assert (sys.stdout, sys.stderr) == streams
    captured = capsys.readouterr()
    assert sorted((captured.out + captured.err).split("\n")) == sorted(
        ["", *(f"line {n}" for n in range(60))]
    )


def test_no_comparison_silences_the_warnings_of_another_thread(shared, monkeypatch):
    changed = []
    monkeypatch.setattr(warnings, "simplefilter", lambda *args, **kwargs: changed.append(args))
    monkeypatch.setattr(warnings, "filterwarnings", lambda *args, **kwargs: changed.append(args))
    CALLS["compare_shapes"](shared)
    assert [args for args in changed if args[0] != "error"] == []
