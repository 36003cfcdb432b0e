"""What touches beside the fingertips on the object: table, tips, palm."""

import json
import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hands import Array

from softhand import build, load_scenario, simulate
from softhand.analysis.energy import energy_ledger
from softhand.assembly.probe import Probe, recorded_state
from softhand.checks.scenario import check_scenario
from softhand.contact.supports import object_on_table, pad_on_hand, plain, table_plane, tips_on_table, tips_on_tips
from softhand.controllers.controller import Controller
from softhand.errors import ModelError, ScenarioError
from softhand.laws.conservative import Conservative
from softhand.laws.hertz import Hertz
from softhand.laws.law import Law
from softhand.laws.nakashima import Nakashima
from softhand.laws.radial import Radial
from softhand.model.shapes.sphere import Sphere
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.recording.recording import Recording
from softhand.references.goal import Goal
from softhand.references.reference import resting
from softhand.scenario.scenario import with_law
from softhand.simulation.simulation import Simulation
from softhand.steppers.adaptive import Adaptive
from softhand.steppers.midpoint import Midpoint
from softhand.steppers.rk4 import RungeKutta4
from softhand.steppers.semi_implicit_euler import SemiImplicitEuler
from softhand.steppers.stepper import Stepper
from softhand.validation.rigs import MU, RADIUS, RIGHT, Body, Carriage, G, Rig, make_rig, make_world, tip
from softhand.viewer.scene.recorded import RecordedScene

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
    lowest = np.min(world.shape.corners() @ rotation[2])
    supports = object_on_table(world, table_plane(0.0, normal), MU, K, damping)
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


@pytest.mark.parametrize("slope", [0.0, 0.15])
def test_a_ball_rests_on_the_table_or_rolls_down_it(slope: float) -> None:
    """It sinks by m g cos / k, and rolls at g sin / (1 + I / (m R^2)) R what is left of r, or stays as it is."""
    gravity = G * np.array([math.sin(slope), 0.0, -math.cos(slope)])
    world = make_world([Carriage("y", (1.0, 0.0, 1.0), mass=1.0, inertia=1.0)],
                       Body(MASS, (0.4 * MASS * 0.03**2,) * 3, SIZE), gravity)  # fmt: skip
    away = tip(world, RIGHT)
    world = replace(world, shape=Sphere(np.eye(3), np.zeros(3), 0.03))
    supports = object_on_table(world, table_plane(0.0, (0.0, 0.0, 1.0)), MU, K, C)
    sink = MASS * G * math.cos(slope) / K
    rig = make_rig(world, [away], (0.0, 0.0, 0.03 - sink), None, supports)
    rig.run(Midpoint(step=1e-3), 0.5)
    assert rig.position[2] == pytest.approx(0.03 - sink, abs=1e-8 if slope else 1e-12)
    speed = 0.5 * G * math.sin(slope) / (1.0 + 0.4 * (0.03 / (0.03 - sink)) ** 2)
    assert rig.position[0] == pytest.approx(0.25 * speed, rel=1e-4, abs=1e-12)
    assert np.linalg.norm(rig.velocity[:3]) == pytest.approx(speed, rel=2e-4, abs=1e-12)
    assert np.linalg.norm(rig.velocity[3:]) == pytest.approx(speed / (0.03 - sink), rel=2e-4, abs=1e-9)


def test_the_plane_has_a_normal_and_a_height() -> None:
    """The table n . x = h meets a corner where n . x is below h, by h - n . x, and pushes along n."""
    rig = lying(0.0)
    normal = np.array([0.2, -0.3, 1.0]) / np.linalg.norm([0.2, -0.3, 1.0])
    corners = rig.plant.world.shape.corners() + rig.position
    height = float(np.sort(corners @ normal)[1]) + 1e-4
    plane = table_plane(height, 3.0 * normal)
    supports = object_on_table(rig.plant.world, plane, MU, K, 0.0)
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
    corners = rig.position + rig.plant.world.shape.corners() @ pin.rpy.rpyToMatrix(0.0, 0.3, 0.0).T
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


