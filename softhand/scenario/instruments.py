"""Sections of a scenario between the grasp and the controller: sensing and actuation."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from pydantic import Field, field_validator, model_validator

from softhand.errors import ScenarioError
from softhand.recording.variables import COMMANDED, FOUND_AFTERWARDS, MEASURED_PREFIX, VARIABLES
from softhand.scenario.tactile import TactileSection
from softhand.settings.settings import Gain, NonNegative, Positive, Settings

Offset: TypeAlias = float | Annotated[tuple[float, ...], Field(min_length=1)]
Seed: TypeAlias = Annotated[int, Field(ge=0, le=10**9)]

_MOST_PERIODS = 10_000
_COARSEST = 1.0  # of what turns


class InstrumentSection(Settings):
    """One instrument, in the unit of what it measures; what is not given is ideal."""

    noise: Gain = 0.0
    """Standard deviation of a sample, one number for all components or one for each."""
    bias: Offset = 0.0
    """What is added to all samples, likewise."""
    quantisation: NonNegative = 0.0
    """Samples are rounded to whole multiples of it; 0 for none."""
    delay: NonNegative = 0.0
    """Time until a sample arrives, a whole number of control periods [s]."""
    rate: Positive | None = None
    """Samples a second, held in between; each control period if not given [Hz]."""
    filter: Positive | None = None
    """Cut-off frequency of a low-pass filter of first order behind all that; none if not given [Hz]."""


class SensingSection(Settings):
    """The instruments through which a controller sees the grasp; what has none is exact and at once."""

    seed: Seed = 0
    """Of the noise; the same seed gives the same noise, under any controller."""
    joint_position: InstrumentSection | None = None
    """Positions of the joints [rad or m], one component a joint."""
    joint_velocity: InstrumentSection | None = None
    """Velocities of the joints [rad/s or m/s], one component a joint."""
    object_position: InstrumentSection | None = None
    """Origin of the object frame [m], world axes."""
    object_orientation: InstrumentSection | None = None
    """Orientation of the object; its errors are rotation vectors in world axes [rad]."""
    object_velocity: InstrumentSection | None = None
    """Velocity of the origin of the object frame [m/s], world axes."""
    object_angular_velocity: InstrumentSection | None = None
    """Angular velocity of the object [rad/s], world axes."""
    contact_force: InstrumentSection | None = None
    """Force of each tip on the object [N], axes of the tip; 3 components for all tips, or 3 for each."""
    contact_torsion: InstrumentSection | None = None
    """Torsion moment of each tip on the object [N m], one component a tip."""
    contact_normal: InstrumentSection | None = None
    """Where each tip is touched, as its normal there; its errors are rotation vectors in axes of the tip [rad]; 3
    components for all tips, or 3 for each."""
    contact_compression: InstrumentSection | None = None
    """Compression dr of each tip [m], one component a tip."""

    @field_validator("object_orientation", "contact_normal")
    @classmethod
    def _rounds_a_turn(cls, section: InstrumentSection | None) -> InstrumentSection | None:
        if section is not None and section.quantisation > _COARSEST:
            raise ValueError(f"quantisation is {section.quantisation:g} rad, but it must be at most {_COARSEST:g}.")
        return section

    @property
    def instruments(self) -> dict[str, InstrumentSection]:
        """Those that are given, by quantity."""
        every = ((name, getattr(self, name)) for name in type(self).model_fields)
        return {name: one for name, one in every if isinstance(one, InstrumentSection)}


class ServoSection(Settings):
    """A low-level servo at each joint, which makes a torque of what the controller commands."""

    kind: Literal["position", "velocity", "impedance"]
    """`position`: the controller commands positions, and tau = K (q_d - q) - D q'; `velocity`: it commands velocities,
    and tau = D (v_d - q'); `impedance`: it commands torques u, and tau = u + K (q_d - q) - D q' about where the joint
    was when the command came."""
    stiffness: Gain = 0.0
    """K, one number for all joints or one for each [N m/rad or N/m]."""
    damping: Gain = 0.0
    """D, likewise [N m s/rad or N s/m]."""
    period: Positive | None = None
    """Time between two samples of the servos, a whole number of control periods [s]; each one if not given."""
    rate_limit: Positive | Annotated[tuple[Positive, ...], Field(min_length=1)] | None = None
    """Largest rate of a set point, likewise, of velocities a second more; none if not given [rad/s or m/s]."""
    torque_limit: Positive | Annotated[tuple[Positive, ...], Field(min_length=1)] | None = None
    """Largest torque of a servo, beside the effort limits, likewise; none if not given [N m or N]."""

    @model_validator(mode="after")
    def _has_gains_of_its_kind(self) -> ServoSection:
        if self.kind == "velocity" and np.any(self.stiffness):
            raise ValueError('a servo of kind "velocity" has no stiffness; remove it, or choose "position".')
        needed = {"position": "stiffness", "velocity": "damping"}.get(self.kind)
        if needed and not np.any(getattr(self, needed)):
            raise ValueError(f'a servo of kind "{self.kind}" does nothing without {needed}; give it, such as 1.0.')
        if self.kind == "impedance" and self.rate_limit is not None:
            raise ValueError('a servo of kind "impedance" has no set point whose rate could be cut; remove rate_limit.')
        return self


class ActuationSection(Settings):
    """What becomes of a command: delay, servo, effort limit, rate limit of the torque, lag, noise, in this order."""

    servo: ServoSection | None = None
    """What makes a torque of the command; it is the torque itself if not given."""

    delay: NonNegative = 0.0
    """Time until a command arrives, a whole number of control periods [s]."""
    rate_limit: Positive | Annotated[tuple[Positive, ...], Field(min_length=1)] | None = None
    """Largest rate of the torque, one number for all joints or one for each; none if not given [N m/s or N/s]."""
    lag: Gain = 0.0
    """Time constant of a first-order lag, likewise; 0 for none [s]."""
    noise: Gain = 0.0
    """Standard deviation of the torque of a control period, likewise [N m or N]."""
    seed: Seed = 0
    """Of the noise."""


def check_loop(
    sensing: SensingSection | None, actuation: ActuationSection | None, tactile: TactileSection | None, period: float
) -> None:
    """Delays, rates and filters that the control period can have.

    Args:
        sensing: the instruments.
        actuation: the drives.
        tactile: the taxels.
        period: control period [s].

    Raises:
        ScenarioError: a delay is no whole number of periods, samples come faster than the loop asks or not in its
            beat, or a filter is beyond the Nyquist frequency; names what is near and good.
    """
    if actuation is not None:
        _check_delay("actuation.delay", actuation.delay, period)
        if actuation.servo is not None and actuation.servo.period is not None:
            _check_delay("actuation.servo.period", actuation.servo.period, period, least=1)
    if tactile is not None:
        _check_sampling("tactile", tactile, period)
    for name, one in (sensing.instruments if sensing is not None else {}).items():
        path = f"sensing.{name}"
        _check_sampling(path, one, period)
        nyquist = 0.5 / period
        if one.filter is not None and one.filter >= nyquist:
            raise _wrong(
                f"{path}.filter", one.filter, f"got {one.filter:.12g} Hz, but a control period of {period:.12g} s has "
                f"no frequencies above {nyquist:.12g} Hz; give a lower one, or leave it out.",
            )  # fmt: skip


def check_variables(
    key: str,
    names: Iterable[str],
    sensing: SensingSection | None,
    actuation: ActuationSection | None,
    tactile: TactileSection | None,
    has_elements: bool,
) -> None:
    """Variables that a run will have.

    Raises:
        ScenarioError: it is as a controller sees it, as it commands, or what taxels feel, and there are no instruments,
            drives or taxels; or no run has it.
    """
    is_measured = sensing is not None and bool(sensing.instruments)
    servo = actuation.servo if actuation is not None else None
    own = COMMANDED[servo.kind if servo is not None and servo.kind in COMMANDED else "torque"]
    for name in names:
        if name in FOUND_AFTERWARDS and not (has_elements and name == "slipped_share"):
            message = f"{key}: {name!r} is found in a recording by softhand.incipient_slip; leave the name out."
            raise ScenarioError(message, key=key, value=name)
        if name.startswith(MEASURED_PREFIX) and not is_measured:
            needed, example = "[sensing]", "sensing.joint_position.noise"
        elif name in COMMANDED.values() and name != COMMANDED["torque"] and name != own:
            kind = name.split("_")[1]
            needed, example = f"a {kind} servo", f'actuation.servo = {{kind = "{kind}", ...}}'
        elif name == COMMANDED["torque"] and (actuation is None or name != own):
            needed = "[actuation]" if actuation is None else "[actuation] without a servo that takes set points"
            example = "actuation.delay"
        elif not has_elements and name in VARIABLES and "element" in VARIABLES[name].dims:
            needed, example = "slip elements", "fingertip.slip_elements = 8"
        elif tactile is None and name in VARIABLES and "taxel" in VARIABLES[name].dims:
            needed, example = "[tactile]", "tactile.count"
        else:
            continue
        message = f"{key}: {name!r} is there under {needed} alone; give that, such as {example}, or leave the name out."
        raise ScenarioError(message, key=key, value=name)


def periods_of(delay: float, period: float) -> int:
    """Whole number of control periods in a delay [s]."""
    return round(delay / period)


def stride_of(rate: float | None, period: float) -> int:
    """Control periods between two samples."""
    return 1 if rate is None else round(1.0 / (rate * period))


def _check_sampling(path: str, one: InstrumentSection | TactileSection, period: float) -> None:
    _check_delay(f"{path}.delay", one.delay, period)
    if one.rate is not None:
        _check_rate(f"{path}.rate", one.rate, period)


def _check_delay(key: str, delay: float, period: float, least: int = 0) -> None:
    periods = delay / period
    if periods > _MOST_PERIODS:
        raise _wrong(key, delay, f"got {delay:.12g} s, but it may be at most {_MOST_PERIODS * period:.12g} s, "
                                 f"{_MOST_PERIODS} control periods; give less.")  # fmt: skip
    if abs(periods - round(periods)) > 1e-9 * max(1.0, periods) or round(periods) < least:
        near = max(round(periods), least) * period
        raise _wrong(
            key, delay, f"got {delay:.12g} s, but it must be a whole number of control periods of {period:.12g} s; the "
            f"nearest good value is {near:.12g}.", near,
        )  # fmt: skip


def _check_rate(key: str, rate: float, period: float) -> None:
    ratio = 1.0 / (rate * period)
    if ratio < 1.0 - 1e-9:
        raise _wrong(
            key, rate, f"got {rate:.12g} Hz, but the controller asks {1.0 / period:.12g} times a second; give at most "
            "that, or leave it out.", 1.0 / period,
        )  # fmt: skip
    if abs(ratio - round(ratio)) > 1e-6 * ratio:
        goods = [1.0 / (count * period) for count in (math.floor(ratio), math.ceil(ratio))]
        near = min(goods, key=lambda good: abs(good - rate))
        raise _wrong(
            key, rate, f"got {rate:.12g} Hz, but a whole number of control periods of {period:.12g} s must lie between "
            f"two samples; the nearest good value is {near:.12g}.", near,
        )  # fmt: skip


def _wrong(key: str, value: float, why: str, near: Any = None) -> ScenarioError:
    return ScenarioError(f"{key}: {why}", key=key, value=value, nearest=near)
