"""Where a loop is looked at: a state of a run with its controller, in front of a control period of any length."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.build import assemble
from softhand.assembly.parts import read_start
from softhand.assembly.probe import Probe, check_states, recorded_scenario
from softhand.assembly.resolve import Setup, resolve
from softhand.assembly.unmodelled import must_model
from softhand.closed_loop.start import goal_at, goal_of, resting_since
from softhand.controllers.controller import Controller
from softhand.derivatives.situation import Situation, relaxed_state
from softhand.errors import RecordingError, ScenarioError, SimulationStopped
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.recording.recording import Recording
from softhand.references.goal import Goal
from softhand.references.reference import resting
from softhand.scenario.scenario import Scenario
from softhand.simulation.asking import raised_by
from softhand.simulation.simulation import whole_periods
from softhand.steppers.midpoint import Midpoint

FINEST = 10
"""Steps of the plant in a control period, at least: what the loop does is then that of the plant, not of its steps."""

START, END = "start", "end"
At = str | float | State


@dataclass(frozen=True, eq=False)
class Place:
    """A state of a run, and what its controller is asked for there.

    Attributes:
        setup: what the run is made of.
        state: at its time.
        goal: what is asked for at all times; None for what the reference asks for then.
        words: where that is.
        memory: of the controller before it speaks there.
        has_memory: whether that is known; else the controller has begun a period before.
        held: for how long a torque is held, other than the scenario says [s].
    """

    setup: Setup
    state: State
    goal: Goal | None
    words: str
    memory: Any = None
    has_memory: bool = False
    held: float | None = None

    def __post_init__(self) -> None:
        must_model("A linear loop", self.setup.world.mechanics, self.setup.actuation)

    @property
    def period(self) -> float:
        """For which a torque is held [s]."""
        if self.held is not None:
            return self.held
        return self.calls * self.setup.asked.control_period

    @property
    def calls(self) -> int:
        """Control periods between two calls of the controller."""
        return whole_periods(self.setup.controller, self.setup.asked.control_period)

    @property
    def controller(self) -> Controller:
        """With its settings."""
        return self.setup.controller

    @property
    def plant(self) -> Plant:
        """Of its own."""
        return _plant(self.setup)

    def with_controller(self, controller: Controller) -> Place:
        """The same with another controller, which has begun a period before."""
        setup = replace(self.setup, controller=controller)
        return replace(self, setup=setup, memory=None, has_memory=False)

    def situation(self, period: float | None = None, steps: int = 1) -> Situation:
        """In front of one control period, its plant in steps of a tenth of it or less.

        Args:
            period: for which the torque is held, other than that of the scenario [s].
            steps: of the plant in a period at least, above `FINEST`.

        Raises:
            ControllerError: the controller raised.
        """
        held = period or self.period
        count = max(FINEST, steps, int(np.ceil(held / self.setup.stepper.step - 1e-9)))
        setup = replace(self.setup, stepper=Midpoint(step=held / count))
        motion = resting(self.goal) if self.goal else setup.reference.start(read_start(setup.asked))
        probe, controller, time = Probe(_plant(setup), motion, setup.sensing), setup.controller, self.state.time
        memory = self.memory
        try:
            if not self.has_memory:
                before = max(time - held, 0.0)
                time = before + held
                first = probe.seen(self.state, before)
                _, memory = controller.torque(first, controller.start(first))
            observation = probe.seen(self.state, time)
            command = np.asarray(controller.torque(observation, memory)[0], dtype=float)
        except Exception as error:
            raise raised_by(controller, error, time) from error
        torque = np.clip(command, -observation.effort_limit, observation.effort_limit)
        state = State(self.state.q, self.state.v, self.state.z, time)
        return Situation(setup, _plant(setup), probe, state, memory, torque, setup.law, held)


def find_place(source: Scenario | Recording, at: At | None = None) -> Place:
    """Where a loop is looked at.

    Args:
        source: a scenario or a recording.
        at: `start`, `end`, a time of the run [s], of which the nearest sample is taken, or a state, such as that of an
            `Equilibrium`. By default the start of a scenario and the end of a recording. Start and end are asked to
            stay there, a state to stay at what is asked for at its time. The end of a recording is its
            quietest sample since the reference rests, the last one if it moves to the end.

    Raises:
        ScenarioError: `at` is none of these, or not within the run, or no state of this plant.
        RecordingError: the recording is empty, or its scenario cannot be read.
        SimulationStopped: the run of the scenario is lost before.
    """
    if isinstance(at, State):
        setup = resolve(recorded_scenario(source) if isinstance(source, Recording) else source)
        return held_pose(setup, goal_at(setup, at), at, at.time, "the given state")
    if isinstance(source, Recording):
        return place_in(source, END if at is None else at)
    setup = resolve(source)
    if at is None or at == START:
        start = read_start(setup.scenario)
        return held_pose(setup, start, setup.grasp.state, 0.0, "the start")
    scenario = setup.scenario
    times = np.arange(round(scenario.duration / scenario.control_period) + 1) * scenario.control_period
    k = len(times) - 1 if at == END else _nearest(times, at, "the run")
    (found,) = _of_run(setup, [k])
    return _asked_to_stay(found) if at == END else found


def find_places(source: Scenario | Recording, count: int) -> Iterator[Place]:
    """Evenly along a run, from its first sample to its last; that of a scenario is computed.

    A scenario has the memory of its controller at each; of a recording the controller begins anew there.
    """
    if isinstance(source, Recording):
        setup, plant = _recorded(source)
        for k in _evenly(len(source), count):
            yield _sample(source, setup, plant, k)
        return
    setup = resolve(source)
    yield from _of_run(setup, _evenly(round(setup.scenario.duration / setup.scenario.control_period) + 1, count))


def _evenly(count: int, wanted: int) -> list[int]:
    return np.unique(np.linspace(0, count - 1, max(2, min(wanted, count))).round().astype(int)).tolist()


def _plant(setup: Setup) -> Plant:
    return Plant(setup.world, setup.fingertips, setup.supports, "compiled", setup.taxels)


def _of_run(setup: Setup, wanted: Sequence[int]) -> Iterator[Place]:
    """Samples of a run, which is computed as far as they go."""
    simulation = assemble(setup)
    k = 0
    for target in wanted:
        try:
            while k < target:
                simulation.sample()
                simulation.step()
                k += 1
            simulation.sample()
        except SimulationStopped as stop:
            stop.say_more(f"Samples up to t = {stop.time:g} s can be looked at: give such a time with `at`.")
            raise
        saved = simulation.save()
        assert saved.carried is not None
        state, has_memory = State(saved.q, saved.v, saved.z, saved.time), bool(saved.carried.loop["has_memory"][0])
        words = f"the sample at t = {saved.time:g} s"
        yield Place(setup, state, None, words, saved.carried.memory, has_memory)


def _recorded(recording: Recording, setup: Setup | None = None) -> tuple[Setup, Plant]:
    if "mode" in recording.attributes:
        raise RecordingError("the recording shows a mode, enlarged, and is no run; give one of a run.", file=None)
    if not len(recording):
        raise RecordingError("the recording has no samples, and so no state; compute the run anew.", file=None)
    setup = setup or resolve(recorded_scenario(recording))
    plant = _plant(setup)
    check_states(plant, recording, "is_slipping")
    return setup, plant


def _sample(recording: Recording, setup: Setup, plant: Plant, k: int) -> Place:
    state = relaxed_state(plant, recording, k)
    return Place(setup, state, None, f"the sample at t = {state.time:g} s")


def held_pose(setup: Setup, goal: Goal, state: State, time: float, words: str) -> Place:
    """A state, which may lack rows for supports, asked to stay at a goal at a time [s]."""
    return Place(setup, replace(_plant(setup).with_supports(state), time=time), goal, words)


def place_in(recording: Recording, at: str | float, setup: Setup | None = None) -> Place:
    """Likewise of a recording, whose setup may be known."""
    setup, plant = _recorded(recording, setup)
    if at not in (START, END):
        return _sample(recording, setup, plant, _nearest(recording.time, at, "the recording"))
    k = 0 if at == START else len(recording) - 1
    begin = resting_since(setup.reference.start(read_start(setup.scenario)), recording.stop_time)
    if at == END and begin is not None:
        speed = np.max(np.abs(recording.joint_velocity), axis=1)
        k = int(np.argmin(np.where(recording.time >= begin, speed, np.inf)))
    return _asked_to_stay(_sample(recording, setup, plant, k))


def _asked_to_stay(place: Place) -> Place:
    motion = place.setup.reference.start(read_start(place.setup.scenario))
    return replace(place, goal=goal_of(motion.update(place.state.time)))


def _nearest(times: NDArray[np.floating[Any]], at: str | float, where: str) -> int:
    number = isinstance(at, int | float) and not isinstance(at, bool) and np.isfinite(at)
    if not number or not times[0] - 1e-9 <= float(at) <= times[-1] + 1e-9:
        near = f"; the nearest is {min(max(float(at), times[0]), times[-1]):g}" if number else ""
        raise ScenarioError(
            f"at: got {at!r}; allowed are 'start', 'end' and times of {where}, {times[0]:g} to {times[-1]:g} s{near}.",
            key="at", value=at,
        )  # fmt: skip
    return int(np.argmin(np.abs(times - float(at))))
