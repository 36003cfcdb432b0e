"""Coupled joints: exact in the terms, in motion, at the start; what motors regulate; what is refused."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hands import BOX_URDF, REPOSITORY
from numpy.typing import NDArray
from test_rigid_terms import assert_equal, random_motion, random_tree

import softhand
from softhand.assembly.plant import read_coupling
from softhand.contact.grasp_map import grasp_map
from softhand.contact.mobility import mobility
from softhand.errors import ModelError, ScenarioError, SofthandError
from softhand.model.arm import Arm
from softhand.model.body import ObjectModel
from softhand.model.compiled_snapshot import CompiledSnapshot, room_for_terms
from softhand.model.configuration import integrate
from softhand.model.coupling import Coupling, CouplingTable
from softhand.model.hand import HandModel
from softhand.model.motors import coupled_of, motor_model
from softhand.model.rigid import rigid_poses, rigid_terms
from softhand.model.snapshot import Snapshot, Terms
from softhand.model.terms import RigidTerms
from softhand.model.tree import read_tree
from softhand.model.world import World, load_world
from softhand.numerics.spatial import rotation_of
from softhand.scenario.bodies import CouplingSection
from softhand.scenario.scenario import load_scenario
from softhand.settings.settings import read_settings
from softhand.simulation.regulated import mobility_of
from softhand.viewer.scene.recorded import RecordedScene

Array = NDArray[np.float64]

GRIPPER = REPOSITORY / "urdf" / "parallel_gripper.urdf"
HAND = REPOSITORY / "urdf" / "coupled_hand.urdf"
JAWS = ("left_tip", "right_tip")
FINGERS = ("index_tip", "middle_tip", "thumb_tip")


def random_coupling(model: pin.Model, rng: np.random.Generator, n_motors: int) -> Coupling:
    """Any map of full rank from motors to the joints of a tree: most joints with one motor, some with several."""
    n = model.nv - 6
    S = np.zeros((n, n_motors))
    for k in range(n):
        some = rng.choice(n_motors, size=min(n_motors, 1 + int(rng.random() < 0.3)), replace=False)
        S[k, some] = rng.uniform(0.3, 2.0, len(some)) * rng.choice([-1.0, 1.0], len(some))
    own = rng.permutation(n)[:n_motors]
    S[own] = 0.0
    S[own, range(n_motors)] = 1.0
    offset = rng.normal(size=n)
    offset[own] = 0.0
    names = tuple(f"motor {k}" for k in range(n_motors))
    infinite = np.full(n_motors, np.inf)
    kinds, slides = np.zeros(n_motors, np.int64), np.zeros(n_motors, np.bool_)
    joints = tuple(list(model.names)[1:-1])
    unlimited = np.full(n, np.inf)
    return Coupling(
        names, joints, S, offset, kinds, slides, infinite, np.array([-infinite, infinite]),
        np.array([-unlimited, unlimited]), None,
    )  # fmt: skip


def whole_configuration(model: pin.Model, coupling: Coupling, q: Array) -> Array:
    """Of all joints, joint by joint, independent of the kernel."""
    whole = pin.neutral(model)
    angles = coupling.S @ q[: len(coupling.motors)] + coupling.offset
    for angle, joint in zip(angles, list(model.joints)[1:-1], strict=True):
        whole[joint.idx_q : joint.idx_q + joint.nq] = angle if joint.nq == 1 else (math.cos(angle), math.sin(angle))
    whole[-7:] = q[-7:]
    return whole


def whole_map(coupling: Coupling) -> Array:
    """S with the object."""
    n, m = coupling.S.shape
    S = np.zeros((n + 6, m + 6))
    S[:n, :m], S[n:, m:] = coupling.S, np.eye(6)
    return S


def coupled_trees(seed: int) -> Any:
    """Model, coupling, its tables, S, and ten motions of random trees."""
    rng = np.random.default_rng(seed)
    for n_joints in rng.integers(2, 16, 6):
        model = random_tree(rng, n_joints)
        coupling = random_coupling(model, rng, int(rng.integers(1, n_joints)))
        coordinates = motor_model(coupling)
        tips = rng.integers(1, n_joints + 1, 2).tolist()
        coupled = coupled_of(coupling, coordinates, model, tips)
        motions = [random_motion(coordinates, rng) for _ in range(5)]
        yield model, coupling, coupled, whole_map(coupling), motions, rng


@pytest.mark.parametrize("seed", range(4))
def test_compiled_terms_are_those_of_all_joints_projected(seed: int) -> None:
    """S^T M S, S^T (C v + N) and J S of random trees, nothing of the last state among them."""
    for model, coupling, coupled, S, motions, _ in coupled_trees(seed):
        tree, found = read_tree(model, coupled), room_for_terms(model, coupled)
        data = model.createData()
        for q, v in motions:
            rigid_terms(tree, q, v, found)
            whole = whole_configuration(model, coupling, q)
            M = np.triu(pin.crba(model, data, whole, pin.Convention.WORLD))
            M = M + np.triu(M, 1).T
            nle = pin.nonLinearEffects(model, data, whole, S @ v)
            poses = np.array([[*pose.rotation.T.ravel(), *pose.translation] for pose in data.oMi])
            J = np.array(found.J)
            assert_equal(found, Terms(S.T @ M @ S, J, S.T @ nle, poses))
            np.testing.assert_allclose(J[:, : model.nv], data.J, rtol=0.0, atol=1e-12 * np.abs(data.J).max())
            rigid_poses(tree, q, found)
            np.testing.assert_array_equal(found.J, J)


@pytest.mark.parametrize("seed", range(4))
def test_the_motion_is_that_of_the_full_model_with_multipliers(seed: int) -> None:
    """[M A^T; A 0] (q'', lambda) = (f - C v - N, 0), with A S = 0: S m'' are the same accelerations."""
    for model, coupling, coupled, S, motions, rng in coupled_trees(10 + seed):
        A = np.linalg.svd(S)[0][:, S.shape[1] :].T  # what S leaves out
        tree, found = read_tree(model, coupled), room_for_terms(model, coupled)
        for q, v in motions:
            force = rng.normal(size=model.nv)
            rigid_terms(tree, q, v, found)
            M = np.triu(found.M) + np.triu(found.M, 1).T
            reduced = np.linalg.solve(M, S.T @ force - found.nle)
            whole = whole_configuration(model, coupling, q)
            data = model.createData()
            full = pin.crba(model, data, whole)
            full = np.triu(full) + np.triu(full, 1).T
            left = force - pin.nonLinearEffects(model, data, whole, S @ v)
            block = np.block([[full, A.T], [A, np.zeros((len(A), len(A)))]])
            scale = np.sqrt(np.abs(np.diag(full)))
            scale = np.concatenate([1.0 / scale, np.full(len(A), np.median(scale))])
            solved = scale * np.linalg.solve(block * np.outer(scale, scale), scale * np.append(left, np.zeros(len(A))))
            np.testing.assert_allclose(S @ reduced, solved[: model.nv], rtol=0.0, atol=1e-7 * np.abs(solved).max())


@pytest.mark.parametrize("seed", range(2))
def test_views_are_the_jacobians_of_bodies_by_the_motors(seed: int) -> None:
    """Column by column the twist of a body, from differences of its pose: finite differences of J S."""
    for model, coupling, coupled, _, motions, _ in coupled_trees(20 + seed):
        coordinates = motor_model(coupling)
        tree, found = read_tree(model, coupled), room_for_terms(model, coupled)
        nv = coordinates.nv
        q, _ = motions[0]
        rigid_poses(tree, q, found)
        J, data = np.array(found.J), model.createData()

        def place(
            body: int, along: Array, step: float, q: Array = q, m: Any = (model, coupling, coordinates, data)
        ) -> Any:
            pin.forwardKinematics(m[0], m[3], whole_configuration(m[0], m[1], pin.integrate(m[2], q, step * along)))
            return m[3].oMi[body].copy()

        for view, body in enumerate((model.njoints - 1, *range(model.njoints - 1))):
            for k in range(nv - 6):
                along, h = np.eye(nv)[k], 1e-6
                before, after = place(body, along, -h), place(body, along, h)
                spin = pin.log3(after.rotation @ before.rotation.T) / (2.0 * h)
                here = place(body, along, 0.0).translation
                moved = (after.translation - before.translation) / (2.0 * h) - np.cross(spin, here)
                column = J[:, model.nv + nv * view + k]
                np.testing.assert_allclose(column, [*moved, *spin], rtol=0.0, atol=1e-8 * max(np.abs(J).max(), 1.0))


def gripper(table: CouplingTable | None = None) -> World:
    """The gripper with one motor, or the one with two under a table."""
    file = GRIPPER if table is None else REPOSITORY / "urdf" / "gripper.urdf"
    return load_world(HandModel.read(file, JAWS, coupling=table), ObjectModel.read(BOX_URDF))


def test_both_snapshots_agree_on_real_hands() -> None:
    for world in (gripper(), load_world(HandModel.read(HAND, FINGERS), ObjectModel.read(BOX_URDF))):
        by_pinocchio, compiled, rng = Snapshot(world), CompiledSnapshot(world), np.random.default_rng(0)
        for _ in range(10):
            q, v = random_motion(world.coordinates, rng)
            for snapshot in (by_pinocchio, compiled):
                snapshot.update(q, v)
            assert_equal(compiled.terms, by_pinocchio.terms)
            J = np.array(compiled.J)
            for snapshot in (by_pinocchio, compiled):
                snapshot.sense(q)
                np.testing.assert_allclose(snapshot.J, J, rtol=0.0, atol=1e-14)
            M = world_terms(world).mass_matrix(q)
            np.testing.assert_allclose(np.triu(M), np.triu(compiled.M), rtol=0.0, atol=1e-12)


def world_terms(world: World) -> RigidTerms:
    """M and C v apart from a simulation."""
    return RigidTerms(world.model, world.coupled)


def test_pinocchio_with_mimic_of_its_own_has_the_same_terms() -> None:
    """Another implementation of the same: Pinocchio's joints that follow one other."""
    native = pin.buildModelFromXML(HAND.read_text(), mimic=True)
    world = load_world(HandModel.read(HAND, FINGERS), ObjectModel.read(BOX_URDF))
    snapshot, rng = CompiledSnapshot(world), np.random.default_rng(3)
    assert [name for name in world.joint_names] == [name for name in native.names if name.endswith("bend")]
    for _ in range(5):
        q, v = random_motion(world.coordinates, rng)
        snapshot.update(q, v)
        data = native.createData()
        M = np.triu(pin.crba(native, data, q[:3]))
        np.testing.assert_allclose(np.triu(snapshot.M[:3, :3]), M, rtol=0.0, atol=1e-15)
        nle = pin.nonLinearEffects(native, data, q[:3], v[:3])
        np.testing.assert_allclose(snapshot.nle[:3], nle, rtol=0.0, atol=1e-12)