TOUCHING = {
    "duration": 0.3,
    "fingertip.contact": "coulomb",
    "fingertip.tips_touch": True,
    "table": {"height": 0.112, "friction": 0.5},
    "palm": ({"frame": "palm", "position": (0.0, 0.01, 0.1), "radius": 0.01, "friction": 0.5},),
}


def touching_plant() -> tuple[Plant, State]:
    """The reference hand with all that may touch, blown up so that it does, and turned out of all symmetry."""
    simulation = build(load_scenario("target-a", TOUCHING))
    plant, state = simulation.plant, simulation.state.copy()
    plant.pads["radius"][plant.world.n_tips :] += 0.2
    state.q[:9] += 0.05 * np.arange(9)
    state.q[-4:] = pin.Quaternion(pin.rpy.rpyToMatrix(0.2, -0.1, 0.3)).coeffs()
    return plant, state


def carried(plant: Plant, joint: int, point: Array, q: Array) -> Array:
    """Where a material point of a joint lies at another configuration [m]; `point` is in the frame of the joint."""
    data = plant.world.model.createData()
    pin.forwardKinematics(plant.world.model, data, q)
    return np.asarray(data.oMi[joint].act(point))


def test_jacobians_of_supports_are_the_relative_motion_of_material_points() -> None:
    """By differences: the pad's point less that of the base, along the contact frame; and the rate of the depth."""
    plant, state = touching_plant()
    model = plant.world.model
    rng = np.random.default_rng(3)
    plant.update(state.q, state.v, state.z)
    contacts, jacobian = plant.contacts.copy(), plant.jacobian
    assert not np.any(contacts["is_idle"])
    data = model.createData()
    pin.forwardKinematics(model, data, state.q)
    step = 1e-6
    for _ in range(3):
        v = rng.normal(size=model.nv)
        ahead, behind = (pin.integrate(model, state.q, sign * step * v) for sign in (1.0, -1.0))
        for i in range(plant.world.n_tips, len(contacts)):
            pad, contact = plant.pads[i], contacts[i]
            moved = np.zeros(3)
            for joint, sign in ((int(pad["joint"]), 1.0), (int(pad["base"]), -1.0)):
                local = data.oMi[joint].actInv(contact["point"])
                moved += sign * (carried(plant, joint, local, ahead) - carried(plant, joint, local, behind))
            velocity = contact["rotation"].T @ moved / (2.0 * step)
            np.testing.assert_allclose(jacobian[i, :3] @ v, velocity, rtol=1e-6, atol=1e-8)
        depths = []
        for q in (ahead, behind):
            plant.update(q, state.v, state.z)
            depths.append(plant.contacts["deformation"][:, 0].copy())
        rate = (depths[0] - depths[1]) / (2.0 * step)
        np.testing.assert_allclose((jacobian[:, 2] @ v)[3:], rate[3:], rtol=1e-6, atol=1e-8)


def test_the_envelope_holds_what_supports_couple() -> None:
    """All of M + J^T J lies inside the envelope; tips that touch couple their fingers."""
    plant, state = touching_plant()
    plant.update(state.q, state.v, state.z)
    J = plant.jacobian.reshape(-1, plant.world.model.nv)
    coupled = (plant.rigid.mass_matrix(state.q) != 0.0) | (J.T @ J != 0.0)
    assert np.all(plant.envelope <= np.argmax(coupled, axis=1))
    assert coupled[3:6, :3].any() and coupled[6:9, :3].any()
    out = np.zeros(plant.world.model.nv)
    plant.acceleration(np.zeros(9), out)
    force = -plant.snapshot.nle - np.einsum("irk,ir->k", plant.jacobian, plant.contacts["force"])
    np.testing.assert_allclose(out, np.linalg.solve(plant.rigid.mass_matrix(state.q), force), rtol=1e-9)


