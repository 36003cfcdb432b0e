"""Round objects on a table: they stand, tip, lie and roll as the bodies that they are, in no special direction."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from rolling_ode import Rolling

from softhand.contact.supports import table_plane
from softhand.model.shapes.cylinder import Cylinder
from softhand.model.shapes.ellipsoid import Ellipsoid
from softhand.model.shapes.shape import Shape
from softhand.model.shapes.sphere import Sphere
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of
from softhand.steppers.adaptive import Adaptive
from softhand.steppers.midpoint import Midpoint
from softhand.steppers.rk4 import RungeKutta4
from softhand.steppers.semi_implicit_euler import SemiImplicitEuler
from softhand.steppers.stepper import Stepper
from softhand.validation.lying import cylinder_inertia, on_table
from softhand.validation.rigs import MASS, Body, G, Rig

RADIUS, HALF = 0.033, 0.050  # [m] of the can
AXES = np.array([0.040, 0.025, 0.030])  # [m] of the ellipsoid
CAN = Cylinder(np.eye(3), np.zeros(3), RADIUS, HALF)
EGG = Ellipsoid(np.eye(3), np.zeros(3), (0.040, 0.025, 0.030))
BALL = Sphere(np.eye(3), np.zeros(3), RADIUS)
SOLID = Body(MASS, cylinder_inertia(MASS, RADIUS, 2.0 * HALF))
EGG_INERTIA = MASS / 5.0 * (AXES @ AXES - AXES**2)
EGG_BODY = Body(MASS, (float(EGG_INERTIA[0]), float(EGG_INERTIA[1]), float(EGG_INERTIA[2])))
NORMAL = np.array([0.3, -0.5, 1.2]) / np.linalg.norm([0.3, -0.5, 1.2])
TABLE = table_plane(0.07, NORMAL)
K = 2e4  # [N/m]
UPRIGHT = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), NORMAL).toRotationMatrix()
ACROSS = np.cross(NORMAL, [1.0, 0.0, 0.0]) / np.linalg.norm(np.cross(NORMAL, [1.0, 0.0, 0.0]))
STANDING = 7  # feet that bear a can on its end: six points and the crown


def sloping(slope: float) -> Array:
    """Gravity on a table that falls by an angle [rad] in some direction of it."""
    downhill = np.cross(NORMAL, [0.2, 0.9, 0.1])
    return G * (math.sin(slope) * downhill / np.linalg.norm(downhill) - math.cos(slope) * NORMAL)


def rotation_in(rig: Rig) -> Array:
    """Axes of the object."""
    return rig.plant.world.object_rotation(rig.state.q)


def rim(direction: Array) -> Array:
    """The point of a can that is farthest out along a direction."""
    out = direction[:2] / np.linalg.norm(direction[:2])
    return np.array([RADIUS * out[0], RADIUS * out[1], math.copysign(HALF, direction[2])])


def pole(direction: Array) -> Array:
    """The same of the ellipsoid."""
    return AXES**2 * direction / np.linalg.norm(AXES * direction)


def test_feet_reach_as_far_as_the_surface() -> None:
    """In every direction: exactly for ball and ellipsoid, and within the crown, 3e-4 of the radius, for the cylinder.

    Turned and off the origin of the object frame; the length of the support function is that of each solid.
    """
    turn, centre, rng = rotation_of((0.4, -1.1, 0.6)), np.array([0.004, -0.002, 0.003]), np.random.default_rng(6)
    cylinder, ellipsoid = Cylinder(turn, centre, RADIUS, HALF), Ellipsoid(turn, centre, (0.040, 0.025, 0.030))
    ball = Sphere(turn, centre, RADIUS)
    for direction in [*rng.normal(size=(200, 3)), *turn.T, *-turn.T]:
        u = direction / np.linalg.norm(direction)
        own = turn.T @ u
        exact = {ball: RADIUS, ellipsoid: float(np.linalg.norm(AXES * own))}
        exact[cylinder] = RADIUS * math.hypot(own[0], own[1]) + HALF * abs(own[2])
        for shape, length in exact.items():
            reach = max(foot.reach(u) for foot in shape.feet()) - centre @ u
            slack = 3e-4 * RADIUS if shape is cylinder else 1e-15
            assert length - slack - 1e-15 <= reach <= length + 1e-15


# ------------------------------------------------------------------------------------------------------------ the force


@pytest.mark.parametrize("shape", [CAN, EGG, BALL], ids=["can", "egg", "ball"])
def test_the_force_is_the_slope_of_an_energy(shape: Shape) -> None:
    """In each direction of the six the generalized force is minus the change of the energy of the feet, at any pose.

    So no way over the body, from end to rim to side, can make or lose energy. A point that is not the deepest fails.
    """
    rng = np.random.default_rng(4)
    rig = on_table(shape, SOLID, np.eye(3), TABLE, np.zeros(3), stiffness=1e3)
    model, rest = rig.plant.world.model, np.zeros(6)
    start = [UPRIGHT @ rotation_of(1e-3 * rng.normal(size=3)) for _ in range(4)]
    for rotation in [*start, *(rotation_of(rng.normal(size=3)) for _ in range(12))]:
        deep = 1e-3 * rng.uniform(0.2, 1.0)
        height = TABLE.offset - deep + max(foot.reach(-rotation.T @ NORMAL) for foot in shape.feet())
        rig.plant.world.set_object_pose(height * NORMAL, rotation, rig.state.q)
        rig.update()
        force = rig.contact_forces()[-6:]
        for k in range(6):
            way = np.zeros(model.nv)
            way[k - 6] = 1e-7
            ends = []
            for sign in (1.0, -1.0):
                q = pin.integrate(model, rig.state.q, sign * way)
                rig.plant.update(q, rig.state.v, rig.state.z)
                depths = rig.plant.support_contacts["deformation"][:, 0]
                stiffness = np.array([support.law.c for support in rig.plant.supports])
                ends.append(0.5 * float(stiffness @ depths**2))
            rest[k] = -(ends[0] - ends[1]) / 2e-7
        np.testing.assert_allclose(force, rest, atol=2e-6)
        assert np.linalg.norm(force[:3]) > 0.1


def test_what_an_ellipsoid_that_turns_adds_to_the_stiffness() -> None:
    """At the end of the shortest axis `rolling` is the force times how the depth bends; at the longest, nothing."""
    shortest, longest = int(np.argmin(AXES)), int(np.argmax(AXES))
    contact, bent = _rolling_at(shortest)
    np.testing.assert_allclose(contact["rolling"], bent, rtol=1e-5)
    assert abs(bent[1]) > 0.05 * bent[0], "in general position"
    contact, bent = _rolling_at(longest)
    np.testing.assert_array_equal(contact["rolling"], 0.0)
    assert max(bent[0], bent[2]) < 0.0


def _rolling_at(axis: int) -> tuple[np.void, Array]:
    """The contact of the ellipsoid on the end of an axis; by differences, its force times the bend of the depth."""
    down = np.eye(3)[axis]
    rotation = pin.Quaternion.FromTwoVectors(down, -NORMAL).toRotationMatrix() @ pin.exp3(0.8 * down)
    rig = on_table(EGG, EGG_BODY, rotation, TABLE, np.zeros(3), depth=1e-4)
    rig.plant.snapshot.update(rig.state.q, rig.state.v)
    rig.plant.touch(rig.state.v, rig.state.z, with_stiffness=True)
    contact, h = rig.plant.support_contacts[0], 1e-4
    x_C, y_C, z_C = contact["rotation"].T

    def depth(turn: Array) -> float:
        return EGG.feet()[0].reach((pin.exp3(turn) @ rotation).T @ -NORMAL)

    def bend(one: Array, other: Array) -> float:
        ends = depth(h * (one + other)), depth(h * (one - other)), depth(h * (other - one)), depth(-h * (one + other))
        return float(contact["force"][2]) * (ends[0] - ends[1] - ends[2] + ends[3]) / (4.0 * h * h)

    # turns that turn z_C, as the body sees it, towards x_C and y_C
    first, second = np.cross(z_C, x_C), np.cross(z_C, y_C)
    return contact, np.array([bend(first, first), bend(first, second), bend(second, second)])


# ------------------------------------------------------------------------------------------------------------- rolling


def rolled(
    shape: Shape,
    body: Body,
    lowest: Callable[[Array], Array],
    rotation: Array,
    spin: Array,
    stiffness: float,
    step: float,
) -> tuple[float, float]:
    """How far a body that rolls for 0.3 s on soft feet is off a rigid one: over the way, and in the turn [rad]."""
    gravity = sloping(0.08)
    rigid = Rolling(lowest, body.mass, np.array(body.inertia), NORMAL, gravity)
    force = rigid.force(rotation, spin)
    depth = float(force @ NORMAL) / stiffness
    rig = on_table(shape, body, rotation, TABLE, gravity, depth=depth, friction=2.0, stiffness=stiffness)
    rig.velocity[:3], rig.velocity[3:] = rotation.T @ np.cross(rigid.arm(rotation), spin), rotation.T @ spin
    rig.update()
    pressing = int(np.argmax(rig.plant.contacts["force"][:, 2]))
    rig.state.z[pressing, :2] = -(rig.plant.contacts["rotation"][pressing].T @ force)[:2] / stiffness
    start = rig.position.copy()
    rig.run(Midpoint(step=step), 0.3)
    end, turned = rigid.after(0.3, start, rotation, spin)
    assert not np.any(rig.plant.support_contacts["slip_loss"])
    way = float(np.linalg.norm(end - start))
    assert way > 0.04
    return float(np.linalg.norm(rig.position - end)) / way, float(np.linalg.norm(pin.log3(rotation_in(rig).T @ turned)))


def test_an_ellipsoid_rolls_as_a_rigid_one() -> None:
    """Of three axes, down a slope and spinning; the stiffer the table, the nearer."""
    rotation, spin = rotation_of((0.4, 1.1, -0.7)), np.array([1.0, 2.0, -3.0])
    far = rolled(EGG, EGG_BODY, pole, rotation, spin, 2e4, 1e-3)
    near = rolled(EGG, EGG_BODY, pole, rotation, spin, 2e5, 2e-4)
    assert max(far) < 1e-2
    assert max(near) < 1e-3
    assert near[0] < 0.2 * far[0]


@pytest.mark.parametrize("tilt", [0.3, 0.55])
def test_a_can_rolls_on_its_rim_as_a_rigid_one(tilt: float) -> None:
    """Tilted, precessing and spinning; what is left is the crown, 3e-4 of the radius."""
    rotation = pin.exp3(tilt * ACROSS) @ UPRIGHT
    spin = 3.0 * NORMAL + rotation @ np.array([0.0, 0.0, -6.0])
    off = rolled(CAN, SOLID, rim, rotation, spin, 2e5, 2e-4)
    assert max(off) < 1.5e-3


def lying(share: float, slope: float, askew: float, friction: float = 0.5, damping: float = 10.0) -> tuple[Rig, Array]:
    """A can on its side, and the way at a right angle to its axis that goes down; `askew` off the steepest [rad]."""
    gravity = sloping(slope)
    downhill = gravity - (gravity @ NORMAL) * NORMAL
    downhill = downhill / np.linalg.norm(downhill) if slope else ACROSS
    along = math.cos(askew) * downhill + math.sin(askew) * np.cross(NORMAL, downhill)
    rotation = np.column_stack([along, -NORMAL, np.cross(NORMAL, along)]) @ pin.exp3(np.array([0.0, 0.0, 0.7]))
    body = Body(MASS, cylinder_inertia(MASS, RADIUS, 2.0 * HALF, share))
    depth = MASS * G * math.cos(slope) / (4.0 * K)
    return on_table(CAN, body, rotation, TABLE, gravity, depth=depth, friction=friction, damping=damping), along


@pytest.mark.parametrize("share", [0.5, 1.0], ids=["solid", "thin wall"])
@pytest.mark.parametrize("askew", [0.0, 0.7])
def test_a_can_rolls_down_at_a_right_angle_to_its_axis(share: float, askew: float) -> None:
    """Its way is g sin cos(askew) t^2 / 2 / (1 + k^2 / r^2), it turns by the way over r, and its axis stays."""
    rig, along = lying(share, math.radians(3.0), askew)
    start, axis = rig.position.copy(), rotation_in(rig)[:, 2].copy()
    rig.run(Midpoint(step=1e-3), 0.4)
    exact = 0.5 * G * math.sin(math.radians(3.0)) * math.cos(askew) / (1.0 + share) * 0.4**2
    way = rig.position - start
    assert way @ along == pytest.approx(exact, rel=1e-3)
    assert np.linalg.norm(way - (way @ along) * along) < 2e-3 * exact
    assert np.linalg.norm(rotation_in(rig)[:, 2] - axis) < 1e-4
    speed = float(rig.velocity[:3] @ (rotation_in(rig).T @ along))
    assert rig.velocity[5] * RADIUS == pytest.approx(speed, rel=2e-3)


def test_a_can_that_slips_slides_and_spins_up() -> None:
    """Steeper than tan = mu (1 + r^2 / k^2): a = g (sin - mu cos) and w' = mu g cos r / k^2."""
    slope, mu = math.radians(40.0), 0.2
    rig, along = lying(0.5, slope, 0.0, mu)
    speeds = []
    rig.run(
        Midpoint(step=5e-4),
        0.2,
        lambda _: speeds.append((rotation_in(rig) @ rig.velocity[:3] @ along, rig.velocity[5])),
    )
    gained = (np.array(speeds[399]) - speeds[199]) / 0.1
    assert gained[0] == pytest.approx(G * (math.sin(slope) - mu * math.cos(slope)), rel=1e-3)
    assert gained[1] == pytest.approx(2.0 * mu * G * math.cos(slope) / RADIUS, rel=1e-3)


