"""Where blocks of columns are multiplied: numpy and compiled loops on the CPU, CuPy on a GPU."""

import warnings
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
import scipy.sparse as sp

from eigenshape._errors import InvalidParameterError
from eigenshape.spectral.multilevel import multilevel_loops as loops

NAMES = ("cpu", "gpu")
CPU_ROWS, GPU_ROWS = 4096, 2**20

Array = Any  # of numpy or of CuPy


@dataclass(frozen=True, eq=False)
class Device:
    """A pair of array libraries with the same calls.

    Attributes
    ----------
    name : "cpu" or "gpu"
    arrays : module
        numpy, or CuPy.
    sparse : module
        scipy.sparse, or cupyx.scipy.sparse.
    rows : int
        How many rows of tall products to form at once: as many as its cache holds, or as keep it busy.
    """

    name: str
    arrays: Any
    sparse: Any
    rows: int


CPU = Device("cpu", np, sp, CPU_ROWS)


def open_device(name: str) -> Device:
    """Return a device by name; where there is no GPU to be used, the CPU, with a warning.

    Raises
    ------
    InvalidParameterError
        If the name is not one of "cpu" and "gpu".
    """
    if name not in NAMES:
        raise InvalidParameterError(f"device must be 'cpu' or 'gpu'; it is {name!r}.")
    if name == "cpu":
        return CPU
    try:
        arrays, sparse = import_module("cupy"), import_module("cupyx.scipy.sparse")
        count = arrays.cuda.runtime.getDeviceCount()
    except ImportError as error:
        return _without_gpu(
            f"CuPy is missing ({error}). Install it with pip install 'eigenshape[gpu]'"
        )
    except Exception as error:  # noqa: BLE001  (the driver's errors are CuPy's own classes)
        return _without_gpu(
            f"CuPy finds no GPU that it can use ({error}). Install the driver of a CUDA GPU"
        )
    return (
        Device("gpu", arrays, sparse, 2**20)
        if count
        else _without_gpu("CuPy finds no GPU. Install the driver of a CUDA GPU")
    )


def _without_gpu(reason: str) -> Device:
    warnings.warn(f"device='gpu' is not to be had, and the CPU computes: {reason}.", stacklevel=4)
    return CPU


def put(device: Device, array: np.ndarray) -> Array:
    """Return an array on the device."""
    return device.arrays.asarray(array)


def fetch(device: Device, array: Array) -> np.ndarray:
    """Return an array of the device to numpy."""
    return array if device is CPU else device.arrays.asnumpy(array)


def put_matrix(device: Device, matrix: sp.sparray, dtype: type) -> Array:
    """Return a sparse matrix by rows on the device, in the precision given."""
    rows = sp.csr_array(matrix)
    rows.sort_indices()
    parts = (
        rows.data.astype(dtype, copy=False),
        rows.indices.astype(np.int32, copy=False),
        rows.indptr.astype(np.int32, copy=False),
    )
    return device.sparse.csr_matrix(tuple(put(device, part) for part in parts), shape=rows.shape)


def multiply(
    device: Device, matrix: Array, block: Array, product: Array, rows: slice | None = None
) -> Array:
    """Write matrix times block, or these rows of it, to `product`, and return it."""
    some = slice(0, matrix.shape[0]) if rows is None else rows
    if device is CPU:
        loops.multiply(
            matrix.indptr[some.start : some.stop + 1], matrix.indices, matrix.data, block, product
        )
    else:
        product[...] = (matrix if rows is None else matrix[some]) @ block
    return product


def smoothing_step(
    device: Device,
    matrix: Array,
    scales: tuple[Array, Array],
    terms: tuple[Array, Array],
    state: list[Array],
    factors: tuple[float, float],
) -> None:
    """Take one Chebyshev step with the state (block, step, room), as `multilevel_loops.smoothing_step` says."""
    block, step, moved = state
    old, new = (block.dtype.type(factor) for factor in factors)
    if device is CPU:
        arrays = matrix.indptr, matrix.indices, matrix.data
        loops.smoothing_step(arrays, scales, terms, block, step, moved, old, new)
    else:
        (weights, inverse), (right, shifts) = scales, terms
        rest = (right - matrix @ block) + (weights * shifts) * block
        step *= old
        step += (inverse * new) * rest
        device.arrays.add(block, step, out=moved)
    state[0], state[2] = moved, block
