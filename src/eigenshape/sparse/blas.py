"""Where SciPy's BLAS lies in memory, for kernels that call it on parts of arrays in place."""

import ctypes
from functools import cache

from scipy.linalg import cython_blas


@cache
def blas_routines() -> tuple[int, int]:
    """Return the addresses of dgemm and dtrsm in this process.

    SciPy exports its routines to Cython as capsules, each with the signature as its name.
    """
    name_of, address_of = ctypes.pythonapi.PyCapsule_GetName, ctypes.pythonapi.PyCapsule_GetPointer
    name_of.argtypes, name_of.restype = [ctypes.py_object], ctypes.c_char_p
    address_of.argtypes, address_of.restype = [ctypes.py_object, ctypes.c_char_p], ctypes.c_void_p
    dgemm, dtrsm = (cython_blas.__pyx_capi__[name] for name in ("dgemm", "dtrsm"))
    return address_of(dgemm, name_of(dgemm)), address_of(dtrsm, name_of(dtrsm))
