"""The figures of a grasp as rows of tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from softhand.grasping.finger_quality import FingerQuality
from softhand.numerics.arrays import Array


def finger_rows(fingers: Sequence[FingerQuality], points: Array, opening: float) -> list[tuple[str, ...]]:
    """A table with one column a finger; the first row are their names.

    Args:
        fingers: of the grasp.
        points: of the contacts in the object frame [m], shape (nc, 3).
        opening: how far off them the tips are [m].
    """
    slides = np.concatenate([finger.slides for finger in fingers])
    unit = "mm" if slides.all() else "deg; slides mm" if slides.any() else "deg"
    rate = "mm/mm" if slides.all() else "mm/rad; slides mm/mm" if slides.any() else "mm/rad"
    gap = [("gap to the contact point [mm]", [f"{1e3 * opening:.1f}"] * len(fingers))] if opening else []
    lines = [
        ("", [finger.name for finger in fingers]),
        ("contact point, object frame [mm]", [numbers(1e3 * point, "{:.1f}") for point in points]),
        *gap,
        ("reach, of the finger's length [mm]", [_reach(finger) for finger in fingers]),
        (f"joint angles [{unit}]", [_joints(finger, finger.angles) for finger in fingers]),
        (f"to the nearest limit [{unit}]", [_joints(finger, finger.reserve) for finger in fingers]),
        ("torque, of its limit [%]", [numbers(100.0 * finger.torque_use, "{:.0f}") for finger in fingers]),
        (f"tip moves by [{rate}]", [_speeds(finger) for finger in fingers]),
        ("manipulability [cm^3/rad^3]", [_manipulability(finger) for finger in fingers]),
        ("Phi, from the rim [deg]", [number(math.degrees(finger.Phi), "{:.1f}") for finger in fingers]),
        ("Phi, to the apex [deg]", [number(90.0 - math.degrees(finger.Phi), "{:.1f}") for finger in fingers]),
        ("dr [mm]", [number(1e3 * finger.depth, "{:.2f}") for finger in fingers]),
        ("normal force [N]", [number(finger.force[2], "{:.2f}") for finger in fingers]),
        ("friction use", [number(finger.friction_use, "{:.2f}") for finger in fingers]),
        ("limit-surface use", [number(finger.limit_surface_use, "{:.2f}") for finger in fingers]),
    ]
    return [(label, *values) for label, values in lines]


def least_reserve(fingers: Sequence[FingerQuality]) -> str:
    """The least distance of a joint to its limits, and of a slide."""
    slides = np.concatenate([finger.slides for finger in fingers])
    reserve = np.concatenate([finger.reserve for finger in fingers])
    texts = []
    if not slides.all():
        texts.append(f"{np.degrees(reserve[~slides].min()):.0f} deg")
    if slides.any():
        texts.append(f"{1e3 * reserve[slides].min():.0f} mm")
    return ", ".join(texts)


def number(value: float, form: str) -> str:
    """A number as text; "-" for what is not known, "pulls" for infinity."""
    if math.isnan(value):
        return "-"
    if math.isinf(value):
        return "pulls"
    text = form.format(value)
    return text if float(text) else form.format(0.0)  # no -0.0


def numbers(values: Sequence[float] | Array, form: str) -> str:
    """Numbers as text; "free" for a distance to no limit."""
    return ", ".join("free" if math.isinf(value) else number(value, form) for value in values)


def _reach(finger: FingerQuality) -> str:
    if finger.missing:
        return f"out of reach by {1e3 * finger.missing:.1f}"
    return f"{1e3 * finger.stretch * finger.length:.0f} of {1e3 * finger.length:.0f}"


def _joints(finger: FingerQuality, values: Array) -> str:
    return numbers(np.where(finger.slides, 1e3 * values, np.degrees(values)), "{:.1f}")


def _speeds(finger: FingerQuality) -> str:
    if np.isnan(finger.speeds).any():
        return "-"
    return numbers(finger.speeds, "{:.2f}") if finger.slides.all() else numbers(1e3 * finger.speeds, "{:.0f}")


def _manipulability(finger: FingerQuality) -> str:
    return "-" if finger.slides.any() else number(1e6 * finger.manipulability, "{:.0f}")
