"""Friction while a tip slides: it is against the sliding velocity, takes all the power, and shares with the spin."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from scipy.integrate import solve_ivp

from softhand.dampings.kelvin_voigt import KelvinVoigt
from softhand.laws.hertz import Hertz
from softhand.laws.law import Law
from softhand.laws.radial import Radial
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of
from softhand.steppers.midpoint import Midpoint
from softhand.steppers.stepper import Stepper
from softhand.validation.check import Check
from softhand.validation.every_law import LAWS, name_of
from softhand.validation.pressures import columns, lever, limit_curve, power
from softhand.validation.rigs import (
    BOTTOM,
    DOWNWARD,
    IMMOVABLE,
    MU,
    RADIUS,
    TOP,
    Body,
    Carriage,
    G,
    Rig,
    block,
    make_rig,
    make_world,
    tip,
    zero_crossing,
)

DIRECTION = math.radians(45.0)
"""Of the sliding velocity in the contact frame, neither along x_C nor along y_C."""


def leaning(law: Law, depth: float, Phi: float, bearing: float = 1.1, **options: object) -> Rig:
    """An immovable box on a fixed tip that leans; the face is turned about its own normal as well.

    Args:
        law: of the tip.
        depth: dr [m].
        Phi: of the contact [rad].
        bearing: of the lean [rad].
        options: of `rigs.tip`.
    """
    turn = (
        rotation_of((0.0, 0.0, bearing)) @ rotation_of((0.0, 0.5 * math.pi - Phi, 0.0)) @ rotation_of((0.0, 0.0, 0.7))
    )
    world = make_world([Carriage("Z")], Body(mass=IMMOVABLE), np.zeros(3))
    return make_rig(world, [tip(world, BOTTOM, law, **options)], turn @ (0.0, 0.0, RADIUS - depth + 0.030), turn)  # type: ignore[arg-type]


def drag(rig: Rig, speed: float, direction: float = DIRECTION) -> None:
    """Let the box of `leaning` slide so that the tip has a velocity relative to it: speed [m/s], direction in C_F."""
    rig.update()
    relative = rig.contact["rotation"] @ (speed * math.cos(direction), speed * math.sin(direction), 0.0)
    turn = np.array(rig.plant.snapshot.poses[rig.plant.world.object_joint][:9]).reshape(3, 3)  # rows: its axes
    rig.velocity[:3] = -turn @ relative


def misalignment(rig: Rig) -> tuple[float, float]:
    """Angle from the sliding velocity to the friction it meets [deg], and friction power over mu f_z |v|."""
    f, v = rig.contact["force"], rig.contact["velocity"]
    angle = math.degrees(math.atan2(v[0] * f[1] - v[1] * f[0], v[0] * f[0] + v[1] * f[1]))
    power = float(f[[0, 1, 3]] @ v[[0, 1, 3]]) / (rig.contact["friction"] * f[2] * math.hypot(v[0], v[1]))
    return angle, power


def steady_sliding() -> Iterable[Check]:
    """Dragged at 45 deg for 6 mm: friction is against the velocity, with all of mu f_z, and there is no torsion."""
    for law in LAWS:
        rig = leaning(law, 1e-3, math.radians(60.0))
        drag(rig, 0.02)
        rig.run(Midpoint(step=1e-3), 0.3)
        angle, power = misalignment(rig)
        yield Check(f"sliding at 45 deg, off the velocity, {name_of(law)}", angle, 0.0, 0.1, "deg")
        yield Check(f"sliding at 45 deg, power over mu f_z v, {name_of(law)}", power, 1.0, 1e-3)
        arm = float(rig.contact["force"][3] / rig.contact["force"][2])
        yield Check(f"sliding at 45 deg, torsion over f_z, {name_of(law)}", 1e3 * arm, 0.0, 1e-3, "mm")


def sliding_with_spin() -> Iterable[Check]:
    """At v = w l, l = tau_max / (mu f_z), the ellipse has shares of sqrt(1/2); the exact limit those of its centre."""
    for law in LAWS:
        rig = leaning(law, 1e-3, math.radians(60.0), limit="ellipse")
        f_t, tau = shares(rig, 1.0)
        yield Check(f"sliding with spin, share of the force, {name_of(law)}", f_t, math.sqrt(0.5), 2e-3)
        yield Check(f"sliding with spin, share of the torsion, {name_of(law)}", tau, -math.sqrt(0.5), 2e-3)
    for law, pressure in ((Radial(radius=RADIUS), columns(1e-3, RADIUS)), (Hertz(radius=RADIUS), power(2.0))):
        for ratio in (0.3, 1.0, 3.0):
            rig = leaning(law, 1e-3, math.radians(60.0))
            found = shares(rig, ratio)
            length = lever(pressure)
            exact = limit_curve(pressure, [ratio * length])[0] / (1.0, -length)
            for what, measured, share in zip(("force", "torsion"), found, exact, strict=True):
                label = f"sliding with spin, v = {ratio:g} w l, exact share of the {what}, {name_of(law)}"
                yield Check(label, measured, float(share), 2e-3, "", True)


def shares(rig: Rig, ratio: float) -> tuple[float, float]:
    """(f_t along v / (mu f_z), tau / tau_max) after 10 mm of slip at v = ratio l |w|, w < 0."""
    rig.update()
    contact, length = rig.contact, float(rig.contact["lever"])
    twist = -2.5e-5 / (length * math.hypot(1.0, ratio))  # of one small step: 25 um of x, y and l w in all
    way = ratio * length * abs(twist)
    x, y = way * math.cos(DIRECTION), way * math.sin(DIRECTION)
    step = contact["theta_per_x"] * x, contact["phi_per_y"] * y, twist + contact["psi_per_x"] * x
    for _ in range(400):
        rig.state.z[0, :3] += step
        rig.update()
        rig.plant.note_slip(rig.state.z)
    f, room = rig.contact["force"], MU * rig.contact["force"][2]
    along = (f[0] * x + f[1] * y) / way
    return float(along / room), float(f[3] / (room * length))


def puck() -> Iterable[Check]:
    """A puck that slides at 0.5 m/s and spins, k^2 = a^2 / 2, w0 = v0 / a: how far it goes and turns until it stops.

    The exact numbers are those of a rigid puck: with the ellipse, and with the integral over the pressure of columns.
    """
    for law, depth, limit in (
        (Radial(radius=RADIUS), 5e-4, "ellipse"),
        (Hertz(radius=RADIUS), 1e-3, "ellipse"),
        (Radial(radius=RADIUS), 5e-4, "exact"),
    ):
        found, exact = slid_puck(law, depth, limit), rigid_puck(law, depth, limit)
        name = f"puck, {limit} limit, {name_of(law)}"
        yield Check(f"{name}: way", 1e3 * found[0], 1e3 * exact[0], 0.01, "mm")
        yield Check(f"{name}: turn", found[1], exact[1], 0.01, "rad")
        yield Check(f"{name}: a tenth of the speed left", 1e3 * found[2], 1e3 * exact[2], 0.02, "ms")
        yield Check(f"{name}: a tenth of the spin left", 1e3 * found[3], 1e3 * exact[3], 0.02, "ms")


SPEED = 0.5  # [m/s]
USUAL = Midpoint(step=1e-3)


def _disc(depth: float) -> float:
    return math.sqrt(RADIUS**2 - (RADIUS - depth) ** 2)


def slid_puck(law: Law, depth: float, limit: str, stepper: Stepper = USUAL) -> tuple[float, float, float, float]:
    """Way [m], turn [rad], and when a tenth of the speed and of the spin are left [s]."""
    normal, a = float(law((depth, 0.0, 0.0, 0.0), 0.5 * math.pi)[0]), _disc(depth)
    mass = normal / G
    carriage = Carriage("xyzZ", (0.0, 0.0, RADIUS - depth), DOWNWARD, mass, 0.5 * mass * a**2)
    world = make_world([carriage], Body(IMMOVABLE, size=(1.0, 1.0, 1.0)), (0.0, 0.0, 0.0))
    rig = make_rig(world, [tip(world, TOP, law, limit=limit)], (0.0, 0.0, -0.5))
    rig.torque[2] = -normal
    rig.state.v[:4] = SPEED * math.cos(0.6), SPEED * math.sin(0.6), 0.0, SPEED / a
    rig.wind_up()
    speeds, spins, ways, step = [SPEED], [SPEED / a], [0.0], stepper.step

    def watch(time: float) -> None:
        speeds.append(math.hypot(rig.state.v[0], rig.state.v[1]))
        spins.append(float(rig.state.v[3]))
        ways.append(math.hypot(rig.state.q[0], rig.state.q[1]))

    rig.run(stepper, 0.25, watch)
    turns = np.cumsum(0.5 * step * (np.array(spins[1:]) + spins[:-1]))
    times = np.linspace(0.0, step * (len(speeds) - 1), len(speeds))
    slow, calm = (zero_crossing(times, np.array(values) - 0.1 * values[0]) for values in (speeds, spins))
    return max(ways), float(np.max(turns)), slow, calm


def rigid_puck(law: Law, depth: float, limit: str) -> tuple[float, float, float, float]:
    """The same of a rigid one, from its equations of motion."""
    a = _disc(depth)
    radius = math.sqrt(RADIUS * depth) if isinstance(law, Hertz) else a
    pressure = power(2.0) if isinstance(law, Hertz) else columns(depth, RADIUS)
    length = lever(pressure) * radius
    share = np.linspace(0.0, 1.0, 80, endpoint=False)
    curve = limit_curve(pressure, np.tan(0.5 * math.pi * share)) if limit == "exact" else np.zeros((80, 2))

    def slow_down(_time: float, y: Array) -> Array:
        speed, spin = max(y[0], 0.0), max(y[1], 1e-9)
        if limit == "ellipse":
            size = math.hypot(speed, spin * length)
            force, torsion = speed / size, spin * length**2 / size
        else:
            place = 2.0 / math.pi * math.atan(speed / (spin * radius))
            force, torsion = (float(np.interp(place, share, part)) for part in curve.T)
            torsion *= radius
        return np.array([-MU * G * force, -MU * G * torsion / (0.5 * a**2), speed, spin])

    def slow(_time: float, y: Array) -> float:
        return float(y[0] - 0.1 * SPEED)

    def calm(_time: float, y: Array) -> float:
        return float(y[1] - 0.1 * SPEED / a)

    def stops(_time: float, y: Array) -> float:
        return float(y[1] - 1e-4 * SPEED / a)

    stops.terminal = True  # type: ignore[attr-defined]
    start = np.array([SPEED, SPEED / a, 0.0, 0.0])
    run = solve_ivp(slow_down, (0.0, 1.0), start, rtol=1e-8, atol=1e-10, events=(slow, calm, stops))
    return float(run.y[2, -1]), float(run.y[3, -1]), float(run.t_events[0][0]), float(run.t_events[1][0])


def dashpots() -> Iterable[Check]:
    """Dragged with a dashpot beside the spring: slip begins where k s + c s' is mu f_z, and s goes on obeying that."""
    c, speed, duration, depth, law = 100.0, 0.003, 0.06, 1e-3, Radial(radius=RADIUS)
    rig = block(depth, law, body=Body(mass=IMMOVABLE), gravity=np.zeros(3),
                damping=KelvinVoigt(radial=0.0, tangential=c, torsional=0.0))  # fmt: skip
    rig.velocity[:2] = speed * math.cos(DIRECTION), speed * math.sin(DIRECTION)
    rig.run(Midpoint(step=2e-4), duration)
    k, most = law.k_tangential, MU * law.K * depth**2
    onset = (most / speed - c) / k
    exact = most / k - (most / k - speed * onset) * math.exp(-(duration - onset) * k / c)
    stored = math.hypot(rig.state.z[0, 0], rig.state.z[0, 1])
    yield Check("slip beside a dashpot: what is stored", 1e3 * stored, 1e3 * exact, 1e-3, "mm")
    travel = 1e3 * (speed * duration - exact)
    yield Check("slip beside a dashpot: travel", 1e3 * float(rig.contact["slip_travel"]), travel, 2e-2, "mm")
    f = rig.contact["force"]
    yield Check("slip beside a dashpot: whole force over mu f_z", math.hypot(f[0], f[1]) / most, 1.0, 1e-12)


EXPERIMENTS = (steady_sliding, sliding_with_spin, puck, dashpots)
