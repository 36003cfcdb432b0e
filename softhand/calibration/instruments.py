"""What instruments would have measured of a piece of a run, and what the measured numbers are off from that."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from softhand.calibration.parameters import BIAS, DELAY, Parameter, bias_of
from softhand.calibration.replay import TIP
from softhand.model.configuration import CONTINUOUS
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.scenario.scenario import Scenario
from softhand.sensing.quantities import components


class Instrument(NamedTuple):
    """Bias, by component, and delay [s] of one."""

    bias: Array
    delay: float


def instruments_of(
    scenario: Scenario, world: World, names: Sequence[str], parameters: Sequence[Parameter], values: Array
) -> dict[str, Instrument]:
    """Those of a scenario, with what is fitted put over it."""
    sizes, found = components(world.n_joints, world.n_tips), {}
    for name in names:
        section = getattr(scenario.sensing, name, None) if scenario.sensing is not None else None
        bias = bias_of(section.bias if section is not None else 0.0, sizes[name])
        delay = section.delay if section is not None else 0.0
        for one, value in zip(parameters, values, strict=True):
            if one.kind == BIAS and one.quantity == name:
                bias[one.component] = value
            elif one.kind == DELAY and one.quantity == name:
                delay = float(value)
        found[name] = Instrument(bias, delay)
    return found


def true_values(name: str, seen: Array, world: World) -> Array:
    """What is true of a quantity in samples of `Replay`, shape (..., components); an orientation as a quaternion."""
    n, nq, nv = world.n_joints, world.nq, world.nv
    if name == "joint_position":
        columns = [
            np.arctan2(seen[..., i + 1], seen[..., i]) if kind == CONTINUOUS else seen[..., i]
            for kind, i, _ in world.joints[:n]
        ]
        return np.stack(columns, axis=-1)
    if name == "joint_velocity":
        return seen[..., [nq + j for _, _, j in world.joints[:n]]]
    if name == "object_position":
        return seen[..., nq - 7 : nq - 4]
    if name == "object_orientation":
        return seen[..., nq - 4 : nq]
    tips = seen[..., nq + nv : nq + nv + TIP * world.n_tips].reshape(*seen.shape[:-1], world.n_tips, TIP)
    return tips[..., :3].reshape(*seen.shape[:-1], -1) if name == "contact_force" else tips[..., 3]


def measured_values(name: str, true: Array, instrument: Instrument, period: float) -> Array:
    """What arrives of true values, one a period along the last axis but one: late, and with the bias.

    Between two periods by the cubic through the four nearest.
    """
    late = instrument.delay / period
    values = true if late == 0.0 else _delayed(true, late)
    if name != "object_orientation":
        return values + instrument.bias
    values = values / np.linalg.norm(values, axis=-1, keepdims=True)
    return quaternion_product(quaternion_by(instrument.bias), values) if np.any(instrument.bias) else values


def off(name: str, values: Array, others: Array, world: World) -> Array:
    """By how much values are off from others: of orientations the rotation vector of A B^-1, in world axes [rad]."""
    if name == "object_orientation":
        difference = quaternion_product(values, others * np.array([-1.0, -1.0, -1.0, 1.0]))
        vector, scalar = difference[..., :3], difference[..., 3:]
        length = np.linalg.norm(vector, axis=-1, keepdims=True)
        angle = 2.0 * np.arctan2(length, np.abs(scalar))
        return np.sign(scalar) * vector * np.where(length > 1e-12, angle / np.maximum(length, 1e-300), 2.0)
    difference = values - others
    if name == "joint_position":
        endless = world.joints[: world.n_joints, 0] == CONTINUOUS
        turn = 2.0 * np.pi
        difference = difference - np.where(endless, turn * np.rint(difference / turn), 0.0)
    return difference


def quaternion_product(a: Array, b: Array) -> Array:
    """a b of quaternions x, y, z, w along the last axis."""
    x, y, z, w = np.moveaxis(a, -1, 0)
    i, j, k, s = np.moveaxis(b, -1, 0)
    return np.stack([
        w * i + s * x + y * k - z * j, w * j + s * y + z * i - x * k, w * k + s * z + x * j - y * i,
        w * s - x * i - y * j - z * k,
    ], axis=-1)  # fmt: skip


def quaternion_by(turn: Array) -> Array:
    """x, y, z, w of a rotation vector [rad]."""
    angle = float(np.linalg.norm(turn))
    return np.append(0.5 * np.sinc(0.5 * angle / np.pi) * turn, np.cos(0.5 * angle))


def _delayed(values: Array, late: float) -> Array:
    """Values `late` periods before; those before the first stencil are extrapolated, and not to be used."""
    samples = values.shape[-2]
    at = np.arange(samples) - late
    first = np.clip(np.floor(at).astype(int) - 1, 0, samples - 4)
    s = at - first
    weights = np.stack([
        -(s - 1) * (s - 2) * (s - 3) / 6, s * (s - 2) * (s - 3) / 2, -s * (s - 1) * (s - 3) / 2,
        s * (s - 1) * (s - 2) / 6,
    ])  # fmt: skip
    return sum(weights[k][:, None] * values[..., first + k, :] for k in range(4))
