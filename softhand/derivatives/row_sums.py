"""Sums of rows of a matrix in the registers of a processor, which compilers do not see that the rows allow."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

BLOCK = 16
"""Numbers of a row that are added up at a time; rows are as many of these long."""
_LANES = 4
_NUMBER, _COUNT = ir.DoubleType(), ir.IntType(64)
_VECTOR = ir.VectorType(_NUMBER, _LANES)


@intrinsic
def number_at(typing_context, address):
    """The number at an address."""

    def generate(context, builder, signature, values):
        return builder.load(builder.inttoptr(values[0], _NUMBER.as_pointer()))

    return types.float64(address), generate


@intrinsic
def sum_rows(typing_context, D, sums, e, terms, numbers):
    """D[row] += number D[column] of all terms of one row of a table of sums, see `assembling.Ways`."""

    def generate(context, builder, signature, values):
        arrays: list[Any] = [context.make_array(kind)(context, builder, value)
                             if isinstance(kind, types.Array) else None
                  for kind, value in zip(signature.args, values, strict=True)]  # fmt: skip
        D, sums, _, terms, numbers = arrays
        width = builder.extract_value(D.shape, 1)
        at = builder.mul(values[2], ir.Constant(_COUNT, 3))
        row, begin, end = (_at(builder, sums.data, at, k) for k in range(3))
        into = builder.gep(D.data, [builder.mul(row, width)])
        with cgutils.for_range_slice(builder, ir.Constant(_COUNT, 0), width, ir.Constant(_COUNT, BLOCK), inc=True) as (
            block,
            _,
        ):
            totals = [cgutils.alloca_once(builder, _VECTOR) for _ in range(BLOCK // _LANES)]
            for k, total in enumerate(totals):
                builder.store(builder.load(_vector(builder, into, block, k), align=8), total)
            with cgutils.for_range_slice(builder, begin, end, ir.Constant(_COUNT, 1), inc=True) as (term, _):
                place = builder.mul(term, ir.Constant(_COUNT, 2))
                of = builder.gep(D.data, [builder.mul(_at(builder, terms.data, place, 0), width)])
                number = builder.load(builder.gep(numbers.data, [_at(builder, terms.data, place, 1)]))
                factor = ir.Constant(_VECTOR, ir.Undefined)
                for lane in range(_LANES):
                    factor = builder.insert_element(factor, number, ir.Constant(ir.IntType(32), lane))
                for k, total in enumerate(totals):
                    other = builder.load(_vector(builder, of, block, k), align=8)
                    product = builder.fmul(factor, other, flags=("contract",))
                    builder.store(builder.fadd(builder.load(total), product, flags=("contract",)), total)
            for k, total in enumerate(totals):
                builder.store(builder.load(total), _vector(builder, into, block, k), align=8)
        return context.get_dummy_value()

    return types.void(D, sums, e, terms, numbers), generate


def _at(builder, table, first, k):
    return builder.load(builder.gep(table, [builder.add(first, ir.Constant(_COUNT, k))]))


def _vector(builder, row, block, k):
    place = builder.gep(row, [builder.add(block, ir.Constant(_COUNT, _LANES * k))])
    return builder.bitcast(place, _VECTOR.as_pointer())