NAKASHIMA = Nakashima(radius=RADIUS, k_r=0.377e6, k_phi=0.166e6, k_theta=0.0266e9, k_psi=0.0488e9)


@pytest.mark.parametrize("law", [NAKASHIMA, Radial(radius=RADIUS), Hertz(radius=RADIUS), Conservative(radius=RADIUS)])
@pytest.mark.parametrize("depth", [0.2e-3, 1e-3, 2.3e-3])
def test_two_tips_in_series_bear_the_force_of_half_the_depth_each(law: Law, depth: float) -> None:
    """f_n(d) is the law's force at d / 2; `plain` alone has that at d."""
    F = law((depth, 0.0, 0.0, 0.0), 0.5 * math.pi)[0]
    assert plain(law)((depth, 0.0, 0.0, 0.0), 0.5 * math.pi)[0] == pytest.approx(F, rel=1e-12)
    assert plain(law, in_series=True)((2.0 * depth, 0.0, 0.0, 0.0), 0.5 * math.pi)[0] == pytest.approx(F, rel=1e-12)


def test_shear_and_torsion_in_series_are_half_as_stiff() -> None:
    """Each of two tips takes half of the displacement; Hertz's own stiffness is met at d = 0.2 r."""
    law = Hertz(radius=RADIUS)
    depth, s, psi = 0.2 * RADIUS, 1e-5, 1e-3
    expected = law((depth, s, s, psi), 0.5 * math.pi)[1:]
    np.testing.assert_allclose(plain(law)((depth, s, s, psi), 0.5 * math.pi)[1:], expected, rtol=1e-9)
    series = plain(law, in_series=True)((2.0 * depth, 2.0 * s, 2.0 * s, 2.0 * psi), 0.5 * math.pi)[1:]
    np.testing.assert_allclose(series, expected, rtol=1e-9)


def two_tips(gap: float, offset: float = 0.0) -> Rig:
    """Two free tips of 0.05 and 0.08 kg that face each other along x, in no gravity, `gap` [m] apart; a box far off."""
    carriages = [
        Carriage("xyz", (-RADIUS - 0.5 * gap, 0.0, 0.0), (0.0, 0.0, 0.0), 0.05, 1e-5),
        Carriage("xyz", (RADIUS + 0.5 * gap, offset, 0.0), (0.0, 0.0, math.pi), 0.08, 1e-5),
    ]
    world = make_world(carriages, Body(), (0.0, 0.0, 0.0))
    fingertips = [tip(world, RIGHT) for _ in carriages]
    return make_rig(world, fingertips, (0.0, 0.0, 1.0), None, tips_on_tips(world, fingertips))


