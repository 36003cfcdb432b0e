"""Calls of machine code at an address: laws and shapes are data of the kernels, not part of them."""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from softhand.numerics.tracing import MEANINGS, call_on_symbols

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


MEANINGS[call] = call_on_symbols


@intrinsic
def done(typing_context, codes, row):
    """Whether straight code did its work: the row of `codes` has its address and that of its words, or zeros."""

    def generate(context, builder, signature, values):
        table = context.make_array(signature.args[0])(context, builder, values[0]).data
        first = builder.mul(values[1], ir.Constant(values[1].type, 2))
        code, words = (
            builder.load(builder.gep(table, [builder.add(first, ir.Constant(first.type, k))])) for k in (0, 1)
        )
        result = cgutils.alloca_once_value(builder, ir.Constant(ir.IntType(64), 0))
        with builder.if_then(builder.icmp_unsigned("!=", code, ir.Constant(code.type, 0))):
            kind = ir.FunctionType(ir.IntType(64), [_DOUBLES, _DOUBLES])
            place = builder.inttoptr(words, _DOUBLES)
            function = builder.inttoptr(code, kind.as_pointer())
            builder.store(builder.call(function, [place, place]), result)
        return builder.icmp_unsigned("!=", builder.load(result), ir.Constant(ir.IntType(64), 0))

    return types.boolean(codes, row), generate


def _pointer(context, builder, kind, value):
    if isinstance(kind, types.Integer):
        return builder.inttoptr(value, _DOUBLES)
    return context.make_array(kind)(context, builder, value).data
