"""Our solver in LaPy's place, and out of it again."""

import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from types import ModuleType

import lapy
import lapy.shapedna
import lapy.solver
import numpy as np
import pytest

import eigenshape as es
from eigenshape.compat.lapy import Solver, install, uninstall

THEIRS = lapy.Solver


@pytest.fixture(autouse=True)
def _theirs_again() -> Iterator[None]:
    yield
    while issubclass(lapy.Solver, Solver):  # THEIRS of this module is replaced, too
        uninstall()


def mesh() -> lapy.TriaMesh:
    ball = es.icosphere(2)
    return lapy.TriaMesh(ball.vertices.copy(), ball.faces.copy())


def test_every_place_gets_ours_and_theirs_again(monkeypatch):
    elsewhere = ModuleType("elsewhere")
    elsewhere.Laplace = THEIRS
    monkeypatch.setitem(sys.modules, "elsewhere", elsewhere)
    places = [
        (lapy, "Solver"),
        (lapy.solver, "Solver"),
        (lapy.shapedna, "Solver"),
        (elsewhere, "Laplace"),
    ]
    install()
    assert all(issubclass(getattr(*place), Solver) for place in places)
    elsewhere.Later = lapy.Solver  # a module that is imported in the meantime
    uninstall()
    assert all(getattr(*place) is THEIRS for place in [*places, (elsewhere, "Later")])
    assert es.compat.lapy.Solver is Solver


def test_ours_stays_until_each_call_is_undone():
    install()
    install()
    uninstall()
    assert issubclass(lapy.Solver, Solver)
    uninstall()
    assert lapy.Solver is THEIRS
    uninstall()  # one too many changes nothing
    install()
    assert issubclass(lapy.Solver, Solver)
    uninstall()
    assert lapy.Solver is THEIRS


def test_many_threads_put_ours_in_place_and_theirs_back():
    class Child(lapy.Solver):
        pass

    def use(_):
        install()
        found = lapy.Solver, lapy.shapedna.Solver, Child.__mro__[1]
        uninstall()
        return found

    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(8) as threads:
            found = list(threads.map(use, range(200)))
    finally:
        sys.setswitchinterval(before)
    assert all(issubclass(each, Solver) for classes in found for each in classes)
    assert lapy.Solver is lapy.shapedna.Solver is Child.__mro__[1] is THEIRS


def test_what_inherits_from_theirs_inherits_from_ours():
    class Child(lapy.Solver):
        pass

    before = Child(mesh(), lump=True).eigs(4)[0]
    install()
    assert Child.__mro__[2] is Solver
    after, vectors = Child(mesh(), lump=True).eigs(4)
    np.testing.assert_allclose(after, before, atol=1e-12)
    assert np.array_equal(vectors, Solver(mesh(), lump=True).eigs(4)[1])
    uninstall()
    assert Child.__mro__[1] is THEIRS


def test_a_function_of_lapy_computes_with_ours():
    install()
    found = lapy.shapedna.compute_shapedna(mesh(), k=5)
    assert np.array_equal(found["Eigenvectors"], Solver(mesh()).eigs(5)[1])


def test_without_lapy_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "lapy", None)
    with pytest.raises(es.MissingExtraError, match=r"needs LaPy; it is not installed\. Run pip"):
        install()
