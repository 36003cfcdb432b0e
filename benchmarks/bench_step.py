"""Time of one 1 ms step: softhand against MuJoCo on the same hand, box and start.

Both sides run in one process on one core, in many short rounds that take turns; a ratio is the median of the ratios of
the rounds, its spread their quartiles. Compared are

physics only       a step under the torques that hold the start; back to the start after each round, for a grasp under
                   constant torques is unstable on both sides. MuJoCo's best case: nothing changes from step to step
physics in motion  a step along the scenario, under the torques that the control law gave before on the same side
compiled control   a control period with the law (59) of the paper, compiled on both sides, along the scenario
numpy control      the same with one and the same Python function, the law written in ordinary numpy

All ratios that count are taken with MuJoCo `implicitfast` and MuJoCo's default feature flags, which is what its users
get from the model. A second ratio beside each is taken with MuJoCo trimmed: the features that this scene does not use
(islands, actuators, sensors, limits, springs, ...) are switched off by hand, which is its fastest set-up. The JSON has
them as `ratio_mujoco_over_softhand` and `ratio_trimmed_mujoco_over_softhand`.

What happens in a control period:

softhand   the loop of `Simulation` without the recorder: reference, observation of the present state, check for faults,
           controller, effort limits, one step of `midpoint`
MuJoCo     reference, `mj_step1` (kinematics and contacts of the present state), one compiled call that makes contact
           Jacobians, K, f_N, ... from MuJoCo's arrays, controller, effort limits, `mj_step2`

MuJoCo's contact forces are those of its last step, since it solves for them together with the motion; this spares it a
solve. Its contact Jacobians are made in the compiled call, which takes less time than `mj_jac`; one more row shows
ordinary numpy code with `mj_jac` and `mj_contactForce` in place of that call.

Before anything is timed, each run is done with checks at every step: three contacts throughout, the laws of both sides
agree, softhand's loop gives what `softhand.simulate` gives. Timed runs must then pass through the same states. Else the
comparison is void: the script says why and fails.

Example: python benchmarks/bench_step.py --rounds 400 --json step.json --plot step.png
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import platform
import random
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib
import mujoco
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mujoco_scene import INTEGRATORS, Scene, Void, describe_settings, gains_of
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from rich.table import Column, Table
from scipy.linalg.lapack import dposv

import softhand
from softhand.assembly.parts import read_motion
from softhand.controllers.regulation import Regulation
from softhand.plots.style import STYLE
from softhand.plugins import SHIPPED, find_plugin

Array = NDArray[np.float64]

PERIOD = 0.001  # [s], of a step and of the control
ROUND = 250  # steps in a round: long enough that finding the caches cold after the other side hardly counts
WARM_UP = 5  # rounds that do not count
SOFTHAND, MUJOCO = "softhand", "MuJoCo"
ROWS = {
    "physics": "physics only",
    "physics_in_motion": "physics in motion",
    "compiled_control": "compiled control",
    "numpy_control": "numpy control",
}
COMPARED = {SOFTHAND: "midpoint", MUJOCO: "implicitfast"}
TRIMMED = f"{COMPARED[MUJOCO]}, trimmed"
PACKAGES = ("softhand", "mujoco", "pin", "numba", "numpy", "scipy")
COLOURS = {SOFTHAND: "#0072B2", MUJOCO: "#D55E00"}

_AGREEMENT = 1e-9  # [N m] between two ways to compute the same torque
_SAME = 1e-12  # [m] between two runs of softhand


# One law for both sides ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Gains:
    """Diagonals of the gains of (59)."""

    K_O: Array
    K_v: Array
    K_N: Array

    @classmethod
    def of(cls, controller: Regulation, n: int, pairs: int) -> Gains:
        """The gains of the built-in controller, where one number stands for all."""
        K_O = [np.broadcast_to(gain, 3) for gain in (controller.K_O_position, controller.K_O_orientation)]
        return cls(np.concatenate(K_O), np.full(n, controller.K_v), np.full(pairs, controller.K_N))


def numpy_law(seen: Any, desired: Any, gains: Gains) -> Array:
    """The law (59) in ordinary numpy, with LAPACK's dposv in place of a pseudo-inverse.

    Args:
        seen: arrays named as in softhand's `Observation`.
        desired: what the reference asks for, `softhand.references.goal.Desired`.
        gains: of the law.

    Returns:
        Joint torques [N m], shape (n,).
    """
    J_O, f_N, tau_C = seen.J_O_f, seen.internal_force, seen.contact_force[:, 3]
    wrench = seen.N_O - gains.K_O * (seen.q_O - desired.coordinates) - tau_C @ seen.J_O_tau
    y = dposv(J_O.T @ J_O, wrench)[1]
    f_C = J_O @ y + seen.K @ (f_N - gains.K_N * (f_N - desired.internal_force))
    return f_C @ seen.J_CF_f - gains.K_v * seen.joint_velocity + seen.N_F + tau_C @ seen.J_CF_tau


class NumpyRegulation(Regulation):
    """`numpy_law` as a controller of softhand."""

    def start(self, observation: softhand.Observation) -> Gains:
        """The gains as arrays."""
        return Gains.of(self, len(observation.joint_position), len(observation.internal_force))

    def torque(self, observation: softhand.Observation, memory: Gains) -> tuple[Array, Gains]:
        """The law."""
        return numpy_law(observation, observation.desired, memory), memory


# softhand ------------------------------------------------------------------------------------------------------------


class SofthandSide:
    """What `Simulation.run` does, without the recorder and in pieces; each of them is public.

    Args:
        scenario: what to run.
        controller: in place of the scenario's.

    Attributes:
        simulation: softhand's.
        time: control periods since the start.
    """

    def __init__(self, scenario: softhand.Scenario, controller: softhand.Controller | None = None) -> None:
        self.simulation = softhand.build(scenario, controller)
        self.reset()
        seen = self.simulation.sample()
        self._holding = seen.J_CF_f.T @ seen.f_C + seen.J_CF_tau.T @ seen.tau_C + seen.N_F
        self._torques = [self._holding]
        self.reset()

    def reset(self) -> None:
        """Back to the start."""
        self.simulation.reset()
        self.time = 0

    def run_physics(self, steps: int) -> None:
        """Steps under the holding torques."""
        advance, state, torque = self.simulation.integration.advance, self.simulation.state, self.simulation.torque
        torque[:] = self._holding
        for _ in range(steps):
            advance(state, torque)

    def record(self, periods: int) -> None:
        """Keep the torques of a controlled run for `replay`."""
        self._torques = []
        self.reset()
        for _ in range(periods):
            self.run_control(1)
            self._torques.append(self.simulation.torque.copy())

    def replay(self, steps: int) -> None:
        """Steps under the torques that were kept."""
        advance, state, torque = self.simulation.integration.advance, self.simulation.state, self.simulation.torque
        for kept in self._torques[self.time : self.time + steps]:
            torque[:] = kept
            advance(state, torque)
        self.time += steps

    def run_control(self, periods: int) -> None:
        """Control periods with the controller of the simulation."""
        sample, step = self.simulation.sample, self.simulation.step
        for _ in range(periods):
            sample()
            step()
        self.time += periods

    def object_pose(self) -> Array:
        """Position [m] and quaternion (w, x, y, z) of the object, shape (7,). A copy."""
        return self.simulation.state.q[[-7, -6, -5, -1, -4, -3, -2]]

    def check(self) -> None:
        """Raise Void if the run has diverged."""
        if not np.all(np.isfinite(self.simulation.state.v)):
            raise Void("softhand has diverged.")

    def fingerprint(self) -> bytes:
        """The state, bit by bit."""
        return self.simulation.state.q.tobytes() + self.simulation.state.v.tobytes()


# MuJoCo --------------------------------------------------------------------------------------------------------------


class MujocoSide:
    """The scene in MuJoCo with the same reference and the same law.

    Args:
        simulation: softhand's, for the model and the start.
        scenario: what to run.
        step: time step [s], a whole number of them makes a control period.
        integrator: a name of `INTEGRATORS`.
        trimmed: switch off the features of MuJoCo that the scene does not use.

    Attributes:
        scene: the scene.
        time: control periods since the start.
    """

    def __init__(
        self,
        simulation: softhand.Simulation,
        scenario: softhand.Scenario,
        step: float,
        integrator: str,
        trimmed: bool = False,
    ) -> None:
        plant = simulation.plant
        self.scene = Scene(plant, simulation.state, scenario.grasp.internal_force, step, integrator, trimmed)
        self._reference = read_motion(scenario)
        controller = Regulation(**scenario.controller.parameters)
        self._gains = Gains.of(controller, plant.world.n_joints, len(scenario.grasp.internal_force))
        self._packed = gains_of(
            self._gains.K_O, self._gains.K_v, self._gains.K_N, plant.world.effort_limit, controller.torsion_compensation
        )
        self._further = round(PERIOD / step) - 1
        self._torques: list[Array] = []
        self._tips = [tip.name for tip in plant.world.tips]
        self.time = 0

    def reset(self) -> None:
        """Back to the start."""
        self.scene.reset()
        self.time = 0

    def run_physics(self, steps: int) -> None:
        """Steps under the holding torques, one call each."""
        model, data, step = self.scene.model, self.scene.data, mujoco.mj_step
        for _ in range(steps):
            step(model, data)

    def run_physics_at_once(self, steps: int) -> None:
        """The same in one call, without Python in between."""
        mujoco.mj_step(self.scene.model, self.scene.data, steps)

    def record(self, periods: int) -> None:
        """Keep the torques of a controlled run for `replay`."""
        self._torques = []
        self.reset()
        for _ in range(periods):
            self.run_compiled(1)
            self._torques.append(self.scene.torque.copy())

    def replay(self, steps: int) -> None:
        """Steps under the torques that were kept, one call each."""
        model, data, torque, step = self.scene.model, self.scene.data, self.scene.torque, mujoco.mj_step
        for kept in self._torques[self.time : self.time + steps]:
            torque[:] = kept
            step(model, data)
        self.time += steps

    def run_compiled(self, periods: int) -> None:
        """Control periods with the compiled law."""
        model, data, control, packed = self.scene.model, self.scene.data, self.scene.control, self._packed
        update, begin, end = self._reference.update, mujoco.mj_step1, mujoco.mj_step2
        for k in range(self.time, self.time + periods):
            desired = update(k * PERIOD)
            begin(model, data)
            control(desired, packed)
            end(model, data)
            if self._further:
                mujoco.mj_step(model, data, self._further)
        self.time += periods

    def run_compiled_forward(self, periods: int) -> None:
        """The same for integrators that cannot be split, such as RK4: a forward pass, then whole steps."""
        model, data = self.scene.model, self.scene.data
        for k in range(self.time, self.time + periods):
            desired = self._reference.update(k * PERIOD)
            mujoco.mj_forward(model, data)
            self.scene.control(desired, self._packed)
            mujoco.mj_step(model, data, self._further + 1)
        self.time += periods

    def run_numpy(self, periods: int) -> None:
        """Control periods with `numpy_law`; what it reads is made by one compiled call."""
        self._run_numpy(periods, self.scene.sense)

    def run_plain(self, periods: int) -> None:
        """The same; what the law reads is made in ordinary numpy."""
        self._run_numpy(periods, self._sense_in_numpy)

    def _run_numpy(self, periods: int, sense: Callable[[], SimpleNamespace]) -> None:
        model, data, apply, packed = self.scene.model, self.scene.data, self.scene.apply, self._packed
        update, begin, end, gains = self._reference.update, mujoco.mj_step1, mujoco.mj_step2, self._gains
        for k in range(self.time, self.time + periods):
            desired = update(k * PERIOD)
            begin(model, data)
            apply(numpy_law(sense(), desired, gains), packed)
            end(model, data)
        self.time += periods

    def _sense_in_numpy(self) -> SimpleNamespace:
        """What `Scene.sense` does, as a user of MuJoCo would write it."""
        model, data, seen = self.scene.model, self.scene.data, self.scene.seen
        n, nc = len(seen.N_F), data.ncon
        xmat, points = data.xmat[-1].reshape(3, 3), data.contact.pos
        frames = data.contact.frame.reshape(nc, 3, 3)[:, [1, 2, 0]]  # rows x, y, normal
        roll, pitch, yaw = (
            np.arctan2(xmat[2, 1], xmat[2, 2]),
            np.arcsin(-xmat[2, 0]),
            np.arctan2(xmat[1, 0], xmat[0, 0]),
        )
        seen.q_O[:3], seen.q_O[3:] = data.xpos[-1], (roll, pitch, yaw)
        T = np.array(
            [
                [np.cos(yaw) * np.cos(pitch), -np.sin(yaw), 0.0],
                [np.sin(yaw) * np.cos(pitch), np.cos(yaw), 0.0],
                [-np.sin(pitch), 0.0, 1.0],
            ]
        )
        seen.N_F[:], seen.joint_velocity[:] = data.qfrc_bias[:n], data.qvel[:n]
        seen.N_O[:3], seen.N_O[3:] = data.qfrc_bias[n : n + 3], T.T @ (xmat @ data.qfrc_bias[n + 3 :])
        linear, angular, wrench = np.zeros((3, model.nv)), np.zeros((3, model.nv)), np.zeros(6)
        for i in range(nc):
            mujoco.mj_jac(model, data, linear, angular, points[i], model.geom_bodyid[data.contact.geom[i, 0]])
            mujoco.mj_contactForce(model, data, i, wrench)
            rows, (x, y, z) = slice(3 * i, 3 * i + 3), points[i] - data.xpos[-1]
            seen.contact_force[i] = wrench[[1, 2, 0, 3]]
            seen.J_CF_f[rows], seen.J_CF_tau[i] = frames[i] @ linear[:, :n], frames[i, 2] @ angular[:, :n]
            seen.J_O_f[rows, :3], seen.J_O_f[rows, 3:] = (
                frames[i],
                frames[i] @ np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]]) @ T,
            )
            seen.J_O_tau[i, 3:] = frames[i, 2] @ T
        self._pair_in_numpy(points, frames, seen)
        return seen

    def _pair_in_numpy(self, points: Array, frames: Array, seen: SimpleNamespace) -> None:
        for column, (i, j) in enumerate(self.scene.pairs):
            direction = points[j] - points[i]
            direction /= np.linalg.norm(direction)
            seen.K[3 * i : 3 * i + 3, column] = frames[i] @ direction
            seen.K[3 * j : 3 * j + 3, column] = -frames[j] @ direction
        seen.internal_force[:] = dposv(seen.K.T @ seen.K, seen.K.T @ seen.contact_force[:, :3].ravel())[1]

    def object_pose(self) -> Array:
        """Position [m] and quaternion (w, x, y, z) of the object, shape (7,). A copy."""
        return self.scene.object_pose()

    def check(self) -> None:
        """Raise Void if a contact is lost, or the control could not read MuJoCo's arrays."""
        self.scene.check()
        if self.time:
            self.scene.check_views()

    def check_sensing(self) -> None:
        """Raise Void if the compiled call, the numpy code and the two laws do not agree."""
        desired = self._reference.update(self.time * PERIOD)
        kept = self.scene.torque.copy()
        plain = numpy_law(self._sense_in_numpy(), desired, self._gains)
        self.scene.apply(numpy_law(self.scene.sense(), desired, self._gains), self._packed)
        by_numpy = self.scene.torque.copy()
        self.scene.control(desired, self._packed)
        gap = max(np.max(np.abs(by_numpy - self.scene.torque)), np.max(np.abs(plain - self.scene.torque)))
        self.scene.torque[:] = kept
        if not gap < _AGREEMENT:
            raise Void(f"the compiled law and the numpy law differ by {gap:.1e} N m on MuJoCo's side.")

    def check_forces_kept(self) -> None:
        """Raise Void if `mj_step1` does not leave the contact forces of the last step where they are."""
        data = self.scene.data
        before = data.efc_force.copy()
        mujoco.mj_step1(self.scene.model, data)
        if not np.array_equal(before, data.efc_force):
            raise Void("mj_step1 has overwritten the contact forces of the last step.")

    def fingerprint(self) -> bytes:
        """The state, bit by bit."""
        return self.scene.data.qpos.tobytes() + self.scene.data.qvel.tobytes()


