"""Random numbers by their place, not by their turn: the same seed, stream and index give the same number at any time.

Philox4x32-10, a block cipher of few rounds run on a counter: Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as
easy as 1, 2, 3", SC 2011. There is no state to keep, so a run that is cut in two, or is done by another loop, sees the
same noise.
"""

from __future__ import annotations

import math

import numpy as np

from softhand.numerics.compiled import compiled

_ROUNDS = 10
_MASK, _HALF = np.uint64(0xFFFFFFFF), np.uint64(32)
_M0, _M1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_W0, _W1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_DROPPED = np.uint64(11)  # bits of 64 that a double has no room for
_UNIT = 1.0 / (1 << 53)


@compiled
def philox(a, b, c, d, k, m):
    """Four words of 32 bits from a counter of four words and a key of two.

    Args:
        a: first word of the counter, as all of them a uint64 below 2^32.
        b: second.
        c: third.
        d: fourth.
        k: first word of the key.
        m: second.
    """
    for _ in range(_ROUNDS):
        p, q = _M0 * a, _M1 * c
        a, b, c, d = (q >> _HALF) ^ b ^ k, q & _MASK, (p >> _HALF) ^ d ^ m, p & _MASK
        k, m = (k + _W0) & _MASK, (m + _W1) & _MASK
    return a, b, c, d


@compiled
def normal(seed, stream, part, index):
    """One number of the standard normal distribution, by Box and Muller.

    Args:
        seed: of the run, int64.
        stream: which quantity, int64, 0 to 2^32 - 1.
        part: which component of it, likewise.
        index: which sample, int64; may be negative.
    """
    key, count = np.uint64(seed), np.uint64(index)
    a, b, c, d = philox(
        count & _MASK, count >> _HALF, np.uint64(part), np.uint64(stream), key & _MASK, key >> _HALF
    )  # fmt: skip
    first = (float(((a << _HALF) | b) >> _DROPPED) + 1.0) * _UNIT  # in (0, 1]
    second = float(((c << _HALF) | d) >> _DROPPED) * _UNIT
    return math.sqrt(-2.0 * math.log(first)) * math.cos(2.0 * math.pi * second)
