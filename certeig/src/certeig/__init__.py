"""Eigenpairs of large sparse symmetric matrices, with a proof that none is missing.

`eigenpairs(W, B, k=...)` solves W φ = λ B φ for SciPy matrices, and counts what it found by
Sylvester's law of inertia. `certeig.kit` and `certeig.sparse` hold what packages that are built on
certeig share with it: checks of arguments, threads, kernels in C, factors.

Examples
--------
>>> import certeig
>>> from scipy.sparse import diags_array
>>> string = diags_array([2.0, -1.0, -1.0], offsets=[0, 1, -1], shape=(50, 50))
>>> certeig.eigenpairs(string, k=3).certificate.complete
True
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from certeig.certificate import Certificate
    from certeig.kit.errors import (
        CerteigError,
        ConvergenceError,
        FileFormatError,
        InvalidParameterError,
    )
    from certeig.kit.threads import set_threads
    from certeig.solve import certify, count_below, eigenpairs, factorize
    from certeig.sparse.symmetric_factor import SymmetricFactor
    from certeig.spectrum import Spectrum

__version__ = "1.0.0"
__all__ = [
    "CerteigError",
    "Certificate",
    "ConvergenceError",
    "FileFormatError",
    "InvalidParameterError",
    "Spectrum",
    "SymmetricFactor",
    "certify",
    "count_below",
    "eigenpairs",
    "factorize",
    "set_threads",
]
_MODULES = {
    "Certificate": "certificate",
    "Spectrum": "spectrum",
    "SymmetricFactor": "sparse.symmetric_factor",
    "set_threads": "kit.threads",
} | dict.fromkeys(("certify", "count_below", "eigenpairs", "factorize"), "solve")


def __getattr__(name: str) -> Any:
    """Load a public name when it is touched, so that packages that need the kit alone load no SciPy."""
    if name not in __all__:
        raise AttributeError(f"certeig has no attribute {name!r}")
    module = import_module(f"certeig.{_MODULES.get(name, 'kit.errors')}")
    return getattr(module, name)


def __dir__() -> list[str]:
    return __all__
