"""Where slip begins: the torsion that a contact holds, alone and together with a force."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from softhand.contact.limit import limit_use
from softhand.laws.hertz import Hertz
from softhand.laws.radial import Radial
from softhand.numerics.arrays import Array
from softhand.steppers.midpoint import Midpoint
from softhand.validation.check import Check
from softhand.validation.pressures import columns, limit_curve, power
from softhand.validation.rigs import IMMOVABLE, MU, RADIUS, Body, block
from softhand.validation.sliding import HEADING

LAW = Radial(radius=RADIUS)


def torsion_limit() -> Iterable[Check]:
    """The largest torsion of columns k_r (cos b - c), at rho = R tan b from the middle, under a spin about it."""
    nodes, weights = np.polynomial.legendre.leggauss(200)
    for depth in (1e-4, 1e-3, 2e-3, 3e-3):
        held, force = _spun(depth, Radial(radius=RADIUS))
        c = 1.0 - depth / RADIUS
        edge = math.acos(c)
        b = 0.5 * edge * (nodes + 1.0)
        dN = LAW.K / math.pi * (np.cos(b) - c) * RADIUS**2 * np.sin(b) * 2.0 * math.pi * 0.5 * edge * weights
        tau_max = MU * float(np.sum(RADIUS * c * np.tan(b) * dN))
        yield Check(f"torsion limit, dr = {1e3 * depth:g} mm", 1e3 * held, 1e3 * tau_max, 1e-8, "mN m")
        if depth == 1e-3:
            yield Check("columns carry the normal force, dr = 1 mm", force, float(np.sum(dN)), 1e-10, "N")
    depth = 1e-3
    held, force = _spun(depth, Hertz(radius=RADIUS))
    # p = p_0 sqrt(1 - x^2): the integral of x 2 x dx p over that of 2 x dx p, by x = sin t
    x = np.sin(0.25 * math.pi * (nodes + 1.0))
    share = np.sum(weights * x**2 * (1.0 - x**2)) / np.sum(weights * x * (1.0 - x**2))
    exact = MU * force * share * math.sqrt(RADIUS * depth)
    yield Check("torsion limit, Hertz pressure", 1e3 * held, 1e3 * float(exact), 1e-2, "mN m")


def _spun(depth: float, law: Radial | Hertz) -> tuple[float, float]:
    rig = block(depth, law)
    rig.velocity[5] = -1e4  # of the box, about z up: the tip below it, whose z_C is up too, turns the other way over it
    rig.wind_up()
    rig.update()
    return float(rig.contact["force"][3]), float(rig.contact["force"][2])


def coupled_onset() -> Iterable[Check]:
    """Dragged and spun at once: slip begins on the limit, the ellipse or that of the pressure, at any share of both."""
    depth = 1e-3
    tau_max, force = _spun(depth, LAW)
    curve = limit_curve(columns(depth, RADIUS), np.tan(0.5 * math.pi * np.linspace(0.0, 1.0, 80, endpoint=False)))
    curve /= curve[0, 1] ** np.array([0.0, 1.0])
    for limit in ("ellipse", "exact"):
        for angle in (0.0, 20.0, 45.0, 70.0, 90.0):
            along = np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle))])
            if limit == "exact":  # where the ray meets the curve
                tangent = curve[:, 1] * along[0] - curve[:, 0] * along[1]
                along = np.array([np.interp(0.0, -tangent, part) for part in curve.T]) if 0.0 < angle < 90.0 else along
            yield Check(f"slip onset, {limit}, torsion {angle:g} deg", _onset(limit, along, tau_max, force), 1.0, 5e-3)


def _onset(limit: str, shares: Array, tau_max: float, force: float) -> float:
    """Time at which a block slips that meets shares (f_t / (mu f_z), tau / tau_max) of the limit after 1 s [s]."""
    rig = block(1e-3, LAW, body=Body(mass=IMMOVABLE), gravity=np.zeros(3), limit=limit)
    rig.velocity[:2] = shares[0] * MU * force / LAW.k_tangential * HEADING
    rig.velocity[5] = -shares[1] * tau_max / LAW.k_torsional
    times: list[float] = []

    def watch(time: float) -> bool:
        times.append(time)
        return bool(rig.contact["slip_travel"] > 0.0 or rig.contact["slip_twist"] > 0.0)

    rig.run(Midpoint(step=1e-3), 2.0, watch)
    return times[-1]


def exact_limit() -> Iterable[Check]:
    """The limit of softhand where the integral over the pressure says it is: largest and least use along the curve."""
    turn = 0.5 * math.pi * np.linspace(0.0, 1.0, 24, endpoint=False)
    for law, depth in ((LAW, 1e-4), (LAW, 1e-3), (LAW, 3e-3), (Hertz(radius=RADIUS), 1e-3)):
        a = math.sqrt(RADIUS * depth) if isinstance(law, Hertz) else math.sqrt(RADIUS**2 - (RADIUS - depth) ** 2)
        pressure = power(2.0) if isinstance(law, Hertz) else columns(depth, RADIUS)
        rig = block(depth, law)
        rig.update()
        lever = rig.contact["lever"]
        uses = [
            limit_use(rig.contact, (-0.8 * f_t, 0.6 * f_t, -tau * a / lever), 1.0)
            for f_t, tau in limit_curve(pressure, np.tan(turn))
        ]
        for what, use in (("largest", max(uses)), ("least", min(uses))):
            name = f"{what} use on the exact limit, {type(law).__name__}, dr = {1e3 * depth:g} mm"
            yield Check(name, use, 1.0, 2e-3)


EXPERIMENTS = (torsion_limit, coupled_onset, exact_limit)
