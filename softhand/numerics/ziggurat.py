"""Three numbers of the standard normal distribution from one block of random bits, by tables.

The ziggurat of Marsaglia, Tsang, "The ziggurat method for generating random variables", J. Stat. Softw. 5 (8), 2000:
under the density lie 256 layers of one area, the lowest with the tail. A layer is drawn, and a place in it, which in 99
of 100 cases needs no more than a look into a table. The numbers are normal but for the 34 bits of a place.
"""

from __future__ import annotations

import math

import numpy as np

from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.philox import bits_at

LAYERS = 256
TAIL = 3.6541528853610088
"""Where the tail begins, so that 256 layers end at the top of the density."""

_LAYER_BITS, _PLACE_BITS, _ONE = np.uint64(LAYERS - 1), np.uint64(8), np.uint64(1)
_OWN, _OWN_BITS = np.uint64(42), np.uint64((1 << 42) - 1)  # each of three numbers has 42 of 128 bits
_REST, _REST_BITS = np.uint64(20), np.uint64((1 << 20) - 1)
_HALF = np.uint64(32)
_PLACE, _MIDDLE = 1.0 / (1 << 33), (1 << 33) - 0.5
_DROPPED = np.uint64(11)
_UNIT = 1.0 / (1 << 53)


def _layers() -> tuple[Array, Array]:
    """Widths of the layers, the lowest first, as wide as its area demands; and the density there, shape (257,)."""
    density = math.exp(-0.5 * TAIL * TAIL)
    area = TAIL * density + math.sqrt(0.5 * math.pi) * math.erfc(TAIL / math.sqrt(2.0))
    widths = [area / density, TAIL]
    for _ in range(LAYERS - 2):
        density += area / widths[-1]
        widths.append(math.sqrt(-2.0 * math.log(density)))
    x = np.array([*widths, 0.0])
    return x, np.exp(-0.5 * x * x)


_WIDTHS, _DENSITY = _layers()


@compiled
def three_normals(words, t, seed, stream, part, index):
    """Three independent numbers, a function of seed, stream, part and index alone.

    Args:
        words: the blocks of `philox.fill_blocks`; column t is that of the part.
        t: which column.
        seed: of the run, int64.
        stream: which quantity, int64; where bits are not enough, those behind it are used as well.
        part: which component of it, int64, 0 to 2^32 - 1.
        index: which sample, int64; may be negative.
    """
    first = (np.uint64(words[0, t]) << _HALF) | np.uint64(words[1, t])
    second = (np.uint64(words[2, t]) << _HALF) | np.uint64(words[3, t])
    third = ((first >> _OWN) << _REST) | ((second >> _OWN) & _REST_BITS)
    return (
        _number(first & _OWN_BITS, seed, stream, part, index),
        _number(second & _OWN_BITS, seed, stream + 1, part, index),
        _number(third, seed, stream + 2, part, index),
    )


@compiled
def _number(bits, seed, stream, part, index):
    """One number from 42 bits: 8 for the layer, 34 for the place in it, on both sides of 0."""
    layer = bits & _LAYER_BITS
    x = _place(bits) * _WIDTHS[layer]
    if abs(x) >= _WIDTHS[layer + _ONE]:
        return _beyond(bits, seed, stream, part, index)
    return x


@compiled
def _place(bits):
    """In (-1, 1)."""
    return (float(np.int64(bits >> _PLACE_BITS)) - _MIDDLE) * _PLACE


@compiled
def _beyond(bits, seed, stream, part, index):
    """The number where the place lies beyond the layer above it: in the tail, below the density, or drawn again."""
    while True:
        stream += 3
        first, second = bits_at(seed, stream, part, index)
        layer = bits & _LAYER_BITS
        x = _place(bits) * _WIDTHS[layer]
        if abs(x) < _WIDTHS[layer + _ONE]:
            return x
        u, v = (float(first >> _DROPPED) + 1.0) * _UNIT, (float(second >> _DROPPED) + 1.0) * _UNIT  # in (0, 1]
        if layer == 0:  # [Marsaglia] exponential beside the tail
            out = -math.log(u) / TAIL
            if -2.0 * math.log(v) > out * out:
                return math.copysign(TAIL + out, x)
        elif _DENSITY[layer] + v * (_DENSITY[layer + _ONE] - _DENSITY[layer]) < math.exp(-0.5 * x * x):
            return x
        else:
            bits = first & _OWN_BITS
