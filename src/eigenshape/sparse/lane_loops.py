"""Sums of rows of eight numbers, the innermost loop of solves and projections, as vector code.

The compiler would use eight scalars, so the vector instructions are written out here. LLVM splits
the vectors into the sizes of the machine.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

# Doubles in a vector of 512 bits; machines without such vectors use two or four instructions.
LANES = 8
VECTOR = ir.VectorType(ir.DoubleType(), LANES)


def _summation(n_targets: int, *, added: bool) -> Any:
    """Return the intrinsic that sums into `n_targets` rows at once.

    More rows use the multipliers better, as long as all fit into registers.
    """

    @intrinsic
    def summation(
        context: Any,
        shares: Any,
        at: Any,
        stride: Any,
        apart: Any,
        given: Any,
        start: Any,
        count: Any,
        taken: Any,
        to: Any,
    ) -> Any:
        """Add or subtract a weighted sum of rows, for each target row q.

        To taken[to + q] goes Σ_t shares[at + t stride + q apart] given[start + t].
        """
        whole = types.int64
        signature = types.void(shares, whole, whole, whole, given, whole, whole, taken, whole)

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            arrays = [
                context.make_array(signature.args[place])(context, builder, arguments[place]).data
                for place in (0, 4, 7)
            ]
            shares, given, taken = arrays
            _, at, stride, apart, _, start, count, _, to = arguments
            eight = ir.Constant(at.type, LANES)
            sums = [
                cgutils.alloca_once_value(builder, ir.Constant(VECTOR, None))
                for _ in range(n_targets)
            ]
            with cgutils.for_range(builder, count) as loop:
                row = _load(builder, given, builder.mul(builder.add(start, loop.index), eight))
                place = builder.add(at, builder.mul(loop.index, stride))
                for total in sums:
                    share = _repeat_scalar(builder, builder.load(builder.gep(shares, [place])))
                    builder.store(_multiply_add(builder, share, row, builder.load(total)), total)
                    place = builder.add(place, apart)
            for q, total in enumerate(sums):
                offset = builder.mul(builder.add(to, ir.Constant(to.type, q)), eight)
                pointer = _pointer(builder, taken, offset)
                change = builder.fadd if added else builder.fsub
                builder.store(
                    change(builder.load(pointer, align=8), builder.load(total)), pointer, align=8
                )
            return context.get_dummy_value()

        return signature, generate

    return summation


def _pointer(builder: Any, data: Any, offset: Any) -> Any:
    return builder.bitcast(builder.gep(data, [offset]), VECTOR.as_pointer())


def _load(builder: Any, data: Any, offset: Any) -> Any:
    return builder.load(_pointer(builder, data, offset), align=8)


def _repeat_scalar(builder: Any, scalar: Any) -> Any:
    zero = ir.Constant(ir.IntType(32), 0)
    one = builder.insert_element(ir.Constant(VECTOR, ir.Undefined), scalar, zero)
    mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), None)
    return builder.shuffle_vector(one, ir.Constant(VECTOR, ir.Undefined), mask)


def _multiply_add(builder: Any, a: Any, b: Any, c: Any) -> Any:
    return builder.fadd(builder.fmul(a, b, flags=["contract"]), c, flags=["contract"])


subtract_sum = _summation(1, added=False)
subtract_four_sums = _summation(4, added=False)
add_eight_sums = _summation(8, added=True)
