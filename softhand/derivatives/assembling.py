"""Derivatives of a period put together from those of its parts, in one compiled call."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from softhand.derivatives.families import PHASES, SWITCHES, Family
from softhand.derivatives.tape import go
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled


class Ways(NamedTuple):
    """All ways of all families, those of one family behind one another."""

    first: NDArray[np.int64]
    """Of each family, and how many there are, shape (families + 1,)."""
    lanes: NDArray[np.int64]
    """Of each family."""
    every: NDArray[np.int64]
    """Bits of the parts of each family."""
    code: NDArray[np.int64]
    """Addresses of the code and of its words, shape (ways, 2)."""
    known: NDArray[np.int64]
    """Bits of the parts that each is known for."""
    reads: NDArray[np.int64]
    """Where the words of each begin, and how many are read, shape (ways, 2)."""
    sources: NDArray[np.int64]
    """Addresses of what is read, for each word."""
    words: Array
    numbers: Array
    """What the codes write."""
    writes: NDArray[np.int64]
    """Where the numbers of each begin, and how many derivatives there are, shape (ways, 2)."""
    entries: NDArray[np.int64]
    """Row and column of each derivative, lane by lane, shape (all, 2); those of a way begin as its numbers do."""
    phases: NDArray[np.int64]
    """Where the derivatives of each phase begin, shape (ways, PHASES + 1)."""
    switches: NDArray[np.int64]
    """Row of the first switch of each part, shape (families, lanes)."""
    counts: NDArray[np.int64]
    """Switches of each way."""
    chosen: NDArray[np.int64]
    """Way of each part, shape (families, lanes)."""
    missing: NDArray[np.int64]
    """A family without a code for some part, and the bits of those; shape (2,)."""


def ways_of(families: Sequence[Family]) -> Ways:
    """The ways that there are now."""
    every = [(f, way) for f, family in enumerate(families) for way in family.ways]
    lanes = [families[f].lanes for f, _ in every]
    sizes = [(way.sources.size + way.written.size, (len(way.code.rows) + way.switches) * n)
             for (_, way), n in zip(every, lanes, strict=True)]  # fmt: skip
    begins = np.concatenate([np.zeros((1, 2), np.int64), np.cumsum(np.array(sizes).reshape(-1, 2), axis=0)])
    words, numbers = np.zeros(max(1, begins[-1, 0])), np.zeros(max(1, begins[-1, 1]))
    sources, entries = np.zeros(len(words), np.int64), np.zeros((len(numbers), 2), np.int64)
    codes = []
    for (_, way), (word, number) in zip(every, begins, strict=False):
        n_read, n_written = way.sources.size, way.written.size
        sources[word : word + n_read] = way.sources.ravel()
        words[word + n_read : word + n_read + n_written] = way.written.ravel().view(np.float64)
        entries[number : number + way.rows.size] = np.stack([way.rows.ravel(), way.columns.ravel()], axis=1)
        codes.append((way.address, words.ctypes.data + 8 * int(word)))
    first = np.cumsum([0, *(len(family.ways) for family in families)])
    widest = max(family.lanes for family in families)
    switches = np.zeros((len(families), widest), np.int64)
    for row, family in zip(switches, families, strict=True):
        row[: len(family.parts)] = [part.first_switch for part in family.parts]
    return Ways(
        first=first.astype(np.int64),
        lanes=np.array([family.lanes for family in families], dtype=np.int64),
        every=np.array([(1 << len(family.parts)) - 1 for family in families], dtype=np.int64),
        code=np.array(codes, dtype=np.int64).reshape(-1, 2),
        known=np.array([way.known for _, way in every], dtype=np.int64),
        reads=np.array([(b[0], way.sources.size) for (_, way), b in zip(every, begins, strict=False)], dtype=np.int64).reshape(-1, 2),
        sources=sources,
        words=words,
        numbers=numbers,
        writes=np.array([(b[1], len(way.code.rows)) for (_, way), b in zip(every, begins, strict=False)], dtype=np.int64).reshape(-1, 2),
        entries=entries,
        phases=np.array([way.phases for _, way in every], dtype=np.int64).reshape(-1, PHASES + 1),
        switches=switches,
        counts=np.array([way.switches for _, way in every], dtype=np.int64),
        chosen=np.zeros((len(families), widest), np.int64),
        missing=np.zeros(2, np.int64),
    )  # fmt: skip


@intrinsic
def _number_at(typing_context, address):
    """The number at an address."""

    def generate(context, builder, signature, values):
        return builder.load(builder.inttoptr(values[0], ir.DoubleType().as_pointer()))

    return types.float64(address), generate


@compiled
def find_derivatives(ways, place):
    """Those of all parts; False if `missing` tells of some that no code does.

    Args:
        ways: `Ways`.
        place: address of `numbers`, shape (1,).
    """
    for f in range(ways.lanes.shape[0]):
        left = ways.every[f]
        for w in range(ways.first[f], ways.first[f + 1]):
            own = ways.known[w] & left
            if own == 0:
                continue
            begin = ways.reads[w, 0]
            for k in range(begin, begin + ways.reads[w, 1]):
                ways.words[k] = _number_at(ways.sources[k])  # type: ignore[call-arg]
            taken = go(ways.code[w], place[0] + 8 * ways.writes[w, 0]) & own
            for lane in range(ways.lanes[f]):
                if taken >> lane & 1:
                    ways.chosen[f, lane] = w
            left &= ~taken
        if left != 0:
            ways.missing[0], ways.missing[1] = f, left
            return False
    return True


@compiled
def add_phase(ways, phase, D, spans):
    """D[row] += derivative D[column] of all derivatives of a phase.

    Args:
        ways: `Ways`.
        phase: which.
        D: derivatives of all numbers by all seeds, shape (rows, seeds).
        spans: which of the seeds each row may depend on: begin and end, shape (rows, 2).
    """
    for f in range(ways.lanes.shape[0]):
        lanes = ways.lanes[f]
        for lane in range(lanes):
            if not ways.every[f] >> lane & 1:
                continue
            w = ways.chosen[f, lane]
            first, count = ways.writes[w, 0], ways.writes[w, 1]
            if phase == SWITCHES:
                D[ways.switches[f, lane] : ways.switches[f, lane] + ways.counts[w]] = 0.0
            for e in range(ways.phases[w, phase], ways.phases[w, phase + 1]):
                row, column = ways.entries[first + lane * count + e, 0], ways.entries[first + lane * count + e, 1]
                value, into, of = ways.numbers[first + e * lanes + lane], D[row], D[column]
                for k in range(spans[column, 0], spans[column, 1]):
                    into[k] += value * of[k]


@compiled
def find_near(ways, D, steps, reach, near):
    """Which switches some entry may cross within its step, to first order.

    Args:
        ways: `Ways`.
        D: as in `add_phase`.
        steps: of each seed.
        reach: how many steps count.
        near: set, for each of them the seed that leads there and the sign, shape (rows, 2).

    Returns:
        How many.
    """
    found = 0
    for f in range(ways.lanes.shape[0]):
        lanes = ways.lanes[f]
        for lane in range(lanes):
            if not ways.every[f] >> lane & 1:
                continue
            w = ways.chosen[f, lane]
            values = ways.writes[w, 0] + ways.writes[w, 1] * lanes
            for n in range(ways.counts[w]):
                value, row = ways.numbers[values + n * lanes + lane], D[ways.switches[f, lane] + n]
                most, seed = 0.0, -1
                for k in range(steps.shape[0]):
                    change = abs(row[k]) * steps[k]
                    if change > most:
                        most, seed = change, k
                if seed >= 0 and abs(value) <= reach * most and found < near.shape[0]:
                    near[found, 0] = seed
                    near[found, 1] = -1 if (row[seed] > 0.0) == (value > 0.0) else 1
                    found += 1
    return found

