"""Slip of a block on a tip: where it begins, how far it goes, what it costs."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from softhand.laws.hertz import Hertz
from softhand.laws.radial import Radial
from softhand.numerics.arrays import Array
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
    rig = block(depth_of(LAW, across), LAW, gravity=(G * math.sin(theta), 0.0, -G * math.cos(theta)))
    rig.shear((-along, 0.0, 0.0), LAW.k_tangential)
    start = rig.position[0]
    rig.run(Midpoint(step=1e-3), 0.3)
    return bool(rig.position[0] - start > 1e-7)


def stopping_distance() -> Iterable[Check]:
    """A block that slides at v0 stops after v0^2 / (2 mu g), and v0 / (mu g)."""
    speed = 0.5
    exact = speed**2 / (2.0 * MU * G)
    rig, stop, distance = stopped_block(Midpoint(step=1e-3), speed)
    yield Check("stopping distance", 1e3 * distance, 1e3 * exact, 1e-3, "mm")
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
        positions.append(float(rig.position[0]))
        speeds.append(float(rig.velocity[0]))
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
        rig.velocity[0] = MU * normal / LAW.k_tangential / limit
        slips: list[float] = []

        def watch(time: float, rig: Rig = rig, slips: list[float] = slips) -> None:
            if rig.contact["slip_travel"] > 0.0:
                slips.append(time)

        rig.run(stepper(step=1e-3), duration, watch)
        way = float(rig.velocity[0]) * (duration - limit)
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
    rig.velocity[5] = 1e4
    rig.wind_up()
    rig.update()
    return abs(float(rig.contact["force"][3])), float(rig.contact["force"][2])


def coupled_onset() -> Iterable[Check]:
    """Dragged and spun at once: slip begins where (f_t / (mu f_z))^2 + (tau / tau_max)^2 = 1."""
    depth = 1e-3
    tau_max, force = _spun(depth, LAW)
    for share in (0.0, 0.3, 0.6, 0.85, 1.0):
        rig = block(depth, LAW, body=Body(mass=IMMOVABLE))
        rig.velocity[0] = math.sqrt(1.0 - share**2) * MU * force / LAW.k_tangential  # the limit after 1 s
        rig.velocity[5] = share * tau_max / LAW.k_torsional
        loads: list[float] = []

        def watch(time: float, rig: Rig = rig, loads: list[float] = loads) -> bool:
            f = rig.contact["force"]
            loads.append(math.hypot(math.hypot(f[0], f[1]) / (MU * force), f[3] / tau_max))
            return bool(rig.contact["slip_travel"] > 0.0 or rig.contact["slip_twist"] > 0.0)

        rig.plant.world.model.gravity.linear = np.zeros(3)
        rig.run(Midpoint(step=1e-3), 2.0, watch)
        slipped = rig.contact["slip_travel"] > 0.0 or rig.contact["slip_twist"] > 0.0
        yield Check(
            f"slip onset on the ellipse, torsion {100 * share:.0f} %", loads[-1] if slipped else math.nan, 1.0, 5e-3
        )


def limit_curve(depth: float, count: int = 60) -> Array:
    """Exact limit (f_t / (mu N), tau / tau_max) of the pressure of columns, from pure spin to slip, shape (count, 2).

    A contact that slips as a whole turns about a point at (d, 0) of its disc; each column drags against its own way:

        f_t = mu int (x - d) / s dN,   tau = mu int (x (x - d) + y^2) / s dN,   s = |(x - d, y)|

    with dN = k_r (cos b - c) r^2 sin b db dg at rho = R tan b, as in `torsion_limit`.
    """
    c = 1.0 - depth / RADIUS
    nodes, weights = np.polynomial.legendre.leggauss(400)
    edge = math.acos(c)
    b, g = 0.5 * edge * (nodes[:, None] + 1.0), 2.0 * math.pi * (np.arange(800) + 0.5) / 800
    dN = (np.cos(b) - c) * np.sin(b) * weights[:, None] * np.ones_like(g)
    dN /= np.sum(dN)
    x, y = c * RADIUS * np.tan(b) * np.cos(g), c * RADIUS * np.tan(b) * np.sin(g)
    a = RADIUS * math.sqrt(1.0 - c * c)
    curve = []
    for share in np.linspace(0.0, 1.0, count):
        d = a * math.tan(0.5 * math.pi * share) if share < 1.0 else 1e6 * a
        s = np.hypot(x - d, y)
        curve.append((np.sum((d - x) / s * dN), np.sum((x * (x - d) + y * y) / s * dN)))
    curve_of: Array = np.array(curve)
    return curve_of / (1.0, float(np.sum(np.hypot(x, y) * dN)))


def exact_curve() -> Iterable[Check]:
    """The ellipse against the exact limit: how far it lies outside or inside, over the whole curve."""
    for depth in (1e-3, 3e-3):
        off = np.hypot(*limit_curve(depth).T) - 1.0
        worst = float(off[np.argmax(np.abs(off))])
        yield Check(f"exact limit off the ellipse, dr = {1e3 * depth:g} mm", worst, 0.0, 0.06)


def static_and_kinetic() -> Iterable[Check]:
    """Dragged slowly: the force rises to mu_s f_z and falls to mu f_z as slip begins."""
    static, kinetic, depth = 0.7, 0.5, 1e-3
    rig = block(depth, LAW, body=Body(mass=IMMOVABLE), gravity=np.zeros(3), friction=kinetic, static_friction=static)
    normal = LAW.K * depth**2
    rig.velocity[0] = static * normal / LAW.k_tangential
    drags: list[float] = []
    rig.run(Midpoint(step=1e-3), 1.5, lambda time: drags.append(abs(float(rig.contact["force"][0]))))
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
        rig.velocity[0] = speed if half % 2 == 0 else -speed
        path, drag = [float(rig.position[0])], [-float(rig.contact_forces()[-6])]
        before = float(rig.contact["slip_loss"])

        def watch(time: float, path: list[float] = path, drag: list[float] = drag) -> None:
            path.append(float(rig.position[0]))
            drag.append(-float(rig.contact_forces()[-6]))

        rig.run(stepper, 0.25 if half == 0 else 0.5, watch)
        if half >= 3:
            area += float(np.trapezoid(drag, path))
            loss += float(rig.contact["slip_loss"]) - before
    exact = 4.0 * MU * normal * (amplitude - MU * normal / LAW.k_tangential)
    yield Check("hysteresis of a tangential cycle, area", 1e3 * area, 1e3 * exact, 1e-3, "mJ")
    yield Check("hysteresis of a tangential cycle, slip loss", 1e3 * loss, 1e3 * area, 1e-3, "mJ")


def _sliding_block(speed: float) -> Rig:
    rig = block(DEPTH, LAW)
    rig.velocity[0] = speed
    rig.wind_up()
    return rig


EXPERIMENTS = (
    incline,
    stopping_distance,
    onset,
    spin_down,
    torsion_limit,
    coupled_onset,
    exact_curve,
    static_and_kinetic,
    hysteresis,
)