def test_rolling_on_a_level_table_goes_on_for_ever() -> None:
    """A second of it: no drift aside, no energy lost or made, no slip, though the place that touches goes round."""
    rig, along = lying(0.5, 0.0, 0.3)
    start = rig.position.copy()
    sunk = RADIUS - MASS * G / (4.0 * K)
    rig.velocity[:3], rig.velocity[5] = rotation_in(rig).T @ (0.3 * along), 0.3 / sunk
    energy = rig.energy()
    rig.run(Midpoint(step=5e-4), 1.0)
    way = rig.position - start
    assert way @ along == pytest.approx(0.3, rel=2e-6)
    assert np.linalg.norm(way - (way @ along) * along) < 1e-7
    assert rig.energy() - energy == pytest.approx(0.0, abs=2e-6 * MASS * 0.3**2)
    assert not np.any(rig.plant.support_contacts["slip_loss"])


@pytest.mark.parametrize(
    ("stepper", "order"), [(Midpoint, 2), (RungeKutta4, 4), (SemiImplicitEuler, 1)], ids=lambda value: str(value)[-20:]
)
def test_steppers_keep_their_order_as_an_ellipsoid_rolls(stepper: type[Stepper], order: int) -> None:
    """Half the step, error over 2^order; with a place that moves over the body."""
    ends = [_rocked(stepper(step=step)) for step in (2e-4, 1e-4, 5e-5)]
    ratio = np.linalg.norm(ends[0] - ends[1]) / np.linalg.norm(ends[1] - ends[2])
    assert math.log2(ratio) == pytest.approx(order, abs=0.25)


