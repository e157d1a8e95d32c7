"""What tests take from the entries of `es.operators.OPERATORS`, so that a new operator is tested by its entry."""

import inspect
from collections.abc import Callable
from functools import partial

import scipy.sparse as sp

import eigenshape as es


def builders() -> dict[str, es.operators.Operator]:
    """Return the entries that are built by one public function, by the name of the function."""
    return {
        entry.build.__name__: entry
        for entry in es.operators.OPERATORS.values()
        if inspect.isfunction(entry.build)
    }


def of_surfaces() -> dict[str, Callable[..., es.Laplacian]]:
    """Return the operators that measure triangles, by name; those of graphs only join them."""
    return {
        name: entry.build
        for name, entry in es.operators.OPERATORS.items()
        if es.TriangleMesh in entry.shapes and sp.sparray not in entry.shapes
    }


def function_of(build: Callable[..., es.Laplacian]) -> Callable[..., es.Laplacian]:
    """Return the function that builds an operator, without the arguments that its entry fixes."""
    return build.func if isinstance(build, partial) else inspect.unwrap(build)