# Measuring -----------------------------------------------------------------------------------------------------------


@dataclass
class Case:
    """One thing to time.

    Attributes:
        row: key of `ROWS`.
        side: who.
        method: stepper or integrator, and what is special.
        runner: a side of its own.
        run: its method that does so many steps.
        rounds: rounds from the start until it goes back there.
        marks: fingerprint after each of these rounds, from the checked run.
        microseconds: per step, one number a round.
    """

    row: str
    side: str
    method: str
    runner: Any
    run: Callable[[int], None]
    rounds: int
    marks: list[bytes] = field(default_factory=list)
    microseconds: list[float] = field(default_factory=list)

    @property
    def key(self) -> tuple[str, str, str]:
        """What identifies it."""
        return self.row, self.side, self.method

    @property
    def is_compared(self) -> bool:
        """Whether a ratio is made of it."""
        return self.is_headline or self.method == TRIMMED

    @property
    def is_headline(self) -> bool:
        """Whether the ratio that counts is made of it."""
        return self.method == COMPARED[self.side]

    def verify(self) -> None:
        """Do all rounds once with checks at each step, and leave the marks."""
        self.runner.reset()
        for _ in range(self.rounds):
            for _ in range(ROUND):
                self.run(1)
                self.runner.check()
            self.marks.append(self.runner.fingerprint())

    def time(self, index: int) -> float:
        """Time round number `index` [us per step]; it must end where the checked run did."""
        if index % self.rounds == 0:
            self.runner.reset()
        began = time.perf_counter_ns()
        self.run(ROUND)
        took = time.perf_counter_ns() - began
        if self.marks and self.runner.fingerprint() != self.marks[index % self.rounds]:
            raise Void(f"{self.side} {self.method} does not repeat itself ({ROWS[self.row]}).")
        return took / ROUND / 1e3


