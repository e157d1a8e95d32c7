"""The solvers of the census, each as its users call it; starting vectors come from a seed, so that a run repeats."""

import inspect
import sys
from collections.abc import Callable
from importlib import import_module

import lapy
import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from census_shapes import Case

import eigenshape as es

# Parts below a hundred points, which equal components have, leave no room for a search.
DENSE_SWITCHES = {"DENSE_POINTS": 100, "DENSE_LIMIT": 0}
TAKES_RNG = "rng" in inspect.signature(spl.eigsh).parameters


def always_sparse() -> None:
    """Turn off the switches by which `solve_spectrum` solves small operators densely.

    They are no public names. So no more than one case in ten may lean on this: most are large enough to
    be solved sparsely anyway, and `Ours` counts the solves of whole operators that were dense all the same.
    """
    roads = import_module("certeig.solver.strategy")
    for name, value in DENSE_SWITCHES.items():
        getattr(roads, name)  # renamed, it would be set in vain
        setattr(roads, name, value)


class Ours:
    """`solve_spectrum`, counting by its progress messages how many solves were dense."""

    def __init__(self) -> None:
        self.dense = 0

    def __call__(self, case: Case, k: int, seed: int) -> np.ndarray:
        """Return k certified eigenvalues."""
        messages: list[str] = []
        spectrum = es.solve_spectrum(
            case.laplacian, k, progress=lambda done, message: messages.append(message)
        )
        self.dense += any("dense" in message for message in messages)
        return spectrum.eigenvalues


def arpack(sigma: float) -> Callable[[Case, int, int], np.ndarray]:
    """Return ARPACK in shift-invert mode at a fixed shift, through scipy with its default tolerance."""

    def solve(case: Case, k: int, seed: int) -> np.ndarray:
        stiffness, mass = case.laplacian.stiffness.tocsc(), case.laplacian.mass.tocsc()
        return spl.eigsh(stiffness, k, mass, sigma=sigma, **_start(case.laplacian.n_points, seed))[
            0
        ]

    return solve


def _start(n: int, seed: int) -> dict[str, object]:
    # ARPACK's own start is uniform in -1..1 as well, only not repeatable.
    rng = np.random.default_rng(seed)
    return {"v0": rng.uniform(-1, 1, n)} | ({"rng": rng} if TAKES_RNG else {})


def lapy_eigs(case: Case, k: int, seed: int) -> np.ndarray:
    """Return what LaPy's solver does on its own matrices."""
    return _lapy_solver(case).eigs(k, rng=seed)[0]


def _lapy_solver(case: Case) -> lapy.Solver:
    mesh = lapy.TriaMesh(np.array(case.mesh.vertices), np.array(case.mesh.faces))
    return lapy.Solver(mesh, lump=case.mass == "lumped")


def has_lapy(case: Case) -> bool:
    """Tell whether LaPy has this operator, with the same matrices up to rounding."""
    if case.mesh is None or not sys.modules.get("lapy"):
        return False
    solver = _lapy_solver(case)
    pairs = (solver.stiffness, case.laplacian.stiffness), (solver.mass, case.laplacian.mass)
    return all(
        abs(sp.csr_array(theirs) - ours).max() <= 1e-12 * abs(ours).max() for theirs, ours in pairs
    )


def dense(case: Case) -> np.ndarray:
    """Return all eigenvalues, by LAPACK."""
    roots = np.sqrt(case.laplacian.mass.diagonal())
    scale = np.outer(roots, roots)  # unit diagonal: the least rounding
    return sl.eigh(
        case.laplacian.stiffness.toarray() / scale,
        case.laplacian.mass.toarray() / scale,
        eigvals_only=True,
    )


SOLVERS: dict[str, Callable[[Case, int, int], np.ndarray]] = {
    "eigenshape": Ours(),
    "ARPACK, σ = -0.01": arpack(-0.01),
    "ARPACK, σ = 1e-8": arpack(1e-8),
    "LaPy": lapy_eigs,
}
