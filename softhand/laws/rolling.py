"""From the moment of a law to the slope of its energy by the lean, which the kernels of a contact work with."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from numba import carray, cfunc, float64, types
from numba.extending import register_jitable
from numba.np.unsafe.ndarray import to_fixed_tuple

from softhand.numerics.compiled import kernel_folder

LEAN = 4
"""Where the two numbers of the lean are among the arguments of a law in surface coordinates."""
LENGTHS = 3
"""How many of the arguments before it are lengths; those differ by radii. The radius follows on the lean."""
DIFFERENCE = 1e-6
"""Step of the central differences that give the second derivatives."""

_SIGNATURE = types.void(types.CPointer(float64), types.CPointer(float64))


@register_jitable
def slope_of(moment_1, moment_2, lean1, lean2):
    """(dU/dlean1, dU/dlean2) [J] of the moment that the energy U has as the tip rolls.

    With the axis of the tip x_F = (lean1, lean2, l3), l3 > 0, and the spin w of the tip relative to the object

        x_F' = w x x_F,   U_1 lean1' + U_2 lean2' = m . w,   m = (-U_2 l3, U_1 l3, U_2 lean1 - U_1 lean2)

    so that m . x_F = 0: the first two numbers of m tell the slope, and with it the third.
    """
    upright = math.sqrt(1.0 - lean1 * lean1 - lean2 * lean2)
    return moment_2 / upright, -moment_1 / upright


@lru_cache(64)
def compile_slope(moment: Callable[..., Any], source: str, has_module: bool, n_arguments: int) -> Any:
    """Machine code of the slope of the energy by the lean: dU/dlean1, dU/dlean2 [J]."""

    def entry(arguments, results):
        source  # noqa: B018  a change of the formula changes this closure, and with it the key on disk
        x: Any = to_fixed_tuple(carray(arguments, n_arguments), n_arguments)  # type: ignore[call-arg]
        values = moment(*x)
        results[0], results[1] = slope_of(values[0], values[1], x[LEAN], x[LEAN + 1])

    with kernel_folder(__name__):
        return cfunc(_SIGNATURE, cache=has_module, error_model="numpy")(entry)


@lru_cache(64)
def compile_bend(moment: Callable[..., Any], source: str, has_module: bool, n_arguments: int) -> Any:
    """Machine code of the derivatives of that slope by central differences.

    Two rows by the lean [J], then two by dr, s1, s2 [N] and psi [J].
    """

    def entry(arguments, results):
        source  # noqa: B018
        x = carray(arguments, n_arguments)
        for j in range(LEAN + 2):
            kept, step = x[j], DIFFERENCE * (x[LEAN + 2] if j < LENGTHS else 1.0)
            x[j] = kept + step
            values = moment(*to_fixed_tuple(x, n_arguments))  # type: ignore[call-arg]
            upper = slope_of(values[0], values[1], x[LEAN], x[LEAN + 1])
            x[j] = kept - step
            values = moment(*to_fixed_tuple(x, n_arguments))
            lower = slope_of(values[0], values[1], x[LEAN], x[LEAN + 1])
            x[j] = kept
            for i in range(2):
                place = 4 + LEAN * i + j if j < LEAN else 2 * i + j - LEAN
                results[place] = (upper[i] - lower[i]) / (2.0 * step)

    with kernel_folder(__name__):
        return cfunc(_SIGNATURE, cache=has_module, error_model="numpy")(entry)