def make_cases(scenario: softhand.Scenario, console: Console) -> list[Case]:
    """All cases, each checked."""
    n_rounds = round(scenario.duration / PERIOD) // ROUND
    cases = [case for case in _physics_cases(scenario) if _is_healthy(case, console)]
    for case in _moving_cases(scenario, n_rounds):
        case.verify()
        cases.append(case)
    _check_sensing(scenario)
    _check_softhand_loop(scenario)
    return cases


def _physics_cases(scenario: softhand.Scenario) -> list[Case]:
    cases = []
    for name in SHIPPED["steppers"]:
        if "rtol" not in find_plugin("steppers", name, "stepper.name").model_fields:  # error control is no match
            side = SofthandSide(scenario.with_values({"stepper": {"name": name, "step": PERIOD}}))
            cases.append(Case("physics", SOFTHAND, name, side, side.run_physics, 1))
    simulation = softhand.build(scenario)
    for name in INTEGRATORS:
        other = MujocoSide(simulation, scenario, PERIOD, name)
        cases.append(Case("physics", MUJOCO, name, other, other.run_physics, 1))
    at_once, trimmed = (MujocoSide(simulation, scenario, PERIOD, COMPARED[MUJOCO], trim) for trim in (False, True))
    cases.append(Case("physics", MUJOCO, TRIMMED, trimmed, trimmed.run_physics, 1))
    label = f"{COMPARED[MUJOCO]}, one call a round"
    cases.append(Case("physics", MUJOCO, label, at_once, at_once.run_physics_at_once, 1))
    return cases