def test_a_swinging_hand_keeps_its_energy() -> None:
    """Three coupled fingers that fall freely: the energy of all links is lost as the fourth power of the step alone."""
    world = load_world(HandModel.read(HAND, FINGERS, rpy=(0.4, 0.9, -0.3)), ObjectModel.read(BOX_URDF))
    tree, out = read_tree(world.model, world.coupled), room_for_terms(world.model, world.coupled)
    data = world.model.createData()

    def rate(q: Array, v: Array) -> Array:
        rigid_terms(tree, q, v, out)
        M = np.triu(out.M) + np.triu(out.M, 1).T
        return np.linalg.solve(M, -out.nle)

    def moved(q: Array, v: Array, time: float) -> Array:
        end = np.empty_like(q)
        integrate(world.joints, q, v, time, end)
        return end

    def energy(q: Array, v: Array) -> tuple[float, float]:
        whole = world.configuration(q)
        kinetic = pin.computeKineticEnergy(world.model, data, whole, world.velocity(v))
        return float(kinetic), float(pin.computePotentialEnergy(world.model, data, whole))

    def lost(h: float) -> float:
        q, v = pin.neutral(world.coordinates), np.zeros(world.nv)
        q[:3], v[:3] = (0.3, 0.9, 0.1), (2.0, -3.0, 4.0)
        begin = energy(q, v)
        for _ in range(round(0.1 / h)):
            k1 = rate(q, v)
            k2 = rate(moved(q, v, 0.5 * h), v + 0.5 * h * k1)
            k3 = rate(moved(q, v + 0.5 * h * k1, 0.5 * h), v + 0.5 * h * k2)
            k4 = rate(moved(q, v + 0.5 * h * k2, h), v + h * k3)
            q = moved(q, v + h / 6.0 * (k1 + k2 + k3), h)
            v = v + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        end = energy(q, v)
        assert abs(end[0] - begin[0]) > 1e-2  # [J] that went to and fro
        return sum(end) - sum(begin)

    coarse, fine = lost(1e-3), lost(5e-4)
    assert abs(fine) < 1e-9
    assert 12.0 < coarse / fine < 20.0


