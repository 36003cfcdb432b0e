"""Derivatives of a period put together from those of its parts, in one compiled call.

Each part has told how some rows depend on some columns. A column that depends on one seed is worth one product; those
that depend on all of them are added up row by row.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.derivatives.families import PHASES, SWITCHES, Family, Way
from softhand.derivatives.row_sums import number_at, sum_rows
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
    """What the codes read."""
    numbers: Array
    """What they write."""
    writes: NDArray[np.int64]
    """Where the numbers of each begin, and where its switches do, shape (ways, 2)."""
    counts: NDArray[np.int64]
    """Switches of each way."""
    products: NDArray[np.int64]
    """Of columns with one seed: which number of D changes, by which other, times which of `numbers`, shape (k, 3)."""
    product_ends: NDArray[np.int64]
    """Begin and end of those of each way, lane and phase, shape (ways, lanes, PHASES + 1)."""
    sums: NDArray[np.int64]
    """Row, and begin and end of its terms, shape (k, 3)."""
    sum_ends: NDArray[np.int64]
    """As `product_ends`."""
    terms: NDArray[np.int64]
    """Column, and which of `numbers`, shape (k, 2)."""
    switches: NDArray[np.int64]
    """Row of the first switch of each part, shape (families, lanes)."""
    chosen: NDArray[np.int64]
    """Way of each part, shape (families, lanes)."""
    missing: NDArray[np.int64]
    """A family without a code for some part, and the bits of those; shape (2,)."""


def ways_of(families: Sequence[Family], spans: NDArray[np.int64], width: int) -> Ways:
    """The ways that there are now.

    Args:
        families: of all parts.
        spans: which of the seeds each row may depend on: begin and end, shape (rows, 2).
        width: numbers of a row.
    """
    every = [(f, way) for f, family in enumerate(families) for way in family.ways]
    sizes = [(way.sources.size + way.written.size, (len(way.code.rows) + way.switches) * families[f].lanes)
             for f, way in every]  # fmt: skip
    begins = np.concatenate([np.zeros((1, 2), np.int64), np.cumsum(np.array(sizes).reshape(-1, 2), axis=0)])
    words, numbers = np.zeros(max(1, begins[-1, 0])), np.zeros(max(1, begins[-1, 1]))
    sources = np.zeros(len(words), np.int64)
    widest, tables = max(family.lanes for family in families), _Tables(spans, width)
    ends = np.zeros((2, len(every), widest, PHASES + 1), np.int64)
    for w, (f, way) in enumerate(every):
        word, number = begins[w].tolist()
        read, written = way.sources.size, way.written.size
        sources[word : word + read] = way.sources.ravel()
        words[word + read : word + read + written] = way.written.ravel().view(np.float64)
        for lane in range(families[f].lanes):
            ends[:, w, lane, 0] = len(tables.products), len(tables.sums)
            for phase in range(PHASES):
                tables.add(way, lane, phase, number)
                ends[:, w, lane, phase + 1] = len(tables.products), len(tables.sums)
    switches = np.zeros((len(families), widest), np.int64)
    for row, family in zip(switches, families, strict=True):
        row[: len(family.parts)] = [part.first_switch for part in family.parts]
    lanes = [families[f].lanes for f, _ in every]
    starts = [(int(b[1]), int(b[1]) + len(way.code.rows) * n)
              for (_, way), b, n in zip(every, begins, lanes, strict=False)]  # fmt: skip
    return Ways(
        first=np.cumsum([0, *(len(family.ways) for family in families)]).astype(np.int64),
        lanes=_whole([family.lanes for family in families]),
        every=_whole([(1 << len(family.parts)) - 1 for family in families]),
        code=_whole([(way.address, words.ctypes.data + 8 * int(b[0]))
                     for (_, way), b in zip(every, begins, strict=False)], 2),
        known=_whole([way.known for _, way in every]),
        reads=_whole([(int(b[0]), way.sources.size) for (_, way), b in zip(every, begins, strict=False)], 2),
        sources=sources,
        words=words,
        numbers=numbers,
        writes=_whole(starts, 2),
        counts=_whole([way.switches for _, way in every]),
        products=_whole(tables.products, 3),
        product_ends=ends[0],
        sums=_whole(tables.sums, 3),
        sum_ends=ends[1],
        terms=_whole(tables.terms, 2),
        switches=switches,
        chosen=np.zeros((len(families), widest), np.int64),
        missing=np.zeros(2, np.int64),
    )  # fmt: skip


def _whole(rows: Sequence[object], width: int = 0) -> NDArray[np.int64]:
    found = np.array(rows, dtype=np.int64)
    return found.reshape(-1, width) if width else found


class _Tables:
    """Products and sums of all ways."""

    def __init__(self, spans: NDArray[np.int64], width: int) -> None:
        self._spans, self._width = spans.tolist(), width
        self._full = max(end - begin for begin, end in self._spans)
        self.products: list[tuple[int, int, int]] = []
        self.sums: list[tuple[int, int, int]] = []
        self.terms: list[tuple[int, int]] = []

    def add(self, way: Way, lane: int, phase: int, first: int) -> None:
        """Those of one phase of a lane; the numbers of the way begin at `first`."""
        lanes = len(way.rows)
        known = -1
        for e in range(way.phases[phase], way.phases[phase + 1]):
            row, column, number = int(way.rows[lane, e]), int(way.columns[lane, e]), first + e * lanes + lane
            begin, end = self._spans[column]
            if end - begin < self._full:
                for k in range(begin, end):
                    self.products.append((row * self._width + k, column * self._width + k, number))
                continue
            if row != known:
                self.sums.append((row, len(self.terms), len(self.terms)))
                known = row
            self.terms.append((column, number))
            self.sums[-1] = row, self.sums[-1][1], len(self.terms)


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
                ways.words[k] = number_at(ways.sources[k])  # type: ignore[call-arg]
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
def add_phase(ways, phase, D, flat):
    """D[row] += derivative D[column] of all derivatives of a phase.

    Args:
        ways: `Ways`.
        phase: which.
        D: derivatives of all numbers by all seeds, shape (rows, width).
        flat: the same, shape (rows * width,).
    """
    for f in range(ways.lanes.shape[0]):
        for lane in range(ways.lanes[f]):
            if not ways.every[f] >> lane & 1:
                continue
            w = ways.chosen[f, lane]
            if phase == SWITCHES:
                D[ways.switches[f, lane] : ways.switches[f, lane] + ways.counts[w]] = 0.0
            for e in range(ways.product_ends[w, lane, phase], ways.product_ends[w, lane, phase + 1]):
                flat[ways.products[e, 0]] += ways.numbers[ways.products[e, 2]] * flat[ways.products[e, 1]]
            for e in range(ways.sum_ends[w, lane, phase], ways.sum_ends[w, lane, phase + 1]):
                sum_rows(D, ways.sums, e, ways.terms, ways.numbers)  # type: ignore[call-arg]


@compiled
def note_near(ways, D, steps, reach, near):
    """Which seeds may cross a switch within their steps, to first order: of each switch that which goes furthest.

    Args:
        ways: `Ways`.
        D: as in `add_phase`.
        steps: of each seed.
        reach: how many steps count.
        near: set, 1 for each of them, shape (seeds,).
    """
    near[:] = 0
    for f in range(ways.lanes.shape[0]):
        lanes = ways.lanes[f]
        for lane in range(lanes):
            if not ways.every[f] >> lane & 1:
                continue
            w = ways.chosen[f, lane]
            values = ways.writes[w, 1]
            for n in range(ways.counts[w]):
                value, row = ways.numbers[values + n * lanes + lane], D[ways.switches[f, lane] + n]
                most, seed = 0.0, -1
                for k in range(steps.shape[0]):
                    change = abs(row[k]) * steps[k]
                    if change > most:
                        most, seed = change, k
                if seed >= 0 and abs(value) <= reach * most:
                    near[seed] = 1
