"""Where SciPy's BLAS and LAPACK lie in memory, for kernels that call it on parts of arrays in place."""

import ctypes
from functools import cache

from scipy.linalg import cython_blas, cython_lapack


@cache
def blas_routine(name: str) -> int:
    """Return the address of a routine in this process.

    SciPy exports its routines to Cython as capsules, each with the signature as its name.
    """
    name_of, address_of = ctypes.pythonapi.PyCapsule_GetName, ctypes.pythonapi.PyCapsule_GetPointer
    name_of.argtypes, name_of.restype = [ctypes.py_object], ctypes.c_char_p
    address_of.argtypes, address_of.restype = [ctypes.py_object, ctypes.c_char_p], ctypes.c_void_p
    capsule = (cython_blas.__pyx_capi__ | cython_lapack.__pyx_capi__)[name]
    return int(address_of(capsule, name_of(capsule)))
