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
def fill_blocks(words, seed, stream, first, index):
    """The blocks of many parts of one stream, a round of all after the other: three times as fast as one by one.

    Args:
        words: set, uint32, shape (4, parts): of part `first + t`, those of `bits_at` from high to low.
        seed: as in `bits_at`.
        stream: likewise.
        first: of the parts.
        index: as in `bits_at`.
    """
    key, count, n = np.uint64(seed), np.uint64(index), words.shape[1]
    k, m = key & _MASK, key >> _HALF
    for t in range(n):
        words[0, t], words[1, t] = np.uint32(count & _MASK), np.uint32(count >> _HALF)
        words[2, t], words[3, t] = np.uint32(first + t), np.uint32(stream)
    for _ in range(_ROUNDS):
        for t in range(n):
            p, q = _M0 * np.uint64(words[0, t]), _M1 * np.uint64(words[2, t])
            b, d = words[1, t], words[3, t]
            words[0, t], words[1, t] = np.uint32((q >> _HALF) ^ b ^ k), np.uint32(q & _MASK)
            words[2, t], words[3, t] = np.uint32((p >> _HALF) ^ d ^ m), np.uint32(p & _MASK)
        k, m = (k + _W0) & _MASK, (m + _W1) & _MASK


@compiled
def bits_at(seed, stream, part, index):
    """128 random bits of a place, as two uint64.

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
    return (a << _HALF) | b, (c << _HALF) | d


@compiled
def normal(seed, stream, part, index):
    """One number of the standard normal distribution, by Box and Muller; args as `bits_at`."""
    a, b = bits_at(seed, stream, part, index)
    first = (float(a >> _DROPPED) + 1.0) * _UNIT  # in (0, 1]
    second = float(b >> _DROPPED) * _UNIT
    return math.sqrt(-2.0 * math.log(first)) * math.cos(2.0 * math.pi * second)
