"""Where a model is linear about: a plant with its state, torques, controller and time, of a scenario or a recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.build import assemble
from softhand.assembly.parts import read_start
from softhand.assembly.probe import Probe, check_states, recorded_scenario, recorded_state
from softhand.assembly.resolve import Setup, resolve
from softhand.assembly.unmodelled import must_model, must_not_feel, must_slip_as_a_whole
from softhand.closed_loop.start import relax_memory
from softhand.controllers.controller import Controller
from softhand.controllers.formula import fields_read
from softhand.errors import RecordingError, ScenarioError
from softhand.laws.law import Law
from softhand.model.world import slides_of
from softhand.numerics.arrays import Array, as_numbers
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.recording.recording import Recording
from softhand.scenario.scenario import Scenario, as_scenario
from softhand.simulation.simulation import whole_periods

_RECORDED = ("joint_position", "joint_velocity", "object_position", "object_rpy", "object_twist", "deformation")

_SLIPS = ("is_slipping", "support_is_slipping")


@dataclass(frozen=True, eq=False)
class Situation:
    """One sample of a run.

    Attributes:
        setup: what the run is made of.
        plant: with compiled terms, for the steps.
        probe: of another plant of the same kind, for what is observed, and of what is asked for.
        state: at its time.
        memory: of the controller before it speaks.
        torque: held from there on, within the effort limits [N m, N], shape (n,).
        law: at all tips in place of those of the scenario, if any.
        held: for how long the torque is held, without pushes from outside [s]; None for what the scenario says.
    """

    setup: Setup
    plant: Plant
    probe: Probe
    state: State
    memory: Any
    torque: Array
    law: Law | None = None
    held: float | None = None

    @property
    def slides(self) -> NDArray[np.bool_]:
        """Which joints slide, shape (n,)."""
        return slides_of(self.plant.world)

    @property
    def period(self) -> float:
        """For which a torque is held [s]."""
        if self.held is not None:
            return self.held
        control_period = self.setup.scenario.control_period
        return whole_periods(self.setup.controller, control_period) * control_period


def find_situation(
    source: Scenario | Recording | str | Path,
    sample: int,
    state: State | None,
    torque: Any,
    controller: Controller | None,
    law: Law | None,
    overrides: Mapping[str, Any] | None,
    values: Mapping[str, Any],
) -> Situation:
    """As `linearize` is asked for it.

    Raises:
        ScenarioError: the sample is none of the run, or a state or torque is no number or not of this plant.
        RecordingError: the recording lacks what tells its states, or has no number there.
    """
    if isinstance(source, Plant):
        raise ScenarioError(
            "source: got a Plant; give a scenario or a recording, or use softhand.linearize_plant(plant, state, "
            "torque).",
            key="source", value=source,
        )  # fmt: skip
    if isinstance(source, Recording):
        if overrides or values:
            given = ", ".join([*(overrides or {}), *values])
            raise ScenarioError(
                f"{given}: a recording has its own scenario; give values with a scenario alone.",
                key=given,
                value=source,
            )
        setup = resolve(recorded_scenario(source), controller, law)
        _check(setup)
        found = _of_recording(source, setup, sample)
    else:
        setup = resolve(as_scenario(source, overrides, **values), controller, law)
        _check(setup)
        found = _of_scenario(setup, sample) if state is None else _at(setup, state)
    if state is not None and isinstance(source, Recording):
        found = _at(setup, state)
    return replace(found, law=law, torque=found.torque if torque is None else checked_torque(torque, len(found.torque)))


def _check(setup: Setup) -> None:
    must_model("A linear model", setup.world.mechanics, setup.actuation)
    must_not_feel("A linear model", "controller", fields_read(setup.controller))
    must_slip_as_a_whole("A linear model", setup.fingertips)


def _empty(setup: Setup) -> tuple[Plant, Probe]:
    plant, seen = (Plant(setup.world, setup.fingertips, setup.supports, "compiled", setup.taxels) for _ in range(2))
    return plant, Probe(seen, setup.reference.start(read_start(setup.scenario)), setup.sensing)


def _at(setup: Setup, state: State) -> Situation:
    """A state given: the controller goes on with the memory that is in it, or begins there."""
    plant, probe = _empty(setup)
    state = checked_state(plant, state)
    carried = state.carried
    if carried is not None and carried.loop["has_memory"][0]:
        return _speaking(setup, plant, probe, state, carried.memory)
    return _speaking(setup, plant, probe, state, setup.controller.start(probe.seen(state, state.time)))


def _speaking(setup: Setup, plant: Plant, probe: Probe, state: State, memory: Any) -> Situation:
    observation = probe.seen(state, state.time)
    command = np.asarray(setup.controller.torque(observation, memory)[0], dtype=float)
    limit = observation.effort_limit
    return Situation(setup, plant, probe, state, memory, np.clip(command, -limit, limit))


def _of_scenario(setup: Setup, sample: int) -> Situation:
    """The run itself, up to there."""
    count = round(setup.scenario.duration / setup.scenario.control_period)
    wanted = _place(sample, count + 1, "the run")
    simulation = assemble(setup)
    for _ in range(wanted):
        simulation.sample()
        simulation.step()
    simulation.sample()
    saved = simulation.save()
    assert saved.carried is not None
    plant, probe = _empty(setup)
    return Situation(setup, plant, probe, saved, saved.carried.memory, simulation.torque.copy())


def _of_recording(recording: Recording, setup: Setup, sample: int) -> Situation:
    """What relaxing dampings remember is taken as relaxed; the controller begins there."""
    plant, probe = _empty(setup)
    check_states(plant, recording, "joint_torque", "is_slipping")
    k = _place(sample, len(recording), "the recording")
    state = relaxed_state(plant, recording, k, "joint_torque")
    memory = setup.controller.start(probe.seen(state, state.time))
    return Situation(setup, plant, probe, state, memory, recording.joint_torque[k].copy())


def relaxed_state(plant: Plant, recording: Recording, sample: int, *names: str) -> State:
    """The state of a sample at its time, what relaxing dampings remember taken as relaxed.

    Args:
        plant: of the recording.
        recording: checked by `check_states`.
        sample: from 0.
        names: of further variables that have to be numbers there.

    Raises:
        RecordingError: it has no number there.
    """
    time = float(recording.time[sample])
    for name in (*_RECORDED, *names):
        values = recording[name][sample]
        if not np.all(np.isfinite(values)):
            bad = values[~np.isfinite(values)][0]
            raise RecordingError(
                f"sample {sample} (t = {time:g} s): {name} has {bad}, which is no number; choose an earlier sample.",
                file=None,
            )
    state = replace(recorded_state(plant, recording, sample), time=time)
    relax_memory(plant, state)
    slips = np.concatenate([recording[name][sample] for name in _SLIPS if name in recording.variables])
    for z, pad, slipped in zip(state.z, plant.pads, slips, strict=False):
        if pad["slip_column"] >= 0:
            z[pad["slip_column"]] = slipped
    return state


def _place(sample: Any, count: int, where: str) -> int:
    if isinstance(sample, bool) or not isinstance(sample, int | np.integer) or not -count <= sample < count:
        raise ScenarioError(
            f"sample: got {sample!r}; {where} has samples 0 to {count - 1}, or from -1, the last, down to {-count}.",
            key="sample", value=sample,
        )  # fmt: skip
    return int(sample) % count


def checked_state(plant: Plant, state: State) -> State:
    """A state of this plant; z may have the rows of the tips alone, as that of a grasp."""
    if state.z.shape[0] == plant.world.n_tips and plant.supports:
        state = replace(plant.with_supports(state), time=state.time)
    model = plant.world
    shapes = {"q": (model.nq,), "v": (model.nv,), "z": (len(plant.contacts), plant.n_memory)}
    for name, shape in shapes.items():
        given = getattr(state, name)
        if given.shape != shape:
            raise _misfit(name, given, f"it has shape {given.shape}, but that of this plant is {shape}")
        if not np.all(np.isfinite(given)):
            place = tuple(int(k) for k in np.argwhere(~np.isfinite(given))[0])
            raise _misfit(name, given, f"it has {given[place]} at {place}, which is no number; give finite numbers")
    if not np.isfinite(state.time):
        raise _misfit("time", state.time, f"got {state.time}; give a finite time [s]")
    return state


def _misfit(name: str, value: Any, why: str) -> ScenarioError:
    return ScenarioError(f"state.{name}: {why}.", key=f"state.{name}", value=value)


def checked_torque(torque: Any, n: int) -> Array:
    """A number for each of n joints [N m, N]."""
    numbers = as_numbers(torque)
    if numbers is None or numbers.shape != (n,) or not np.all(np.isfinite(numbers)):
        raise ScenarioError(
            f"torque: got {torque!r}; the hand has {n} joints, give a finite number for each.",
            key="torque", value=torque,
        )  # fmt: skip
    return numbers