def _moving_cases(scenario: softhand.Scenario, rounds: int) -> list[Case]:
    stepper, integrator = COMPARED[SOFTHAND], COMPARED[MUJOCO]
    scenario = scenario.with_values({"stepper": {"name": stepper, "step": PERIOD}})
    ours, ours_moving = SofthandSide(scenario), SofthandSide(scenario)
    ours_numpy = SofthandSide(scenario, NumpyRegulation(**scenario.controller.parameters))
    ours_moving.record(rounds * ROUND)
    cases = [
        Case("physics_in_motion", SOFTHAND, stepper, ours_moving, ours_moving.replay, rounds),
        Case("compiled_control", SOFTHAND, stepper, ours, ours.run_control, rounds),
        Case("numpy_control", SOFTHAND, stepper, ours_numpy, ours_numpy.run_control, rounds),
    ]
    for label, trim in ((integrator, False), (TRIMMED, True)):
        moving, compiled, numpy = (MujocoSide(ours.simulation, scenario, PERIOD, integrator, trim) for _ in range(3))
        moving.record(rounds * ROUND)
        cases += [
            Case("physics_in_motion", MUJOCO, label, moving, moving.replay, rounds),
            Case("compiled_control", MUJOCO, label, compiled, compiled.run_compiled, rounds),
            Case("numpy_control", MUJOCO, label, numpy, numpy.run_numpy, rounds),
        ]
    plain = MujocoSide(ours.simulation, scenario, PERIOD, integrator)
    return [*cases, Case("numpy_control", MUJOCO, f"{integrator}, with mj_jac", plain, plain.run_plain, rounds)]