# ---------------------------------------------------------------------------------------------- the table of motors

DIFFERENTIAL = {
    "joints": {"left_slide": {"grip": 1.0, "shift": 1.0}, "right_slide": {"grip": 1.0, "shift": -1.0}},
    "motors": {"grip": {"effort": 60.0}, "shift": {"effort": 60.0}},
}
"""The two jaws of `gripper` by a motor that closes both and one that shifts both."""


def table_of(section: dict[str, Any]) -> CouplingTable:
    found = read_coupling(read_settings(CouplingSection, section, "hand.coupling"))
    assert found is not None
    return found


def test_a_table_is_the_mimic_that_says_the_same() -> None:
    """gripper.urdf under a table against parallel_gripper.urdf, whose right jaw follows the left: to the last bit."""
    table = {"joints": {"right_slide": {"left_slide": 1.0}}, "motors": {"left_slide": {"effort": 60.0}}}
    values = {"hand.urdf": str(REPOSITORY / "urdf" / "gripper.urdf"), "hand.coupling": table, "duration": 0.1}
    by_table = softhand.simulate(load_scenario("parallel-gripper", values))
    by_urdf = softhand.simulate("parallel-gripper", duration=0.1)
    for name in ("joint_position", "joint_torque", "object_position", "contact_force"):
        np.testing.assert_array_equal(by_table[name], by_urdf[name])
    assert by_table.labels["joint"] == ("left_slide",)
    assert by_table.labels["coupled_joint"] == ("right_slide",)
    np.testing.assert_array_equal(by_table.coupled_position, by_table.joint_position)
    assert by_table.units("coupled_position") == ("m",)


