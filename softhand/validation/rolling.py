"""A solid sphere on a floor: the tip is its underside. It rolls at the radius R = r - dr of the pressed tip."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from softhand.laws.radial import Radial
from softhand.steppers.midpoint import Midpoint
from softhand.validation.check import Check
from softhand.validation.rigs import MASS, G, ball, depth_of, zero_crossing

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


EXPERIMENTS = (rolls_down, slide_to_roll)
