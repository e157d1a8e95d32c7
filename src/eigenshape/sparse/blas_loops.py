"""Two routines of SciPy's BLAS for compiled loops, which work on parts of arrays in place.

In a compiled loop np.dot copies arrays that are not contiguous, and subtracting its product takes
another pass.
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import get_cython_function_address, intrinsic

CHARACTER, WHOLE, REAL = ir.IntType(8), ir.IntType(32), ir.DoubleType()
MODULE = "scipy.linalg.cython_blas"


def addresses() -> tuple[int, int]:
    """Return the addresses of dgemm and dtrsm in this process.

    They are arguments of compiled loops, because compiled code on disk cannot hold addresses.
    """
    return get_cython_function_address(MODULE, "dgemm"), get_cython_function_address(
        MODULE, "dtrsm"
    )


@intrinsic
def subtract_product(
    context,
    address,
    size,
    left,
    left_at,
    left_wide,
    right,
    right_at,
    right_wide,
    taken,
    taken_at,
    taken_wide,
):
    """Subtract A Bᵀ from C, where all three are parts of matrices in C order.

    A part is given by the flat index of its first entry, and by the number of entries from one row
    to the next; size = (rows, columns, terms).
    """
    whole = types.int64
    parts = left, whole, whole, right, whole, whole, taken, whole, whole
    signature = types.void(whole, size, *parts)

    def generate(context, builder, signature, arguments):
        address, size = arguments[:2]
        rows, columns, terms = (
            _store_whole(builder, builder.extract_value(size, i)) for i in range(3)
        )
        left, right, taken = (_part(context, builder, signature, arguments, i) for i in (2, 5, 8))
        minus, one = (_store_real(builder, value) for value in (-1.0, 1.0))
        # In Fortran's order every matrix is transposed: Cᵀ = Cᵀ - B Aᵀ.
        flags = [_letter(builder, letter) for letter in "TN"]
        given = [*flags, columns, rows, terms, minus, *right, *left, one, *taken]
        _call(builder, address, given)
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def solve_triangle(
    context,
    address,
    size,
    triangle,
    triangle_at,
    triangle_wide,
    right,
    right_at,
    right_wide,
):
    """Replace X by X L⁻ᵀ, where L is unit lower triangular and both are parts of matrices.

    Parts are given as in `subtract_product`; size = (rows of X, columns).
    """
    whole = types.int64
    signature = types.void(whole, size, triangle, whole, whole, right, whole, whole)

    def generate(context, builder, signature, arguments):
        address, size = arguments[:2]
        rows, columns = (_store_whole(builder, builder.extract_value(size, i)) for i in range(2))
        triangle, right = (_part(context, builder, signature, arguments, i) for i in (2, 5))
        flags = [_letter(builder, letter) for letter in "LUTU"]
        given = [*flags, columns, rows, _store_real(builder, 1.0), *triangle, *right]
        _call(builder, address, given)
        return context.get_dummy_value()

    return signature, generate


def _store_whole(builder, number):
    return cgutils.alloca_once_value(builder, builder.trunc(number, WHOLE))


def _store_real(builder, value):
    return cgutils.alloca_once_value(builder, ir.Constant(REAL, value))


def _letter(builder, letter):
    return cgutils.alloca_once_value(builder, ir.Constant(CHARACTER, ord(letter)))


def _part(context, builder, signature, arguments, i):
    """Return the address of a part, and the number of entries from one row to the next."""
    array = context.make_array(signature.args[i])(context, builder, arguments[i])
    return builder.gep(array.data, [arguments[i + 1]]), _store_whole(builder, arguments[i + 2])


def _call(builder, address, given):
    kind = ir.FunctionType(ir.VoidType(), [pointer.type for pointer in given])
    builder.call(builder.inttoptr(address, kind.as_pointer()), given)
