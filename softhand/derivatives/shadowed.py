"""Derivatives of all numbers of a run on tape: its tangent and its adjoint."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from softhand.derivatives.tape import ASKED, NEXT, SAMPLE, WHY, Shadows, pull, push
from softhand.derivatives.taped_run import TapedRun
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.differentiated import addresses

LANES = 8
"""Of a tangent."""


class Shadowed:
    """Derivatives of all numbers of a run, and the codes for them; all zero at first.

    Args:
        taped: recorded.
        lanes: numbers beside one another.
        kind: "tangent" or "adjoint".

    Attributes:
        arrays: shadow of each memory, shape (words, lanes).
    """

    def __init__(self, taped: TapedRun, lanes: int, kind: str) -> None:
        self.taped, self.lanes = taped, lanes
        play, layouts = taped.play, taped.layouts
        for array in (play.now, play.command, play.block, play.torque, play.external):
            layouts.number_of(array)
        self.arrays = [np.zeros((-(-array.nbytes // 8), lanes)) for array in layouts.memories]
        places = [array.ctypes.data for array in self.arrays]
        table = np.zeros_like(play.table)
        self._kept = []
        for number, ways in enumerate(taped.ways):
            for k, way in enumerate(ways):
                words = np.concatenate([way.words, np.array(addresses(way.writer.memories, places), dtype=np.int64)])
                table[number, k] = taped.slope_code(kind, lanes, number, k), words.ctypes.data
                self._kept.append(words)
        at = self.at
        self.shadows = Shadows(
            table=table,
            desired=self._room(len(play.desired), play.now.size),
            now=at(play.now),
            commands=self._room(*play.commands.shape),
            command=at(play.command),
            block=at(play.block),
            torque=at(play.torque),
            external=at(play.external),
            rows=self._room(*play.rows.shape),
        )

    def _room(self, rows: int, numbers: int) -> Array:
        return np.zeros((rows, numbers * self.lanes))

    def at(self, array: AnyArray) -> Array:
        """The shadow of a contiguous array of numbers, its lanes behind one another, shape (numbers * lanes,)."""
        number, begin = self.taped.layouts.number_of(array)
        found: Array = self.arrays[number][begin // 8 : begin // 8 + array.nbytes // 8].reshape(-1)
        return found

    def clear(self) -> None:
        """All zero."""
        for array in self.arrays:
            array[...] = 0.0
        for array in (self.shadows.desired, self.shadows.commands, self.shadows.rows):
            array[...] = 0.0

    def push(self, asked: Callable[[int], None] | None = None) -> None:
        """The tangent along the run."""
        play, place = self.taped.play, np.array([self.taped.play.tape.ctypes.data])
        play.progress[NEXT] = play.progress[SAMPLE] = 0
        while True:
            push(play, self.shadows, place, self.lanes)
            if play.progress[WHY] != ASKED:
                return
            assert asked is not None
            asked(int(play.progress[NEXT]))
            play.progress[NEXT] += 1

    def pull(self, asked: Callable[[int], None] | None = None) -> None:
        """The adjoint against the run."""
        play, place = self.taped.play, np.array([self.taped.play.tape.ctypes.data])
        play.progress[NEXT], play.progress[SAMPLE] = len(play.order), len(play.rows)
        while True:
            pull(play, self.shadows, place)
            if play.progress[WHY] != ASKED:
                return
            assert asked is not None
            asked(int(play.progress[NEXT]) - 1)
            play.progress[NEXT] -= 1
