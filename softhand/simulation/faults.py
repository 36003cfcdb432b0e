"""What ends a run before its time: where the fingertip model, or the integration, has nothing more to say."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from softhand.errors import SimulationStopped
from softhand.numerics.branches import seldom, usually
from softhand.numerics.compiled import compiled
from softhand.plant.plant import Plant

HEALTHY, DIVERGED, FLAT, APEX, RIM, BROKEN, PULLS = range(7)
_NAMES = {FLAT: "flat", APEX: "apex", RIM: "rim", BROKEN: "law", PULLS: "law"}

_FLAT_BELOW = 0.05  # R / r: a hemisphere cannot be pressed flatter
_APEX_BELOW = 0.01  # cos Phi
_APEX_JUMP = 1.0  # [rad] of Theta between two samples: the contact went past the apex in between
_APEX_NEAR = math.radians(80.0)  # Phi that is told with any other reason
_FASTEST = 1e3  # [m/s, rad/s] faster than any hand: the run has diverged


@compiled
def find_fault(v, pads, contacts, Theta):
    """What ends the run, and at which finger; Theta of the previous sample is brought up to date."""
    for i in range(contacts.shape[0]):
        if seldom(contacts[i].is_broken > 0):
            return BROKEN, i
    for k in range(v.shape[0]):
        if not usually(abs(v[k]) < _FASTEST):
            return DIVERGED, 0
    for i in range(contacts.shape[0]):
        contact = contacts[i]
        if seldom((contact.deformation[0] > 0.0) & (contact.deformation_force[0] < 0.0)):
            return PULLS, i
        if seldom((pads[i].radius > 0.0) & (contact.distance < _FLAT_BELOW * pads[i].radius)):
            return FLAT, i
        if pads[i].is_support:
            continue
        if pads[i].can_slip and not usually(contact.deformation[0] > 0.0):
            Theta[i] = math.nan
            continue
        if pads[i].is_surface:
            if seldom(contact.sin_Phi < 0.0):
                return RIM, i
            continue
        phi = contact.angles[1] + contact.deformation[2]
        turn = abs(contact.angles[0] - Theta[i])
        Theta[i] = contact.angles[0]
        if seldom((contact.cos_Phi < _APEX_BELOW) | (min(turn, 2.0 * math.pi - turn) > _APEX_JUMP)):
            return APEX, i
        if not usually((phi > 0.0) & (phi < math.pi)):
            return RIM, i
    return HEALTHY, 0


def stopped(fault: int, finger: int, plant: Plant, last_good: float, is_limited: bool) -> SimulationStopped:
    """The error for what `find_fault` found.

    Args:
        fault: code of `find_fault`.
        finger: at which contact.
        plant: with the contacts of the faulty state.
        last_good: time of the last sample without fault [s].
        is_limited: whether the stepper is stable up to some step only.
    """
    if fault == DIVERGED:
        return diverged("a velocity is beyond reason or not a number", last_good, is_limited)
    contact, name = plant.contacts[finger], plant.contact_names[finger]
    if fault in (BROKEN, PULLS):
        return _bad_law(fault, plant, finger, last_good)
    Phi = math.degrees(contact["angles"][1])
    phi = Phi if plant.pads[finger]["is_surface"] else Phi + math.degrees(contact["deformation"][2])
    what = {
        FLAT: f"is pressed flat (dr = {1e3 * contact['deformation'][0]:.2f} mm)",
        APEX: f"rolls over its apex (Phi = {Phi:.2f} deg), where the paper's coordinates are singular",
        RIM: f"rolls over its rim (phi = {phi:.1f} deg)",
    }[fault]
    return SimulationStopped(
        f"{name} {what} after t = {last_good:g} s; the fingertip model ends there. "
        "`softhand check` tells whether the step is too long for the stepper, or the loop grows by itself.",
        reason=_NAMES[fault],
        time=last_good,
        finger=name,
    )


def _bad_law(fault: int, plant: Plant, finger: int, last_good: float) -> SimulationStopped:
    contact, name, law = (
        plant.contacts[finger],
        plant.contact_names[finger],
        type(plant.materials[finger].law).__name__,
    )
    what = "answers a deformation within reason with NaN or infinity"
    if fault == PULLS:
        what = (
            f"pulls with {-contact['deformation_force'][0]:.3g} N while the tip is compressed by "
            f"{1e3 * contact['deformation'][0]:.3g} mm"
        )
    return SimulationStopped(
        f"the fingertip law '{law}' {what}, at {name} after t = {last_good:g} s; mend its formula or its parameters.",
        reason=_NAMES[fault],
        time=last_good,
        finger=name,
        law=law,
    )


def broken_down(error: FloatingPointError, plant: Plant, last_good: float, is_limited: bool) -> SimulationStopped:
    """The error for a step that could not be made: of the law, if it is to blame."""
    blamed = np.flatnonzero(plant.contacts["is_broken"])
    if blamed.size:
        return _bad_law(BROKEN, plant, int(blamed[0]), last_good)
    return diverged(str(error), last_good, is_limited)


def diverged(why: str, last_good: float, is_limited: bool) -> SimulationStopped:
    """The error for a run whose integration broke down; see `stopped`."""
    other = " for the stepper (midpoint is stable for stiff tips)," if is_limited else ""
    return SimulationStopped(
        f"the run diverged ({why}); the last good time is t = {last_good:g} s. `softhand check` tells whether "
        f"stepper.step is too long{other} or the loop grows by itself.",
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
    near = [
        f"{tip.name} {math.degrees(largest):.1f} deg"
        for (tip, largest), pad in zip(tips, plant.pads[: plant.world.n_tips], strict=True)
        if largest > _APEX_NEAR and not pad["is_surface"]
    ]
    return f" Largest Phi before, with the apex at 90 deg: {', '.join(near)}." if near else ""


def out_of_range(time: NDArray[np.float64], dr: NDArray[np.float64], Phi: NDArray[np.float64], plant: Plant) -> str:
    """Where tips were deformed beyond what their law is meant for, though the run went on; "" if nowhere.

    Args:
        time: of each sample [s].
        dr: compression of each sample and contact [m], shape (samples, nc).
        Phi: likewise [rad].
        plant: for the laws and the names of the tips.
    """
    found = []
    for i, (tip, fingertip) in enumerate(zip(plant.world.tips, plant.fingertips, strict=True)):
        law = fingertip.law
        lowest, highest = law.Phi_range
        touches = dr[:, i] > 0.0
        if not touches.any():
            continue
        when, depth, angle = time[touches], dr[touches, i] / law.radius, np.degrees(Phi[touches, i])
        for beyond, worst, limit in (
            (depth > law.deepest, f"dr = {np.max(depth):.2f} r", f"dr = {law.deepest:g} r"),
            (angle > highest, f"Phi = {np.max(angle):.1f} deg", f"Phi = {highest:g} deg"),
            (angle < lowest, f"Phi = {np.min(angle):.1f} deg", f"Phi = {lowest:g} deg"),
        ):
            if beyond.any():
                found.append(
                    f"{tip.name} goes to {worst}, beyond {limit} at t = {when[np.argmax(beyond)]:.3g} s, where the law "
                    f"'{type(law).__name__}' is no longer meant to hold."
                )
    return " ".join(found)