def test_steppers_agree_on_an_ellipsoid() -> None:
    """The one with error control finds the same motion."""
    np.testing.assert_allclose(_rocked(Adaptive(step=1e-3)), _rocked(RungeKutta4(step=5e-5)), atol=1e-6)


def _rocked(stepper: Stepper) -> Array:
    """q and v of an ellipsoid that rocks and rolls for 4 ms, and never slips or lets go."""
    rotation, depth = rotation_of((0.4, 1.1, -0.7)), 1e-4
    rig = on_table(EGG, EGG_BODY, rotation, TABLE, -G * NORMAL, depth=depth, friction=5.0, damping=2.0)
    rig.velocity[3:] = rotation.T @ np.array([0.05, -0.1, 0.08])
    rig.run(stepper, 4e-3)
    assert not np.any(rig.plant.support_contacts["slip_loss"])
    return np.concatenate([rig.state.q, rig.state.v])


# ---------------------------------------------------------------------------------------------------- standing, tipping


def standing(tilt: float = 0.0, damping: float = 10.0, friction: float = 0.5) -> Rig:
    """A can on its end, tilted by an angle [rad]."""
    depth = 0.0 if tilt else MASS * G / (STANDING * K)
    rotation = pin.exp3(tilt * ACROSS) @ UPRIGHT
    return on_table(CAN, SOLID, rotation, TABLE, -G * NORMAL, depth=depth, damping=damping, friction=friction)


