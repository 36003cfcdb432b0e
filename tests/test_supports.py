"""What touches beside the fingertips on the object: table, tips, palm."""

import math

import numpy as np
import pinocchio as pin
import pytest

from softhand.contact.supports import corners_on_table, table_plane
from softhand.steppers.midpoint import Midpoint
from softhand.validation.rigs import MU, RIGHT, Body, Carriage, G, Rig, make_rig, make_world, tip

MASS = 0.2  # [kg]
SIZE = (0.056, 0.036, 0.060)  # [m]
BOX = Body(MASS, (81.93e-6, 112.78e-6, 74.70e-6), SIZE)
K = 2e4  # [N/m] of a corner
C = 10.0  # [N s/m]
SINK = MASS * G / (4.0 * K)


def lying(
    height: float = 0.0,
    *,
    pitch: float = 0.0,
    slope: float = 0.0,
    normal: tuple[float, float, float] = (0.0, 0.0, 1.0),
    damping: float = C,
    size: tuple[float, float, float] = SIZE,
) -> Rig:
    """A box over a table; its lowest corner is `height` [m] above it. `slope` turns gravity downhill, along x."""
    gravity = G * np.array([math.sin(slope), 0.0, -math.cos(slope)])
    away = Carriage("y", (1.0, 0.0, 1.0), mass=1.0, inertia=1.0)
    world = make_world([away], Body(MASS, BOX.inertia, size), gravity)
    rotation = pin.rpy.rpyToMatrix(0.0, pitch, 0.0)
    lowest = np.min(world.box.corners() @ rotation[2])
    supports = corners_on_table(world, table_plane(0.0, normal), MU, K, damping)
    return make_rig(world, [tip(world, RIGHT)], (0.0, 0.0, height - lowest), rotation, supports)


def forces_on_object(rig: Rig) -> np.ndarray:
    """Of the supports, in the world [N], shape (supports, 3)."""
    contacts = rig.plant.support_contacts
    return -np.einsum("iab,ib->ia", contacts["rotation"], contacts["force"][:, :3])


def test_a_box_at_rest_sinks_by_its_weight_over_the_stiffness_and_stays() -> None:
    """Four corners of k each carry m g: it comes to rest m g / (4 k) deep, and there it stays."""
    rig = lying(0.0)
    rig.run(Midpoint(step=1e-3), 1.0)
    assert rig.position[2] == pytest.approx(0.5 * SIZE[2] - SINK, abs=1e-9)
    rest = lying(-SINK)
    start = rest.state.q.copy()
    rest.run(Midpoint(step=1e-3), 1.0)
    np.testing.assert_allclose(rest.state.q, start, atol=1e-12)
    np.testing.assert_allclose(forces_on_object(rest).sum(axis=0), [0.0, 0.0, MASS * G], atol=1e-9)


def test_the_plane_has_a_normal_and_a_height() -> None:
    """The table n . x = h meets a corner where n . x is below h, by h - n . x, and pushes along n."""
    rig = lying(0.0)
    normal = np.array([0.2, -0.3, 1.0]) / np.linalg.norm([0.2, -0.3, 1.0])
    corners = rig.plant.world.box.corners() + rig.position
    height = float(np.sort(corners @ normal)[1]) + 1e-4
    plane = table_plane(height, 3.0 * normal)
    supports = corners_on_table(rig.plant.world, plane, MU, K, 0.0)
    other = make_rig(rig.plant.world, rig.plant.fingertips, rig.position, None, supports)
    other.update()
    depth = np.maximum(height - corners @ normal, 0.0)
    assert np.count_nonzero(depth) == 2
    np.testing.assert_allclose(other.plant.support_contacts["deformation"][:, 0], depth, atol=1e-15)
    np.testing.assert_allclose(forces_on_object(other), np.outer(K * depth, normal), rtol=1e-9, atol=1e-12)


