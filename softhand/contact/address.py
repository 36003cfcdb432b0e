"""Calls of machine code at an address: laws and shapes are data of the kernels, not part of them."""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

_DOUBLES = ir.DoubleType().as_pointer()


@intrinsic
def call(typing_context, address, arguments, results):
    """Call the machine code void f(double*, double*) at an address; `arguments` is an array or an address as well."""

    def generate(context, builder, signature, values):
        kind = ir.FunctionType(ir.VoidType(), [_DOUBLES, _DOUBLES])
        function = builder.bitcast(builder.inttoptr(values[0], cgutils.voidptr_t), kind.as_pointer())
        pointers = [
            _pointer(context, builder, kind, value) for kind, value in zip(signature.args[1:], values[1:], strict=True)
        ]
        builder.call(function, pointers)
        return context.get_dummy_value()

    return types.void(address, arguments, results), generate


def _pointer(context, builder, kind, value):
    if isinstance(kind, types.Integer):
        return builder.inttoptr(value, _DOUBLES)
    return context.make_array(kind)(context, builder, value).data
