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


# Rows after the present one that memory is asked for, since it takes long to answer (measured).
AHEAD = 32


def _summation(n_targets: int, change: str, *, kept: bool = True, ahead: int = 0) -> Any:
    """Return the intrinsic that changes `n_targets` rows at once by sums: "fadd" or "fsub".

    Rows that are not kept count as 0. More rows use the multipliers better, as long as all fit into
    registers. Shares are fetched from memory this many terms ahead.
    """

    @intrinsic
    def summation(
        context,
        shares,
        at,
        stride,
        apart,
        given,
        start,
        count,
        taken,
        to,
    ):
        """Change each target row q by a weighted sum of rows.

        To taken[to + q] goes Σ_t shares[at + t stride + q apart] given[start + t].
        """
        whole = types.int64
        signature = types.void(shares, whole, whole, whole, given, whole, whole, taken, whole)

        def generate(context, builder, signature, arguments):
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
                if ahead:
                    far = builder.mul(stride, ir.Constant(at.type, ahead))
                    _fetch(builder, shares, builder.add(place, far))
                for total in sums:
                    share = _repeat_scalar(builder, builder.load(builder.gep(shares, [place])))
                    builder.store(_multiply_add(builder, share, row, builder.load(total)), total)
                    place = builder.add(place, apart)
            for q, total in enumerate(sums):
                offset = builder.mul(builder.add(to, ir.Constant(to.type, q)), eight)
                pointer = _pointer(builder, taken, offset)
                row = builder.load(pointer, align=8) if kept else ir.Constant(VECTOR, None)
                row = getattr(builder, change)(row, builder.load(total))
                builder.store(row, pointer, align=8)
            return context.get_dummy_value()

        return signature, generate

    return summation


def _pointer(builder, data, offset):
    return builder.bitcast(builder.gep(data, [offset]), VECTOR.as_pointer())


def _load(builder, data, offset):
    return builder.load(_pointer(builder, data, offset), align=8)


def _fetch(builder, data, offset):
    byte, flag = ir.IntType(8).as_pointer(), ir.IntType(32)
    kind = ir.FunctionType(ir.VoidType(), [byte, flag, flag, flag])
    fetch = builder.module.declare_intrinsic("llvm.prefetch", [byte], kind)
    # For reading, into the caches of all levels, data and no code.
    flags = [ir.Constant(flag, value) for value in (0, 3, 1)]
    builder.call(fetch, [builder.bitcast(builder.gep(data, [offset]), byte), *flags])


def _repeat_scalar(builder, scalar):
    zero = ir.Constant(ir.IntType(32), 0)
    one = builder.insert_element(ir.Constant(VECTOR, ir.Undefined), scalar, zero)
    mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), None)
    return builder.shuffle_vector(one, ir.Constant(VECTOR, ir.Undefined), mask)


def _multiply_add(builder, a, b, c):
    return builder.fadd(builder.fmul(a, b, flags=["contract"]), c, flags=["contract"])


subtract_sum = _summation(1, "fsub")
subtract_four_sums = _summation(4, "fsub")
write_negative_sum = _summation(1, "fsub", kept=False)
write_four_negative_sums = _summation(4, "fsub", kept=False)
add_eight_sums = _summation(8, "fadd", ahead=AHEAD)


@intrinsic
def write_row_product(
    context,
    entries,
    indices,
    start,
    stop,
    given,
    taken,
    to,
):
    """Write Σ entries[p] given[indices[p]] for p from start to stop - 1 to row `to` of `taken`.

    Even and odd terms are summed separately, so that an addition need not wait for the one before.
    """
    whole = types.int64
    signature = types.void(entries, indices, whole, whole, given, taken, whole)

    def generate(context, builder, signature, arguments):
        entries, indices, given, taken = (
            context.make_array(signature.args[place])(context, builder, arguments[place]).data
            for place in (0, 1, 4, 5)
        )
        start, stop, to = (arguments[place] for place in (2, 3, 6))
        one, eight = ir.Constant(start.type, 1), ir.Constant(start.type, LANES)
        even, odd = (
            cgutils.alloca_once_value(builder, ir.Constant(VECTOR, None)) for _ in range(2)
        )

        def add_term(place, total):
            index = builder.load(builder.gep(indices, [place]))
            index = builder.sext(index, start.type)
            row = _load(builder, given, builder.mul(index, eight))
            entry = _repeat_scalar(builder, builder.load(builder.gep(entries, [place])))
            builder.store(_multiply_add(builder, entry, row, builder.load(total)), total)

        count = builder.sub(stop, start)
        pairs = builder.lshr(count, one)
        with cgutils.for_range(builder, pairs) as loop:
            place = builder.add(start, builder.shl(loop.index, one))
            add_term(place, even)
            add_term(builder.add(place, one), odd)
        with builder.if_then(builder.icmp_signed("<", builder.shl(pairs, one), count)):
            add_term(builder.sub(stop, one), even)
        total = builder.fadd(builder.load(even), builder.load(odd))
        builder.store(total, _pointer(builder, taken, builder.mul(to, eight)), align=8)
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def fetch_row(context, rows, at):
    """Ask memory for row `at` of `rows`, which may lie beyond the end."""
    return _row_action(rows, _fetch)


@intrinsic
def copy_row(context, given, start, taken, to):
    """Copy row `start` of `given` to row `to` of `taken`."""
    return _row_change(given, taken, lambda builder, row, old: row)


@intrinsic
def add_row(context, given, start, taken, to):
    """Add row `start` of `given` to row `to` of `taken`."""
    return _row_change(given, taken, lambda builder, row, old: builder.fadd(old, row))


@intrinsic
def clear_row(context, rows, at):
    """Set row `at` of `rows` to zero."""

    def clear(builder, data, offset):
        zeros = ir.Constant(VECTOR, None)
        builder.store(zeros, _pointer(builder, data, offset), align=8)

    return _row_action(rows, clear)


@intrinsic
def divide_row(context, rows, at, divisor):
    """Divide row `at` of `rows` by a number that is not 0."""

    def divide(builder, data, offset, divisor):
        pointer = _pointer(builder, data, offset)
        row, divisors = builder.load(pointer, align=8), _repeat_scalar(builder, divisor)
        builder.store(builder.fdiv(row, divisors), pointer, align=8)

    return _row_action(rows, divide, types.float64)


def _row_action(rows, act, *kinds):
    """Return the intrinsic that does something to one row, given further numbers of some kinds."""
    signature = types.void(rows, types.int64, *kinds)

    def generate(context, builder, signature, arguments):
        rows, at, *numbers = arguments
        data = context.make_array(signature.args[0])(context, builder, rows).data
        act(builder, data, builder.mul(at, ir.Constant(at.type, LANES)), *numbers)
        return context.get_dummy_value()

    return signature, generate


def _row_change(given, taken, change):
    whole = types.int64
    signature = types.void(given, whole, taken, whole)

    def generate(context, builder, signature, arguments):
        eight = ir.Constant(arguments[1].type, LANES)
        given, taken = (
            _pointer(
                builder,
                context.make_array(signature.args[place])(context, builder, arguments[place]).data,
                builder.mul(arguments[place + 1], eight),
            )
            for place in (0, 2)
        )
        row, old = (builder.load(pointer, align=8) for pointer in (given, taken))
        builder.store(change(builder, row, old), taken, align=8)
        return context.get_dummy_value()

    return signature, generate