def test_tips_push_each_other_apart_with_equal_forces() -> None:
    """At a depth d each gets K (d / 2)^2 along the line of the centres, away from the other one."""
    rig = two_tips(-2e-3)
    rig.update()
    push = Radial(radius=RADIUS).K * 1e-3**2
    np.testing.assert_allclose(rig.contact_forces()[:6], [-push, 0.0, 0.0, push, 0.0, 0.0], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(rig.plant.support_contacts["point"][0], 0.0, atol=1e-15)


def test_tips_that_collide_keep_their_momentum() -> None:
    """Off centre, with slip: the momentum of both is what it was, and what energy is missing went into slip."""
    rig = two_tips(1e-4, 12e-3)
    rig.state.v[0], rig.state.v[3] = 0.3, -0.2
    masses = np.repeat([0.05, 0.08], 3)
    before, energy = (masses * rig.state.v[:6]).reshape(2, 3).sum(axis=0), rig.energy()
    largest: list[float] = []
    rig.run(Midpoint(step=1e-5), 0.03, lambda _: largest.append(rig.plant.support_contacts["force"][0, 2]))
    contact = rig.plant.support_contacts[0]
    assert max(largest) > 0.5 and contact["force"][2] == 0.0, "they have met, and parted"
    np.testing.assert_allclose((masses * rig.state.v[:6]).reshape(2, 3).sum(axis=0), before, atol=1e-14)
    assert abs(rig.state.v[1]) > 0.1 and contact["slip_loss"] > 1e-3
    assert energy - rig.energy() == pytest.approx(contact["slip_loss"], rel=1e-4)


def test_a_tip_meets_the_table_as_soft_as_its_law() -> None:
    """A tip that points down, d deep in the table, is pushed up with the force of its law."""
    depth = 1.5e-3
    carriage = Carriage("z", (0.0, 0.0, RADIUS - depth), (0.0, 0.5 * math.pi, 0.0), 0.05, 1e-5)
    world = make_world([carriage], Body(), (0.0, 0.0, 0.0))
    fingertips = [tip(world, RIGHT, NAKASHIMA)]
    rig = make_rig(world, fingertips, (0.0, 0.0, 1.0), None, tips_on_table(world, fingertips, table_plane(0.0), MU))
    rig.update()
    assert rig.contact_forces()[0] == pytest.approx(math.pi * 0.377e6 * depth**2, rel=1e-9)
    assert rig.plant.support_contacts["point"][0, 2] == pytest.approx(0.0, abs=1e-15)


def test_a_palm_holds_the_box_from_below_at_the_exact_depth() -> None:
    """A ball of stiffness k under the middle of the box carries m g at the depth m g / k."""
    k = 1e4
    world = make_world([Carriage("y", (1.0, 0.0, 1.0), mass=1.0, inertia=1.0)], Body())
    palm = pad_on_hand(world, "palm 1", "base", (0.01, 0.02, 0.03), 0.02, MU, k, 5.0)
    position = np.array([0.01, 0.02, 0.03 + 0.02 + 0.03 - MASS * G / k])
    rig = make_rig(world, [tip(world, RIGHT)], position, None, [palm])
    start = rig.state.q.copy()
    rig.run(Midpoint(step=1e-3), 0.5)
    np.testing.assert_allclose(rig.state.q, start, atol=1e-12)
    contact = rig.plant.support_contacts[0]
    assert contact["deformation"][0] == pytest.approx(MASS * G / k, rel=1e-9)
    np.testing.assert_allclose(contact["rotation"] @ contact["force"][:3], [0.0, 0.0, MASS * G], rtol=1e-9, atol=1e-9)
    with pytest.raises(ModelError, match="no link or frame is called 'wrist'"):
        pad_on_hand(world, "palm 1", "wrist", (0.0, 0.0, 0.0), 0.02, MU, k, 5.0)


def rocking(stepper: Stepper, duration: float = 0.02) -> Array:
    """A box that rocks on its four corners, all of which press and stick: q and v after a while."""
    rig = lying(-2.0 * SINK, damping=2.0)
    rig.velocity[:] = 1e-4, 1e-4, 0.0, 0.005, 0.005, 0.005
    rig.run(stepper, duration)
    contacts = rig.plant.support_contacts
    assert np.count_nonzero(contacts["force"][:, 2] > 0.0) == 4
    assert not np.any(contacts["slip_loss"])
    return np.concatenate([rig.state.q, rig.state.v])


@pytest.mark.parametrize(("stepper", "order"), [(Midpoint, 2), (RungeKutta4, 4), (SemiImplicitEuler, 1)])
def test_steppers_keep_their_order_with_supports(stepper: type[Stepper], order: int) -> None:
    """Half the step, error over 2^order."""
    ends = [rocking(stepper(step=step), 4e-3) for step in (2e-4, 1e-4, 5e-5)]
    ratio = np.linalg.norm(ends[0] - ends[1]) / np.linalg.norm(ends[1] - ends[2])
    assert math.log2(ratio) == pytest.approx(order, abs=0.25)


def test_steppers_agree_on_a_box_on_the_table() -> None:
    """Midpoint, Runge-Kutta and the one with error control find the same motion."""
    exact = rocking(RungeKutta4(step=5e-5))
    np.testing.assert_allclose(rocking(Adaptive(step=1e-3)), exact, atol=1e-6)
    np.testing.assert_allclose(rocking(Midpoint(step=2e-5)), exact, atol=2e-6)


@pytest.mark.parametrize("stepper", ["midpoint", "rk4"])
def test_what_does_not_touch_changes_nothing(stepper: str) -> None:
    """A table far below, tips far apart and a palm far off: every number is the same."""
    values = {"duration": 0.1, "fingertip.contact": "coulomb", "stepper.name": stepper, "stepper.step": 5e-4}
    without = load_scenario("target-a", values)
    palm = {"frame": "palm", "position": [0.0, 0.0, -0.1], "radius": 0.01, "friction": 0.5}
    supports = {"table": {"height": -0.1, "friction": 0.5}, "fingertip.tips_touch": True, "palm": [palm]}
    with_supports, alone = simulate(without.with_values(supports)), simulate(without)
    for name, array in alone.variables.items():
        np.testing.assert_allclose(with_supports[name], array, rtol=1e-13, atol=1e-13, err_msg=name)
    assert not np.any(with_supports.support_force)


class Idle(Controller):
    """No torque."""

    def torque(self, observation, memory):
        """Zero."""
        return np.zeros(len(observation.joint_position)), memory


def dropped(step: float) -> tuple[Recording, Plant]:
    """A box falls 3 mm onto the table, tilted, with some speed along it, and comes to rest."""
    carriages = [Carriage("y", (x, 0.0, 1.0), mass=1.0, inertia=1.0) for x in (-1.0, 1.0)]
    world = make_world(carriages, BOX)
    rotation = pin.rpy.rpyToMatrix(0.05, 0.1, 0.0)
    lowest = float(np.min(world.shape.corners() @ rotation[2]))
    supports = object_on_table(world, table_plane(0.0), MU, K, C)
    rig = make_rig(world, [tip(world, RIGHT)] * 2, (0.0, 0.0, 0.003 - lowest), rotation, supports)
    rig.velocity[0] = 0.1
    still = resting(Goal(np.zeros(6), (0.0,)))
    return Simulation(rig.plant, rig.state, Idle(), Midpoint(step=step), still, 0.8, step).run(), rig.plant


def test_a_dropped_box_comes_to_rest_with_its_ledger_closed() -> None:
    """All of its fall went into the springs, the damping and the slip of the corners."""
    residuals = []
    for step in (1e-4, 5e-5):
        recording, plant = dropped(step)
        assert np.max(np.abs(recording.object_twist[-1])) < 1e-6
        ledger = energy_ledger(recording, plant)
        assert ledger.is_spring
        lowered = MASS * G * (recording.object_position[0, 2] - recording.object_position[-1, 2])
        assert ledger.gravity[-1] == pytest.approx(-lowered)
        assert ledger.slip[-1] > 0.02 * lowered and ledger.damping[-1] > 0.1 * lowered
        residuals.append(abs(ledger.residual[-1]) / lowered)
    assert residuals[1] < 0.01
    assert residuals[1] < 0.7 * residuals[0]


LOWERED = {
    "duration": 0.4, "fingertip.contact": "coulomb", "reference.duration": 0.3,
    "reference.object_position": [0.0, 0.01, 0.134], "reference.object_rpy": [0.0, 0.0, 0.0],
    "reference.internal_force": [4.0, 4.0, 3.0], "table": {"height": 0.110, "friction": 0.5},
}  # fmt: skip


@pytest.fixture(scope="module")
def lowered() -> Recording:
    """The hand of target A presses the box onto a table that is 2 mm below it."""
    return simulate(with_law(load_scenario("target-a", LOWERED), "conservative"))


def test_a_run_with_a_table_keeps_its_ledger(lowered: Recording) -> None:
    """The scenario in the recording has the table, and the accounts of the corners are in the ledger."""
    assert np.max(lowered.support_force[-1, :, 2]) > 0.1
    ledger = energy_ledger(lowered)
    assert ledger.damping[-1] > 0.0 and ledger.slip[-1] > np.sum(lowered.slip_loss[-1])
    assert abs(ledger.residual[-1]) < 0.02 * ledger.exchanged


def test_states_are_found_again_in_a_recording(lowered: Recording, tmp_path: Path) -> None:
    """The plant at a recorded state, of a file, has the recorded forces of the supports."""
    lowered.save(tmp_path / "run.nc")
    recording = Recording.load(tmp_path / "run.nc")
    plant = Probe.of_scenario(with_law(load_scenario("target-a", LOWERED), "conservative")).plant
    assert recording.labels["support"] == plant.contact_names[3:]
    sample = len(recording) - 1
    state = recorded_state(plant, recording, sample)
    plant.update(state.q, state.v, state.z)
    np.testing.assert_allclose(plant.support_contacts["force"], recording.support_force[sample], rtol=1e-6, atol=1e-6)


def test_corners_that_meet_the_table_together_are_one_event(lowered: Recording) -> None:
    """The list of events names the table once, not each corner."""
    touches = [event for event in json.loads(lowered.attributes["events"]) if "table" in event["finger"]]
    assert touches[0]["kind"] == "touch"
    first = np.flatnonzero(np.any(lowered.support_force[:, :, 2] > 0.0, axis=1))[0]
    assert touches[0]["time"] == lowered.time[first]
    assert any(event["finger"] == "table" and event["text"].endswith("corners") for event in touches)
    for one, other in pairwise(event for event in touches if event["kind"] == "touch"):
        assert other["time"] > one["time"] + 0.005


def test_the_table_is_drawn_where_it_is(lowered: Recording) -> None:
    """The slab has its top at the table's height, below the way of the object."""
    scene = RecordedScene(lowered)
    slab, update = next(
        (item, update) for item, update in zip(scene.items, scene.frame(0), strict=True) if item.name == "table/slab"
    )
    corners = slab.vertices @ update.pose[:3, :3].T + update.pose[:3, 3]
    assert corners[:, 2].max() == pytest.approx(0.110, abs=1e-8)
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    way = lowered.object_position[:, :2]
    np.testing.assert_allclose(middle[:2], 0.5 * (way.min(axis=0) + way.max(axis=0)), atol=1e-8)
    assert "table" in scene.layers


def test_check_says_what_may_touch_and_warns_of_an_object_in_the_table() -> None:
    """A start 5 mm deep is doubtful, one above is not."""
    deep = check_scenario(load_scenario("target-a", {**TOUCHING, "table": {"height": 0.117, "friction": 0.5}}))
    assert any("5 mm deep" in warning for warning in deep.warnings)
    rows = dict(check_scenario(load_scenario("target-a", TOUCHING)).start)
    assert rows["the table meets"] == "8 corners of the object, finger_1_tip, finger_2_tip, finger_3_tip"
    assert "finger_1_tip-finger_3_tip" in rows["tips meet each other"]
    assert rows["palm 1"] == "meets the object"
    assert not check_scenario(load_scenario("target-a", TOUCHING)).warnings


def test_a_table_without_a_direction_is_refused() -> None:
    """The message names the key."""
    with pytest.raises(ScenarioError, match=r"table\.normal"):
        load_scenario("target-a", {"table": {"height": 0.0, "friction": 0.5, "normal": [0.0, 0.0, 0.0]}})


def test_a_scenario_with_supports_survives_its_file(tmp_path: Path) -> None:
    """Table and palms are written and read."""
    scenario = load_scenario("target-a", TOUCHING)
    (tmp_path / "scenario.toml").write_text(scenario.to_toml())
    assert load_scenario(tmp_path / "scenario.toml") == scenario
