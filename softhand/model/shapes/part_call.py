"""Calling a part of a union from the formula of the union: its data lie within those of the union."""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

_DOUBLES = ir.DoubleType().as_pointer()


@intrinsic
def call_part(typing_context, address, data, first, io):
    """Call the machine code void f(double*, double*) at an address with the numbers from data[first] on, and io."""

    def generate(context, builder, signature, values):
        kind = ir.FunctionType(ir.VoidType(), [_DOUBLES, _DOUBLES])
        function = builder.bitcast(builder.inttoptr(values[0], cgutils.voidptr_t), kind.as_pointer())
        builder.call(function, [builder.gep(values[1], [values[2]]), values[3]])
        return context.get_dummy_value()

    return types.void(address, data, first, io), generate