def _is_healthy(case: Case, console: Console) -> bool:
    """Verify a case; one that is not compared may fail and is then left out."""
    try:
        case.verify()
    except Void as failure:
        if case.is_compared:
            raise
        console.print(f"{case.side} {case.method} at {1e3 * PERIOD:g} ms left out: {failure}")
        return False
    return True


def _check_sensing(scenario: softhand.Scenario) -> None:
    """Laws and forces on MuJoCo's side, along the whole run."""
    for trimmed in (False, True):
        side = MujocoSide(softhand.build(scenario), scenario, PERIOD, COMPARED[MUJOCO], trimmed)
        for _ in range(round(scenario.duration / PERIOD)):
            side.check_forces_kept()
            side.check_sensing()
            side.run_compiled(1)


def _check_softhand_loop(scenario: softhand.Scenario) -> None:
    """The timed loop gives what `softhand.simulate` gives; the numpy law gives the same but for rounding."""
    positions = softhand.simulate(scenario)["object_position"]
    for controller, tolerance in ((None, _SAME), (NumpyRegulation(**scenario.controller.parameters), 1e-9)):
        side = SofthandSide(scenario, controller)
        side.run_control(len(positions) - 1)
        gap = np.max(np.abs(side.object_pose()[:3] - positions[-1]))
        if not gap < tolerance:
            raise Void(f"softhand's loop ends {gap:.1e} m from where softhand.simulate ends.")