def test_contact_begins_at_the_corner() -> None:
    """The contact point is where the corner meets the plane, so that friction has no lever of its own."""
    rig = lying(-1e-5, pitch=0.3)
    rig.update()
    corners = rig.position + rig.plant.world.box.corners() @ pin.rpy.rpyToMatrix(0.0, 0.3, 0.0).T
    touching = rig.plant.support_contacts["force"][:, 2] > 0.0
    np.testing.assert_array_equal(touching, corners[:, 2] < 0.0)
    assert np.count_nonzero(touching) == 2
    expected = corners[touching] * [1.0, 1.0, 0.0]
    np.testing.assert_allclose(rig.plant.support_contacts["point"][touching], expected, atol=1e-15)


@pytest.mark.parametrize("share", [0.9, 0.99])
def test_below_the_friction_angle_a_box_sticks_without_creep(share: float) -> None:
    """tan(slope) < mu: after the first shock nothing moves any more."""
    rig = lying(-SINK, slope=math.atan(share * MU))
    rig.run(Midpoint(step=1e-3), 2.0)
    at = rig.state.q.copy()
    rig.run(Midpoint(step=1e-3), 1.0)
    np.testing.assert_allclose(rig.state.q, at, atol=1e-10)


def test_above_the_friction_angle_a_box_slides_with_g_sin_minus_mu_cos() -> None:
    """tan(slope) > mu: it goes downhill, along x, with g (sin - mu cos)."""
    slope = math.atan(1.2 * MU)
    rig = lying(-SINK * math.cos(slope), slope=slope)
    speed = []
    rig.run(Midpoint(step=1e-3), 1.0, lambda _: speed.append(rig.velocity[0]))
    expected = G * (math.sin(slope) - MU * math.cos(slope))
    assert (speed[-1] - speed[499]) / 0.5 == pytest.approx(expected, rel=1e-6)
    assert all(rig.plant.support_contacts["is_slipping"][::2])


def test_the_table_stops_a_sliding_box() -> None:
    """From v it slides v^2 / (2 mu g) before it sticks."""
    rig = lying(-SINK, size=(0.2, 0.2, 0.01))
    rig.velocity[0] = 1.0
    rig.run(Midpoint(step=2e-4), 0.5)
    assert np.max(np.abs(rig.velocity)) < 1e-9
    assert rig.position[0] == pytest.approx(1.0 / (2.0 * MU * G), rel=2e-3)


@pytest.mark.parametrize(("over", "turned"), [(-0.03, 0.0), (0.03, 0.5 * math.pi)])
def test_a_tilted_box_returns_before_its_edge_and_falls_past_it(over: float, turned: float) -> None:
    """Its centre over the edge is at pitch = atan(width / height); on either side it goes another way."""
    rig = lying(0.0, pitch=math.atan2(SIZE[0], SIZE[2]) + over)
    rig.run(Midpoint(step=5e-4), 2.0)
    rotation = pin.Quaternion(rig.state.q[-4:]).toRotationMatrix()
    np.testing.assert_allclose(rotation, pin.rpy.rpyToMatrix(0.0, turned, 0.0), atol=1e-3)
    assert np.max(np.abs(rig.velocity)) < 1e-6


def test_the_table_gives_the_object_what_changes_its_momentum() -> None:
    """m a = m g + the forces at the corners, and the torque about the centre of mass is theirs too."""
    rig = lying(-2e-5, pitch=0.02)
    rig.velocity[:] = 0.02, -0.03, 0.01, 0.3, -0.2, 0.4
    rig.run(Midpoint(step=1e-3), 0.01)
    rig.update()
    out = np.zeros(rig.plant.world.model.nv)
    rig.plant.acceleration(rig.torque, out)
    rotation = pin.Quaternion(rig.state.q[-4:]).toRotationMatrix()
    linear, spin = rig.velocity[:3], rig.velocity[3:]
    acceleration = rotation @ (out[-6:-3] + np.cross(spin, linear))
    force = forces_on_object(rig)
    assert np.count_nonzero(force[:, 2]) >= 2
    weight = np.array([0.0, 0.0, -MASS * G])
    np.testing.assert_allclose(MASS * acceleration, force.sum(axis=0) + weight, atol=1e-12)
    inertia = np.array(BOX.inertia)
    change = rotation @ (inertia * out[-3:] + np.cross(spin, inertia * spin))
    arms = rig.plant.support_contacts["point"] - rig.position
    np.testing.assert_allclose(change, np.cross(arms, force).sum(axis=0), atol=1e-12)
