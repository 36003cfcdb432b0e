"""What ends a run before its time: where the fingertip model, or the integration, has nothing more to say."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from softhand.compiled import compiled
from softhand.errors import SimulationStopped
from softhand.plant import Plant

HEALTHY, DIVERGED, FLAT, APEX, RIM = range(5)
_NAMES = {FLAT: "flat", APEX: "apex", RIM: "rim"}

_FLAT_BELOW = 0.05  # R / r: a hemisphere cannot be pressed flatter
_APEX_BELOW = 0.01  # cos Phi
_APEX_JUMP = 1.0  # [rad] of Theta between two samples: the contact went past the apex in between
_APEX_NEAR = math.radians(80.0)  # Phi that is told with any other reason
_FASTEST = 1e3  # [m/s, rad/s] faster than any hand: the run has diverged


@compiled
def find_fault(v, pads, contacts, Theta):
    """What ends the run, and at which finger; Theta of the previous sample is brought up to date."""
    for k in range(v.shape[0]):
        if not abs(v[k]) < _FASTEST:
            return DIVERGED, 0
    for i in range(contacts.shape[0]):
        contact = contacts[i]
        phi = contact.angles[1] + contact.deformation[2]
        if contact.distance < _FLAT_BELOW * pads[i].radius:
            return FLAT, i
        turn = abs(contact.angles[0] - Theta[i])
        Theta[i] = contact.angles[0]
        if contact.cos_Phi < _APEX_BELOW or min(turn, 2.0 * math.pi - turn) > _APEX_JUMP:
            return APEX, i
        if not 0.0 < phi < math.pi:
            return RIM, i
    return HEALTHY, 0


def stopped(fault: int, finger: int, plant: Plant, last_good: float) -> SimulationStopped:
    """The error for what `find_fault` found.

    Args:
        fault: code of `find_fault`.
        finger: at which contact.
        plant: with the contacts of the faulty state.
        last_good: time of the last sample without fault [s].
    """
    if fault == DIVERGED:
        return diverged("a velocity is beyond reason or not a number", last_good)
    contact, name = plant.contacts[finger], plant.world.tips[finger].name
    Phi = math.degrees(contact["angles"][1])
    what = {
        FLAT: f"is pressed flat (dr = {1e3 * contact['deformation'][0]:.2f} mm)",
        APEX: f"rolls over its apex (Phi = {Phi:.2f} deg), where the paper's coordinates are singular",
        RIM: f"rolls over its rim (phi = {Phi + math.degrees(contact['deformation'][2]):.1f} deg)",
    }[fault]
    return SimulationStopped(
        f"{name} {what} after t = {last_good:g} s; the fingertip model ends there. "
        "If the motion was rough before, the step is too large for this stepper.",
        reason=_NAMES[fault],
        time=last_good,
        finger=name,
    )


def diverged(why: str, last_good: float) -> SimulationStopped:
    """The error for a run whose integration broke down."""
    return SimulationStopped(
        f"the run diverged ({why}); the last good time is t = {last_good:g} s. Try a smaller stepper.step, "
        "the stepper midpoint, which is stable for stiff tips, or lower gains.",
        reason="diverged",
        time=last_good,
    )


def approach(Phi: NDArray[np.float64], plant: Plant) -> str:
    """Which tips came near the apex, where the paper's law turns stiff without bound; "" if none.

    Args:
        Phi: of each sample and contact [rad], shape (samples, nc).
        plant: for the names of the tips.
    """
    tips = zip(plant.world.tips, Phi.max(axis=0), strict=True)
    near = [f"{tip.name} {math.degrees(largest):.1f} deg" for tip, largest in tips if largest > _APEX_NEAR]
    return f" Largest Phi before, with the apex at 90 deg: {', '.join(near)}." if near else ""
