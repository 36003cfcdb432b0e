"""The only loop: observe, control, record, step."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Sequence

import numpy as np

from softhand.controllers.controller import Controller
from softhand.errors import ScenarioError, SimulationStopped, SofthandError
from softhand.numerics.arrays import AnyArray, Array, as_numbers
from softhand.numerics.prepared import prepared
from softhand.plant.plant import Plant
from softhand.plant.state import Carried, State
from softhand.recording.recording import Recording
from softhand.references.reference import Motion
from softhand.sensing.fields import RECORDED, room
from softhand.sensing.instruments import Instruments
from softhand.sensing.observation import Observation
from softhand.sensing.quantities import Sensing
from softhand.sensing.sensor import Sensor
from softhand.settings.failures import blaming, failure
from softhand.simulation.actuation import Actuation
from softhand.simulation.asking import Actuators, Asking
from softhand.simulation.faults import HEALTHY, approach, broken_down, find_fault, stopped
from softhand.simulation.fitting import must_fit, periods_until
from softhand.simulation.guard import Guard
from softhand.simulation.interrupts import interruptible, interrupts_held
from softhand.simulation.keep import Keep
from softhand.simulation.pushes import OBJECT, Push, Pushes, Vector3
from softhand.simulation.regulated import notes_of
from softhand.simulation.samples import Samples
from softhand.simulation.touched import Touched
from softhand.steppers.stepper import Stepper

Progress = Callable[[float], None]
"""Called now and then with the simulated time [s]."""

Watch = Callable[[Observation], None]
"""Called with the true observation of each sample."""

TOTALS = ("is_broken", "is_slipping", "slip_travel", "slip_twist", "slip_loss", "limit_surface_use", "slip_speed")
_REPORT_EVERY = 20  # samples between two calls of the progress function
_ZERO = (0.0, 0.0, 0.0)


class Simulation:
    """One run: a plant at its start, a controller, a stepper and a reference.

    `run` does it all. Or drive it yourself, a control period at a time, with the controller or with torques of yours:

        simulation.reset()
        while simulation.time < 1.0:
            observation = simulation.sample()   # the controller has spoken: simulation.torque
            simulation.step()                   # or simulation.step(torque)

    `save` gives the state, `reset(state)` goes back to it; what comes then is what came before, to the last bit.

    Attributes:
        plant: hand, object and contacts.
        state: where they are; live.
        integration: the stepper at work on `state`.
        reference: what the controller is asked for.
        observation: what the controller sees; live.
        truth: what it would see without instruments; live, the same where there are none.
        time: simulated time [s] of the next sample.
        torque: joint torques that the next `step` holds [N m, N], shape (n,); set by `sample`.
        torque_limited: 1 where an effort limit cut the command, shape (n,).
        scenario: TOML text that the run can be repeated from; goes into the recording.

    Args:
        plant: hand, object and contacts.
        start: where they begin.
        controller: None for a simulation that is given torques.
        stepper: integrates a step.
        reference: desired pose and internal force against time.
        duration: of a run [s].
        control_period: between two samples [s]; a whole number of steps.
        scenario: as the attribute.
        pushes: from outside, at times that are known.
        keep: what is recorded of `run`; all variables, each control period, if None.
        sensing: instruments between the grasp and the controller; it sees the truth if None.
        actuation: drives between the controller and the joints; these have the torque at once if None.
        guard: what may end the run beside faults; the sample at which it does is the last one.
    """

    def __init__(
        self,
        plant: Plant,
        start: State,
        controller: Controller | None,
        stepper: Stepper,
        reference: Motion,
        duration: float,
        control_period: float,
        scenario: str = "",
        pushes: Sequence[Push] = (),
        keep: Keep | None = None,
        sensing: Sensing | None = None,
        actuation: Actuation | None = None,
        guard: Guard | None = None,
    ) -> None:
        self.plant, self.state, self.scenario, self.reference = plant, start.copy(), scenario, reference
        self._start, self._period, self._guard = start, control_period, guard
        self._keep = keep or Keep.all()
        self._periods, self._steps = round(duration / control_period), round(control_period / stepper.step)
        self._step = stepper.step
        self._is_limited = math.isfinite(stepper.stable_up_to)
        self._sensor = Sensor(plant, reference.desired)
        self.observation = self.truth = self._sensor.observation
        self._instruments: Instruments | None = None
        if sensing is not None:
            self._instruments = Instruments(plant, self.truth, sensing, reference.desired)
            self.observation = self._instruments.observation
        self._touch = Touched(plant, self.truth) if plant.taxels is not None else None
        with blaming(f"stepper '{type(stepper).__name__}'", "stepper.name"):
            self.integration = stepper.start(plant)
        self._actuators = Actuators(
            self.integration.torque, self.truth.effort_limit, plant.world.joints, self.state.arrays, actuation
        )
        self.torque, self.torque_limited = self._actuators.torque, self._actuators.limited
        self._asking = Asking(controller, self._actuators.command) if controller else None
        self._stride = whole_periods(controller, control_period) if controller else 1
        self._pushes = Pushes(plant, pushes)
        self._Theta = np.zeros(plant.world.n_tips)
        self._find_fault = prepared(find_fault, self.state.v, plant.pads, plant.contacts, self._Theta)
        with blaming(f"stepper '{type(stepper).__name__}'", "stepper.name"):
            self.integration.advance(self.state, self.torque)  # compiles, so that no clock of a run counts it
        self.reset()

    def reset(self, state: State | None = None) -> None:
        """Back to the start, or to a state.

        Args:
            state: of `save`, or any q, v and z of this plant; its time must be that of a sample.

        Raises:
            ScenarioError: the state is not one of this plant and stepper, or its time lies between two samples.
        """
        state = self._start if state is None else state
        loop = {**self._actuators.carry(0), **(self._instruments.carry(0) if self._instruments else {})}
        loop |= self._touch.carry() if self._touch else {}
        must_fit(state, self.state, self.plant, self.integration, loop)
        self._k = periods_until(state.time, self._period)
        self.state.assign(state)
        self.time = round(self._k * self._period, 12)
        self.integration.restart()
        self._actuators.reset()
        if self._instruments:
            self._instruments.forget()
        if self._touch:
            self._touch.forget()
        self._pushes.clear()
        self._Theta[:], self.plant.at[0], self.plant.external[:] = np.nan, np.nan, 0.0
        self._turns: dict[str, Array] = {}
        for name in TOTALS:
            self.plant.contacts[name] = 0
        self.plant.elements[...] = 0.0
        if self._asking:
            self._asking.restart()
        self._asked_at = -1
        if state.carried is not None:
            self._resume(state, state.carried)

    def save(self) -> State:
        """The state now, before the sample at `time`: all that the future depends on. An independent copy.

        Torques and pushes that are given by call are not in it: they are given again.

        Raises:
            ControllerError: the memory of the controller cannot be copied.
        """
        loop = {"torque": self.torque.copy(), "limited": self.torque_limited.copy(), "Theta": self._Theta.copy()}
        memory, has_memory = None, False
        if self._asking:
            asked = self._asked_at == self._k
            memory, has_memory = self._asking.remembered(asked, self.time), self._asking.has_started
        loop["has_memory"] = np.array([has_memory])
        loop |= {f"turns {name}": turns for name, turns in self._turns.items()}
        loop |= self._actuators.carry(self._k)
        if self._instruments:
            loop |= self._instruments.carry(self._k)
        if self._touch:
            loop |= self._touch.carry()
        carried = Carried(self.plant.carry(), self.integration.carry(), loop, memory, self.plant.names)
        return State(self.state.q.copy(), self.state.v.copy(), self.state.z.copy(), self.time, carried)

    def push(self, force: Vector3 = _ZERO, moment: Vector3 = _ZERO, on: str = OBJECT, point: Vector3 = _ZERO) -> None:
        """Push during the next control period.

        Args:
            force: world axes [N], shape (3,).
            moment: world axes [N m], shape (3,).
            on: "object", or a link or frame of the hand.
            point: where the force acts, in the frame of that body [m], shape (3,).

        Raises:
            ModelError: the hand has no such link.
            ScenarioError: these are no finite numbers.
        """
        self._pushes.add(Push(force, moment, on, point))

    def sample(self) -> Observation:
        """Observe, measure if there are instruments, ask the controller, apply the effort limits or what drives do.

        Returns:
            What the controller sees; live.

        Raises:
            ControllerError: the controller raised, or returned no torque.
            SimulationStopped: the state is beyond reason, or a contact has left the range of the model.
        """
        self.reference.update(self.time)
        observation = self._sensor.observe(self.state, self.time)
        fault, finger = self._find_fault()
        if fault != HEALTHY:
            raise stopped(fault, finger, self.plant, self._last_good(), self._is_limited)
        if self._touch:
            self._touch.read(self._k)
        if self._instruments:
            observation = self._instruments.see(self._k)
        if self._asking is not None:
            if self._k % self._stride == 0:
                self._ask(self._asking, observation)
            self._actuators.act(self._k)
        if self._pushes.are_any:
            self._pushes.apply(self.time, self.state.q)
        return observation

    def _ask(self, asking: Asking, observation: Observation) -> None:
        asking.ask(observation)
        self._asked_at = self._k
        if not self._actuators.apply():
            command = self._actuators.command.tolist()
            raise asking.bad(f"returned a torque with NaN or infinity: {command}", self.time)

    def step(self, torque: Array | None = None) -> None:
        """Hold the torques for one control period.

        Args:
            torque: in place of those of the controller [N m, N], shape (n,); cut to the effort limits, and handed to
                the drives if there are any. Set points where servos take these.

        Raises:
            SimulationStopped: the integration broke down, or something collides and that ends the run.
            ScenarioError: the torques are not n finite numbers.
        """
        stop = self._guard.stopped(self._k, self.time, self.state.q) if self._guard else None
        if stop:
            raise stop
        if torque is not None:
            self._take(torque)
        if torque is not None or not self._actuators.has_acted(self._k):
            self._actuators.act(self._k)
        try:
            for k in range(self._steps):
                if self._pushes.are_any:
                    self._pushes.apply(self.time + k * self._step, self.state.q)
                self.integration.advance(self.state, self.torque)
        except FloatingPointError as error:
            raise broken_down(error, self.plant, self.time, self._is_limited) from error
        except SofthandError:
            raise
        except Exception as error:
            raise SimulationStopped(
                f"stepper '{type(self.integration).__name__}' raised {failure(error)} (at t = {self.time:g} s).",
                reason="stepper", time=self.time,
            ) from error  # fmt: skip
        if self._pushes.are_any:
            self._pushes.clear()
            self.plant.external[:] = 0.0
        self._k += 1
        self.time = round(self._k * self._period, 12)

    def run(
        self,
        progress: Progress | None = None,
        watch: Watch | None = None,
        start: State | None = None,
        until: float | None = None,
    ) -> Recording:
        """Simulate from the start, or a state, to the end.

        Args:
            progress: called every 20 control periods.
            watch: called every control period with the true observation, which is live; for viewers.
            start: of `save`, to go on from there.
            until: end earlier [s].

        Returns:
            All samples, one a control period, the last at the end of the run.

        Raises:
            ControllerError: the controller raised, or returned no torque.
            SimulationStopped: the run diverged, a contact left the range of the model, or it was interrupted. Both
                carry `.recording` with all samples so far.
        """
        self.reset(start)
        first, last = self._k, self._periods if until is None else round(until / self._period)
        expected = (last - first) // self._keep.every + 2
        samples = Samples(self.plant, self._live(), self.truth.known.sizes, self._period, self._keep, expected)
        samples.turns, self._first = dict(self._turns), first
        self._notes: dict[str, str] = {}
        self._began = clock.perf_counter()
        try:
            with interruptible():
                for k in range(first, last + 1):
                    observation = self.sample()
                    samples.record(k, always=k == last)
                    if k == first:
                        self._notes = notes_of(self.plant.world, observation)
                        self._began = clock.perf_counter()  # the first sample may compile the controller
                    if progress is not None and k % _REPORT_EVERY == 0:
                        progress(self.time)
                    if watch is not None:
                        watch(self.truth)
                    if k < last:
                        self.step()
                if progress is not None:
                    progress(self.time)
            with interrupts_held() as held:
                recording = self._finish(samples, "")
        except SimulationStopped as stop:
            with interrupts_held():
                stop.say_more(approach(samples.largest_Phi[None], self.plant))
                stop.recording = self._finish(samples, str(stop))
            raise
        except KeyboardInterrupt as interrupt:
            time = samples.time
            message = f"interrupted at t = {time:g} s"
            with interrupts_held():
                recording = self._finish(samples, message)
            raise SimulationStopped(message, recording=recording, reason="interrupted", time=time) from interrupt
        if held.came:
            raise SimulationStopped(
                f"interrupted after the last sample, at t = {recording.stop_time:g} s; the run is complete",
                recording=recording, reason="interrupted", time=recording.stop_time,
            )  # fmt: skip
        return recording

    def _resume(self, state: State, carried: Carried) -> None:
        self.plant.resume(state, carried.plant)
        self.integration.resume(carried.stepper)
        self.torque[:], self.torque_limited[:] = carried.loop["torque"], carried.loop["limited"]
        self._Theta[:] = carried.loop["Theta"]
        self._actuators.resume(carried.loop)
        if self._instruments:
            self._instruments.resume(carried.loop["instruments"])
        if self._touch:
            self._touch.resume(carried.loop)
        self._turns = {name[6:]: turns for name, turns in carried.loop.items() if name.startswith("turns ")}
        if self._asking:
            self._asking.restart(carried.memory, bool(carried.loop["has_memory"][0]))

    def _take(self, torque: Array) -> None:
        command = as_numbers(torque)
        if command is not None and command.shape == self.torque.shape:
            self._actuators.command[:] = command
        if command is None or command.shape != self.torque.shape or not self._actuators.apply():
            raise ScenarioError(
                f"torque: got {torque!r}; the hand has {len(self.torque)} joints, give a finite number for each.",
                key="torque",
                value=torque,
            )

    def _last_good(self) -> float:
        """Time of the previous sample [s]."""
        return round(max(self._k - 1, 0) * self._period, 12)

    def _live(self) -> dict[str, AnyArray]:
        """What a sample is a copy of, by the names of `Samples`."""
        recorded = slice(room(self.truth.known.sizes, RECORDED))
        live: dict[str, AnyArray] = {
            "observed": self._sensor.block[recorded],
            "joint_torque": self.torque,
            "torque_limited": self.torque_limited,
            "external_force": self.plant.external,
        }
        if self._instruments:
            live["measured"] = self._instruments.block[recorded]
        if self._actuators.drive:
            live[self._actuators.commands] = self._actuators.drive.commanded
        return live

    def _finish(self, samples: Samples, reason: str) -> Recording:
        steps = max(self._k - self._first, 0) * self._steps
        wall = max(clock.perf_counter() - self._began, 1e-9)
        figures = {"steps_per_second": steps / wall, "wall_time": wall, **self._notes}
        recording = samples.recording(self.scenario, reason, self.reference.phases, figures)
        self._turns = samples.turns
        return recording


def whole_periods(controller: Controller, period: float) -> int:
    """Control periods between two calls of the controller.

    Raises:
        ScenarioError: its own period is no whole number of them, or its settings are for another one.
    """
    if controller.period is None:
        controller.check_period(period)
        return 1
    controller.check_period(controller.period)
    stride = round(controller.period / period)
    if stride < 1 or abs(stride * period - controller.period) > 1e-9 * period:
        raise ScenarioError(
            f"controller.period: got {controller.period:g} s; it must be a whole number of control periods of "
            f"{period:g} s, at least one.",
            key="controller.period",
            value=controller.period,
        )
    return stride