@pytest.mark.parametrize("terms", ["pinocchio", "compiled"])
def test_a_full_differential_is_the_hand_without_it(terms: str) -> None:
    """Two motors for two jaws are other coordinates of the same: the same motion under tau_motor = S^T tau."""
    values = {"stepper.terms": terms, "duration": 0.3, "object.position": [0.002, 0.0, 0.07]}
    plain = softhand.build(load_scenario("gripper", values))
    mixed = softhand.build(load_scenario("gripper", {**values, "hand.coupling": DIFFERENTIAL}))
    assert mixed.plant.world.joint_names == ("grip", "shift")
    S = np.array([[1.0, 1.0], [1.0, -1.0]])
    np.testing.assert_allclose(S @ mixed.state.q[:2], plain.state.q[:2], rtol=0.0, atol=1e-10)
    for k in range(200):
        torque = np.array([9.0 + 2.0 * math.sin(0.05 * k), 9.5 - math.sin(0.03 * k)])
        for simulation, own in ((plain, torque), (mixed, S.T @ torque)):
            simulation.sample()
            simulation.step(own)
    assert np.ptp([plain.state.q[0], plain.state.q[1]]) > 1e-4
    np.testing.assert_allclose(S @ mixed.state.q[:2], plain.state.q[:2], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(S @ mixed.state.v[:2], plain.state.v[:2], rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(mixed.state.q[2:], plain.state.q[2:], rtol=0.0, atol=1e-9)


def test_limits_of_motors_are_the_tightest_of_their_joints() -> None:
    """Of the mimic joint, whose range is the shorter one; of a differential what its partner lets it have."""
    world = load_world(HandModel.read(HAND, FINGERS), ObjectModel.read(BOX_URDF))
    lower, upper = world.position_limits
    np.testing.assert_allclose(lower, 3 * [-0.20])  # (-0.20 - 0.05) / 0.9 of the other joint is less
    np.testing.assert_allclose(upper, 3 * [1.30])
    table = table_of({"joints": {"right_slide": {"left_slide": -2.0}}, "offsets": {"right_slide": 0.06}})
    lower, upper = gripper(table).position_limits
    np.testing.assert_allclose([lower, upper], [[0.005], [0.03]], rtol=0.0, atol=1e-15)
    lower, upper = gripper(table_of(DIFFERENTIAL)).position_limits
    np.testing.assert_allclose(lower, [0.0, -0.025], atol=1e-9)
    np.testing.assert_allclose(upper, [0.05, 0.025], atol=1e-9)
    narrow = {**DIFFERENTIAL, "motors": {"grip": {"effort": 1.0, "upper": 0.02}, "shift": {"effort": 2.0}}}
    world = gripper(table_of(narrow))
    np.testing.assert_allclose(world.position_limits[1], [0.02, 0.02], atol=1e-9)
    np.testing.assert_allclose(world.effort_limit, [1.0, 2.0])


def test_chains_of_mimics_are_followed_to_their_leader(tmp_path: Path) -> None:
    """thumb follows middle, middle follows index, with an offset each: ratio and offset through both."""
    text = HAND.read_text()
    for joint, line in (
        ("middle_bend", '<mimic joint="index_bend" multiplier="0.5" offset="0.1"/>'),
        ("thumb_bend", '<mimic joint="middle_bend" multiplier="-2" offset="0.3"/>'),
    ):
        begin = text.index(f'<joint name="{joint}"')
        text = text[:begin] + text[begin:].replace("</joint>", f"{line}</joint>", 1)
    file = tmp_path / "chain.urdf"
    file.write_text(text)
    coupling = load_world(HandModel.read(file, FINGERS), ObjectModel.read(BOX_URDF)).coupling
    assert coupling is not None
    assert coupling.motors == ("index_bend",)
    row = coupling.joint_names.index("thumb_bend"), coupling.joint_names.index("thumb_follow")
    np.testing.assert_allclose(coupling.S[list(row), 0], [-1.0, -0.9])
    np.testing.assert_allclose(coupling.offset[list(row)], [0.1, 0.9 * 0.1 + 0.05])


# -------------------------------------------------------------------------------------------------------- the start


def test_the_start_of_coupled_fingers_is_at_rest() -> None:
    """Under the torques of the controller nothing begins to move, and all tips lie on the points that were found."""
    for name in ("coupled-hand", "parallel-gripper"):
        simulation = softhand.build(name)
        observation = simulation.sample()
        acceleration = np.zeros(simulation.plant.world.nv)
        state = simulation.state
        simulation.plant.update(state.q, state.v, state.z)
        simulation.plant.acceleration(simulation.torque, acceleration)
        assert np.abs(acceleration).max() < 1e-3  # [rad/s^2, m/s^2], for 1e4 without the torques
        asked = np.array(load_scenario(name).grasp.contact_points) + state.q[-7:-4]
        assert np.linalg.norm(observation.contact_point - asked, axis=1).max() < 1e-3


def test_the_jacobian_of_a_tip_is_that_of_its_motors() -> None:
    """`Arm.point_jacobian` and what the controller sees, against differences of the place of the tip."""
    simulation = softhand.build("coupled-hand")
    world, arm = simulation.plant.world, Arm(simulation.plant.world)
    observation = simulation.sample()
    angles = observation.joint_position.copy()
    for i in range(3):
        arm.move(angles)
        jacobian = arm.point_jacobian(i, arm.tip(i)[0])
        for k in range(world.n_joints):
            h = 1e-6 * np.eye(world.n_joints)[k]
            ends = []
            for way in (h, -h):
                arm.move(angles + way)
                ends.append(arm.tip(i)[0].copy())
            np.testing.assert_allclose(jacobian[:, k], (ends[0] - ends[1]) / 2e-6, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(observation.tip_jacobian[i], jacobian, rtol=0.0, atol=1e-14)


# ---------------------------------------------------------------------------------------------------- whole scenarios


def test_one_motor_holds_against_a_push_by_the_mechanism() -> None:
    """Along the jaws no motor pushes back: f_1 + f_2 stays, f_1 - f_2 is the push, each tip as deep as its law says.

    dr_1 = F^-1(f_0 + P / 2),   dr_2 = F^-1(f_0 - P / 2),   x = (dr_1 - dr_2) / 2
    """
    f_0, P = 12.0, 6.0  # [N]
    damped = {"name": "kelvin-voigt", "radial": 30.0, "tangential": 30.0, "torsional": 0.0}
    values = {
        "gravity": [0.0, 0.0, 0.0], "grasp.internal_force": [f_0], "reference": {"kind": "hold"},
        "controller.K_N": 1.0, "fingertip.damping": damped, "duration": 1.5,
        "push": [{"force": [P, 0.0, 0.0], "point": [0.0, 0.0, 0.010], "duration": 2.0}],
    }  # fmt: skip
    recording = softhand.simulate(load_scenario("parallel-gripper", values))
    law = softhand.build("parallel-gripper").plant.fingertips[0].law

    def depth(force: float) -> float:
        low, high = 0.0, 0.9 * law.radius
        for _ in range(100):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if law([middle, 0.0, 0.0, 0.0], 0.5 * math.pi)[0] < force else (low, middle)
        return low

    # the object goes along +x, into the right tip, which carries half of the push more
    deeper, shallower = depth(f_0 + 0.5 * P), depth(f_0 - 0.5 * P)
    np.testing.assert_allclose(recording.deformation[-1, :, 0], [shallower, deeper], rtol=1e-6)
    between = recording.object_position[-1, 0] + 0.010 * math.sin(recording.object_rpy[-1, 1])  # at the contacts
    np.testing.assert_allclose(between, 0.5 * (deeper - shallower), rtol=1e-6)
    np.testing.assert_allclose(recording.contact_force[-1, :, 2], [f_0 - 0.5 * P, f_0 + 0.5 * P], rtol=1e-6)
    np.testing.assert_allclose(recording.joint_torque[-1], [2.0 * f_0], rtol=1e-6)


def test_what_motors_regulate_is_told() -> None:
    """One motor of a gripper squeezes and moves nothing; three of a hand move it one way and squeeze in two."""
    cases = {
        "parallel-gripper": ("0 of 6", "1 of 1"), "gripper": ("1 of 6: x", "1 of 1"),
        "coupled-hand": ("1 of 6: x with", "2 of 3: "),
    }  # fmt: skip
    for name, (motions, forces) in cases.items():
        simulation = softhand.build(name)
        found = mobility_of(simulation.plant.world, simulation.sample())
        assert found.motions_text().startswith(motions)
        assert found.forces_text(["23", "13", "12"][: found.forces.shape[1]]).startswith(forces)
    recording = softhand.simulate("parallel-gripper", duration=0.01)
    rows = dict(softhand.summarize(recording).rows())
    assert rows["motors"] == "1 for 2 joints: left_slide"
    assert rows["motions of the object that they regulate"] == "0 of 6"
    assert "motors" not in dict(softhand.summarize(softhand.simulate("gripper", duration=0.01)).rows())
    quality = dict(softhand.grasp_quality(load_scenario("coupled-hand")).rows())
    assert quality["motions of the object that they regulate"].startswith("1 of 6: x with")


def test_mobility_by_rank() -> None:
    """Against ranks of matrices, for random grasps: what moves, what squeezes, and that it does."""
    rng = np.random.default_rng(5)
    for nc, n in ((2, 1), (2, 4), (3, 3), (3, 7), (3, 9), (4, 12)):
        points = rng.normal(scale=0.03, size=(nc, 3))
        G = grasp_map(points)
        moved = rng.normal(size=(6, min(n, 2)))  # as many columns that move the object as a whole
        J = np.hstack([G.T @ moved, rng.normal(size=(3 * nc, n - moved.shape[1]))])
        found = mobility(J, G, np.zeros((3 * nc, 0)), 0.03)
        rank = np.linalg.matrix_rank
        shared = rank(J, 1e-9) + rank(G) - rank(np.hstack([J, G.T]), 1e-9)
        assert len(found.motions) == shared >= min(moved.shape[1], rank(G))
        for row in found.motions:
            velocity = G.T @ (row / np.repeat([1.0, 0.03], 3))
            assert np.linalg.norm(J @ np.linalg.lstsq(J, velocity, rcond=None)[0] - velocity) < 1e-9
        assert found.n_forces == 3 * nc - rank(G)


def test_turning_everything_changes_nothing() -> None:
    """Hand, object and gravity turned together: the motors move as before."""
    rpy = (0.3, -0.5, 1.1)
    R = rotation_of(rpy)
    place = R @ np.array([0.0, 0.0, 0.087])
    turned = {
        "hand.rpy": list(rpy), "object.rpy": list(rpy), "object.position": place.tolist(),
        "gravity": (R @ np.array([0.0, 0.0, -9.81])).tolist(), "duration": 0.2, "reference": {"kind": "hold"},
    }  # fmt: skip
    push = [{"force": [0.3, 0.2, 0.4], "duration": 1.0}]
    one = softhand.simulate(
        load_scenario("coupled-hand", {"duration": 0.2, "push": push, "reference": {"kind": "hold"}})
    )
    push = [{"force": (R @ np.array([0.3, 0.2, 0.4])).tolist(), "duration": 1.0}]
    other = softhand.simulate(load_scenario("coupled-hand", {**turned, "push": push}))
    assert np.abs(one.joint_position[-1] - one.joint_position[0]).max() > 1e-5
    np.testing.assert_allclose(other.joint_position, one.joint_position, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(other.object_position @ R, one.object_position, rtol=0.0, atol=1e-9)


def test_the_order_of_tips_changes_nothing() -> None:
    """index, middle, thumb as thumb, index, middle, with points and pairs put likewise."""
    push = [{"force": [0.3, 0.2, 0.4], "duration": 1.0}]
    one = softhand.simulate(
        load_scenario("coupled-hand", {"duration": 0.2, "push": push, "reference": {"kind": "hold"}})
    )
    points = load_scenario("coupled-hand").grasp.contact_points
    values = {
        "hand.tips": ["thumb_tip", "index_tip", "middle_tip"], "duration": 0.2, "push": push,
        "grasp.contact_points": [list(points[k]) for k in (2, 0, 1)],
        "grasp.internal_force": [0.0, 5.0, 5.0],  # pairs 23, 13, 12 of the new order
        "reference": {"kind": "hold"},
    }  # fmt: skip
    other = softhand.simulate(load_scenario("coupled-hand", values))
    np.testing.assert_allclose(other.joint_position, one.joint_position, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(other.contact_force, one.contact_force[:, [2, 0, 1]], rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("name", ["parallel-gripper", "coupled-hand"])
def test_the_work_of_motors_is_all_the_work(name: str) -> None:
    """The ledger of a run with pushes: what motors and pushes put in is in the bodies, the tips and friction."""
    push = [{"force": [0.5, 0.0, 0.3], "duration": 0.1}]
    recording = softhand.simulate(load_scenario(name, {"duration": 0.2, "push": push}))
    ledger = softhand.energy_ledger(recording)
    assert ledger.exchanged > 1e-6
    assert abs(ledger.residual[-1]) < 2e-2 * ledger.exchanged


@pytest.mark.parametrize("coupling", [None, DIFFERENTIAL])
def test_pictures_show_all_links_where_they_are(coupling: dict[str, Any] | None) -> None:
    """The tips of the picture are those of the run: with a mimic, and with motors that no URDF knows."""
    name = "parallel-gripper" if coupling is None else "gripper"
    values = {} if coupling is None else {"hand.coupling": coupling}
    recording = softhand.simulate(load_scenario(name, {"duration": 0.05, **values}))
    scene = RecordedScene(recording)
    for sample in (0, -1):
        scene.frame(sample)
        for i, tip in enumerate(JAWS):
            place = scene.skeleton.frame(tip)[:3, 3]
            np.testing.assert_allclose(place, recording.tip_position[sample, i], rtol=0.0, atol=1e-12)
    assert recording.units("joint_position") == ("m",)


def test_many_runs_are_single_runs() -> None:
    """The compiled loop with coupled joints: to 1e-9 what Python does."""
    scenario = load_scenario("parallel-gripper", {"duration": 0.05})
    runs = softhand.rollout(scenario, {"object.mass": [0.2, 0.25]}, variables=("joint_position", "contact_force"))
    assert runs.compiled.all()
    for k, mass in enumerate((0.2, 0.25)):
        alone = softhand.simulate("parallel-gripper", mass=mass, duration=0.05)
        np.testing.assert_allclose(runs.joint_position[k], alone.joint_position[::10], rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(runs.contact_force[k], alone.contact_force[::10], rtol=0.0, atol=1e-7)


def test_an_open_start_closes_with_one_motor() -> None:
    """The box stands on a table between the open jaws, which one motor closes until they press."""
    values = {
        "grasp.opening": 0.004, "grasp.internal_force": [0.0], "table": {"height": 0.04, "friction": 0.5},
        "reference": {"kind": "hold"}, "duration": 0.3,
    }  # fmt: skip
    simulation = softhand.build(load_scenario("parallel-gripper", values))
    observation = simulation.sample()
    np.testing.assert_allclose(observation.deformation[:, 0], -0.004, atol=1e-6)
    for _ in range(300):
        observation = simulation.sample()
        simulation.step(8.0 - 40.0 * observation.joint_velocity)
    np.testing.assert_allclose(simulation.sample().contact_force[:, 2], 4.0, atol=1e-2)


# ------------------------------------------------------------------------------------------------------- what is wrong


def changed(file: Path, joint: str, before: str, after: str, folder: Path) -> Path:
    """A copy of a URDF in which a text of one joint is another."""
    text = file.read_text()
    begin = text.index(f'<joint name="{joint}"')
    assert before in text[begin : text.index("</joint>", begin)]
    target = folder / "changed.urdf"
    target.write_text(text[:begin] + text[begin:].replace(before, after, 1))
    return target


MIMICS = {
    'joint="nothing"': 'joint="nothing": no joint is called so',
    'joint="left_tip_mount"': 'joint="left_tip_mount" is fixed, so that nothing leads the joint',
    'joint="right_slide"': 'joint="right_slide" leads round in a ring, right_slide follows right_slide',
    'joint="left_slide" multiplier="0"': 'multiplier="0": nothing moves the joint',
    'joint="left_slide" multiplier="2" offset="0.2"': "leave the motor 'left_slide' no range",
}


@pytest.mark.parametrize("mimic", MIMICS)
def test_a_mimic_that_cannot_be_is_refused(mimic: str, tmp_path: Path) -> None:
    file = changed(GRIPPER, "right_slide", 'joint="left_slide" multiplier="1" offset="0"', mimic, tmp_path)
    with pytest.raises(SofthandError) as error:
        load_world(HandModel.read(file, JAWS), ObjectModel.read(BOX_URDF))
    assert MIMICS[mimic] in str(error.value)
    assert "\n" not in str(error.value)


def test_mimics_in_a_ring_are_refused(tmp_path: Path) -> None:
    axis = '<axis xyz="1 0 0"/>'
    file = changed(GRIPPER, "left_slide", axis, f'{axis}<mimic joint="right_slide"/>', tmp_path)
    with pytest.raises(ModelError, match="leads round in a ring, left_slide follows right_slide follows left_slide"):
        load_world(HandModel.read(file, JAWS), ObjectModel.read(BOX_URDF))


TABLES: dict[str, tuple[dict[str, Any], str]] = {
    "unknown joint": ({"joints": {"thumb": {"grip": 1.0}}}, "the hand has no moving joint 'thumb'; there are: left_"),
    "no motor": ({"joints": {"left_slide": {"grip": 0.0}}}, "no motor moves 'left_slide'"),
    "no effort": (
        {"joints": {"left_slide": {"grip": 1.0}}},
        "the motor 'grip' has no effort limit, as no joint is called so; write hand.coupling.motors.grip.effort",
    ),
    "unknown motor": (
        {"joints": {"left_slide": {"grip": 1.0}}, "motors": {"grab": {"effort": 1.0}}},
        "no motor is called 'grab'; there are: grip, right_slide",
    ),
    "dependent": (
        {"joints": {"left_slide": {"a": 1.0, "b": 2.0}, "right_slide": {"a": 2.0, "b": 4.0}}},
        "the motors a, b can turn together without moving any joint",
    ),
    "too many": (
        {"joints": {"left_slide": {"a": 1.0, "b": 2.0}, "right_slide": {"c": 2.0}}},
        "the motors a, b can turn together without moving any joint",
    ),
    "a joint with a row": (
        {"joints": {"left_slide": {"right_slide": 1.0}, "right_slide": {"grip": 1.0}}},
        "'left_slide' is moved by 'right_slide', a joint with a row of its own; name its motors, grip",
    ),
    "an offset alone": (
        {"joints": {"left_slide": {"right_slide": 1.0}}, "offsets": {"right_slide": 0.01}},
        "'right_slide' has no row in hand.coupling.joints",
    ),
    "no range": (
        {"joints": {"left_slide": {"right_slide": 1.0}}, "offsets": {"left_slide": 0.06}},
        "leave the motor 'right_slide' no range",
    ),
    "no range together": (
        {"joints": {"left_slide": {"a": 1.0, "b": 1.0}, "right_slide": {"a": 1.0, "b": -1.0}},
         "motors": {"a": {"effort": 1.0, "lower": 0.2}, "b": {"effort": 1.0}}},
        "no range",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", TABLES)
def test_a_table_that_cannot_be_is_refused(case: str) -> None:
    section, message = TABLES[case]
    with pytest.raises(ScenarioError) as error:
        gripper(table_of(section))
    assert message in str(error.value)
    assert "\n" not in str(error.value)
    assert error.value.key.startswith("hand.coupling")


def test_mimic_and_table_of_one_joint_are_refused() -> None:
    table = table_of({"joints": {"right_slide": {"left_slide": 1.0}}})
    with pytest.raises(ScenarioError, match="'right_slide' follows 'left_slide' by the <mimic> of the URDF already"):
        load_world(HandModel.read(GRIPPER, JAWS, coupling=table), ObjectModel.read(BOX_URDF))
    table = table_of({"joints": {"left_slide": {"right_slide": 1.0}}})
    with pytest.raises(ScenarioError, match="a joint which follows 'left_slide' itself; name that one"):
        load_world(HandModel.read(GRIPPER, JAWS, coupling=table), ObjectModel.read(BOX_URDF))


def test_wrong_keys_of_the_table_are_told() -> None:
    with pytest.raises(ScenarioError, match=r"hand.coupling.rows: .*unknown key"):
        load_scenario("gripper", {"hand.coupling": {"rows": {}, "joints": {"left_slide": {"grip": 1.0}}}})
    with pytest.raises(ScenarioError, match="no joint is coupled"):
        load_scenario("gripper", {"hand.coupling": {"joints": {}}})


def test_points_out_of_reach_are_told_with_the_nearest_ones() -> None:
    """1 cm beside what the jaws reach: the message has points with which the same scenario starts."""
    values = {"grasp.contact_points": [[-0.028, 0.0, 0.0], [0.028, 0.0, 0.0]]}
    with pytest.raises(softhand.SofthandError, match=r"10 mm beside its own; take grasp\.contact_points = ") as error:
        softhand.build(load_scenario("parallel-gripper", values))
    points = json.loads(str(error.value).split("grasp.contact_points = ")[1].rstrip("."))
    softhand.build(load_scenario("parallel-gripper", {"grasp.contact_points": points}))
    section = {"joints": {"right_slide": {"left_slide": 1.0}}, "motors": {"left_slide": {"effort": 9.0, "upper": 0.01}}}
    values = {"hand.urdf": str(REPOSITORY / "urdf" / "gripper.urdf"), "hand.coupling": section}
    with pytest.raises(softhand.SofthandError, match=r"off its face by .* mm within the joint limits"):
        softhand.build(load_scenario("parallel-gripper", values))


def test_an_object_beside_the_middle_is_told_where_it_must_be() -> None:
    with pytest.raises(softhand.SofthandError, match=r"5 mm beside; take object.position = \[0, 0, 0.07\]"):
        softhand.build(load_scenario("parallel-gripper", {"object.position": [0.005, 0.0, 0.07]}))


def test_small_motions_about_a_rest_are_those_about_the_state_of_motors() -> None:
    """A state has motors, not joints; the rest is found, taken up again, and refused for another hand."""
    rest = softhand.equilibrium("coupled-hand")
    found = softhand.stability("coupled-hand", at=rest.state)
    assert found.held_growth == pytest.approx(rest.growth, abs=1e-6) and found.held_growth < -0.1
    stiffness = softhand.grasp_stiffness("coupled-hand", joints="controller", state=rest.state)
    assert np.max(np.abs(stiffness.unbalanced)) < 1e-6
    with pytest.raises(softhand.ScenarioError, match="this plant has 8 positions"):
        softhand.stability("parallel-gripper", at=rest.state)
