"""Linear-quadratic regulator of hand and object about a rest."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from scipy.linalg import eig, solve_discrete_are

from softhand.controllers.controller import Controller
from softhand.controllers.gain_file import POSE, GainFile
from softhand.derivatives.situation import find_situation
from softhand.design.rest import RestModel, finely, model_at_rest
from softhand.design.weights import Weights
from softhand.errors import GraspError, SofthandError
from softhand.laws.law import Law
from softhand.margins.delay import delay_margin
from softhand.margins.groups import Groups
from softhand.margins.loop import Loop, close_loop
from softhand.margins.modes import Mode, find_modes
from softhand.margins.place import find_place
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.plant.state import State
from softhand.resting.equilibrium import equilibrium
from softhand.scenario.scenario import Scenario, as_scenario
from softhand.settings.settings import read_settings

_LOST = 1e-8
"""Of the size of a pencil: what is smaller is rounding, and the mode is out of reach or out of sight."""
_INSIDE = 1e-6
"""By which a multiplier is below 1 that dies out for sure."""
_TOLD = 4


@dataclass(frozen=True, eq=False)
class LqrDesign(Record):
    """The state feedback u = -K x that makes sum T (x^T Q x + u^T R u) least, about a rest.

    x are displacements of joints and object, in its own axes, their rates, then the sums of errors over time. Costs are
    of the time of a period, T, so that the same weights stand for the same wish at any period.

    Attributes:
        A: of one control period, with the sums, shape (s, s).
        B: by the torques, shape (s, n).
        Q: shape (s, s).
        R: shape (n, n).
        P: x^T P x is what is still to be paid from x on, shape (s, s).
        K: [N m, N by x], shape (n, s).
        states: names of x.
        state_units: of x.
        inputs: names of the joints.
        weights: as they were taken.
        growth: of the fastest growing, or slowest dying, motion [1/s].
        growth_before: the same with the controller of the scenario [1/s].
        modes: the motions of the loop that keep their shape, the fastest growing first.
        modes_before: those with the controller of the scenario.
        delay: between sample and torque, beyond what the loop has, at which some motion begins to grow [s].
        delay_before: likewise with the controller of the scenario; NaN if some motion grows without.
        gains: what a gain file has.
        state: the rest.
        controller: of the scenario.
        where: in words.
    """

    units: ClassVar = {
        "growth": "1/s", "growth_before": "1/s", "delay": "s", "delay_before": "s", "period": "s",
        **dict.fromkeys(("A", "B", "Q", "R", "P", "K"), "SI, by the names of rows and columns"),
    }  # fmt: skip
    unreported: ClassVar = frozenset({"state", "gains", "weights"})

    A: Array
    B: Array
    Q: Array
    R: Array
    P: Array
    K: Array
    states: tuple[str, ...]
    state_units: tuple[str, ...]
    inputs: tuple[str, ...]
    weights: Weights
    growth: float
    growth_before: float
    modes: tuple[Mode, ...]
    modes_before: tuple[Mode, ...]
    delay: float
    delay_before: float
    gains: GainFile
    state: State
    controller: str
    where: str

    @property
    def period(self) -> float:
        """For which a torque is held [s]."""
        return self.gains.period

    def cost(self, x: Sequence[float] | Array) -> float:
        """What a run from x costs until all has died out, x^T P x; the sums that are left out of x begin at zero."""
        full = np.zeros(len(self.A))
        full[: len(x)] = x
        return float(full @ self.P @ full)

    def poles(self) -> Array:
        """Eigenvalues of A - B K, the largest first."""
        values = np.linalg.eigvals(self.A - self.B @ self.K)
        return np.asarray(values[np.argsort(-np.abs(values), kind="stable")])

    def save(self, file: str | Path) -> None:
        """Write the gain file that the controller `state-feedback` takes.

        Raises:
            RecordingError: it cannot be written.
        """
        self.gains.write(Path(file))

    header: ClassVar = ("before", "after")

    def rows(self) -> list[tuple[str, str, str]]:
        """Label, value with the controller of the scenario and with the new gains."""
        rows = [
            ("controller", self.controller, "state-feedback"),
            ("slowest motion", f"{self.growth_before:+.3g} 1/s", f"{self.growth:+.3g} 1/s"),
            ("delay until some motion grows", _ms(self.delay_before), _ms(self.delay)),
        ]
        for k in range(_TOLD):
            rows.append((f"mode {k + 1}", _told(self.modes_before, k), _told(self.modes, k)))
        return rows

    def __repr__(self) -> str:
        return f"<LqrDesign: {len(self.states)} states, slowest motion {self.growth:+.3g} 1/s>"


def _ms(seconds: float) -> str:
    if math.isnan(seconds):
        return "some motion grows without"
    return f"{1e3 * seconds:.3g} ms" if math.isfinite(seconds) else "beyond 40 periods"


def _told(modes: tuple[Mode, ...], k: int) -> str:
    if k >= len(modes):
        return ""
    ringing = f" at {modes[k].frequency:.3g} Hz" if modes[k].frequency else ""
    return f"{modes[k].growth:+.3g} 1/s{ringing}"


def design_lqr(
    source: Scenario | str | Path,
    weights: Mapping[str, Any] | Weights | None = None,
    *,
    state: State | None = None,
    torque: Sequence[float] | Array | None = None,
    controller: Controller | None = None,
    law: Law | None = None,
    overrides: Mapping[str, Any] | None = None,
    **values: Any,
) -> LqrDesign:
    """A linear-quadratic regulator for a grasp at rest.

        design = softhand.design_lqr("hold", {"object_position": 4e6, "object_position_integral": 1e7})
        design.save("gains.toml")
        controller = {"name": "state-feedback", "gain_file": "gains.toml"}
        softhand.simulate(softhand.load_scenario("hold", {"controller": controller}))

    The plant is one control period of `linearize`, in steps of a tenth of it or less, so that it is the plant and not
    its steps; stuck shear follows the motion by rolling, and x has 2 (n + 6) numbers, all of which a controller sees.
    SciPy's `solve_discrete_are` solves

        P = Q T + A^T P A - A^T P B (R T + B^T P B)^-1 B^T P A,    K = (R T + B^T P B)^-1 B^T P A

    Args:
        source: a scenario, its name or path. Its controller finds the rest, where its reference ends.
        weights: see `Weights`; those left out have its defaults.
        state: a rest, in place of that one.
        torque: held there [N m, N], shape (n,), in place of those of the controller.
        controller: in place of the scenario's.
        law: at all tips in place of the scenario's.
        overrides: dotted keys and values put over those of the scenario.
        values: the same by the last part of the key.

    Raises:
        ScenarioError: a weight is negative or unknown, the state is no rest, or the tips relax.
        GraspError: there is no rest, it is at a limit of friction or torque, or a motion cannot be controlled or does
            not show in the cost; says which.
        SofthandError: as `build`.
    """
    wanted = weights if isinstance(weights, Weights) else read_settings(Weights, dict(weights or {}), "weights")
    scenario = as_scenario(source, overrides, **values)
    if state is None:
        state = equilibrium(scenario, torque=torque, controller=controller, law=law).state
    at = finely(find_situation(scenario, 0, state, torque, controller, law, None, {}))
    model = model_at_rest(at)
    A, B, Q, R, integrals = _problem(model, wanted)
    names, units = _names(model, integrals)
    groups = Groups(at.plant, at.state.q)
    _check_modes(A, B, Q, model, groups, names)
    T = at.period
    try:
        P = solve_discrete_are(A, B, T * Q, T * R)
        K = np.linalg.solve(T * R + B.T @ P @ B, B.T @ P @ A)
    except (np.linalg.LinAlgError, ValueError) as error:
        raise _no_regulator(str(error)) from error
    loop = _loop(model, A, B, K, names)
    if not loop.growth < 0.0:
        raise _no_regulator(f"the loop that was found grows at {loop.growth:+.3g} 1/s")
    place = find_place(scenario, state)
    if controller is not None:
        place = place.with_controller(controller)
    before = close_loop(place)
    return LqrDesign(
        A=A, B=B, Q=Q, R=R, P=P, K=K, states=names, state_units=units, inputs=tuple(at.plant.world.joint_names),
        weights=wanted, growth=loop.growth, growth_before=before.growth, modes=find_modes(loop, groups),
        modes_before=find_modes(before, groups), delay=delay_margin(loop, place),
        delay_before=delay_margin(before, place), gains=_gain_file(model, K, integrals), state=state,
        controller=at.setup.scenario.controller.name, where=f"the rest at t = {at.state.time:g} s",
    )  # fmt: skip


def _no_regulator(why: str) -> SofthandError:
    return SofthandError(
        f"design_lqr: no regulator was found to the digits of a computer: {why}; bring the weights nearer to each "
        "other, such as by a larger weights.torque."
    )


def _problem(model: RestModel, weights: Weights) -> tuple[Array, Array, Array, Array, tuple[int, ...]]:
    """A, B, Q, R with sums of errors, and which errors are summed."""
    nv, n, pairs = model.moving, model.B.shape[1], len(model.forces)
    errors, T = model.errors, model.at.period
    rates = np.zeros_like(model.forces)
    rates[:, nv:] = model.forces[:, :nv]
    eye = np.eye(2 * nv)
    seen = np.vstack([errors, eye[2 * nv - 6 :], rates, eye[:n], eye[nv : nv + n]])
    sizes = {
        "object_position": 3, "object_orientation": 3, "internal_force": pairs, "object_velocity": 3,
        "object_angular_velocity": 3, "internal_force_rate": pairs, "joint_position": n, "joint_velocity": n,
    }  # fmt: skip
    cost = np.concatenate([weights.diagonal(name, size) for name, size in sizes.items()])
    summed = {"object_position_integral": 3, "object_orientation_integral": 3, "internal_force_integral": pairs}
    of_sums = np.concatenate([weights.diagonal(name, size) for name, size in summed.items()])
    chosen = np.flatnonzero(of_sums > 0.0)
    m = len(chosen)
    A = np.block([[model.A, np.zeros((2 * nv, m))], [T * errors[chosen], np.eye(m)]])
    B = np.vstack([model.B, np.zeros((m, n))])
    Q = np.zeros((2 * nv + m,) * 2)
    Q[: 2 * nv, : 2 * nv] = seen.T @ (cost[:, None] * seen)
    Q[2 * nv :, 2 * nv :] = np.diag(of_sums[chosen])
    return A, B, Q, np.diag(weights.diagonal("torque", n)), tuple(chosen.tolist())


def _names(model: RestModel, integrals: tuple[int, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    units = ["m"] * 3 + ["rad"] * 3 + ["N"] * len(model.forces)
    names = [*POSE, *(f"internal force {k + 1}" for k in range(len(model.forces)))]
    return (
        (*model.states, *(f"{names[k]}, summed" for k in integrals)),
        (*model.state_units, *(f"{units[k]} s" for k in integrals)),
    )


def _check_modes(A: Array, B: Array, Q: Array, model: RestModel, groups: Groups, names: tuple[str, ...]) -> None:
    """Refuse what no torque reaches, and what grows or stays without a cost; by the test of Popov, Belevitch, Hautus.

    In units in which a period moves all alike: without that the sizes of a pencil mean nothing.
    """
    nv, T, s = model.moving, model.at.period, len(A)
    scale = np.concatenate([np.ones(nv), np.full(nv, 1.0 / T), np.full(s - 2 * nv, T)])
    a, b = A * scale / scale[:, None], B / scale[:, None]
    b = b / np.linalg.norm(b)
    paid = Q * np.outer(scale, scale)
    root = np.linalg.eigh(paid / (np.max(np.abs(paid)) or 1.0))
    c = np.sqrt(np.maximum(root.eigenvalues, 0.0))[:, None] * root.eigenvectors.T
    values, ways = eig(a)
    for k in np.argsort(-np.abs(values), kind="stable"):
        value = values[k]
        if abs(value) < 1.0 - _INSIDE or value.imag < -1e-12:
            continue
        pencil = a - value * np.eye(s)
        reached = np.linalg.svd(np.hstack([pencil, b]), compute_uv=False)[-1]
        seen = np.linalg.svd(np.vstack([pencil, c]), compute_uv=False)[-1]
        if min(reached, seen) > _LOST:
            continue
        rate = np.log(complex(value)) / T
        ringing = f"rings at {abs(rate.imag) / (2.0 * np.pi):.3g} Hz and " if abs(rate.imag) > 1e-6 else ""
        told = f"{ringing}goes at {rate.real:+.3g} 1/s" if abs(rate.real) > 1e-3 else f"{ringing}never dies out"
        move = ways[:nv, k]
        what = names[2 * nv + int(np.argmax(np.abs(ways[2 * nv :, k])))] if s > 2 * nv else ""
        if np.max(np.abs(move)) > 1e-6 * np.max(np.abs(ways[:, k])) or not what:
            what = groups.name(move, groups.shares(move))
        if reached <= _LOST:
            raise GraspError(
                f"a motion cannot be controlled, and {told}: {what}. No torque of this hand reaches it; sum fewer "
                "errors over time, let the tips damp, or grip otherwise.",
                finger="", quantity="uncontrollable", value=float(abs(value)),
            )  # fmt: skip
        raise GraspError(
            f"a motion does not show in the cost, and {told}: {what}. Give it a weight, such as "
            "weights.joint_position.",
            finger="", quantity="undetectable", value=float(abs(value)),
        )  # fmt: skip


def _loop(model: RestModel, A: Array, B: Array, K: Array, names: tuple[str, ...]) -> Loop:
    """The regulator put in."""
    s = 2 * model.moving
    world = model.at.plant.world
    slides = model.at.slides
    return Loop(
        period=model.at.period, A=model.A, B=model.B, K=-K, N=A[s:], states=names,
        state_units=(*model.state_units, *("" for _ in names[s:])), inputs=tuple(world.joint_names),
        input_units=tuple("N" if slide else "N m" for slide in slides), moving=model.moving, remembered=0, switches=(),
        C=np.zeros((0, len(A))), outputs=(), output_units=(),
    )  # fmt: skip


def _gain_file(model: RestModel, K: Array, integrals: tuple[int, ...]) -> GainFile:
    at, s = model.at, 2 * model.moving
    world, q = at.plant.world, at.state.q
    seen = at.probe.seen(at.state, at.state.time)
    joint_follow, torque_follow = model.follow()
    return GainFile(
        period=at.period, joints=tuple(world.joint_names), tips=tuple(tip.name for tip in world.tips),
        joint_position=seen.joint_position.copy(), object_position=world.object_position(q).copy(),
        object_rotation=world.object_rotation(q).copy(), internal_force=model.internal_force,
        torque=np.asarray(at.torque, dtype=float), joint_follow=joint_follow, torque_follow=torque_follow,
        K=K[:, :s], integrals=integrals, K_integral=K[:, s:],
    )  # fmt: skip
