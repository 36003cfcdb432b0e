"""Round bodies on a floor: a sphere whose underside is the tip, rolling at R = r - dr; a can on a table."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pinocchio as pin

from softhand.contact.supports import table_plane
from softhand.laws.radial import Radial
from softhand.model.shapes.cylinder import Cylinder
from softhand.numerics.arrays import Array
from softhand.steppers.midpoint import Midpoint
from softhand.validation.check import Check
from softhand.validation.lying import cylinder_inertia, on_table
from softhand.validation.rigs import MASS, MU, Body, G, Rig, ball, depth_of, zero_crossing

LAW = Radial(radius=0.010)


def rolls_down() -> Iterable[Check]:
    """On a slope of 15 deg it rolls without slip: v^2 = 2 g h / (1 + I / (m R^2))."""
    theta = math.radians(15.0)
    weight = MASS * G * np.array([math.sin(theta), -math.cos(theta)])
    depth = depth_of(LAW, -weight[1])
    rolling = LAW.radius - depth
    rig = ball(depth, weight, LAW)
    rig.shear((2.0 / 7.0 * weight[0], 0.0, 0.0), LAW.k_tangential)  # of the floor; friction holds the sphere back
    rig.state.q[2] = -1.0  # the tip turns under the sphere as it rolls
    rig.run(Midpoint(step=1e-3), 0.08)
    path = float(rig.state.q[0])
    exact = 2.0 * G * path * math.sin(theta) / 1.4
    yield Check("sphere rolls down, v^2", float(rig.state.v[0]) ** 2, exact, 1e-4, "m^2/s^2")
    yield Check("sphere rolls down, w R / v", float(rig.state.v[2]) * rolling / float(rig.state.v[0]), 1.0, 1e-4)
    exact_path = 0.5 * G * math.sin(theta) / 1.4 * 0.08**2
    yield Check("sphere rolls down, path", 1e3 * path, 1e3 * exact_path, 1e-4, "mm")


def slide_to_roll() -> Iterable[Check]:
    """Set down at v0 without spin it slides until t = 2 v0 / (7 mu g), and rolls on at 5/7 v0."""
    mu, speed = 0.5, 0.3
    depth = depth_of(LAW, MASS * G)
    rig = ball(depth, (0.0, -MASS * G), LAW, friction=mu)
    rig.state.q[2] = -1.0
    rig.state.v[0] = speed
    rig.wind_up()
    times, slips, speeds = [0.0], [speed], [speed]

    def watch(time: float) -> bool:
        times.append(time)
        slips.append(float(rig.state.v[0] - (LAW.radius - depth) * rig.state.v[2]))
        speeds.append(float(rig.state.v[0]))
        return slips[-1] <= 0.0

    rig.run(Midpoint(step=1e-4), 0.2, watch)
    time = zero_crossing(times, slips)
    yield Check("slide to roll, time", 1e3 * time, 1e3 * 2.0 * speed / (7.0 * mu * G), 2e-3, "ms")
    yield Check("slide to roll, speed then", float(np.interp(time, times, speeds)), 5.0 / 7.0 * speed, 2e-3, "m/s")


def can_rolls_down() -> Iterable[Check]:
    """A can lies on a slope, its axis askew: it rolls square to its axis with a = g sin cos / (1 + k^2 / r^2).

    A solid one and one of thin wall, on a table that lies askew in the world; and from which slope on it slips.
    """
    for name, share in (("solid", 0.5), ("thin wall", 1.0)):
        rig, along, askew = _lying_can(share, math.radians(8.0))
        start = rig.position.copy()
        rig.run(Midpoint(step=1e-3), 0.4)
        exact = 0.5 * G * math.sin(math.radians(8.0)) * math.cos(askew) / (1.0 + share) * 0.4**2
        way = rig.position - start
        yield Check(f"{name} can rolls down, path", 1e3 * float(way @ along), 1e3 * exact, 1e-3, "mm")
        aside = float(np.linalg.norm(way - (way @ along) * along))
        yield Check(f"{name} can rolls down, aside", 1e3 * aside, 0.0, 1e-3 * 1e3 * exact, "mm")
    low, high = 45.0, 65.0
    while high - low > 0.1:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _rolls(math.radians(middle)) else (low, middle)
    yield Check("solid can slips from", 0.5 * (low + high), math.degrees(math.atan(3.0 * MU)), 0.5, "deg", True)


def _lying_can(share: float, slope: float, askew: float = 0.4) -> tuple[Rig, Array, float]:
    """A can at rest on its side, the way in which it rolls down, and the angle of that to the steepest one [rad]."""
    normal = np.array([0.2, -0.3, 0.9]) / np.linalg.norm([0.2, -0.3, 0.9])
    downhill = np.cross(normal, [0.5, 0.8, 0.1])
    downhill /= np.linalg.norm(downhill)
    along = math.cos(askew) * downhill + math.sin(askew) * np.cross(normal, downhill)
    axis = np.cross(normal, along)
    rotation = np.column_stack([along, normal, -axis]) @ pin.exp3(np.array([0.0, 0.0, 0.7]))
    gravity = G * (math.sin(slope) * downhill - math.cos(slope) * normal)
    radius, height = 0.033, 0.1
    body = Body(MASS, cylinder_inertia(MASS, radius, height, share))
    can = Cylinder(np.eye(3), np.zeros(3), radius, 0.5 * height)
    depth = MASS * G * math.cos(slope) / (4.0 * 2e4)
    return on_table(can, body, rotation, table_plane(0.05, normal), gravity, depth=depth), along, askew


def _rolls(slope: float) -> bool:
    """Whether it slips no more once the shock of the start is over."""
    rig, _, _ = _lying_can(0.5, slope, 0.0)
    travel: list[float] = []
    rig.run(Midpoint(step=1e-3), 0.3, lambda _: travel.append(float(np.sum(rig.plant.support_contacts["slip_travel"]))))
    return travel[-1] == travel[199]


EXPERIMENTS = (rolls_down, slide_to_roll, can_rolls_down)
