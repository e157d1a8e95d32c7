"""The same digits for any number of threads."""

import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import eigenshape as es
from certeig.kit.threads import VARIABLES, map_in_threads, thread_count, usable_cores
from eigenshape.retrieval.heat.features import describe_views

SHAPE = es.make_creature("fish", n_vertices=800)
CALLS = {
    "describe": lambda: [
        np.concatenate([each.numbers.ravel() for each in es.retrieval.extract_patches(SHAPE)])
    ],
    "views by heat": lambda: [
        descriptor.vectors for descriptor in describe_views(SHAPE, es.retrieval.SCALE_FREE, 3)
    ],
    "kernel": lambda: [es.mesh_laplacian(SHAPE).stiffness.data],
    "geodesic_balls": lambda: [es.geometry.geodesic_balls(SHAPE, 0.1).data],
}


@pytest.fixture(autouse=True)
def default():
    yield
    es.set_threads(None)


@pytest.mark.parametrize("name", CALLS)
def test_digits_do_not_depend_on_the_number_of_threads(name):
    found = []
    for n in (1, 2, 4):
        assert es.set_threads(n) == n
        found.append([array.tobytes() for array in CALLS[name]()])
    assert found[0] == found[1] == found[2]


def test_work_is_shared_and_inner_calls_start_no_more_threads():
    es.set_threads(3)
    names, lock, together = set(), threading.Lock(), threading.Barrier(3, timeout=30)

    def inner(_):
        return threading.get_ident()

    def outer(number):
        together.wait()  # all three run at the same time
        with lock:
            names.add(threading.get_ident())
        return number, set(map_in_threads(inner, range(4))) == {threading.get_ident()}

    assert map_in_threads(outer, range(3)) == [(0, True), (1, True), (2, True)]
    assert len(names) == 3


def test_an_error_is_raised_and_the_next_call_works():
    es.set_threads(2)
    with pytest.raises(ZeroDivisionError):
        map_in_threads(lambda number: 1 / number, [1, 0, 1])
    assert map_in_threads(lambda number: 2 * number, range(5)) == [0, 2, 4, 6, 8]
    assert map_in_threads(len, []) == []


def test_threads_of_the_user_compute_side_by_side():
    es.set_threads(2)
    with ThreadPoolExecutor(3) as pool:
        found = list(pool.map(lambda _: CALLS["describe"]()[0].tobytes(), range(3)))
    assert len(set(found)) == 1


@pytest.mark.parametrize("variable", VARIABLES)
def test_the_environment_variable_counts_until_a_number_is_set(monkeypatch, variable):
    for each in VARIABLES:
        monkeypatch.delenv(each, raising=False)
    monkeypatch.setenv(variable, "3")
    assert thread_count() == 3
    assert es.set_threads(2) == 2
    assert es.set_threads(None) == 3
    monkeypatch.setenv(variable, "many")
    with pytest.raises(
        es.InvalidParameterError, match=f"{variable} must be a whole number of at least 1; it"
    ):
        thread_count()
    monkeypatch.setenv(variable, "")
    assert es.set_threads(None) == usable_cores() >= 1
    with pytest.raises(es.InvalidParameterError, match="n must be at least 1; it is 0"):
        es.set_threads(0)


def test_the_first_variable_that_is_set_counts(monkeypatch):
    for number, variable in enumerate(VARIABLES, 2):
        monkeypatch.setenv(variable, str(number))
    assert es.set_threads(None) == 2
    monkeypatch.setenv(VARIABLES[0], " ")
    assert es.set_threads(None) == 3
