"""A block on a tip without slip: depth, laws, ringing, rebound."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from scipy.optimize import brentq

from softhand.dampings.hunt_crossley import HuntCrossley
from softhand.dampings.kelvin_voigt import KelvinVoigt
from softhand.laws.hertz import Hertz
from softhand.laws.law import Law
from softhand.laws.power import Power
from softhand.laws.radial import Radial
from softhand.steppers.midpoint import Midpoint
from softhand.steppers.rk4 import RungeKutta4
from softhand.validation.check import Check
from softhand.validation.rigs import IMMOVABLE, MASS, RADIUS, Body, G, block, depth_of

LAW = Radial(radius=RADIUS)


def resting_depth() -> Iterable[Check]:
    """A damped block comes to rest where the law carries its weight."""
    exact = {
        "paper's normal force": (LAW, math.sqrt(MASS * G / LAW.K)),
        "Hertz": (
            hertz := Hertz(radius=RADIUS),
            (0.75 * MASS * G * (1.0 - hertz.nu**2) / hertz.E / math.sqrt(RADIUS)) ** (2.0 / 3.0),
        ),
        "power 1.7": (power := Power(radius=RADIUS, zeta=1.7, c_d=2e5), (MASS * G / power.c_d) ** (1.0 / 1.7)),
    }
    for name, (law, depth) in exact.items():
        rig = block(1.2 * depth, law, damping=KelvinVoigt(radial=20.0))
        rig.run(Midpoint(step=1e-3), 2.0)
        yield Check(f"resting depth, {name}", 1e3 * float(rig.contact["deformation"][0]), 1e3 * depth, 1e-9, "mm")


def normal_force() -> Iterable[Check]:
    """The force of the contact against the formula."""
    for depth in (1e-5, 1e-3):
        hertz = Hertz(radius=RADIUS, E=0.5e6, nu=0.3)
        exact = 4.0 / 3.0 * 0.5e6 / (1.0 - 0.3**2) * math.sqrt(RADIUS) * depth**1.5
        yield Check(f"Hertz, d = {1e3 * depth:g} mm", _pressed(depth, hertz), exact, 1e-10, "N")
        power = Power(radius=RADIUS, c_d=3e5, zeta=1.8)
        yield Check(f"power law, d = {1e3 * depth:g} mm", _pressed(depth, power), 3e5 * depth**1.8, 1e-10, "N")


def _pressed(depth: float, law: Law) -> float:
    rig = block(depth, law)
    rig.update()
    return float(rig.contact_forces()[-4])  # what lifts the box


def ringing() -> Iterable[Check]:
    """Small motions about rest ring at sqrt(k / m) and sqrt(k / I) in each of the four directions."""
    inertia = 1e-5
    depth = depth_of(LAW, MASS * G)
    springs = {
        "along x": (0, LAW.k_tangential / MASS),
        "along y": (1, LAW.k_tangential / MASS),
        "normal": (2, 2.0 * LAW.K * depth / MASS),
        "torsion": (5, LAW.k_torsional / inertia),
    }
    for name, (index, square) in springs.items():
        rig = block(depth, LAW, body=Body(inertia=(IMMOVABLE, IMMOVABLE, inertia)))
        rig.velocity[index] = 1e-5
        times: list[float] = []
        speeds: list[float] = []

        def watch(time: float, rig=rig, index=index, times=times, speeds=speeds) -> None:
            times.append(time)
            speeds.append(float(rig.velocity[index]))

        exact = math.sqrt(square)
        rig.run(Midpoint(step=1e-4), 10.2 * 2.0 * math.pi / exact, watch)
        yield Check(f"ringing {name}", _frequency(times, speeds), exact / (2.0 * math.pi), 1e-3, "Hz")


def _frequency(times: list[float], speeds: list[float]) -> float:
    """From the first to the last sign change, half a period each."""
    t, v = np.array(times), np.array(speeds)
    k = np.flatnonzero(v[:-1] * v[1:] < 0.0)
    crossings = t[k] + v[k] / (v[k] - v[k + 1]) * (t[k + 1] - t[k])
    return float(0.5 * (len(crossings) - 1) / (crossings[-1] - crossings[0]))


def rebound() -> Iterable[Check]:
    """Thrown at the tip a block comes back: with all its speed, or as lambda v - ln(1 + lambda v) says; never pulled.

    f (1 + lambda d') along v dv = -(f / m) (1 + lambda v) dd makes that expression equal at v0 and at -v1.
    """
    speed = 0.5
    back, _ = _thrown(speed, KelvinVoigt(radial=0.0, tangential=0.0, torsional=0.0))
    yield Check("rebound without damping", back, speed, 1e-5, "m/s")
    for rate in (0.2, 2.0):
        back, _ = _thrown(speed, HuntCrossley(radial=rate))
        level = _expression(speed, rate, 0.0)
        exact = brentq(_expression, 0.0, min(speed, 0.999999 / rate), args=(-rate, level))
        yield Check(f"rebound, lambda = {rate:g} s/m", back, exact, 1e-4, "m/s")
    _, pull = _thrown(speed, KelvinVoigt(radial=30.0))
    yield Check("rebound over a dashpot: largest pull", pull, 0.0, 0.0, "N")


def _expression(speed: float, rate: float, level: float) -> float:
    return rate * speed - math.log1p(rate * speed) - level


def _thrown(speed: float, damping: HuntCrossley | KelvinVoigt) -> tuple[float, float]:
    """Speed after the contact, and the largest pull within it."""
    rig = block(-1e-4, LAW, gravity=(0.0, 0.0, 0.0), damping=damping)
    rig.velocity[2] = -speed
    forces = []

    def watch(time: float) -> bool:
        forces.append(float(rig.contact["force"][2]))
        return bool(rig.contact["deformation"][0] < -1e-5 and rig.velocity[2] > 0.0)

    rig.run(RungeKutta4(step=1e-5), 0.1, watch)
    return float(rig.velocity[2]), max(0.0, -min(forces))


EXPERIMENTS = (resting_depth, normal_force, ringing, rebound)