def test_a_can_stands_on_its_end_and_stays() -> None:
    """Six points and the crown bear m g / 7 each."""
    rig = standing()
    start = rig.state.q.copy()
    rig.run(Midpoint(step=1e-3), 0.5)
    np.testing.assert_allclose(rig.state.q, start, atol=1e-12)
    pressing = rig.plant.support_contacts["force"][:, 2]
    np.testing.assert_allclose(np.sort(pressing)[-STANDING:], MASS * G / STANDING, rtol=1e-6)
    assert np.count_nonzero(pressing) == STANDING


@pytest.mark.parametrize("load", [0.0, 20.0, 60.0])
def test_a_can_that_is_pressed_down_comes_to_rest(load: float) -> None:
    """A little tilted, with a load on it [N] and steps of 3 ms: it does not buzz between two sides of the rim."""
    body = Body(MASS, SOLID.inertia)
    heavy = -(G + load / MASS) * NORMAL
    rotation = pin.exp3(1e-4 * ACROSS) @ UPRIGHT
    depth = (MASS * G + load) / (STANDING * K)
    rig = on_table(CAN, body, rotation, TABLE, heavy, depth=depth)
    rig.run(Midpoint(step=1e-3 if load == 0.0 else 3e-3), 1.5)
    assert np.max(np.abs(rig.velocity)) < 1e-6
    np.testing.assert_allclose(rotation_in(rig)[:, 2], NORMAL, atol=1e-8)


