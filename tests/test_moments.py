"""Laws whose energy depends on the lean: contacts transmit its moment, so that rolling stores and returns it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hands import reference_task

from softhand import build, equilibrium, grasp_quality, load_scenario, simulate, squeeze
from softhand.assembly.parts import read_controller
from softhand.contact.pads import Support
from softhand.contact.supports import table_plane
from softhand.errors import LawError
from softhand.laws.bulk import Bulk
from softhand.laws.law import Law, check_law
from softhand.laws.parallel_distributed import ParallelDistributed
from softhand.model.shapes.box import Box
from softhand.model.shapes.cylinder import Cylinder
from softhand.model.shapes.ellipsoid import Ellipsoid
from softhand.model.shapes.shape import Shape
from softhand.model.shapes.sphere import Sphere
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of
from softhand.plant.dynamics import add_contact_force, add_contact_moment
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.scenario.scenario import Scenario, with_law

R = 0.010  # [m]


class Lopsided(Law):
    """U = (1/2) k {d^2 (1 + a lean1 + b lean1 lean2^2) + |s|^2 + c s1 lean2 d} + (1/2) k_psi psi^2: no symmetry."""

    coordinates = "surface"
    k: float = 2000.0
    k_psi: float = 0.03

    @staticmethod
    def force(dr, s1, s2, psi, lean1, lean2, radius, k, k_psi):  # type: ignore[no-untyped-def,override]
        if dr <= 0.0:
            return 0.0, 0.0, 0.0, 0.0
        bent = 1.0 + 0.3 * lean1 - 0.7 * lean1 * lean2 * lean2
        return k * dr * bent + 0.2 * k * s1 * lean2, k * s1 + 0.2 * k * lean2 * dr, k * s2, k_psi * psi

    @staticmethod
    def energy(dr, s1, s2, psi, lean1, lean2, radius, k, k_psi):  # type: ignore[no-untyped-def,override]
        if dr <= 0.0:
            return 0.0
        bent = 1.0 + 0.3 * lean1 - 0.7 * lean1 * lean2 * lean2
        return 0.5 * k * (dr * dr * bent + s1 * s1 + s2 * s2 + 0.4 * s1 * lean2 * dr) + 0.5 * k_psi * psi * psi

    @staticmethod
    def moment(dr, s1, s2, psi, lean1, lean2, radius, k, k_psi):  # type: ignore[no-untyped-def,override]
        if dr <= 0.0:
            return 0.0, 0.0
        upright = (1.0 - lean1 * lean1 - lean2 * lean2) ** 0.5
        first = 0.5 * k * dr * dr * (0.3 - 0.7 * lean2 * lean2)
        second = 0.5 * k * (-1.4 * dr * dr * lean1 * lean2 + 0.4 * s1 * dr)
        return -second * upright, first * upright


LAWS: list[Law] = [Bulk(radius=R), ParallelDistributed(radius=R), Lopsided(radius=R)]
TURN, CENTRE = rotation_of((0.3, -0.4, 0.7)), np.array([0.002, -0.003, 0.004])
SHAPES: dict[str, Shape | None] = {
    "plane": None,
    "box": Box(TURN, CENTRE, np.array([0.028, 0.018, 0.030])),
    "ball": Sphere(TURN, CENTRE, 0.025),
    "can": Cylinder(TURN, CENTRE, 0.020, 0.030),
    "egg": Ellipsoid(TURN, CENTRE, (0.030, 0.018, 0.024)),
}
by_name = pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)


def plant_with(law: Law, shape: Shape | None) -> Plant:
    """The reference hand and an object of that shape, whose tips never slip; without one its box as planes."""
    task = reference_task()
    tips = tuple(replace(tip, law=law, friction=1e6, can_slip=shape is not None) for tip in task.fingertips)
    world = task.world if shape is None else replace(task.world, shape=shape)
    return replace(task, world=world, fingertips=tips).plant()


def touching(plant: Plant, rng: np.random.Generator) -> State:
    """Hand and object in general position, tip 0 pressed into the object, with shear and torsion."""
    world = plant.world
    while True:
        q, v, rotation = np.zeros(world.nq), rng.normal(size=world.nv), rotation_of(rng.normal(size=3))
        q[: world.n_joints] = rng.normal(size=world.n_joints)
        q[-4:] = pin.Quaternion(rotation).coeffs()
        state = State(q, v, np.zeros((world.n_tips, plant.n_memory)))
        plant.update(*state.arrays)
        depth = rng.uniform(1e-3, 3e-3)
        if plant.pads["can_slip"][0]:
            foot, normal = world.shape.nearest(rng.choice([0.045, 0.2]) * rng.uniform(-1.0, 1.0, 3))
        else:
            face = plant.fingertips[0].face
            normal, foot = face.normal, face.normal * face.offset + 0.01 * rng.normal() * face.tangent
        state.q[-7:-4] = plant.contacts["tip"][0] - rotation @ (foot + (R - depth) * normal)
        state.z[0, :3] = [*rng.normal(0.0, 6e-4, 2), rng.normal(0.0, 0.1)]
        plant.update(*state.arrays)
        if plant.contacts["sin_Phi"][0] > 0.5 and plant.contacts["deformation"][0, 0] > 0.5 * depth:
            return state


def energy_of(plant: Plant, law: Law, q: Array, z: Array) -> float:
    """Of tip 0."""
    plant.update(q, np.zeros(plant.world.nv), z)
    assert law.energy is not None
    return float(law.energy(*plant.contacts["deformation"][0], *plant.contacts["lean"][0], *law.parameters()))


def pushed(plant: Plant) -> tuple[Array, Array]:
    """Generalized force of tip 0 at the last state: by its force and torsion, and by its moment."""
    touch, contact = (plant.columns[0], plant.contact_columns[0]), plant.contacts[0]
    by_force, by_moment = np.zeros((2, plant.world.nv))
    add_contact_force(*touch, contact["force"], by_force)
    add_contact_moment(*touch, contact["lean_elastic"], by_moment)
    return by_force, by_moment


@by_name
@pytest.mark.parametrize("shape", list(SHAPES))
def test_force_torsion_and_moment_are_the_slope_of_the_energy(law: Law, shape: str) -> None:
    """Along any motion of hand and object the energy grows by what the contacts take: on faces, edges, curved surfaces.

    Moved by finite ways; shear and torsion follow by rolling. A wrong sign, an axis or a lever mixed up would fail, and
    so would a contact frame that is taken to stand still on an object where it turns.
    """
    plant, rng = plant_with(law, SHAPES[shape]), np.random.default_rng(5)
    features = set()
    for _ in range(24):
        state = touching(plant, rng)
        features.add(int(plant.contacts["feature"][0]))
        (force, moment), rate = pushed(plant), plant.contacts["deformation_rate"][:, 1:].copy()
        ends = []
        for h in (1e-7, -1e-7):
            q, z = pin.integrate(plant.world.coordinates, state.q, h * state.v), state.z.copy()
            z[:, :3] += h * rate
            ends.append(energy_of(plant, law, q, z))
        grown = (ends[0] - ends[1]) / 2e-7
        size = np.linalg.norm(force) * np.linalg.norm(state.v)
        assert -(force + moment) @ state.v == pytest.approx(grown, rel=1e-6, abs=1e-8 * size)
        assert abs(moment @ state.v) > 1e-6 * size  # which is not to be left out
    assert features == {"plane": {1}, "box": {1, 2, 3}, "can": {1, 2}}.get(shape, {1})


def test_where_the_frame_jumps_nothing_pulls() -> None:
    """On the far side of a ball the tangent of the frame is taken anew: within its jump there is no rate of it."""
    plant, rng = plant_with(Bulk(radius=R), SHAPES["ball"]), np.random.default_rng(3)
    state = touching(plant, rng)
    n, t = plant.pads["face_normal"][0], plant.pads["face_tangent"][0]
    rotation, size = plant.world.object_rotation(state.q), []
    for cosine in (-0.9989, -0.999 + 1e-9, -0.999, -0.999 - 1e-9, -0.9991):
        normal = cosine * n + np.sqrt(1.0 - cosine**2) * (0.6 * t + 0.8 * np.cross(n, t))
        state.q[-7:-4] = plant.contacts["tip"][0] - rotation @ (CENTRE + (0.025 + R - 2e-3) * normal)
        plant.update(*state.arrays)
        size.append(np.abs(plant.contacts["turning"][0]).max())
    assert max(size) < 50.0 / (R - 2e-3) and size[2] < size[0] and size[0] > 1e3


@by_name
def test_the_moment_on_a_face_is_a_couple_on_the_object(law: Law) -> None:
    """m_1, m_2 about the axes of the face and m_3 about its normal, by differences of the energy, and no force."""
    plant, rng = plant_with(law, None), np.random.default_rng(8)
    for _ in range(5):
        state = touching(plant, rng)
        contact, (_, out) = plant.contacts[0].copy(), pushed(plant)
        assert law.energy is not None
        slopes = []
        for k in range(2):
            move = 1e-5 * np.eye(2)[k]
            ahead, behind = (
                law.energy(*contact["deformation"], *(contact["lean"] + sign * move), *law.parameters())
                for sign in (1.0, -1.0)
            )
            slopes.append((ahead - behind) / 2e-5)
        l1, l2 = contact["lean"]
        l3 = np.sqrt(1.0 - l1**2 - l2**2)
        m = np.array([-slopes[1] * l3, slopes[0] * l3, slopes[1] * l1 - slopes[0] * l2])
        np.testing.assert_allclose(contact["moment"], m, rtol=1e-7, atol=1e-9 * np.linalg.norm(m))
        np.testing.assert_allclose(law.moment(*contact["deformation"], *contact["lean"], *law.parameters()), m[:2],
                                   rtol=1e-7, atol=1e-9 * np.linalg.norm(m))  # fmt: skip
        on_object = plant.world.object_rotation(state.q).T @ contact["rotation"] @ m
        np.testing.assert_allclose(out[-6:-3], 0.0, atol=1e-18)
        np.testing.assert_allclose(out[-3:], on_object, rtol=1e-7, atol=1e-9 * np.linalg.norm(m))


# ---------------------------------------------------------------------------------------------------------- grasps


PUSH: dict[str, Any] = {"force": [0.5, -0.3, 0.4], "moment": [0.003, 0.002, -0.004], "start": 0.01, "duration": 0.05}
RELAXING = {"fingertip.damping": {"name": "fung", "shares": [0.2, 0.1], "rates": [20.0, 3.0]}}
CAN_SLIP = {"fingertip.contact": "coulomb"}


def scenario(law: str, values: dict[str, Any] | None = None, name: str = "target-a") -> Scenario:
    return with_law(load_scenario(name), law).with_values(values or {})


@pytest.mark.parametrize("values", [{}, RELAXING, CAN_SLIP], ids=["plain", "relaxing", "slipping"])
@pytest.mark.parametrize("law", ["bulk", "parallel-distributed"])
def test_a_grasp_starts_at_rest(law: str, values: dict[str, Any]) -> None:
    """Forces and moments are in balance with the weight: no acceleration of the object, and none of joints held."""
    simulation = build(scenario(law, values))
    plant, state = simulation.plant, simulation.state
    out = np.zeros(plant.world.nv)
    plant.update(*state.arrays)
    torque = -plant.rigid.mass_matrix(state.q) @ plant.acceleration(np.zeros(plant.world.n_joints), out)
    n = plant.world.n_joints
    acceleration = plant.acceleration(torque[:n], np.zeros(plant.world.nv))
    np.testing.assert_allclose(acceleration, 0.0, atol=1e-8)
    assert np.abs(plant.tip_contacts["moment"]).max() > 5e-4
    assert np.linalg.norm(plant.rigid.mass_matrix(state.q)[-6:] @ out) < 1e-9


@pytest.mark.parametrize("name", ["can", "gripper"])
def test_a_grasp_of_another_shape_or_with_coupled_joints_starts_at_rest(name: str) -> None:
    """On a can the moments have a force beside them, as its normal turns; jaws with one motor move together."""
    simulation = build(scenario("bulk", name=name))
    plant, state = simulation.plant, simulation.state
    plant.update(*state.arrays)
    acceleration = plant.acceleration(np.zeros(plant.world.n_joints), np.zeros(plant.world.nv))
    left = plant.rigid.mass_matrix(state.q)[-6:] @ acceleration
    np.testing.assert_allclose(left, 0.0, atol=1e-9)


def test_a_pinch_whose_moments_turn_about_its_line_takes_torsion() -> None:
    """Two tips cannot carry a moment about the line between them by forces: torsions do, and all is at rest."""
    law = Lopsided(radius=R)
    simulation = build(load_scenario("pinch"), law=law)
    plant, state = simulation.plant, simulation.state
    plant.update(*state.arrays)
    acceleration = plant.acceleration(np.zeros(plant.world.n_joints), np.zeros(plant.world.nv))
    np.testing.assert_allclose(plant.rigid.mass_matrix(state.q)[-6:] @ acceleration, 0.0, atol=1e-9)
    assert np.abs(plant.tip_contacts["force"][:, 3]).max() > 1e-5


@by_name
def test_what_is_left_to_a_controller_that_knows_no_moments(law: Law) -> None:
    """(59) ends where its springs carry them: K_O e = G_m m - J_O^fT J_CF^-fT J_m^T m, by the moments at the end."""
    at = load_scenario("target-a").with_values({"controller.orientation_error": "euler"})
    rest = equilibrium(at, law=law)
    simulation = build(at, law=law)
    simulation.reset(rest.state)
    plant, seen = simulation.plant, simulation.sample()
    n, moved = plant.world.n_joints, np.zeros(plant.world.nv)
    for k in range(plant.world.n_tips):
        touch = plant.columns[k], plant.contact_columns[k]
        add_contact_moment(*touch, plant.contacts["lean_elastic"][k], moved)
    rotation = seen.object_rotation
    on_object = np.concatenate([rotation @ moved[-6:-3], rotation @ moved[-3:]])
    beside = np.linalg.lstsq(seen.hand_force_jacobian.T, -moved[:n], rcond=None)[0]
    wrench = seen.coordinate_map.T @ (on_object - seen.object_force_jacobian.T @ beside)
    controller: Any = read_controller(at)
    stiffness = np.repeat([controller.K_O_position, controller.K_O_orientation], 3)
    error = seen.object_coordinates - seen.object_coordinates_desired
    np.testing.assert_allclose(stiffness * error, wrench, rtol=1e-6, atol=1e-8)
    assert np.linalg.norm(error) > 1e-4


@pytest.mark.parametrize("law", ["bulk", "parallel-distributed"])
def test_a_turned_world_runs_alike(law: str) -> None:
    """The hand on another base, and gravity turned with it: the same forces and moments in the contact frames."""
    turn, shift = rotation_of((0.4, -0.3, 1.1)), np.array([0.3, -0.1, 0.2])
    plain = load_scenario("hold").with_values({"duration": 0.1, "push": [PUSH], "reference": {"kind": "hold"}})
    runs = []
    for R_B, p_B in ((np.eye(3), np.zeros(3)), (turn, shift)):
        push = {**PUSH, "force": (R_B @ PUSH["force"]).tolist(), "moment": (R_B @ PUSH["moment"]).tolist()}
        rotation = R_B @ rotation_of(plain.object.rpy)
        runs.append(simulate(with_law(plain, law).with_values({
            "hand.position": p_B.tolist(), "hand.rpy": pin.rpy.matrixToRpy(R_B).tolist(),
            "gravity": (R_B @ np.asarray(plain.gravity)).tolist(), "push": [push],
            "object.position": (p_B + R_B @ np.asarray(plain.object.position)).tolist(),
            "object.rpy": pin.rpy.matrixToRpy(rotation).tolist(),
        })))  # fmt: skip
    one, other = runs
    for name, scale in (("contact_moment", 1e-3), ("contact_force", 1.0), ("joint_position", 1.0)):
        np.testing.assert_allclose(other[name], one[name], rtol=0.0, atol=1e-9 * scale, err_msg=name)
    assert np.ptp(one.contact_moment[..., 0], axis=0).max() > 1e-5


@by_name
def test_a_mirrored_contact_has_the_mirrored_moment(law: Law, rng: np.random.Generator) -> None:
    """Shipped laws prefer no direction and no hand: m turns about the normal with lean and shear, as a pseudovector."""
    for _ in range(5):
        lean, s = rng.uniform(-0.4, 0.4, 2), rng.normal(0.0, 5e-4, 2)
        d, psi, angle = rng.uniform(1e-3, 3e-3), rng.normal(0.0, 0.1), rng.uniform(-3.0, 3.0)
        rest = law.parameters()
        assert law.moment is not None
        m = np.array(law.moment(d, *s, psi, *lean, *rest))
        if isinstance(law, Lopsided):
            mirrored = law.moment(d, s[0], -s[1], -psi, lean[0], -lean[1], *rest)
            assert not np.allclose(mirrored, [-m[0], m[1]], rtol=1e-3)
            return
        Q = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        np.testing.assert_allclose(law.moment(d, *(Q @ s), psi, *(Q @ lean), *rest), Q @ m, rtol=1e-10, atol=1e-15)
        mirrored = law.moment(d, s[0], -s[1], -psi, lean[0], -lean[1], *rest)
        np.testing.assert_allclose(mirrored, [-m[0], m[1]], rtol=1e-12, atol=1e-18)


def test_the_steppers_agree() -> None:
    """Midpoint comes to rk4 as the square of its step, over the moments too."""
    fine = simulate(scenario("bulk", {"duration": 0.2, "stepper": {"name": "rk4", "step": 1.25e-4}}))
    off = []
    for step in (1e-3, 5e-4):
        run = simulate(scenario("bulk", {"duration": 0.2, "stepper": {"name": "midpoint", "step": step}}))
        off.append(np.abs(run.object_position - fine.object_position).max())
        assert np.abs(run.contact_moment - fine.contact_moment).max() < 2e-6
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.3)


def test_what_lifts_off_has_no_moment() -> None:
    """Without touch nothing is transmitted, also by a tip that may slip and stored something before."""
    for shape in ("plane", "box"):
        plant, rng = plant_with(Bulk(radius=R), SHAPES[shape]), np.random.default_rng(2)
        state = touching(plant, rng)
        assert np.abs(plant.contacts["moment"][0]).max() > 1e-5
        state.q[-7:-4] += 0.02 * plant.contacts["rotation"][0, :, 2]
        plant.update(*state.arrays)
        assert plant.contacts["deformation"][0, 0] < 0.0
        for name in ("moment", "lean_elastic", "lean_force"):
            np.testing.assert_array_equal(plant.contacts[name][0], 0.0)


# ----------------------------------------------------------------------------------------------------------------- laws


class Threefold(Lopsided):
    @staticmethod
    def moment(dr, s1, s2, psi, lean1, lean2, radius, k, k_psi):  # type: ignore[no-untyped-def,override]
        return 0.0, 0.0, 0.0


class Endless(Lopsided):
    @staticmethod
    def moment(dr, s1, s2, psi, lean1, lean2, radius, k, k_psi):  # type: ignore[no-untyped-def,override]
        return float("inf"), 0.0


class Polar(Law):
    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius):  # type: ignore[no-untyped-def,override]
        return 1e3 * dr, dtheta, dphi, dpsi

    @staticmethod
    def moment(dr, dtheta, dphi, dpsi, phi, radius):  # type: ignore[no-untyped-def,override]
        return 0.0, 0.0


class Unlike(Lopsided):
    @staticmethod
    def moment(dr, s1, s2, psi, lean, radius, k, k_psi):  # type: ignore[no-untyped-def,override]
        return 0.0, 0.0


class Bound(Lopsided):
    def moment(self, dr):  # type: ignore[no-untyped-def,override]
        return 0.0, 0.0


@pytest.mark.parametrize(
    ("law", "told"),
    [
        (Threefold, r"law 'Threefold': moment must return 2 finite numbers, got \[0.0, 0.0, 0.0\]"),
        (Endless, r"law 'Endless': moment must return 2 finite numbers, got \[inf, 0.0\]"),
        (Polar, r"law 'Polar': it has a `moment`, and polar coordinates, in which no contact transmits one: write"),
        (Unlike, r"law 'Unlike': moment must take dr, s1, s2, psi, lean1, lean2, radius, k, k_psi \(9 numbers\)"),
        (Bound, r"law 'Bound': moment is no static method; write @staticmethod above it"),
    ],
)
def test_a_moment_that_cannot_be_used_is_named(law: type[Law], told: str) -> None:
    with pytest.raises(LawError, match=told) as raised:
        check_law(law(radius=R))
    assert raised.value.law == law.__name__


def test_where_a_tip_cannot_lean_a_moment_is_refused() -> None:
    """An ellipsoid under the object has no axis."""
    task = reference_task()
    support = Support(
        "egg", Bulk(radius=R), 0.5, task.world.object_joint, np.zeros(3), 0.0, 0, table_plane(0.0),
        semi_axes=(0.02, 0.01, 0.03),
    )  # fmt: skip
    with pytest.raises(LawError, match="law 'Bulk' has a `moment`, which egg does not transmit"):
        Plant(task.world, task.fingertips, [support])


def test_the_table_of_a_grasp_has_the_forces_and_torques_of_its_start() -> None:
    """Those that are in balance with the moments."""
    bent = scenario("bulk", CAN_SLIP)
    found, simulation = grasp_quality(bent), build(bent)
    plant, state = simulation.plant, simulation.state
    plant.update(*state.arrays)
    contacts, n = plant.tip_contacts, plant.world.n_joints
    in_world = np.einsum("kab,kb->ka", contacts["rotation"], contacts["force"][:, :3])
    np.testing.assert_allclose(found.forces, in_world, rtol=1e-8, atol=1e-9)
    still = plant.rigid.mass_matrix(state.q) @ plant.acceleration(np.zeros(n), np.zeros(plant.world.nv))
    torque = np.concatenate([finger.torque for finger in found.fingers])
    np.testing.assert_allclose(torque, -still[:n], rtol=1e-8, atol=1e-10)


def test_what_counts_forces_alone_refuses_moments_by_name() -> None:
    """How far a grasp holds, by forces and torsions."""
    with pytest.raises(
        LawError, match="law 'Bulk' transmits moments where the tips lean, and how a grasp holds is told"
    ):
        squeeze(scenario("bulk", CAN_SLIP))


def test_instruments_do_not_measure_moments() -> None:
    """A controller behind instruments is told so by NaN; the recording has the truth."""
    simulation = build(scenario("bulk", {"duration": 0.005, "sensing": {"seed": 1, "contact_force": {"noise": 0.01}}}))
    recording = simulation.run()
    assert np.isnan(simulation.sample().contact_moment).all()
    assert np.isfinite(recording.contact_moment).all() and np.abs(recording.contact_moment).max() > 1e-3
    assert "contact_moment" not in simulate(load_scenario("target-a").with_values({"duration": 0.003})).variables
