"""The only loop: observe, control, record, step."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softhand.contact.pairs import contact_pairs
from softhand.controllers.controller import Controller
from softhand.errors import ControllerError, ScenarioError, SimulationStopped, SofthandError
from softhand.numerics.compiled import compiled
from softhand.numerics.prepared import prepared
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.recording.events import events_as_text, find_events, phases_as_text
from softhand.recording.recording import Recording
from softhand.references.reference import Reference
from softhand.sensing.observation import Observation
from softhand.sensing.sensor import Sensor
from softhand.simulation.faults import HEALTHY, approach, broken_down, find_fault, out_of_range, stopped
from softhand.simulation.recorder import Recorder
from softhand.steppers.stepper import Stepper
from softhand.version import __version__

Progress = Callable[[float], None]
"""Called now and then with the simulated time [s]."""

Watch = Callable[[Observation], None]
"""Called with what is seen at each sample."""

_SLIP = ("limit_surface_use", "is_slipping", "slip_travel", "slip_twist", "slip_loss")
_SUPPORT = ("force", "deformation", "point", "rotation", "is_slipping", "slip_loss")
_REPORT_EVERY = 20  # samples between two calls of the progress function


class Simulation:
    """One run: a plant at its start, a controller, a stepper and a reference.

    `run` does it all. Or drive it yourself, a control period at a time:

        simulation.reset()
        while simulation.time < 1.0:
            observation = simulation.sample()   # the controller has spoken: simulation.torque
            simulation.step()

    Attributes:
        plant: hand, object and contacts.
        state: where they are.
        integration: the stepper at work on `state`.
        observation: what the controller sees; live.
        time: simulated time [s] of the next sample.
        torque: joint torques that the next `step` holds [N m], shape (n,); set by `sample`, yours to change after it.
        torque_limited: 1 where an effort limit cut the command, shape (n,).
        scenario: TOML text that the run can be repeated from; goes into the recording.
    """

    def __init__(
        self,
        plant: Plant,
        start: State,
        controller: Controller,
        stepper: Stepper,
        reference: Reference,
        duration: float,
        control_period: float,
        scenario: str = "",
    ) -> None:
        n, nc = plant.world.n_joints, plant.world.n_tips
        self.plant, self.state, self.scenario = plant, start.copy(), scenario
        self._start, self._controller, self._reference = start, controller, reference
        self._period = control_period
        self._periods = round(duration / control_period)
        self._steps = round(control_period / stepper.step)
        self._stride = _whole_periods(controller, control_period)
        self._sensor = Sensor(plant, reference.desired)
        self.observation = self._sensor.observation
        self.integration = stepper.start(plant)
        self.torque, self.torque_limited = self.integration.torque, np.zeros(n, np.int8)
        self._command, self._Theta = np.zeros(n), np.zeros(nc)
        self._limit = prepared(_limit, self._command, self.observation.effort_limit, self.torque, self.torque_limited)
        self._find_fault = prepared(find_fault, self.state.v, plant.pads, plant.contacts, self._Theta)
        self.integration.advance(self.state, self.torque)  # compiles, so that no clock of a run counts it
        self.reset()

    def reset(self) -> None:
        """Back to the start."""
        for now, start in zip((self.state.q, self.state.v, self.state.z),
                              (self._start.q, self._start.v, self._start.z), strict=True):  # fmt: skip
            now[...] = start
        self._k, self.time = 0, 0.0
        self._memory: Any = None
        self._checked: Any = None
        self.integration.restart()
        self.torque[:], self.torque_limited[:], self._Theta[:] = 0.0, 0, np.nan
        for name in ("is_broken", *_SLIP):
            self.plant.contacts[name] = 0

    def sample(self) -> Observation:
        """Observe, ask the controller, apply the effort limits.

        Raises:
            ControllerError: the controller raised, or returned no torque.
            SimulationStopped: the state is beyond reason, or a contact has left the range of the model.
        """
        self._reference.update(self.time)
        observation = self._sensor.observe(self.state, self.time)
        fault, finger = self._find_fault()
        if fault != HEALTHY:
            raise stopped(fault, finger, self.plant, self._last_good())
        if self._k % self._stride == 0:
            self._ask(observation)
            if not self._limit():
                raise self._bad_torque(f"returned a torque with NaN or infinity: {self._command.tolist()} N m")
        return observation

    def step(self) -> None:
        """Hold the torques for one control period."""
        try:
            for _ in range(self._steps):
                self.integration.advance(self.state, self.torque)
        except FloatingPointError as error:
            raise broken_down(error, self.plant, self.time) from error
        self._k += 1
        self.time = round(self._k * self._period, 12)

    def run(self, progress: Progress | None = None, watch: Watch | None = None) -> Recording:
        """Simulate from the start to the end.

        Args:
            progress: called every 20 control periods.
            watch: called every control period with the observation, which is live; for viewers.

        Returns:
            All samples, one a control period, the last at the end of the run.

        Raises:
            ControllerError: the controller raised, or returned no torque.
            SimulationStopped: the run diverged, a contact left the range of the model, or it was interrupted. Both
                carry `.recording` with all samples so far.
        """
        recorder = self._allocate()
        self.reset()
        began = clock.perf_counter()
        try:
            for k in range(self._periods + 1):
                self.sample()
                recorder.record()
                if k == 0:
                    began = clock.perf_counter()  # the first sample may compile the controller
                if progress is not None and k % _REPORT_EVERY == 0:
                    progress(self.time)
                if watch is not None:
                    watch(self.observation)
                if k < self._periods:
                    self.step()
        except SimulationStopped as stop:
            message = f"{stop}{self._approach(recorder)}"
            stop.args = (message,)
            stop.recording = self._finish(recorder, began, message)  # type: ignore[attr-defined]
            raise
        except KeyboardInterrupt as interrupt:
            time = round(self._period * max(len(recorder) - 1, 0), 12)
            message = f"interrupted at t = {time:g} s"
            raise SimulationStopped(
                message, recording=self._finish(recorder, began, message), reason="interrupted", time=time
            ) from interrupt
        if progress is not None:
            progress(self.time)
        return self._finish(recorder, began, "")

    def _allocate(self) -> Recorder:
        try:
            return Recorder(self._live(), self._periods + 1)
        except (MemoryError, ValueError) as error:
            raise ScenarioError(
                f"duration: {self._periods + 1:,} samples do not fit into memory ({error}); "
                "shorten duration or lengthen control_period.",
                key="duration",
                value=self._periods * self._period,
            ) from error

    def _ask(self, observation: Observation) -> None:
        """Ask the controller; sets the command and its memory."""
        try:
            if self._k == 0:
                self._memory = self._controller.start(observation)
            result = self._controller.torque(observation, self._memory)
        except Exception as error:
            raise self._raised(error) from error
        if not (isinstance(result, tuple) and len(result) == 2):
            raise self._bad_torque(f"returned {result!r}; it must return the torque and its memory, two values")
        command, self._memory = result
        if command is not self._checked:  # many controllers write into the same array each time
            self._check(command)
        self._command[:] = command

    def _check(self, result: Any) -> None:
        try:
            command = np.asarray(result, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise self._bad_torque(f"returned {result!r} as torque, which is no array of numbers") from error
        if command.shape != self._command.shape:
            raise self._bad_torque(
                f"returned a torque of shape {command.shape}: {command.tolist()}; "
                f"the hand has {len(self._command)} joints"
            )
        self._checked = result if isinstance(result, np.ndarray) else None

    def _raised(self, error: Exception) -> SofthandError:
        """What to raise for an error of the controller: what it raised on purpose, all else with its name."""
        if isinstance(error, ScenarioError | ControllerError):
            return error
        return self._bad_torque(f"raised {type(error).__name__}: {error}")

    def _bad_torque(self, what: str) -> ControllerError:
        name, time = type(self._controller).__name__, self.time
        return ControllerError(
            f"controller '{name}' {what} (at t = {time:g} s).", controller=name, reason="controller", time=time
        )

    def _last_good(self) -> float:
        """Time of the previous sample [s]."""
        return round(max(self._k - 1, 0) * self._period, 12)

    def _approach(self, recorder: Recorder) -> str:
        return approach(recorder["contacts"]["angles"][:, :, 1], self.plant) if len(recorder) else ""

    def _live(self) -> dict[str, NDArray[Any]]:
        seen, desired = self.observation, self._reference.desired
        return {
            "joint_position": seen.joint_position,
            "joint_velocity": seen.joint_velocity,
            "joint_torque": self.torque,
            "torque_limited": self.torque_limited,
            "q_O": seen.q_O,
            "object_twist": seen.object_twist,
            "internal_force": seen.internal_force,
            "contacts": self.plant.tip_contacts,
            **self._supports(),
            "contact_coordinates": seen.eta,
            "contact_coordinates_rate": seen.eta_rate,
            "friction_use": seen.friction_use,
            "q_Od": desired.coordinates,
            "internal_force_desired": desired.internal_force,
        }

    def _finish(self, recorder: Recorder, began: float, reason: str) -> Recording:
        variables = {"time": np.round(np.arange(len(recorder)) * self._period, 12), **recorder.variables()}
        q_O, q_Od, contacts = (variables.pop(name) for name in ("q_O", "q_Od", "contacts"))
        variables["object_position"], variables["object_rpy"] = q_O[:, :3], q_O[:, 3:]
        variables["object_position_desired"], variables["object_rpy_desired"] = q_Od[:, :3], q_Od[:, 3:]
        for name, field in (
            ("deformation", "deformation"),
            ("contact_force", "force"),
            ("contact_angles", "angles"),
            ("contact_point", "point"),
            ("contact_rotation", "rotation"),
            ("tip_position", "tip"),
            ("contact_feature", "feature"),
            *((name, name) for name in _SLIP),
        ):
            variables[name] = contacts[field]
        variables["deformation"] = _deformation(contacts, self.plant)
        world = self.plant.world
        lower, upper = world.position_limits
        position = variables["joint_position"]
        variables["joint_limited"] = np.subtract(position > upper, position < lower, dtype=np.int8)
        steps = max(len(recorder) - 1, 0) * self._steps
        wall = max(clock.perf_counter() - began, 1e-9)
        recording = Recording(
            variables=variables,
            labels={
                "joint": world.joint_names,
                "contact": tuple(tip.name for tip in world.tips),
                "pair": tuple(f"{i + 1}{j + 1}" for i, j in contact_pairs(world.n_tips)),
                **({"support": tuple(support.name for support in self.plant.supports)} if self.plant.supports else {}),
            },
            scenario=self.scenario,
            version=__version__,
            complete=not reason,
            reason=reason,
            stop_time=float(variables["time"][-1]) if len(recorder) else 0.0,
            attributes={"steps_per_second": steps / wall, "wall_time": wall, **self._notes(variables)},
            hand_urdf=world.hand_text,
            object_urdf=world.object_text,
        )
        if self._reference.phases:
            recording.attributes["phases"] = phases_as_text(self._reference.phases)
        recording.attributes["events"] = events_as_text(find_events(recording))
        return recording

    def _supports(self) -> dict[str, NDArray[Any]]:
        if not self.plant.supports:
            return {}
        return {f"support_{name}": self.plant.support_contacts[name] for name in _SUPPORT}

    def _notes(self, variables: dict[str, NDArray[Any]]) -> dict[str, str]:
        """What a reader of the recording must know of the fingertip law."""
        Phi, dr = variables["contact_angles"][..., 1], variables["deformation"][..., 0]
        note = out_of_range(variables["time"], dr, Phi, self.plant) if len(dr) else ""
        return {"out_of_range": note} if note else {}


def _deformation(contacts: NDArray[np.void], plant: Plant) -> NDArray[np.float64]:
    """As recorded: the displacements of a law in surface coordinates as the angles s / R."""
    deformation = contacts["deformation"].copy()
    surface = np.flatnonzero(plant.pads["is_surface"][: plant.world.n_tips])
    deformation[:, surface, 1:3] /= contacts["distance"][:, surface, None]
    return deformation


def _whole_periods(controller: Controller, period: float) -> int:
    """Control periods between two calls of the controller."""
    if controller.period is None:
        return 1
    stride = round(controller.period / period)
    if stride < 1 or abs(stride * period - controller.period) > 1e-9 * period:
        raise ScenarioError(
            f"controller.period: got {controller.period:g} s; it must be a whole number of control periods of "
            f"{period:g} s, at least one.",
            key="controller.period",
            value=controller.period,
        )
    return stride


@compiled
def _limit(command, effort_limit, torque, limited):
    """Apply the effort limits; False if the command is not finite, torque then stays."""
    for k in range(command.shape[0]):
        if not math.isfinite(command[k]):
            return False
    for k in range(command.shape[0]):
        torque[k] = min(max(command[k], -effort_limit[k]), effort_limit[k])
        limited[k] = torque[k] != command[k]
    return True
