"""Many worlds side by side that go on together, some control periods at a call; what is asked may change in between."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.resolve import Setup
from softhand.batch.asked import Asked
from softhand.batch.loop import FAULT, FEEL, FINGER, LIMIT, NEXT, RECORDED, look
from softhand.batch.run import CompiledRun, is_compiled
from softhand.contact.address import call, done
from softhand.errors import ScenarioError, SimulationStopped
from softhand.numerics.addressed import Addressed, addressed
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.compiled import compiled
from softhand.numerics.layouts import Layouts
from softhand.sensing.fields import RECORDED as RECORDED_FIELDS
from softhand.sensing.fields import Sizes, beginnings, shapes
from softhand.sensing.groups import parts_of
from softhand.simulation.faults import HEALTHY
from softhand.simulation.keep import Keep
from softhand.simulation.pushes import Push, push_table

IDLE = -1
"""In `Worlds.turns`: a world that stays as it is, its observation as well."""

_CHUNKS = 4  # for each thread, so that one that had easy worlds can take more


class Seat(NamedTuple):
    """What a world shares with the others: rows of their arrays."""

    code: NDArray[np.int64]
    """Address of `run_periods`, and of what it is called with, shape (2,)."""
    turn: NDArray[np.int64]
    """Control periods to come, shape (1,)."""
    period: float
    """[s]"""
    wanted: Array
    """What is asked for meanwhile, as in `Motion`, shape (numbers,)."""
    command: Array
    """Goes into the first numbers of the memory of the law."""
    memory: Array
    """Of the law."""
    segments: NDArray[np.int64]
    """Of the block of the observation that are seen: begin and size of each, shape (segments, 2)."""
    seen: Array
    """At the end, shape (numbers,)."""
    fault: NDArray[np.int64]
    """As in `Plan.progress`: what ended the run, and at which contact, shape (2,)."""


@compiled
def go_on(m, senses, plan, seat):
    """The control periods of one world, then its observation; nothing of a world that has ended."""
    progress, first = plan.progress, plan.progress[NEXT]
    if seat.turn[0] < 0 or progress[FAULT] != HEALTHY:
        return
    progress[LIMIT] = first + seat.turn[0]
    for i in range(seat.turn[0]):
        plan.desired[i, 0] = (first + i) * seat.period
        for k in range(seat.wanted.shape[0]):
            plan.desired[i, 1 + k] = seat.wanted[k]
    for k in range(seat.wanted.shape[0]):
        plan.now[k] = seat.wanted[k]
    for k in range(seat.command.shape[0]):
        seat.memory[k] = seat.command[k]
    if seat.turn[0] > 0:
        call(seat.code[0], seat.code[1], seat.code[1])  # type: ignore[call-arg]
    if progress[FAULT] == HEALTHY and not done(plan.straight, RECORDED):  # type: ignore[call-arg]
        progress[FAULT], progress[FINGER] = look(
            m.tree, m.touch, m.terms, m.state, m.at, senses, plan.parts, plan.Theta
        )
    if progress[FAULT] == HEALTHY and plan.between[FEEL, 0] != 0:
        call(plan.between[FEEL, 0], plan.between[FEEL, 1], plan.between[FEEL, 1])  # type: ignore[call-arg]
    seat.fault[0], seat.fault[1] = progress[FAULT], progress[FINGER]
    if progress[FAULT] == HEALTHY:
        end = 0
        for s in range(seat.segments.shape[0]):
            for k in range(seat.segments[s, 1]):
                seat.seen[end + k] = plan.block[seat.segments[s, 0] + k]
            end += seat.segments[s, 1]


@compiled
def all_go_on(codes):
    """One after the other: rows of an address and of what is called with it, shape (worlds, 2)."""
    for i in range(codes.shape[0]):
        call(codes[i, 0], codes[i, 1], codes[i, 1])  # type: ignore[call-arg]


class Worlds:
    """Runs of one structure that go on together: their physics in threads, without the lock of the interpreter.

    A world does the same alone and in any company, to the last bit.

    Attributes:
        wanted: what is asked for while the worlds go on, as `Motion.now` and `Motion.twist` lie, live, shape
            (worlds, numbers).
        commands: what the laws find in the first numbers of their memories, live, shape (worlds, `command`).
        turns: control periods that each world goes on; 0 to observe only, `IDLE` for nothing; live, shape (worlds,).
        seen: fields of the observation of each world after `go_on`, live, shape (worlds, ...) each; of a world that has
            ended, the last that was good.
        faults: what ended each world, `HEALTHY` or a number of `simulation.faults`, and at which contact, shape
            (worlds, 2).
        runs: the runs.
        setups: what each of them is made of.
        sizes: of an observation.

    Args:
        setup: of one world, in which all begin; `become` makes them differ.
        count: how many.
        fields: of an observation that are seen, names of `sensing.fields.FIELDS`.
        command: how many numbers the law is told.
        threads: at work at the same time.

    Raises:
        ScenarioError: there is no machine code for the stepper or the law of the setup.
    """

    def __init__(self, setup: Setup, count: int, fields: Sequence[str], command: int = 0, threads: int = 1) -> None:
        scenario, self._period = setup.asked, setup.asked.control_period
        if not is_compiled(setup):
            raise _not_compiled("stepper.name", scenario.stepper.name)
        self._asked, self._fields = Asked(), tuple(fields)
        kept = {"joint_position" if name == "configuration" else name for name in fields} & set(RECORDED_FIELDS)
        self._keep = Keep.of(kept, scenario.duration, self._period)
        self.runs = [self._made(setup) for _ in range(count)]
        self.setups, first = [setup] * count, self.runs[0]
        self.sizes: Sizes = first.sizes
        sizes = [prod(shapes(self.sizes)[name]) for name in self._fields]
        self._segments = np.array([*zip(map(beginnings(self.sizes).get, self._fields), sizes, strict=True)], np.int64)
        self.wanted, self.commands = np.tile(first.plan.now, (count, 1)), np.zeros((count, command))
        self.turns, self.faults = np.zeros(count, np.int64), np.zeros((count, 2), np.int64)
        self._seen, self._codes = np.zeros((count, sum(sizes))), np.zeros((count, 2), np.int64)
        ends = np.cumsum(sizes)
        self.seen = {
            name: self._seen[:, end - size : end].reshape(count, *shapes(self.sizes)[name])
            for name, size, end in zip(self._fields, sizes, ends, strict=True)
        }
        self._starts = [_copies(run) for run in self.runs]
        self._seats = [self._seat(index) for index in range(count)]
        chunks = np.array_split(self._codes, min(count, _CHUNKS * threads if threads > 1 else 1))
        self._work = [addressed(all_go_on, chunk, layouts=Layouts()) for chunk in chunks]
        self._pool = ThreadPoolExecutor(threads) if len(chunks) > 1 else None

    def go_on(self) -> None:
        """All worlds for as many control periods as `turns` says, then `seen` and `faults`."""
        if self._pool is None:
            self._work[0]()
            return
        list(self._pool.map(lambda work: work(), self._work))

    def restart(self, index: int) -> None:
        """One world at its start again, as if it were new; `go_on` tells what is seen there."""
        for array, start in self._starts[index]:
            array[...] = start
        self.wanted[index] = self.runs[index].plan.now
        self.faults[index], self.commands[index] = HEALTHY, 0.0

    def become(self, index: int, setup: Setup) -> None:
        """Make one world another one, at its start.

        Raises:
            ScenarioError: it is not of the same structure.
        """
        run = self.runs[index]
        if not run.become(setup, self._keep):  # a number is or was 0 or 1: code of its own
            run = self._made(setup)
            if run.sizes != self.sizes:
                raise ScenarioError("worlds: one has another hand than the others.", key="hand")
        self.setups[index], self.runs[index], self._starts[index] = setup, run, _copies(run)
        self._seats[index] = self._seat(index)
        self.restart(index)

    def push(self, index: int, pushes: Sequence[Push]) -> None:
        """The pushes of one world from now on, as many as its scenario has.

        Raises:
            ScenarioError: a push is none.
        """
        run = self.runs[index]
        for array, new in zip(run.plan.pushes, push_table(run.plant, pushes), strict=True):
            array[...] = new

    def time(self) -> Array:
        """Of each world since its start [s], shape (worlds,)."""
        return np.array([run.plan.progress[NEXT] for run in self.runs]) * self._period

    def error(self, index: int) -> SimulationStopped:
        """What ended a world."""
        return self.runs[index].error()

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()

    def _made(self, setup: Setup) -> CompiledRun:
        run = CompiledRun(setup, self._keep, self._asked)
        if run.law is None:
            raise _not_compiled("controller.name", type(setup.controller).__name__)
        return run

    def _seat(self, index: int) -> Addressed:
        """The place of a run among the others."""
        run = self.runs[index]
        assert run.law is not None and not np.any(parts_of(self._fields) > run.plan.parts)
        seat = Seat(
            code=np.array([run.periods.code, run.periods.place], dtype=np.int64),
            turn=_row(self.turns, index),
            period=self._period,
            wanted=_row(self.wanted, index),
            command=_row(self.commands, index),
            memory=run.law.memory,
            segments=self._segments,
            seen=_row(self._seen, index),
            fault=_row(self.faults, index),
        )
        code = addressed(go_on, run.mechanics, run.senses, run.plan, seat, layouts=run.layouts)
        self._codes[index] = code.code, code.place
        return code


def _row(array: AnyArray, index: int) -> AnyArray:
    """A row as memory of its own, so that all worlds are laid out alike."""
    own: Any = array[index : index + 1].reshape(-1)
    return np.asarray(memoryview(own))


def _copies(run: CompiledRun) -> list[tuple[AnyArray, AnyArray]]:
    """All that changes while a run goes on, with what is in it now."""
    assert run.law is not None
    own = {id(array): array for array in (*run.layouts.memories, run.law.memory) if array is not run.plan.desired}
    return [(array, array.copy()) for array in own.values() if array.flags.writeable]


def _not_compiled(key: str, name: str) -> ScenarioError:
    return ScenarioError(
        f"{key}: there is no machine code for {name!r}, which worlds side by side need.", key=key, value=name
    )