def measure(cases: Sequence[Case], rounds: int, console: Console) -> None:
    """Time all cases in rounds, each round in another order; those of a ratio one right after the other."""
    shuffle = random.Random(0).shuffle
    groups = _group(cases)
    gc.collect()
    gc.disable()
    try:
        for index in track(range(-WARM_UP, rounds), "Timing", console=console, transient=True):
            shuffle(groups)
            for group in groups:
                shuffle(group)
                for case in group:
                    took = case.time(max(index, 0))
                    if index >= 0:
                        case.microseconds.append(took)
    finally:
        gc.enable()


def _group(cases: Sequence[Case]) -> list[list[Case]]:
    """Those of each row that ratios are made of, and each other case alone."""
    compared = [[case for case in cases if case.row == row and case.is_compared] for row in ROWS]
    return compared + [[case] for case in cases if not case.is_compared]


# Results -------------------------------------------------------------------------------------------------------------


def quartiles(values: Any) -> list[float]:
    """First quartile, median, third quartile."""
    return [float(value) for value in np.percentile(values, [25, 50, 75])]


@dataclass(frozen=True)
class Ratios:
    """MuJoCo's time over softhand's, quartiles of the rounds, of each row."""

    default: dict[str, list[float]]
    """With MuJoCo's default feature flags: those that count."""
    trimmed: dict[str, list[float]]
    """With the features of MuJoCo switched off that the scene does not use."""

    @classmethod
    def of(cls, cases: Sequence[Case]) -> Ratios:
        """Round by round."""
        times = {case.key: np.array(case.microseconds) for case in cases}
        return cls(*(
            {row: quartiles(times[row, MUJOCO, method] / times[row, SOFTHAND, COMPARED[SOFTHAND]]) for row in ROWS}
            for method in (COMPARED[MUJOCO], TRIMMED)
        ))  # fmt: skip


def report(cases: Sequence[Case], found: Ratios) -> dict[str, Any]:
    """All results as plain data."""
    scene = next(case.runner.scene for case in cases if case.side == MUJOCO and case.is_headline)
    trimmed = next(case.runner.scene for case in cases if case.method == TRIMMED)
    return {
        "ratio_mujoco_over_softhand": {row: values[1] for row, values in found.default.items()},
        "ratio_trimmed_mujoco_over_softhand": {row: values[1] for row, values in found.trimmed.items()},
        "ratio_quartiles": found.default,
        "ratio_trimmed_quartiles": found.trimmed,
        "compared": COMPARED,
        "microseconds_per_step": [
            {"row": case.row, "side": case.side, "method": case.method, "median": quartiles(case.microseconds)[1],
             "quartiles": quartiles(case.microseconds)}
            for case in cases
        ],
        "settings": {"step": PERIOD, "steps_per_round": ROUND, "rounds": len(cases[0].microseconds),
                     "mujoco": describe_settings(scene.model),
                     "mujoco_trimmed": describe_settings(trimmed.model)},
        "versions": versions(),
    }  # fmt: skip


def versions() -> dict[str, str]:
    """Of Python and of what takes part."""
    return {"python": platform.python_version(), **{name: version(name) for name in PACKAGES}}


