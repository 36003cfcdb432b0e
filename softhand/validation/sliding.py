"""Slip of a block on a tip: where it begins, how far it goes, what it costs."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from softhand.laws.radial import Radial
from softhand.steppers.adaptive import Adaptive
from softhand.steppers.midpoint import Midpoint
from softhand.steppers.rk4 import RungeKutta4
from softhand.steppers.semi_implicit_euler import SemiImplicitEuler
from softhand.steppers.stepper import Stepper
from softhand.validation.check import Check
from softhand.validation.rigs import IMMOVABLE, MASS, MU, RADIUS, Body, G, Rig, block, depth_of, zero_crossing

STEPPERS: dict[str, type[Stepper]] = {
    "midpoint": Midpoint,
    "rk4": RungeKutta4,
    "adaptive": Adaptive,
    "semi-implicit-euler": SemiImplicitEuler,
}
LAW = Radial(radius=RADIUS)
DEPTH = depth_of(LAW, MASS * G)
HEADING = np.array([math.cos(0.6), math.sin(0.6)])
"""Of a block that slides: along no axis."""


def incline() -> Iterable[Check]:
    """A block at rest on a slope slides from theta = atan mu on; gravity is tilted instead of the slope."""
    low, high = 20.0, 35.0
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _slides(math.radians(middle)) else (middle, high)
    yield Check("incline: slides from", 0.5 * (low + high), math.degrees(math.atan(MU)), 0.1, "deg", True)


def _slides(theta: float) -> bool:
    """Whether a block that starts at rest, in balance if friction can hold it, moves within 0.3 s."""
    along, across = MASS * G * math.sin(theta), MASS * G * math.cos(theta)
    rig = block(depth_of(LAW, across), LAW, gravity=(*(G * math.sin(theta) * HEADING), -G * math.cos(theta)))
    rig.shear((*(-along * HEADING), 0.0), LAW.k_tangential)
    start = rig.position[:2].copy()
    rig.run(Midpoint(step=1e-3), 0.3)
    return bool(HEADING @ (rig.position[:2] - start) > 1e-7)


def stopping_distance() -> Iterable[Check]:
    """A block that slides at v0 stops after v0^2 / (2 mu g), and v0 / (mu g)."""
    speed = 0.5
    exact = speed**2 / (2.0 * MU * G)
    rig, stop, distance = stopped_block(Midpoint(step=1e-3), speed)
    yield Check("stopping distance", 1e3 * distance, 1e3 * exact, 1e-3, "mm")
    aside = float(HEADING[0] * rig.position[1] - HEADING[1] * rig.position[0])
    yield Check("stopping block, off its heading", 1e3 * aside, 0.0, 1e-9, "mm")
    yield Check("stopping time", stop, speed / (MU * G), 1e-3, "s")
    yield Check("slip travel until rest", 1e3 * float(rig.contact["slip_travel"]), 1e3 * exact, 1e-3, "mm")
    loss = 0.5 * MASS * speed**2
    yield Check("friction work until rest", 1e3 * float(rig.contact["slip_loss"]), 1e3 * loss, 1e-3, "mJ")


def stopped_block(stepper: Stepper, speed: float = 0.5) -> tuple[Rig, float, float]:
    """A block that slid until it stopped, when that was [s], and how far it went [m]."""
    rig = _sliding_block(speed)
    times, positions, speeds = [0.0], [0.0], [speed]

    def watch(time: float) -> bool:
        times.append(time)
        positions.append(float(HEADING @ rig.position[:2]))
        speeds.append(float(HEADING @ rig.velocity[:2]))
        return speeds[-1] <= 0.0

    rig.run(stepper, 1.0, watch)
    stop = zero_crossing(times, speeds)
    return rig, stop, float(np.interp(stop, times, positions))


def onset() -> Iterable[Check]:
    """Dragged evenly, to the limit in the middle of a step: with every stepper slip is there at its end."""
    depth, limit, duration = 1e-3, 0.1005, 0.12
    normal = LAW.K * depth**2
    for name, stepper in STEPPERS.items():
        rig = block(depth, LAW, body=Body(mass=IMMOVABLE), gravity=np.zeros(3))
        speed = MU * normal / LAW.k_tangential / limit
        rig.velocity[:2] = speed * HEADING
        slips: list[float] = []

        def watch(time: float, rig: Rig = rig, slips: list[float] = slips) -> None:
            if rig.contact["slip_travel"] > 0.0:
                slips.append(time)

        rig.run(stepper(step=1e-3), duration, watch)
        way = speed * (duration - limit)
        yield Check(f"slip begins, {name}", 1e3 * slips[0], 1e3 * limit, 0.5 + 1e-9, "ms", True)
        yield Check(f"slip travel from there, {name}", 1e3 * float(rig.contact["slip_travel"]), 1e3 * way, 1e-9, "mm")


def spin_down() -> Iterable[Check]:
    """A block that spins on the tip stops after I w0 / tau_max."""
    inertia, spin, length = 1e-5, 20.0, 0.0015
    rig = block(DEPTH, LAW, body=Body(inertia=(IMMOVABLE, IMMOVABLE, inertia)), torsion_length=length)
    rig.velocity[5] = spin
    rig.wind_up()
    times, spins = [0.0], [spin]

    def watch(time: float) -> bool:
        times.append(time)
        spins.append(float(rig.velocity[5]))
        return spins[-1] <= 0.0

    rig.run(Midpoint(step=1e-3), 1.0, watch)
    yield Check("spin-down time", zero_crossing(times, spins), inertia * spin / (MU * MASS * G * length), 2e-3, "s")


def static_and_kinetic() -> Iterable[Check]:
    """Dragged slowly: the force rises to mu_s f_z and falls to mu f_z as slip begins."""
    static, kinetic, depth = 0.7, 0.5, 1e-3
    rig = block(depth, LAW, body=Body(mass=IMMOVABLE), gravity=np.zeros(3), friction=kinetic, static_friction=static)
    normal = LAW.K * depth**2
    rig.velocity[:2] = static * normal / LAW.k_tangential * HEADING
    drags: list[float] = []
    rig.run(Midpoint(step=1e-3), 1.5, lambda time: drags.append(-float(HEADING @ rig.contact_forces()[-6:-4])))
    yield Check("static coefficient", max(drags) / normal, static, 2e-3)
    yield Check("kinetic coefficient", drags[-1] / normal, kinetic, 1e-9)
    yield Check("force falls at the onset within one step", 1e3 * _fall_time(drags), 1.0, 1e-9, "ms")


def _fall_time(drags: list[float]) -> float:
    """From the largest force to the last one [s], samples of 1 ms."""
    peak = int(np.argmax(drags))
    return 1e-3 * (next(k for k in range(peak, len(drags)) if abs(drags[k] / drags[-1] - 1.0) < 1e-9) - peak)


def hysteresis() -> Iterable[Check]:
    """A tangential cycle of amplitude A encloses 4 mu f_z (A - mu f_z / k), which is what slip takes."""
    depth, amplitude, step = 1e-3, 2e-3, 1e-4
    normal = LAW.K * depth**2
    rig = block(depth, LAW, body=Body(mass=IMMOVABLE), gravity=np.zeros(3))
    speed = 4.0 * amplitude
    stepper = Midpoint(step=step)
    area = loss = 0.0
    for half in range(5):
        rig.velocity[:2] = (speed if half % 2 == 0 else -speed) * HEADING
        path, drag = [float(HEADING @ rig.position[:2])], [-float(HEADING @ rig.contact_forces()[-6:-4])]
        before = float(rig.contact["slip_loss"])

        def watch(time: float, path: list[float] = path, drag: list[float] = drag) -> None:
            path.append(float(HEADING @ rig.position[:2]))
            drag.append(-float(HEADING @ rig.contact_forces()[-6:-4]))

        rig.run(stepper, 0.25 if half == 0 else 0.5, watch)
        if half >= 3:
            area += float(np.trapezoid(drag, path))
            loss += float(rig.contact["slip_loss"]) - before
    exact = 4.0 * MU * normal * (amplitude - MU * normal / LAW.k_tangential)
    yield Check("hysteresis of a tangential cycle, area", 1e3 * area, 1e3 * exact, 1e-3, "mJ")
    yield Check("hysteresis of a tangential cycle, slip loss", 1e3 * loss, 1e3 * area, 1e-3, "mJ")


def _sliding_block(speed: float) -> Rig:
    rig = block(DEPTH, LAW)
    rig.velocity[:2] = speed * HEADING
    rig.wind_up()
    return rig


EXPERIMENTS = (
    incline,
    stopping_distance,
    onset,
    spin_down,
    static_and_kinetic,
    hysteresis,
)