def test_a_light_disc_under_a_fingers_load_rests() -> None:
    """7 g, 2 mm thick and pressed with 10 N, at steps of 1 ms."""
    radius, half, mass = 0.012, 0.001, 0.007
    disc = Cylinder(np.eye(3), np.zeros(3), radius, half)
    body = Body(mass, cylinder_inertia(mass, radius, 2.0 * half))
    rotation = pin.exp3(2e-4 * ACROSS) @ UPRIGHT
    rig = on_table(disc, body, rotation, TABLE, -(G + 10.0 / mass) * NORMAL, depth=10.0 / (STANDING * K))
    rig.run(Midpoint(step=1e-3), 1.0)
    assert np.max(np.abs(rig.velocity)) < 1e-3
    np.testing.assert_allclose(rotation_in(rig)[:, 2], NORMAL, atol=1e-5)


def test_a_standing_can_that_spins_stops_as_on_an_even_pressure() -> None:
    """After I w0 / (2/3 mu m g a)."""
    rig = standing()
    rig.velocity[5], inertia = 5.0, SOLID.inertia[2]
    exact = inertia * 5.0 / (2.0 / 3.0 * 0.5 * MASS * G * RADIUS)
    rig.run(Midpoint(step=1e-4), 0.5 * exact)
    assert rig.velocity[5] == pytest.approx(2.5, rel=5e-3)
    rig.run(Midpoint(step=1e-4), 2.0 * exact)
    assert np.max(np.abs(rig.velocity)) < 1e-2


