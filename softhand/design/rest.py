"""The plant at a rest as x' = A x + B u in coordinates that a controller sees, and what it has to hold there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from softhand.derivatives.linearize import linearize_at
from softhand.derivatives.situation import Situation
from softhand.errors import GraspError, ScenarioError
from softhand.margins.loop import rolling_coordinates
from softhand.margins.place import FINEST
from softhand.numerics.arrays import Array
from softhand.steppers.midpoint import Midpoint

_AT_REST = 1e-4  # [m/s^2 or rad/s^2, m/s or rad/s]


@dataclass(frozen=True, eq=False)
class RestModel:
    """One control period beside a rest: x are displacements of joints and object, in its own axes, and their rates.

    Attributes:
        at: where.
        A: shape (2 nv, 2 nv).
        B: shape (2 nv, n).
        forces: internal forces by x, shape (np, 2 nv).
        internal_force: at rest [N], shape (np,).
        states: names of x.
        state_units: of x.
    """

    at: Situation
    A: Array
    B: Array
    forces: Array
    internal_force: Array
    states: tuple[str, ...]
    state_units: tuple[str, ...]

    @property
    def moving(self) -> int:
        """nv."""
        return len(self.A) // 2

    @property
    def errors(self) -> Array:
        """Pose error and error of the internal forces by x, shape (6 + np, 2 nv)."""
        pose = np.zeros((6, 2 * self.moving))
        pose[:, self.moving - 6 : self.moving] = np.eye(6)
        return np.vstack([pose, self.forces])

    def follow(self) -> tuple[Array, Array]:
        """How joints and torques of a rest go with pose and internal forces, to first order, shape (n, 6 + np) each.

        Of the rests beside this one, A_vq q + B_v u = 0, those with the pose and force that are asked for: the nearest
        where a hand cannot hold both, the one of the least torques where it can in many ways.
        """
        nv, n = self.moving, self.B.shape[1]
        stiffness, push = self.A[nv:, :nv], self.B[nv:]
        scale = np.linalg.norm(stiffness) / np.linalg.norm(push)
        _, size, rows = np.linalg.svd(np.hstack([stiffness, scale * push]))
        free = rows[int(np.sum(size > 1e-10 * size[0])) :].T  # rests: (q, u / scale) = free a
        errors = self.errors[:, :nv] @ free[:nv]
        weight = np.repeat([1.0, 0.03, 1e-4], [3, 3, len(errors) - 6])  # [m] of 1 m, of 1 rad and of 1 N
        chosen = free @ np.linalg.pinv(weight[:, None] * errors, rcond=1e-8) * weight
        return chosen[:n], scale * chosen[nv:]


def finely(at: Situation) -> Situation:
    """The same with the steps of `stability`: midpoint, a tenth of a control period or less."""
    steps = max(FINEST, round(at.period / at.setup.stepper.step))
    setup = replace(at.setup, stepper=Midpoint(step=at.period / steps))
    return replace(at, setup=setup, held=at.period)


def model_at_rest(at: Situation) -> RestModel:
    """The model of a situation.

    Raises:
        ScenarioError: it moves or accelerates, or the tips have a memory that no controller sees.
        GraspError: a contact is at its limit, or a torque.
    """
    _check_rest(at)
    limited = np.flatnonzero(np.abs(at.torque) >= at.plant.world.effort_limit)
    if len(limited):
        name = at.plant.world.joint_names[limited[0]]
        raise GraspError(
            f"the torque of {name} is at its effort limit at rest, {at.torque[limited[0]]:.3g}: nothing is left to "
            "control with; grip less hard, or choose another target.",
            finger=name, quantity="torque", value=float(at.torque[limited[0]]),
        )  # fmt: skip
    model = linearize_at(at, (), ("internal_force",))
    for switch in model.switches:
        raise GraspError(
            f"{switch.where} is at a switch there ({switch.what}, {switch.side}): motions to both sides have no one "
            "linear model; choose a rest where tips stick and touch.",
            finger=switch.where, quantity=switch.what, value=switch.side,
        )  # fmt: skip
    spread, gather, names, units, remembered = rolling_coordinates(at, model)
    if remembered:
        raise ScenarioError(
            f"fingertip.damping: relaxing tips remember {names[2 * len(at.state.v)]}, which no controller sees; "
            'design with fingertip.damping = {name = "kelvin-voigt"}.',
            key="fingertip.damping", value=remembered,
        )  # fmt: skip
    seen = at.probe.seen(at.state, at.state.time)
    return RestModel(
        at, gather @ model.A @ spread, gather @ model.B, model.C @ spread, seen.internal_force.copy(), names, units
    )


def _check_rest(at: Situation) -> None:
    plant, state = at.plant, at.state
    plant.update(state.q, state.v, state.z)
    acceleration: Any = plant.acceleration(at.torque, np.zeros(len(state.v)))
    names = (*plant.world.joint_names, *(f"object {way}" for way in ("x", "y", "z")), *(["object turn"] * 3))
    for values, word, unit in ((state.v, "moves at", "/s"), (acceleration, "accelerates with", "/s^2")):
        k = int(np.argmax(np.abs(values)))
        if abs(values[k]) > _AT_REST:
            raise ScenarioError(
                f"state: is no rest: {names[k]} {word} {abs(values[k]):.3g} rad{unit} or m{unit} under the torques "
                "there; give softhand.equilibrium(...).state.",
                key="state", value=float(values[k]),
            )  # fmt: skip
