"""Where a loop is looked at: a pose of plant and controller that the reference stays at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from softhand.assembly.instruments import read_actuation
from softhand.assembly.parts import read_controller, read_start
from softhand.assembly.plant import read_grasp, read_supports, read_world
from softhand.assembly.probe import Probe, check_states, recorded_scenario, recorded_state
from softhand.assembly.resolve import Setup, resolve
from softhand.assembly.taxels import read_taxels
from softhand.assembly.unmodelled import must_model, must_slip_as_a_whole
from softhand.contact.elements import LAW
from softhand.contact.records import LEANING, REMEMBERED, STORED
from softhand.controllers.controller import Controller
from softhand.errors import RecordingError, ScenarioError
from softhand.laws.law import Law
from softhand.model.world import World
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.recording.recording import Recording
from softhand.references.goal import Desired, Goal
from softhand.references.reference import Motion, resting
from softhand.scenario.scenario import Scenario
from softhand.simulation.actuation import Actuation


@dataclass(frozen=True, eq=False)
class HeldStart:
    """A state whose reference stays there.

    Attributes:
        probe: of its plant, supports included.
        state: about which small motions are looked at.
        controller: of the scenario.
        period: for which a torque is held [s].
        time: in the run [s].
        actuation: the drives, which are not part of it.
    """

    probe: Probe
    state: State
    controller: Controller
    period: float
    time: float = 0.0
    actuation: Actuation | None = None

    def must_be_known(self, tool: str) -> None:
        """Refuse dry friction and servos for a tool that takes controller and plant alone, as `must_model`."""
        must_model(tool, self.probe.plant.world.mechanics, self.actuation)
        must_slip_as_a_whole(tool, self.probe.plant.fingertips)


def held_start(scenario: Scenario, laws: Law | Sequence[Law] | None = None, world: World | None = None) -> HeldStart:
    """The start of a scenario, asked to stay there.

    Args:
        scenario: of which the reference is not used.
        laws: in place of the scenario's fingertip laws, one for all or one for each.
        world: hand and object, if they are read already.

    Raises:
        GraspError: there is no start at rest.
    """
    world, controller = world or read_world(scenario), read_controller(scenario)
    fingertips, grasp = read_grasp(scenario, world, laws)
    supports, taxels = read_supports(scenario, world, fingertips), read_taxels(scenario, world)
    plant = Plant(world, fingertips, supports, scenario.stepper.terms, taxels)
    probe = Probe(plant, resting(read_start(scenario)))
    period, drives = controller.period or scenario.control_period, read_actuation(scenario, world, controller)
    return HeldStart(probe, plant.with_supports(grasp.state), controller, period, actuation=drives)


def held_at(setup: Setup, goal: Goal, state: State, time: float = 0.0) -> HeldStart:
    """A state of a run, asked to stay at a goal; the controller is a copy, which the run does not share.

    Args:
        setup: what the run is made of.
        goal: what is asked for there.
        state: memories of supports included, or without them, as a grasp has it.
        time: when that is [s].
    """
    plant, controller = (
        Plant(setup.world, setup.fingertips, setup.supports, taxels=setup.taxels),
        setup.controller.model_copy(),
    )
    period = controller.period or setup.scenario.control_period
    still = state if len(state.z) == len(plant.contacts) else plant.with_supports(state)
    return HeldStart(Probe(plant, resting(goal)), still, controller, period, time, setup.actuation)


def held_state(scenario: Scenario, state: State) -> HeldStart:
    """A state of a scenario, such as that of an `Equilibrium`, asked to stay at what is asked for at its time.

    Raises:
        ScenarioError: it is no state of this plant.
    """
    setup = resolve(scenario)
    return held_at(setup, goal_at(setup, state), state, state.time)


def goal_at(setup: Setup, state: State) -> Goal:
    """What is asked for at the time of a state of this plant.

    Raises:
        ScenarioError: it is no state of this plant.
    """
    desired = setup.reference.start(read_start(setup.scenario)).update(state.time)
    nq, nv, nc = setup.world.nq, setup.world.nv, setup.world.n_tips
    if (state.q.shape, state.v.shape) != ((nq,), (nv,)) or state.z.ndim != 2 or len(state.z) < nc:
        raise ScenarioError(
            f"state: q, v and z have the shapes {state.q.shape}, {state.v.shape} and {state.z.shape}; this plant has "
            f"{nq} positions, {nv} velocities and {nc} tips.",
            key="state", value=state,
        )  # fmt: skip
    return goal_of(desired)


def held_end(recording: Recording, setup: Setup | None = None) -> HeldStart:
    """Where a run came to rest: its quietest sample since the reference stands still, or its last one if it moves.

    What relaxing dampings remember is taken as relaxed; the controller begins there anew.

    Args:
        recording: with at least one sample.
        setup: of its scenario, if that is known.

    Raises:
        RecordingError: it is empty, or its scenario cannot be read.
    """
    if not len(recording):
        raise RecordingError("the recording has no samples, and so no end.", file=None)
    setup = setup or resolve(recorded_scenario(recording))
    motion = setup.reference.start(read_start(setup.scenario))
    begin, k = resting_since(motion, recording.stop_time), len(recording) - 1
    if begin is not None:
        speed = np.max(np.abs(recording.joint_velocity), axis=1)
        k = int(np.argmin(np.where(recording.time >= begin, speed, np.inf)))
    return _held(recording, setup, k)


def held_sample(recording: Recording, time: float) -> HeldStart:
    """The sample of a run nearest to a time, asked to stay at what the reference asks for there; see `held_end`.

    Args:
        recording: with at least one sample.
        time: within it [s].

    Raises:
        RecordingError: it does not reach to that time, or its scenario cannot be read.
    """
    if not len(recording) or not recording.time[0] <= time <= recording.time[-1]:
        reach = f"goes from {recording.time[0]:g} to {recording.time[-1]:g} s" if len(recording) else "has no samples"
        raise RecordingError(f"at: got {time:g} s, but the recording {reach}.", file=None)
    k = int(np.argmin(np.abs(recording.time - time)))
    return _held(recording, resolve(recorded_scenario(recording)), k)


def _held(recording: Recording, setup: Setup, k: int) -> HeldStart:
    plant, time = Plant(setup.world, setup.fingertips, setup.supports, taxels=setup.taxels), float(recording.time[k])
    check_states(plant, recording)
    desired = setup.reference.start(read_start(setup.scenario)).update(time)
    held = held_at(setup, goal_of(desired), recorded_state(plant, recording, k), time)
    relax_memory(held.probe.plant, held.state)
    return held


def goal_of(desired: Desired) -> Goal:
    """What is asked for at one time, as plain values."""
    return Goal(desired.coordinates, desired.internal_force, float(desired.opening[0]), float(desired.carried[0]),
                standoff=desired.standoff)  # fmt: skip


def resting_since(motion: Motion, time: float) -> float | None:
    """Since when a reference has asked for what it asks for at a time [s]; None if it comes from elsewhere just then.

    References that do not know where they rest count as moving.
    """
    now, since = goal_of(motion.update(time)).row(), None
    for begin in sorted((0.0, *motion.stops), reverse=True):
        if motion.stops and begin < time:
            if not np.array_equal(goal_of(motion.update(begin)).row(), now):
                break
            since = begin
    return since


def relax_memory(plant: Plant, state: State) -> None:
    """What relaxing dampings remember as it is where a state has lasted, in place."""
    plant.update(state.q, state.v, state.z)
    for pad, contact, rows, memory in zip(plant.pads, plant.contacts, plant.elements, state.z, strict=True):
        n, count, size = int(pad["elements"]), int(pad["relaxations"]), int(pad["remembered"])
        whole = np.concatenate([contact["deformation_force"], contact["lean_force"]])
        for element, force in enumerate([whole] if n == 1 else rows[:n, LAW : LAW + REMEMBERED + LEANING]):
            first = element * int(pad["block"]) + STORED
            memory[first : first + size * count] = np.tile(force[:size], count)
