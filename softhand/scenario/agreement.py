"""Whether the sections of a scenario agree: counts, open fingers, names of tips, whole numbers of steps."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

from softhand.errors import ScenarioError
from softhand.scenario.bodies import HandSection
from softhand.scenario.fingertip import FingertipSection
from softhand.scenario.task import GraspSection, ReferenceSection
from softhand.settings.wording import choices, show

_MOST_STEPS = 1e9


def check_counts(hand: HandSection, grasp: GraspSection, reference: ReferenceSection) -> None:
    """One contact point a fingertip, one internal force a pair of them.

    Raises:
        ScenarioError: more or fewer, in the grasp or in what the reference asks for.
    """
    tips = len(hand.tips)
    pairs = tips * (tips - 1) // 2
    why = f"{tips} fingertips with {pairs} pair{'s' if pairs > 1 else ''}"
    _check_count("grasp.contact_points", grasp.contact_points, tips, f"{tips} fingertips")
    _check_count("grasp.internal_force", grasp.internal_force, pairs, why)
    for key, force in _desired_forces(reference):
        _check_count(key, force, pairs, why)


def check_opening(grasp: GraspSection, fingertip: FingertipSection) -> None:
    """Open fingers do not squeeze, and a tip that comes and goes needs the solid box.

    Raises:
        ScenarioError: an internal force, or tips that never leave their face, with open fingers.
    """
    if not grasp.opening:
        if any(grasp.standoff):
            raise ScenarioError(
                f"grasp.standoff: got {show(grasp.standoff)}, but a hand that holds the object at the start cannot "
                "stand off it; set grasp.opening above 0, or remove the key.",
                key="grasp.standoff",
                value=grasp.standoff,
            )
        return
    if any(grasp.internal_force):
        raise ScenarioError(
            f"grasp.internal_force: got {show(grasp.internal_force)}, but with grasp.opening the tips do not "
            "touch at the start and it must be 0; the squeeze to come belongs into [reference].",
            key="grasp.internal_force",
            value=grasp.internal_force,
        )
    if fingertip.contact != "coulomb":
        raise ScenarioError(
            'fingertip.contact: grasp.opening needs "coulomb"; a tip under "rolling" never leaves its face.',
            key="fingertip.contact",
            value=fingertip.contact,
        )


def check_tips(hand: HandSection, fingertip: FingertipSection) -> None:
    """The tables of single tips belong to tips of the hand, and hold together with the keys of all tips.

    Raises:
        ScenarioError: an unknown fingertip, or what `FingertipSection.at` refuses.
    """
    for tip in fingertip.tips or ():
        if tip not in hand.names:
            message = f"fingertip.tips: {show(tip)} is no fingertip. {choices(tip, hand.names)}"
            raise ScenarioError(message, key=f"fingertip.tips.{tip}", value=tip)
        fingertip.at(tip)


def check_times(duration: float, period: float, step: float, every: float | None = None) -> None:
    """A whole number of steps makes a control period, a whole number of these the run and the time between samples.

    Args:
        duration: of the run [s].
        period: control period [s].
        step: of the stepper [s].
        every: between two samples that are recorded [s].

    Raises:
        ScenarioError: no whole number, with the nearest good value; or far too many steps.
    """
    rule = f"go a whole number of times into the control period of {period:.12g} s"
    _check_whole("stepper.step", step, period / step, rule, lambda count: period / count)
    rule = f"be a whole number of control periods of {period:.12g} s"
    _check_whole("duration", duration, duration / period, rule, lambda count: period * count)
    if every is not None:
        _check_whole("record.every", every, every / period, rule, lambda count: period * count)


def _desired_forces(reference: ReferenceSection) -> Iterator[tuple[str, tuple[float, ...]]]:
    if reference.internal_force is not None:
        yield "reference.internal_force", reference.internal_force
    for k, waypoint in enumerate(reference.waypoints, start=1):
        if waypoint.internal_force is not None:
            yield f"reference.waypoints, internal_force of item {k}", waypoint.internal_force


def _check_count(key: str, values: tuple[Any, ...], count: int, why: str) -> None:
    if len(values) != count:
        message = f"{key}: got {show(values)} of length {len(values)}, but {why} need length {count}."
        raise ScenarioError(message, key=key, value=values)


def _check_whole(key: str, value: float, ratio: float, rule: str, good: Callable[[int], float]) -> None:
    """Refuse a ratio that is no whole number; `good` gives the value of the setting that has a given ratio."""
    if not ratio < _MOST_STEPS:
        message = f"{key}: got {value:.12g} s, but at most {_MOST_STEPS:.0e} steps are allowed; it must {rule}."
        raise ScenarioError(message, key=key, value=value)
    if not round(ratio) or abs(ratio - round(ratio)) > 1e-9 * ratio:
        near = min(
            good(max(1, math.floor(ratio))), good(max(1, math.ceil(ratio))), key=lambda other: abs(other - value)
        )
        message = f"{key}: got {value:.12g} s, but it must {rule}; the nearest good value is {near:.12g}."
        raise ScenarioError(message, key=key, value=value, nearest=near)
