"""A run as a tape: computed once, from which its tangent and its adjoint are taken."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.resolve import Setup
from softhand.batch import loop
from softhand.batch.asked import PERIODS
from softhand.batch.loop import BAD_TORQUE, look
from softhand.batch.run import CompiledRun
from softhand.derivatives.following import meanings_of, solvers_of, still_memories
from softhand.derivatives.tape import (
    AFTER,
    ASK,
    ASKED,
    BEGIN,
    FULL,
    KEEP,
    NEXT,
    NO_WAY,
    TAKE,
    WHY,
    Play,
    note,
    record,
)
from softhand.errors import ScenarioError, SimulationStopped, SofthandError
from softhand.model.rigid import branch_terms, rigid_terms
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.differentiated import Ways, Writer, addresses
from softhand.numerics.followed import Followed
from softhand.numerics.kept_codes import KeptCodes
from softhand.numerics.layouts import numbers_in
from softhand.numerics.llvm_text import assembled, loaded
from softhand.numerics.symbols import Place
from softhand.sensing.fields import FIELDS
from softhand.sensing.groups import parts_of
from softhand.simulation.asking import limit
from softhand.simulation.faults import HEALTHY
from softhand.simulation.keep import Keep
from softhand.simulation.pushes import add_pushes
from softhand.steppers.kernels import MIDPOINT
from softhand.steppers.midpoint import begin_kick, kick, kick_drift, meet_contact, start_step

_WAYS = 64
"""Most ways through one code."""
_FIRST_TAPE = 1 << 20


class LawNotFollowedError(Exception):
    """A control law does what cannot be followed; its answers can still be differenced."""


class Code(NamedTuple):
    """A kernel with its arguments, of which straight ways are followed."""

    name: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    numbers: Any = None
    """Array of the numbers among them."""


class Way(NamedTuple):
    """One way through a code."""

    writer: Writer
    words: NDArray[np.int64]


def begin_steps(tree, touch, terms, envelope, kicks, at, step, state):
    """What the first step from a state does before."""
    rigid_terms(tree, state.q, state.v, terms)
    start_step(touch, terms, envelope, kicks, at, step, state)


def push_bodies(pushes, clock, terms, external):
    """The pushes of a step."""
    for k in range(external.shape[0]):
        external[k] = 0.0
    add_pushes(pushes, clock[0], terms.poses, terms.J, external)


def beginning_with_none(formula: Any) -> Any:
    """A formula of a user, which begins with no torque."""

    def begun(observed, settings, memory, torque):
        torque[:] = 0.0
        formula(observed, settings, memory, torque)

    return begun


class TapedRun:
    """One run.

    Args:
        run: compiled, at its start.
        commands: torques of each control period in place of the law, shape (periods, n); None for the law.
        moving: places of memories that do not change during a run by which derivatives are taken.
        in_python: whether a controller in plain Python is asked in place of the law.

    Attributes:
        play: the run in the order of time.
        layouts: of all its arrays.
        ways: that each code was followed along.
    """

    def __init__(
        self,
        run: CompiledRun,
        commands: Array | None = None,
        moving: frozenset[Place] = frozenset(),
        in_python: bool = False,
    ) -> None:
        self.run, self.moving, self._follows_law = run, moving, commands is None and not in_python
        self._has_commands, self._in_python = commands is not None, in_python
        self._known: dict[tuple[str, int, int, int], int] = {}
        self.m, self.senses, self.plan = run.mechanics, run.senses, run.plan
        self.law, self.plant = run.law, run.plant
        if in_python:
            every = parts_of(FIELDS)
            self.plan = self.plan._replace(parts=every, parts_between=every)
        self.layouts = run.layouts
        if self.plan.kind != MIDPOINT:
            raise ScenarioError(
                "stepper.name: a gradient of a run is there for midpoint alone; choose that stepper.",
                key="stepper.name",
                value=self.plan.kind,
            )
        if self.plant.world.coupling is not None:
            raise ScenarioError(
                "hand: a gradient of a run is not there for coupled joints, by <mimic> or hand.coupling; "
                "softhand.linearize has the derivatives of one control period.",
                key="hand.coupling",
                value=self.plant.world.coupling.motors,
            )
        self._solvers = solvers_of(self.plant, self.layouts)
        self._meanings = meanings_of(self.plant, self._solvers)
        self._numbers = np.array(numbers_in(self.law._arguments)) if self.law is not None else np.zeros(0)
        self._codes = self._every_code(commands)
        self.ways: list[list[Way]] = [[] for _ in self._codes]
        order, period, starts = self._in_order(commands)
        self._still = still_memories(self._solvers, self.layouts)
        self._still |= {self.layouts.number_of(array)[0] for array in (self.m.at, self.plan.Theta)}
        self._constant = {self.layouts.number_of(array)[0] for array in self.constants()}
        n_steps = sum(1 for code in order if code == AFTER)
        n, plan = len(self.m.torque), self.plan
        periods = int(plan.progress[loop.LAST])
        self.start_rows = starts
        self.play = Play(
            order=np.array(order, dtype=np.int64),
            period=np.array(period, dtype=np.int64),
            ways=np.zeros(len(self._codes), np.int64),
            table=np.zeros((len(self._codes), _WAYS, 2), np.int64),
            sizes=np.zeros((len(self._codes), _WAYS), np.int64),
            taken=np.zeros(len(order), np.int64),
            where=np.zeros(len(order), np.int64),
            tape=np.empty(_FIRST_TAPE),
            progress=np.zeros(5, np.int64),
            desired=asked_for(run, periods),
            now=plan.now,
            clock=plan.clock,
            commands=np.zeros((periods + 1, n)) if commands is None else _padded(commands, periods + 1),
            command=plan.command,
            q=self.m.state.q,
            at=self.m.at,
            segments=plan.segments,
            block=plan.block,
            torque=self.m.torque,
            limited=plan.limited,
            external=self.m.external,
            rows=plan.rows,
            contacts=self.m.touch.contacts,
            is_support=self.m.touch.pads["is_support"].copy(),
            sides=np.zeros((n_steps + 1, len(self.m.touch.contacts)), np.int64),
            limits=np.zeros((periods, n), np.int64),
        )
        self._place = np.zeros(1, np.int64)

    def is_like(self, keep: Keep, commands: Array | None, in_python: bool) -> bool:
        """Whether it may become such a run."""
        has_commands = commands is not None
        return (keep, has_commands, in_python) == (self.run.keep, self._has_commands, self._in_python)

    def become(self, setup: Setup, keep: Keep, commands: Array | None) -> bool:
        """Be another run that differs in numbers alone, at its start.

        Returns:
            False where it differs in more; then this one is of no use.
        """
        if not self.run.become(setup, keep):
            return False
        play = self.play
        if self.law is not None:
            self._numbers[:] = numbers_in(self.law._arguments)
        for i, solver in enumerate(self._solvers):
            solver.pads[...] = self.plant.pads[i : i + 1]
        play.desired[...] = asked_for(self.run, len(play.desired) - 1)
        if commands is not None:
            play.commands[...] = _padded(commands, len(play.commands))
        play.progress[:] = 0
        return True

    def inputs(self) -> list[AnyArray]:
        """Arrays that a run begins with, but for what is asked for."""
        return inputs_of(self.run, self._numbers)

    def constants(self) -> list[AnyArray]:
        """Arrays that a run does not write to, but for scratch."""
        m, body = self.m, self.senses.body
        found = [m.joints, m.touch.pads, m.touch.columns, m.envelope, m.tree.joints, m.tree.gravity, body.joints,
                 body.tip_joints, body.tip_views, body.tip_rotations, body.pairs, body.bodies, body.gravity,
                 self.plan.effort_limit, self.plan.pushes.rows, self.plan.pushes.moves, self._numbers]  # fmt: skip
        if self.law is not None:
            found += list(_arrays(self.law._arguments[1]))
        shape = getattr(self.plant.world.shape, "data", None)
        return found if shape is None else [*found, shape]

    def _every_code(self, commands: Array | None) -> list[Code]:
        m, senses, plan = self.m, self.senses, self.plan
        step = plan.step
        seen = m.tree, m.touch, m.terms, m.state, m.at, senses
        found = [
            Code("look", look, (*seen, plan.parts, plan.Theta)),
            Code("glance", look, (*seen, plan.parts_between, plan.Theta)),
            Code("limit", limit, (plan.command, plan.effort_limit, m.torque, plan.limited)),
            Code("begin", begin_steps, (m.tree, m.touch, m.terms, m.envelope, m.kicks, m.at, step, m.state)),
            Code("push", push_bodies, (plan.pushes, plan.clock, m.terms, m.external)),
            Code("drift", kick_drift, (m.joints, m.torque, m.external, m.touch, m.terms, m.envelope, m.kicks, step,
                                       m.state)),
            *(Code(f"branch {k}", branch_terms, (m.tree, int(first), int(last), m.state.q, m.kicks.ahead, m.terms))
              for k, (first, last) in enumerate(m.branches)),
            Code("kick begins", begin_kick, (m.torque, m.external, m.terms, m.envelope, m.kicks, step, m.state.v)),
            *(Code(f"contact {i}", meet_contact, (i, m.touch, m.terms, m.kicks, step, m.state.z))
              for i in range(len(m.touch.contacts))),
            Code("kick", kick, (m.envelope, m.kicks, step, m.state.v)),
        ]  # fmt: skip
        if self._follows_law and self.law is not None:
            formula = self.law._plain
            followed = self.law.controller.formula if formula is None else beginning_with_none(formula)
            assert followed is not None
            found.append(Code("law", followed, self.law._arguments, self._numbers))
        return found

    def _in_order(self, commands: Array | None) -> tuple[list[int], list[int], list[int]]:
        """What is done when."""
        plan, numbers = self.plan, {code.name: k for k, code in enumerate(self._codes)}
        own = ("drift", "kick begins", "kick", "branch", "contact")
        step = [numbers[code.name] for code in self._codes if code.name.startswith(own)]
        has_pushes = len(plan.pushes.rows) > 0
        order: list[int] = []
        period: list[int] = []
        starts: list[int] = []
        last = int(plan.progress[loop.LAST])
        for k in range(last + 1):
            starts.append(len(order))
            is_kept = k % plan.every == 0
            order += [BEGIN, numbers["look" if is_kept else "glance"]]
            if commands is not None:
                order += [TAKE, numbers["limit"]] if k < last else []
            elif k % plan.stride == 0:
                order += [numbers.get("law", ASK), numbers["limit"]]
            if has_pushes:
                order.append(numbers["push"])
            if is_kept:
                order.append(KEEP)
            if k < last:
                for i in range(plan.steps):
                    if has_pushes and i:
                        order.append(numbers["push"])
                    order += [*([numbers["begin"]] if k == i == 0 else []), *step, AFTER]
            period += [k] * (len(order) - len(period))
        return order, period, starts

    def record(self, asked: Callable[[int], None] | None = None) -> None:
        """Compute the run.

        Args:
            asked: called where a controller in plain Python is to be asked, with the number of the entry.

        Raises:
            SimulationStopped: the run does not come to its end.
            ScenarioError: a kernel cannot be followed.
        """
        play = self.play
        note(play, 0)
        while True:
            self._place[0] = play.tape.ctypes.data
            record(play, self._place)
            why = play.progress[WHY]
            if why == FULL:
                play = self.play = play._replace(tape=np.concatenate([play.tape, np.empty_like(play.tape)]))
            elif why == NO_WAY:
                self._follow(int(play.order[play.progress[NEXT]]))
            elif why == ASKED:
                assert asked is not None
                asked(int(play.progress[NEXT]))
                play.progress[NEXT] += 1
            else:
                return

    def time(self) -> float:
        """Where the run is now [s]."""
        return float(self.play.clock[0])

    def _follow(self, number: int) -> None:
        """Another way through a code: that of the numbers as they are."""
        code, play = self._codes[number], self.play
        count = int(play.ways[number])
        tables = self._tables(code)
        try:
            followed = Followed(
                code.function, code.arguments, tables, self.moving, self._meanings, self.layouts, code.numbers
            )
        except SofthandError:
            raise
        except Exception as error:
            if code.name == "law":
                raise LawNotFollowedError(str(error)) from error
            raise ScenarioError(
                f"the derivative of {code.name!r} at t = {self.time():g} s cannot be taken: {error}.",
                key=code.name, value=code.name,
            ) from error  # fmt: skip
        if code.name in ("look", "glance") and followed.result[0] != HEALTHY:
            raise self._lost(*followed.result)
        if code.name == "limit" and followed.result is False:
            raise self._lost(BAD_TORQUE, 0)
        if count == _WAYS and code.name == "law":
            raise LawNotFollowedError("too many ways")
        if count == _WAYS:
            raise ScenarioError(
                f"{code.name!r} takes more than {_WAYS} ways in this run, the last at t = {self.time():g} s.",
                key=code.name, value=count,
            )  # fmt: skip
        writer = Writer(followed.sums, Ways(self._constant, self.moving, self._still))
        words = np.array(addresses(writer.memories, self.layouts.places), dtype=np.int64)
        self.ways[number].append(Way(writer, words))
        play.table[number, count] = self.code_of(number, count, writer.recording()), words.ctypes.data
        play.sizes[number, count] = len(writer.taped)
        play.ways[number] = count + 1

    def slope_code(self, kind: str, lanes: int, number: int, way: int) -> int:
        """Machine code of the tangent or the adjoint of a way."""
        key = kind, lanes, number, way
        if key not in self._known:
            writer = self.ways[number][way].writer
            text = writer.adjoint() if kind == "adjoint" else writer.tangent(lanes)
            self._known[key] = self.code_of(number, way, text)
        return self._known[key]

    def code_of(self, number: int, way: int, text: str) -> int:
        """Machine code of a text; quickly made where it runs seldom."""
        name = self._codes[number].name
        is_first = way == 0 and name in ("look", "drift", "kick")
        return machine_code(text, name == "begin" or is_first or way > 1)

    def _lost(self, fault: int, finger: int) -> SimulationStopped:
        """The error of a run that is lost midway."""
        progress, play = self.plan.progress, self.play
        progress[loop.NEXT] = play.period[play.progress[NEXT]]
        progress[loop.FAULT], progress[loop.FINGER] = fault, finger
        return self.run.error()

    def _tables(self, code: Code) -> tuple[Any, ...]:
        m, body = self.m, self.senses.body
        return (m.joints, m.touch.pads, m.touch.columns, m.envelope, m.tree.joints, body.joints, body.tip_joints,
                body.pairs, body.bodies, self.plan.parts, self.plan.parts_between, self.plan.pushes.rows,
                self.plan.pushes.moves,
                *([] if self.law is None else _arrays(self.law._arguments[1])))  # fmt: skip


def inputs_of(run: CompiledRun, numbers: Array) -> list[AnyArray]:
    """Arrays that a run begins with, in the same order for each run of one structure.

    Args:
        run: at its start.
        numbers: those among the settings of its law.
    """
    m, body, law = run.mechanics, run.senses.body, run.law
    found = [m.touch.pads, m.tree.joints, m.tree.gravity, body.tip_rotations, body.bodies, body.gravity,
             run.plan.effort_limit, run.plan.pushes.rows, m.state.q, m.state.v, m.state.z, numbers]  # fmt: skip
    if law is not None:
        found += [*_arrays(law._arguments[1]), law.memory]
    shape = getattr(run.plant.world.shape, "data", None)
    return found if shape is None else [*found, shape]


def _arrays(argument: Any) -> Iterator[AnyArray]:
    """All arrays in tuples of tuples."""
    if isinstance(argument, tuple):
        for item in argument:
            yield from _arrays(item)
    elif isinstance(argument, np.ndarray):
        yield argument


def asked_for(run: CompiledRun, periods: int) -> Array:
    """What is asked for in all control periods."""
    return np.concatenate([run.table(k, min(k + PERIODS - 1, periods)) for k in range(0, periods + 1, PERIODS)])


def _padded(rows: Array, count: int) -> Array:
    found = np.zeros((count, rows.shape[1]))
    found[: len(rows)] = rows
    return found


_known: dict[str, int] = {}


def machine_code(text: str, is_rare: bool = False) -> int:
    """Address of the code of a text, from this process, from disk, or made now and kept."""
    key = f"{hashlib.sha256(text.encode()).hexdigest()} {is_rare}"  # not optimized it has other last bits
    if key not in _known:
        store = KeptCodes(__name__, key)
        content = store.found()
        if content is None:
            content = assembled(text, 0 if is_rare else 1)
            store.keep(content)
        _known[key] = loaded(content)
    return _known[key]
