"""One run in the compiled loop."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from softhand.assembly.guard import guard_after, read_guard
from softhand.assembly.parts import read_start
from softhand.assembly.resolve import Setup
from softhand.batch.asked import PERIODS, Asked
from softhand.batch.loop import (
    ACT,
    BAD_TORQUE,
    BETWEEN,
    FAULT,
    FEEL,
    FEEL_BETWEEN,
    FINGER,
    LAST,
    LAW,
    LIMIT,
    NEXT,
    RECORDED,
    SAMPLES,
    SEE,
    Plan,
    Senses,
    look,
    run_periods,
)
from softhand.contact.pairs import contact_pairs
from softhand.controllers.controller import Controller
from softhand.errors import SimulationStopped
from softhand.numerics.addressed import Addressed, addressed
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.layouts import Layouts
from softhand.numerics.straight import Fixed, put, straight
from softhand.plant.plant import Plant
from softhand.references.reference import desired_of
from softhand.sensing.fields import Sizes, pick, room
from softhand.sensing.groups import parts_of
from softhand.sensing.instruments import NEEDED, Instruments
from softhand.sensing.known import sizes_of
from softhand.sensing.observation import Observation
from softhand.sensing.seen import see_measured
from softhand.sensing.sensor import Sensor, Wanted
from softhand.simulation.actuation import Drive, act, drive_of
from softhand.simulation.actuation import become as become_drive
from softhand.simulation.asking import at_fault, raised_by
from softhand.simulation.faults import HEALTHY, stopped
from softhand.simulation.keep import Keep
from softhand.simulation.pushes import Push, PushTable, push_table
from softhand.simulation.simulation import TOTALS, whole_periods
from softhand.steppers.kernels import MIDPOINT, RK4, SEMI_IMPLICIT_EULER, mechanics_of
from softhand.steppers.midpoint import Midpoint
from softhand.steppers.rk4 import RungeKutta4
from softhand.steppers.semi_implicit_euler import SemiImplicitEuler
from softhand.steppers.straight_steps import straight_steps
from softhand.tactile.field import Felt
from softhand.tactile.reading import feel_and_read
from softhand.tactile.taxels import Taxels

KINDS = {Midpoint: MIDPOINT, SemiImplicitEuler: SEMI_IMPLICIT_EULER, RungeKutta4: RK4}
"""Of the steppers that there is machine code for, see `steppers.kernels`."""


class Outcome(NamedTuple):
    """How a run ended."""

    reason: str
    """`finished`, or one word as in `SimulationStopped.reason`."""
    time: float
    """Of the last good sample [s]."""
    message: str
    """In a sentence; "" if it is finished."""


FINISHED = "finished"


class Result(NamedTuple):
    """What is kept of a run."""

    outcome: Outcome
    variables: dict[str, AnyArray]
    """`time` and those that were asked for, shape (samples, ...) each."""


def is_compiled(setup: Setup) -> bool:
    """Whether there is machine code for the stepper; whether there is for the law, only its start tells."""
    return type(setup.stepper) in KINDS


def _times(setup: Setup) -> Any:
    """What of a setup tells how often what is done."""
    scenario = setup.asked
    return setup.stepper, setup.controller.period, scenario.duration, scenario.control_period, len(scenario.push)


def _pushes(setup: Setup, plant: Plant) -> PushTable:
    return push_table(plant, [Push(**push.model_dump()) for push in setup.asked.push])


@contextmanager
def _blamed(controller: Controller) -> Iterator[None]:
    """Whatever is raised inside is an error of the controller at the start."""
    try:
        yield
    except (Exception, SystemExit) as error:
        raise raised_by(controller, error, 0.0) from error


class CompiledRun:
    """One run, ready to go; it has all its memory to itself.

    Attributes:
        plant: hand, object and contacts, live.
        law: the control law as compiled code; None if it has none, and then there is no run.
        mechanics: what a step works with.
        senses: what the sensor works with.
        plan: what is done when, and what is kept.
        layouts: of the arrays of all three.
        periods: machine code that runs control periods up to `Plan.progress`.
        observation: live.
        keep: what is kept.
    """

    def __init__(self, setup: Setup, keep: Keep, asked: Asked) -> None:
        scenario = setup.asked
        self._setup, self.keep, self._asked = setup, keep, asked
        self._asked_for: Any = None
        self._guard = read_guard(setup)
        self.plant = plant = Plant(setup.world, setup.fingertips, setup.supports, "compiled", setup.taxels)
        self._state = plant.with_supports(setup.grasp.state).copy()
        self._follow(setup)
        now = np.zeros(self._motion.now.size + self._motion.twist.size)
        desired = desired_of(now[: self._motion.now.size].reshape(3, -1), now[self._motion.now.size :].reshape(2, 6))
        self._block = self._room(setup)
        self._sensor = sensor = Sensor(plant, desired, self._block)
        self.observation = truth = sensor.observation
        self._instruments: Instruments | None = None
        if setup.sensing is not None:
            seen = self._block[room(truth.known.sizes) :]
            self._instruments = Instruments(plant, truth, setup.sensing, desired, seen)
            self.observation = self._instruments.observation
        now[:] = self.table(0, 0)[0, 1:]
        observation = self._observe()
        with _blamed(setup.controller):
            self.law = setup.controller.compiled(observation)
        self._forget()
        if self.law is None:
            return
        n, sizes = plant.world.n_joints, observation.known.sizes
        periods = round(scenario.duration / scenario.control_period)
        torque = np.zeros(n)
        self.mechanics = mechanics_of(plant, self._state, torque)
        self.senses = Senses(sensor.body, Wanted.of(desired), sensor.groups)
        self.plan = Plan(
            kind=KINDS[type(setup.stepper)],
            step=setup.stepper.step,
            steps=round(scenario.control_period / setup.stepper.step),
            stride=whole_periods(setup.controller, scenario.control_period),
            every=keep.every,
            law=np.array([self.law.call.code, self.law.call.place], dtype=np.int64),
            command=self.law.torque,
            effort_limit=observation.effort_limit.copy(),
            limited=np.zeros(n, np.int8),
            clock=observation._views.clock,
            desired=np.empty((PERIODS, 1 + now.size)),
            now=now,
            pushes=_pushes(setup, plant),
            parts=parts_of({*keep.fields, *self._reads()}),
            parts_between=parts_of(self._reads()),
            segments=keep.segments(sizes),
            block=self._block,
            rows=np.zeros((keep.samples(periods), keep.width(sizes, plant.world.nv))),
            Theta=np.full(plant.world.n_tips, np.nan),
            progress=np.array([0, 0, periods, HEALTHY, 0, 0], dtype=np.int64),
            straight=np.zeros((3, 2), np.int64),
            between=np.zeros((4, 2), np.int64),
        )
        self.layouts = Layouts()
        self._drive = self._put_between()
        self._straight = self._straight_code()
        self.periods = addressed(run_periods, self.mechanics, self.senses, self.plan, layouts=self.layouts)
        m, plan = self.mechanics, self.plan
        written = *m.kicks, m.mass, m.slopes, m.tree.work, m.torque, plan.limited, plan.Theta, plan.progress
        self._new = [(array, array.copy()) for array in written]

    def _room(self, setup: Setup) -> Array:
        """Memory of the observation, of what the controller sees and of the commanded torques."""
        world = self.plant.world
        size = room(sizes_of(self.plant, len(contact_pairs(world.n_tips))))
        return np.zeros(size if setup.sensing is None and setup.actuation is None else 2 * size + world.n_joints)

    def _observe(self) -> Observation:
        """What the controller sees at the start."""
        truth = self._sensor.observe(self._state, 0.0)
        if self._instruments is None:
            return truth
        seen = self._instruments.see(0)
        self._instruments.forget()
        return seen

    def _reads(self) -> frozenset[str]:
        """Fields of the true observation that are needed in each period."""
        assert self.law is not None
        return self.law.reads if self._instruments is None else NEEDED

    def _put_between(self) -> Drive | None:
        """The code of instruments and drives, put into its place."""
        plan, instruments, setup = self.plan, self._instruments, self._setup
        assert self.law is not None
        codes: list[Addressed] = []
        if instruments is not None:
            arguments = instruments.arguments(plan.progress, {*self.keep.measured, *self.law.reads})
            codes.append(addressed(see_measured, *arguments, layouts=self.layouts))
            plan.between[SEE] = codes[-1].code, codes[-1].place
        if self.plant.taxels is not None:
            codes.append(self._put_taxels(self.plant.taxels))
        drive = None
        if setup.actuation is not None:
            world, m = self.plant.world, self.mechanics
            drive = drive_of(setup.actuation, plan.command, plan.effort_limit, m.torque, plan.limited, world.joints,
                             m.state, self._block[-world.n_joints :])  # fmt: skip
            codes.append(addressed(act, drive, plan.progress, layouts=self.layouts))
            plan.between[ACT] = codes[-1].code, codes[-1].place
        self._between = codes
        return drive

    def _put_taxels(self, taxels: Taxels) -> Addressed:
        """The code of the taxels, where samples are recorded; in between if they remember, or the law reads them."""
        plant, plan, m = self.plant, self.plan, self.mechanics
        assert self.law is not None
        felt, seen = (pick(Felt, one._views) for one in (self._sensor.observation, self.observation))
        if self._instruments is None:
            seen = Felt(*(array[:0] for array in felt))
        code = addressed(
            feel_and_read, plant.skin, plant.reading, m.touch.pads, m.touch.contacts, m.terms.poses, felt, seen,
            plan.progress, layouts=self.layouts,
        )  # fmt: skip
        plan.between[FEEL] = code.code, code.place
        if taxels.hysteresis > 0.0 or taxels.is_timed or not self.law.reads.isdisjoint(Felt._fields):
            plan.between[FEEL_BETWEEN] = code.code, code.place
        return code

    def _become_between(self, setup: Setup) -> bool:
        """Be the instruments and drives of another run."""
        instruments, drive = self._instruments, self._drive
        if (instruments is None) != (setup.sensing is None) or (drive is None) != (setup.actuation is None):
            return False
        if instruments is not None and setup.sensing is not None and not instruments.become(setup.sensing):
            return False
        return drive is None or setup.actuation is None or become_drive(drive, setup.actuation)

    def become(self, setup: Setup, keep: Keep) -> bool:
        """Be another run that differs in numbers alone, ready to go: in the same memory, and as if it were new.

        Making one run ready takes milliseconds, which go into memory and code; this takes a tenth of it, and the same
        setup again still less. What is in `plan.pushes` stays there with it.

        Returns:
            False where the two differ in more; then this run is of no use.
        """
        if self.law is None or keep != self.keep or _times(setup) != _times(self._setup):
            return False
        if setup is self._setup:
            self.plant.forget()
        elif (setup.taxels is not None and self._setup.taxels is not None
              and (setup.taxels.hysteresis > 0.0) != (self._setup.taxels.hysteresis > 0.0)) or (
            not self.plant.become(setup.world, setup.fingertips, setup.supports, setup.taxels)
            or not self._sensor.become()
        ):  # fmt: skip
            return False
        if not self._become_between(setup):
            return False
        for array, new in self._new:
            array[...] = new
        start, plan = self.plant.with_supports(setup.grasp.state), self.plan
        for array, new in zip(self._state.arrays, start.arrays, strict=True):
            array[...] = new
        self._follow(setup)
        if self._motion.now.size + self._motion.twist.size != plan.now.size:
            return False
        self._guard = guard_after(setup, self._setup, self._guard)
        is_other, self._setup = setup is not self._setup, setup
        plan.now[:] = self.table(0, 0)[0, 1:]
        observation = self._observe()
        with _blamed(setup.controller):
            if not self.law.become(setup.controller, observation):
                return False
        self._forget()
        plan.effort_limit[:] = self.observation.effort_limit
        if is_other:
            for array, new in zip(plan.pushes, _pushes(setup, self.plant), strict=True):
                array[...] = new
        return True

    def _follow(self, setup: Setup) -> None:
        """The motion that is asked for."""
        start = read_start(setup.asked)
        asked = setup.reference, start.row().tobytes()
        if self._asked_for != asked:
            self._asked_for, self._start, self._motion = asked, start, setup.reference.start(start)

    def _forget(self) -> None:
        """The observation of the start belongs to no step."""
        self.plant.at[0] = np.nan
        for name in TOTALS:
            self.plant.contacts[name] = 0
        self.plant.elements[...] = 0.0

    def _straight_code(self) -> list[Addressed | None]:
        """Straight code for all that there can be, put into its place."""
        m, senses, plan = self.mechanics, self.senses, self.plan
        body, layouts = senses.body, self.layouts
        own = (
            m.touch.pads, m.touch.columns, body.joints, body.tip_joints, body.tip_views, body.pairs, body.bodies,
        )  # fmt: skip
        found = straight_steps(m, plan.step, layouts) if plan.kind == MIDPOINT else []
        for row, parts in ((RECORDED, plan.parts), (BETWEEN, plan.parts_between)):
            fixed = Fixed((*own, parts), (*own, parts))
            found += straight(
                look, [(m.tree, m.touch, m.terms, m.state, m.at, senses, parts, plan.Theta)], fixed, layouts
            )
            put(found[-1], plan.straight[row])
        if self.law is not None and plan.law[0]:
            found.append(put(self.law.straight(layouts), plan.straight[LAW]))
        return found

    def hold(self, torque: Array) -> None:
        """Run under these torques in place of the law [N m, N], shape (n,); only what is kept is observed."""
        self.mechanics.torque[:] = torque
        kept, between = parts_of(self.keep.fields), self.plan.between.copy()
        between[[SEE, ACT]] = 0
        self.plan = self.plan._replace(
            law=np.zeros(2, np.int64), parts=kept, parts_between=parts_of(()), between=between
        )
        self._straight = self._straight_code()
        self.periods = addressed(run_periods, self.mechanics, self.senses, self.plan, layouts=self.layouts)

    def go(self, is_stopped: Callable[[], bool], periods: int = PERIODS) -> Result:
        """Run to the end, or until somebody says stop, which is asked every so many control periods, at most 500.

        A guard is asked in Python, between calls of the compiled loop that are so much shorter; where it ends the run
        the sample of that period is still taken, and no step follows it.
        """
        progress, period, stop = self.plan.progress, self._setup.asked.control_period, None
        stride = periods if self._guard is None else self._guard.stride
        while progress[NEXT] <= progress[LAST] and progress[FAULT] == HEALTHY:
            if is_stopped():
                return self._result(Outcome("interrupted", self._time(), f"interrupted at t = {self._time():g} s"))
            first = int(progress[NEXT])
            if self._guard is not None and first < progress[LAST]:
                stop = self._guard.stopped(first, round(first * period, 12), self._state.q)
                if stop:
                    progress[LAST] = first
            progress[LIMIT] = min(first + periods, first + stride - first % stride)
            rows = self.table(first, min(int(progress[LIMIT]) - 1, int(progress[LAST])))
            self.plan.desired[: len(rows)] = rows
            self.periods()
        if progress[FAULT] != HEALTHY:
            stop = self.error()
        if stop:
            return self._result(Outcome(stop.reason, stop.time, str(stop)))
        return self._result(Outcome(FINISHED, round(int(progress[LAST]) * period, 12), ""))

    @property
    def sizes(self) -> Sizes:
        """Of the observation."""
        return self.observation.known.sizes

    def table(self, first: int, last: int) -> Array:
        """What is asked for in these control periods."""
        reference, period = self._setup.reference, self._setup.asked.control_period
        return self._asked.rows(reference, self._start, self._motion, period, first, last)

    def _time(self) -> float:
        """Of the last sample without fault [s]."""
        return round(max(int(self.plan.progress[NEXT]) - 1, 0) * self._setup.asked.control_period, 12)

    def error(self) -> SimulationStopped:
        """The error for what ended the run, by `Plan.progress`."""
        fault, finger = int(self.plan.progress[FAULT]), int(self.plan.progress[FINGER])
        if fault != BAD_TORQUE:
            return stopped(fault, finger, self.plant, self._time(), math.isfinite(self._setup.stepper.stable_up_to))
        controller, time = self._setup.controller, float(self.plan.clock[0])
        self.observation.__dict__["time"] = time
        assert self.law is not None
        error = controller.complaint(self.observation, self.law)
        if isinstance(error, SimulationStopped):
            return error
        what = f"raised {type(error).__name__}: {error}"
        if error is None:
            what = f"returned a torque with NaN or infinity: {self.plan.command.tolist()} N m"
        return at_fault(controller, what, time)

    def _result(self, outcome: Outcome) -> Result:
        rows = self.plan.rows[: self.plan.progress[SAMPLES]].copy()
        return Result(outcome, self.keep.variables_of(rows, self.observation.known.sizes, self.plant))