def draw_tables(cases: Sequence[Case], found: Ratios) -> list[Table]:
    """Medians, and their ratios."""
    times = Table("", "", Column("us", justify="right"), Column("quartiles", justify="right"))
    times.title = f"Time of a {1e3 * PERIOD:g} ms step, one core"
    for row, label in ROWS.items():
        for case in (case for case in cases if case.row == row):
            low, middle, high = quartiles(case.microseconds)
            times.add_row(label, f"{case.side} {case.method}", f"{middle:.2f}", f"{low:.2f} - {high:.2f}")
            label = ""
        times.add_section()
    headings = ("default flags", "quartiles", "trimmed", "quartiles")
    ratio = Table("", *(Column(heading, justify="right") for heading in headings))
    ratio.title = f"MuJoCo {COMPARED[MUJOCO]} / softhand {COMPARED[SOFTHAND]}"
    for row, label in ROWS.items():
        cells = []
        for low, middle, high in (found.default[row], found.trimmed[row]):
            cells += [f"{middle:.2f}", f"{low:.2f} - {high:.2f}"]
        ratio.add_row(label, *cells)
    return [times, ratio]


def draw(cases: Sequence[Case], found: Ratios) -> Figure:
    """Bars of the median times with their quartiles; pale what the headline is not made of. Very long bars are cut."""
    end = 1.5 * max(quartiles(case.microseconds)[2] for case in cases if case.is_compared)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(7.0, 0.5 + 0.22 * (len(cases) + 1.5 * len(ROWS))), layout="constrained")
        axes = figure.add_subplot()
        place, ticks = 0.0, []
        for row, label in ROWS.items():
            default, trimmed = found.default[row][1], found.trimmed[row][1]
            title = f"{label}: MuJoCo / softhand = {default:.2f} (MuJoCo trimmed: {trimmed:.2f})"
            axes.text(0.005 * end, place, title, weight="bold", va="center")
            for case in (case for case in cases if case.row == row):
                place += 1.0
                _draw_bar(axes, place, case, end)
                ticks.append((place, f"{case.side} {case.method}"))
            place += 1.5
        axes.set_yticks([y for y, _ in ticks], [text for _, text in ticks])
        axes.set_xlim(0.0, end)
        axes.set_ylim(place - 0.8, -0.7)
        axes.grid(visible=False, axis="y")
        axes.tick_params(axis="y", length=0)
        axes.set_xlabel(f"time of a {1e3 * PERIOD:g} ms step [µs]")
    return figure


def _draw_bar(axes: Axes, place: float, case: Case, end: float) -> None:
    low, middle, high = quartiles(case.microseconds)
    axes.barh(place, min(middle, end), 0.75, color=COLOURS[case.side], alpha=1.0 if case.is_headline else 0.45)
    if middle > 0.9 * end:
        text = f"{middle:.0f} →" if middle > end else f"{middle:.1f} "
        axes.text(0.99 * min(middle, end), place, text, va="center", ha="right")
    else:
        axes.plot([low, high], [place, place], color="0.2", linewidth=0.8)
        axes.text(high, place, f" {middle:.1f}", va="center", color="0.2")


def read_arguments() -> argparse.Namespace:
    """The command line."""
    summary, _, rest = (__doc__ or "").partition("\n")
    parser = argparse.ArgumentParser(
        description=summary, epilog=rest, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=400, help="rounds that count (default: %(default)s)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all results")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="draw them (.png, .svg or .pdf)")
    return parser.parse_args()


def stay_on_one_core() -> None:
    """Keep this process on one core, where the system can."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def main() -> int:
    """Check, measure, report."""
    arguments, console = read_arguments(), Console()
    stay_on_one_core()
    scenario = softhand.load_scenario("target-a")
    try:
        with console.status("Checking that both sides do the same (the first time compiles)"):
            cases = make_cases(scenario, console)
        measure(cases, arguments.rounds, console)
    except Void as failure:
        console.print(f"[bold red]The comparison is void:[/] {failure}")
        return 1
    found = Ratios.of(cases)
    console.print(*draw_tables(cases, found))
    if arguments.json:
        arguments.json.write_text(json.dumps(report(cases, found), indent=2) + "\n")
    if arguments.plot:
        softhand.save_figure(draw(cases, found), arguments.plot)
    return 0


if __name__ == "__main__":
    sys.exit(main())