def test_a_lying_can_that_spins_stops_as_on_a_line_of_even_pressure() -> None:
    """After I w0 / (mu m g h / 4) with the height h; it spins about the normal of the table."""
    rig, _ = lying(0.5, 0.0, 0.0)
    rig.velocity[3:] = rotation_in(rig).T @ (5.0 * NORMAL)
    exact = SOLID.inertia[0] * 5.0 / (0.5 * MASS * G * 2.0 * HALF / 4.0)
    rig.run(Midpoint(step=1e-4), 0.5 * exact)
    assert NORMAL @ (rotation_in(rig) @ rig.velocity[3:]) == pytest.approx(2.5, rel=1e-2)


@pytest.mark.parametrize(("over", "falls"), [(-0.03, False), (0.03, True)])
def test_a_tilted_can_returns_or_falls(over: float, falls: bool) -> None:
    """Its centre stands over the rim at atan(r / half the height); beyond that it comes to lie on its side."""
    rig = standing(math.atan2(RADIUS, HALF) + over)
    rig.run(Midpoint(step=5e-4), 2.0)
    upright = abs(float(rotation_in(rig)[:, 2] @ NORMAL))
    assert upright == pytest.approx(0.0 if falls else 1.0, abs=1e-3)


def test_from_end_to_rim_to_side_no_energy_comes_or_goes() -> None:
    """A can tips over without damping, and bounces: energy and loss of slip stay together."""
    residuals = []
    for step in (1e-4, 5e-5):
        rig = standing(0.02, damping=0.0, friction=0.8)
        rotation, spin = rotation_in(rig), 8.0 * ACROSS + 2.0 * NORMAL
        rig.velocity[:3], rig.velocity[3:] = (
            rotation.T @ np.cross(rotation @ rim(-rotation.T @ NORMAL), spin),
            rotation.T @ spin,
        )
        energy, tilts = rig.energy(), []
        rig.run(
            RungeKutta4(step=step), 0.25, lambda _, rig=rig, tilts=tilts: tilts.append(rotation_in(rig)[:, 2] @ NORMAL)
        )
        lost = float(np.sum(rig.plant.support_contacts["slip_loss"]))
        residuals.append(abs(rig.energy() + lost - energy))
        assert max(tilts) > 0.999 and abs(min(tilts, key=abs)) < 0.05, "from its end to its side"
    assert residuals[-1] < 1e-3 * MASS * G * HALF
    assert residuals[-1] < 0.7 * residuals[0] or residuals[-1] < 1e-5 * MASS * G * HALF


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_an_ellipsoid_stands_on_the_end_of_an_axis(axis: int) -> None:
    """m g / k deep; on the shortest axis it comes back from a tilt, on the longest it falls."""
    down = np.eye(3)[axis]
    rotation = pin.Quaternion.FromTwoVectors(down, -NORMAL).toRotationMatrix()
    rig = on_table(EGG, EGG_BODY, rotation, TABLE, -G * NORMAL, depth=MASS * G / K)
    start = rig.state.q.copy()
    rig.run(Midpoint(step=1e-3), 0.05)
    np.testing.assert_allclose(rig.state.q, start, atol=1e-9)
    tilted = pin.exp3(0.05 * ACROSS) @ rotation
    rig = on_table(EGG, EGG_BODY, tilted, TABLE, -G * NORMAL, depth=MASS * G / K)
    least = []
    rig.run(Midpoint(step=1e-3), 0.6, lambda _: least.append(-float(rotation_in(rig)[:, axis] @ NORMAL)))
    assert (min(least) > math.cos(0.06)) == (axis == int(np.argmin(AXES)))
