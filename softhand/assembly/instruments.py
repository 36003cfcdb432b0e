"""The instruments and drives of a scenario, for its hand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from softhand.controllers.controller import Controller
from softhand.errors import ScenarioError
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.scenario.instruments import ActuationSection, InstrumentSection, ServoSection, periods_of, stride_of
from softhand.scenario.scenario import Scenario
from softhand.sensing.quantities import QUANTITIES, Channel, Sensing, components
from softhand.settings.wording import show
from softhand.simulation.actuation import Actuation, lag_shares
from softhand.simulation.servo import COMMANDS, Servos

Numbers = float | Sequence[float]


def read_sensing(scenario: Scenario, world: World) -> Sensing | None:
    """The instruments of a scenario; None where all is exact.

    Raises:
        ScenarioError: a list has another length than its quantity has components.
    """
    section = scenario.sensing
    if section is None or not section.instruments:
        return None
    sizes, period = components(world.n_joints, world.n_tips), scenario.control_period
    channels = {name: _channel(name, one, sizes[name], world, period) for name, one in section.instruments.items()}
    return Sensing(channels, section.seed)


def read_actuation(scenario: Scenario, world: World, controller: Controller) -> Actuation | None:
    """The drives of a scenario; None where the joints have the command at once.

    Raises:
        ScenarioError: a list has another length than there are joints, or the controller does not command what the
            servos take.
    """
    section, period, n = scenario.actuation, scenario.control_period, world.n_joints
    speeds = world.mechanics.velocity_limit
    servo = section.servo if section is not None else None
    _check_commands(controller, servo)
    if section is None and not np.any(np.isfinite(speeds)):
        return None
    section = section or ActuationSection()
    rate = math.inf if section.rate_limit is None else section.rate_limit
    lag, noise, most = (
        _one_each(f"actuation.{key}", value, n, f"{n} joints")
        for key, value in (("lag", section.lag), ("noise", section.noise), ("rate_limit", rate))
    )
    delay, shares = periods_of(section.delay, period), lag_shares(lag, period)
    servos = None if servo is None else _read_servos(servo, period, n, controller)
    return Actuation(delay, most * period, *shares, noise, section.seed, speeds.copy(), servos)


def _read_servos(section: ServoSection, period: float, n: int, controller: Controller) -> Servos:
    keys = ("stiffness", "damping", "rate_limit", "torque_limit")
    given = [math.inf if getattr(section, key) is None else getattr(section, key) for key in keys]
    K, D, rate, most = (
        _one_each(f"actuation.servo.{key}", value, n, f"{n} joints") for key, value in zip(keys, given, strict=True)
    )
    stride = 1 if section.period is None else periods_of(section.period, period)
    commands = 1 if controller.period is None else periods_of(controller.period, period)
    return Servos(section.kind, K, D, rate * period, most, stride, commands)


def _check_commands(controller: Controller, servo: ServoSection | None) -> None:
    """A controller commands what its servos take."""
    takes, commands = "torque" if servo is None else COMMANDS[servo.kind], controller.commands
    if takes == commands:
        return
    name = type(controller).__name__
    is_torque = commands == "torque"
    own = 'none, or one of kind "impedance"' if is_torque else f'one of kind "{commands}"'
    have = "there is no servo" if servo is None else f'it is of kind "{servo.kind}"'
    raise ScenarioError(
        f"actuation.servo: the controller {name} commands a {commands} of each joint; of servos it needs {own}, but "
        f"{have}; "
        + ("choose that, or the controller set-points." if is_torque else
           f'write [actuation.servo] with kind = "{commands}" and its gains.'),
        key="actuation.servo", value=None if servo is None else servo.kind,
    )  # fmt: skip


def not_linear(scenario: Scenario) -> list[str]:
    """Keys of what no linear loop has: rounding, rates that are cut, and torques that fall with the speed."""
    kinds = ("quantisation", "rate_limit", "velocity_limit")
    return [key for key in left_out(scenario) if key.rpartition(".")[2] in kinds]


def left_out(scenario: Scenario) -> list[str]:
    """Keys of what a loop of ideal instruments and drives leaves out, but noise, which has no dynamics, and bias."""
    found = []
    for name, one in (scenario.sensing.instruments if scenario.sensing is not None else {}).items():
        given = one.model_dump(exclude_none=True)
        found += [f"sensing.{name}.{key}" for key, value in given.items() if key not in ("bias", "noise") and value]
    if scenario.actuation is not None:
        given = scenario.actuation.model_dump(exclude_none=True, exclude={"seed", "noise"})
        found += [f"actuation.{key}" for key, value in given.items() if key != "servo" and np.any(value)]
    if scenario.hand.joints is not None and scenario.hand.joints.velocity_limit is not None:
        found.append("hand.joints.velocity_limit")
    return found


def _channel(name: str, one: InstrumentSection, size: int, world: World, period: float) -> Channel:
    noise, bias = (
        _components(f"sensing.{name}.{key}", value, size, QUANTITIES[name].each, world)
        for key, value in (("noise", one.noise), ("bias", one.bias))
    )
    share = 1.0 if one.filter is None else -math.expm1(-2.0 * math.pi * one.filter * period)
    delay, stride = periods_of(one.delay, period), stride_of(one.rate, period)
    return Channel(noise, bias, one.quantisation, delay, stride, share)


def _components(key: str, value: Any, size: int, each: str, world: World) -> Array:
    if each == "tip axis" and isinstance(value, Sequence) and len(value) == 3:
        return np.tile(np.asarray(value, dtype=float), world.n_tips)
    counted = {"joint": f"{size} joints", "axis": "3 axes", "tip": f"{size} fingertips"}
    return _one_each(key, value, size, counted.get(each, f"{world.n_tips} fingertips with 3 axes each"), each)


def _one_each(key: str, value: Numbers, size: int, why: str, each: str = "") -> Array:
    if isinstance(value, Sequence) and len(value) != size:
        lengths = f"one number, 3 or {size}" if each == "tip axis" else f"one number, or {size}"
        message = f"{key}: got {show(value)} of length {len(value)}, but {why} need {lengths}."
        raise ScenarioError(message, key=key, value=value)
    return np.array(np.broadcast_to(np.asarray(value, dtype=float), (size,)))
