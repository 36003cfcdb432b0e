"""Armature, damping, dry friction and stops of joints against what is known of a finger that touches nothing."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hands import BOX_URDF, REPOSITORY
from joint_rigs import AXES, CENTRE, GRAVITY, MASS, Finger, finger_world, inertia_about
from scipy.optimize import brentq

import softhand
from softhand.errors import ScenarioError
from softhand.model.body import ObjectModel
from softhand.model.compiled_snapshot import CompiledSnapshot
from softhand.model.hand import HandModel
from softhand.model.joint_mechanics import JointTable
from softhand.model.snapshot import Snapshot
from softhand.model.terms import RigidTerms
from softhand.model.world import World, load_world
from softhand.numerics.linear import factor
from softhand.plant.resistance import hold, resistance_of
from softhand.steppers.adaptive import Adaptive
from softhand.steppers.midpoint import Midpoint
from softhand.steppers.rk4 import RungeKutta4
from softhand.steppers.semi_implicit_euler import SemiImplicitEuler

INERTIA = inertia_about(AXES[0])  # of the one link [kg m^2]
STEPPERS = [Midpoint, SemiImplicitEuler]


def test_armature_is_inertia_of_the_joint_alone() -> None:
    """On the diagonal of M of Pinocchio and of the kernel; beside Steiner's theorem for one link."""
    armature = (("joint0", 3e-6), ("joint2", 7e-6))
    plain, rotors = Finger(3), Finger(3, armature=armature)
    for finger in (plain, rotors):
        finger.q[:] = 0.3, -0.8, 0.5
    np.testing.assert_allclose(rotors.mass() - plain.mass(), np.diag([3e-6, 0.0, 7e-6]), atol=1e-18)
    assert Finger(1, armature=2e-6).mass()[0, 0] == pytest.approx(INERTIA + 2e-6, rel=1e-12)


def test_a_pendulum_swings_slower_with_a_rotor() -> None:
    """Small swings about its rest: omega^2 = |g across the axis| m l / (I + armature)."""
    armature, axis = 1.3 * INERTIA, AXES[0] / np.linalg.norm(AXES[0])
    finger = Finger(gravity=GRAVITY, armature=armature, limits=(-50.0, 50.0))
    to_world = finger.world.model.jointPlacements[1].rotation
    a, c = to_world @ axis, to_world @ CENTRE
    across, lever = np.asarray(GRAVITY) - a * (a @ GRAVITY), c - a * (a @ c)
    omega = np.sqrt(MASS * np.linalg.norm(across) * np.linalg.norm(lever) / (INERTIA + armature))
    rest = np.arctan2(a @ np.cross(lever, across), lever @ across)
    finger.q[0] = rest + 1e-3
    q, _ = finger.run(2e-4, 10.25 * 2.0 * np.pi / omega)
    beyond = q[:, 0] - rest
    crossings = np.flatnonzero(beyond[:-1] * beyond[1:] < 0.0)
    at = crossings + beyond[crossings] / (beyond[crossings] - beyond[crossings + 1])
    assert len(at) >= 20
    assert (at[-1] - at[0]) * 2e-4 == pytest.approx((len(at) - 1) * np.pi / omega, rel=1e-5)


def test_damping_lets_a_joint_run_out() -> None:
    """v = v_0 exp(-d t / I), at the order of each stepper, and the travel with it."""
    d, v0, duration = 4e-4, 3.0, 0.05
    exact = v0 * np.exp(-d * duration / INERTIA)
    for stepper, order in ((Midpoint, 2), (SemiImplicitEuler, 1), (RungeKutta4, 4)):
        errors = []
        for step in (2e-3, 1e-3):
            finger = Finger(damping=d)
            finger.v[0] = v0
            q, v = finger.run(step, duration, stepper)
            errors.append(v[-1, 0] - exact)
            rough = 3e-2 if order > 1 else 1.1 * step * d / INERTIA
            assert q[-1, 0] == pytest.approx(INERTIA / d * (v0 - exact), rel=rough)
        assert errors[0] / errors[1] == pytest.approx(2.0**order, rel=0.12), stepper


def test_damping_of_one_joint_is_its_power() -> None:
    """Of three joints one is damped: the energy falls by the integral of d v^2, and nothing else takes any."""
    finger = Finger(3, gravity=GRAVITY, damping=(("joint1", 2e-4),))
    finger.v[:] = 2.0, -3.0, 1.5
    before, step = finger.energy(), 1e-4
    _, v = finger.run(step, 0.1)
    power = 2e-4 * v[:, 1] ** 2
    lost = step * (np.sum(power) - 0.5 * (power[0] + power[-1]))
    assert before - finger.energy() == pytest.approx(lost, rel=1e-3)
    assert lost > 1e-5


@pytest.mark.parametrize("stepper", STEPPERS)
def test_dry_friction_stops_a_joint_for_good(stepper: Any) -> None:
    """After v_0 I / f at v_0^2 I / 2 f, either way round; then it is at rest, to the last bit."""
    f, v0, step = 2e-3, 2.0, 1e-4
    for way in (1.0, -1.0):
        finger = Finger(friction=f)
        finger.v[0] = way * v0
        q, v = finger.run(step, 2.0 * v0 * INERTIA / f, stepper)
        last = int(np.flatnonzero(v[:, 0])[-1])
        assert last * step == pytest.approx(v0 * INERTIA / f, abs=1.5 * step)
        assert way * q[-1, 0] == pytest.approx(v0**2 * INERTIA / (2.0 * f), rel=2.0 * step * f / (v0 * INERTIA))
        assert np.all(v[last + 1 :] == 0.0) and np.all(q[last + 1 :] == q[-1])


@pytest.mark.parametrize("stepper", STEPPERS)
def test_a_held_joint_does_not_creep(stepper: Any) -> None:
    """Under 99.9 % of the friction nothing moves in 5,000 steps; under 110 % it goes with what is left."""
    f = 2e-3
    finger = Finger(friction=f)
    finger.q[0], finger.torque[0] = 0.37, 0.999 * f
    q, v = finger.run(1e-3, 5.0, stepper)
    assert np.all(q == 0.37) and np.all(v == 0.0)
    for way in (1.0, -1.0):
        finger.torque[0], finger.q[0], finger.v[0] = way * 1.1 * f, 0.37, 0.0
        _, v = finger.run(1e-3, 0.02, stepper)
        assert v[-1, 0] == pytest.approx(way * 0.1 * f / INERTIA * 0.02, rel=1e-9)


def test_a_joint_that_is_held_stands_like_a_rigid_link() -> None:
    """Friction holds the first of two joints: the second swings as if the first were welded; its energy is kept."""
    held, welded = Finger(2, gravity=GRAVITY, friction=(("joint0", 10.0),)), Finger(2, gravity=GRAVITY)
    for finger in (held, welded):
        finger.q[:] = 0.4, -0.3
    before = held.energy()
    data = welded.world.model.createData()
    nle = pin.nonLinearEffects(welded.world.model, data, welded.state.q, welded.state.v)
    expected = -nle[1] / welded.mass()[1, 1]
    step = 1e-4
    q, v = held.run(step, step)
    assert v[1, 1] / step == pytest.approx(expected, rel=1e-3) and abs(expected) > 10.0
    q, v = held.run(step, 0.2)
    assert np.all(q[:, 0] == 0.4) and np.all(v[:, 0] == 0.0) and np.ptp(q[:, 1]) > 0.5
    assert held.energy() == pytest.approx(before, abs=1e-6 * np.ptp(0.5 * held.mass()[1, 1] * v[:, 1] ** 2))


def test_friction_takes_what_its_torque_does() -> None:
    """All three joints rub: what is lost is f |dq| summed, to the order of the step."""
    f, lost, left = np.array([1e-3, 2e-3, 0.5e-3]), [], []
    for step in (2e-4, 1e-4):
        finger = Finger(3, gravity=GRAVITY, friction=tuple((f"joint{k}", f[k]) for k in range(3)))
        finger.v[:] = 4.0, -5.0, 6.0
        before = finger.energy()
        q, _ = finger.run(step, 0.2)
        lost.append(before - finger.energy())
        left.append(lost[-1] - float(f @ np.sum(np.abs(np.diff(q, axis=0)), axis=0)))
    assert lost[1] > 1e-3 and abs(left[1]) < 2e-3 * lost[1] and abs(left[1]) < 0.6 * abs(left[0])


def test_the_solution_of_friction_is_the_only_one() -> None:
    """Beside all 3^n guesses of which joints are held and which way the others slide, for random A."""
    rng, own = np.random.default_rng(5), resistance_of(finger_world(3, friction=1.0))
    envelope = np.zeros(9, np.int64)
    kinds = set()
    for _ in range(200):
        root = rng.normal(size=(9, 9)) * 10.0 ** rng.uniform(-1.0, 1.0, 9)
        A = root @ root.T + 0.1 * np.eye(9)
        own.friction[:] = rng.uniform(0.1, 2.0, 3) * (rng.random(3) < 0.8)
        u, weight = np.linalg.solve(A, rng.normal(size=9) * 2.0), 0.7
        G = weight * np.linalg.inv(A)[:3, :3]
        matrix, w, change = A.copy(), u.copy(), np.zeros(9)
        assert factor(matrix, envelope) < 0
        hold(own, matrix, envelope, weight, w, change)
        found = _by_guessing(G, u[:3], own.friction)
        np.testing.assert_allclose(own.dry, found, rtol=1e-8, atol=1e-8)
        np.testing.assert_allclose(w, u + weight * np.linalg.solve(A, np.append(own.dry, np.zeros(6))),
                                   rtol=1e-6, atol=1e-9 * np.abs(u).max())  # fmt: skip
        kinds.add(tuple(w[:3] == 0.0))
    assert len(kinds) == 8


def _by_guessing(G: Any, u: Any, f: Any) -> Any:
    best, least = None, np.inf
    for guess in product((-1, 0, 1), repeat=3):
        sides = np.array(guess)
        r, held = -sides * f, np.flatnonzero((sides == 0) & (f > 0.0))
        if len(held):
            r[held] = np.linalg.solve(G[np.ix_(held, held)], -(u + G @ r)[held])
        w = u + G @ r
        wrong = np.max(np.maximum(np.abs(r) - f, 0.0) / (f + 1e-12)) + np.sum(np.maximum(sides * -w * (f > 0.0), 0.0))
        if wrong < least:
            best, least = r, wrong
    assert least < 1e-9
    return best


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_joint_bounces_off_its_stop(side: float) -> None:
    """v'/chi - ln(1 + chi v')/chi^2 is the same before and after: the law of Hunt and Crossley, solved."""
    k, chi, v0 = 2.0, 0.4, 3.0
    finger = Finger(limits=(-0.2, 0.2), stop_stiffness=k, stop_damping=chi)
    finger.v[0] = side * v0
    q, v = finger.run(1e-5, 0.2)

    def potential(speed: float) -> float:
        return speed / chi - np.log1p(chi * speed) / chi**2

    expected = brentq(lambda speed: potential(-speed) - potential(v0), 1e-9, 1.0 / chi - 1e-9)
    assert np.max(side * q[:, 0]) > 0.2 and np.min(side * q[:, 0]) < 0.0
    returns = int(np.argmax(side * q[:, 0] * (side * v[:, 0] < 0.0) > 0.2)) + 1
    free = returns + int(np.argmax(side * q[returns:, 0] < 0.2))
    assert side * v[free, 0] == pytest.approx(-expected, rel=1e-4)
    assert expected < 0.7 * v0  # well below that of a spring alone
    deepest = np.sqrt(2.0 * INERTIA / k * potential(v0))
    assert np.max(side * q[:, 0]) - 0.2 == pytest.approx(deepest, rel=1e-4)


@pytest.mark.parametrize("stepper", [Midpoint, SemiImplicitEuler, RungeKutta4])
def test_a_stop_without_damping_gives_all_back(stepper: Any) -> None:
    """And takes a joint no further than sqrt(I / k) v."""
    k, v0 = 2.0, 3.0
    finger = Finger(limits=(-0.1, 0.1), stop_stiffness=k)
    finger.v[0] = v0
    q, v = finger.run(2e-5, 0.06, stepper)
    assert np.max(q) - 0.1 == pytest.approx(v0 * np.sqrt(INERTIA / k), rel=1e-3)
    assert v[-1, 0] == pytest.approx(-v0, rel=1e-3)


def test_a_stop_bears_a_load() -> None:
    """At rest the joint lies deeper by torque over stiffness; nothing is left of the bounces."""
    finger = Finger(limits=(-0.1, 0.1), stop_stiffness=5.0, stop_damping=3.0, damping=1e-4)
    finger.torque[0] = 0.05
    q, v = finger.run(1e-4, 3.0)
    assert q[-1, 0] == pytest.approx(0.1 + 0.05 / 5.0, rel=1e-6) and abs(v[-1, 0]) < 1e-6


def test_a_mirrored_finger_does_the_mirrored_thing() -> None:
    """Torques, speeds and angles with the other sign, of one joint without gravity."""
    ends = []
    for way in (1.0, -1.0):
        finger = Finger(limits=(-0.1, 0.1), stop_stiffness=5.0, stop_damping=0.3, friction=1e-3, damping=1e-4,
                        armature=1e-6)  # fmt: skip
        finger.v[0], finger.torque[0] = way * 5.0, way * 2e-3
        q, _ = finger.run(1e-3, 0.3)
        ends.append(way * q)
    np.testing.assert_allclose(ends[0], ends[1], rtol=0.0, atol=1e-12)
    assert np.max(ends[0]) > 0.1


@pytest.mark.parametrize("stepper", [RungeKutta4, Adaptive])
def test_steppers_of_smooth_accelerations_refuse_dry_friction(stepper: Any) -> None:
    """Rather than leave it out without a word."""
    with pytest.raises(ScenarioError, match=r"hand\.joints\.friction: the stepper .* does not know dry friction"):
        stepper(step=1e-3).start(Finger(friction=1e-3).plant)


def test_dynamics_of_the_urdf_are_taken_where_asked_for() -> None:
    """Both numbers of each joint; not otherwise."""
    dynamics = '<dynamics damping="0.25" friction="0.5"/>'
    free, asked = (
        finger_world(2, dynamics=dynamics, **given) for given in ({}, {"damping": "urdf", "friction": "urdf"})
    )
    assert not np.any(free.mechanics.damping) and not np.any(free.mechanics.friction)
    np.testing.assert_array_equal(asked.mechanics.damping, [0.25, 0.25])
    np.testing.assert_array_equal(asked.mechanics.friction, [0.5, 0.5])


COUPLED = REPOSITORY / "urdf" / "coupled_hand.urdf"


def coupled_world(file: Any = COUPLED, **mechanics: Any) -> World:
    """Three motors for six joints."""
    hand = HandModel.read(file, ("index_tip", "middle_tip", "thumb_tip"), mechanics=JointTable(**mechanics))
    return load_world(hand, ObjectModel.read(BOX_URDF))


def test_rotors_of_coupled_joints_are_those_of_their_motors() -> None:
    """S^T M S + armature, from Pinocchio, from the kernel and apart from a run; nothing of it on the joints."""
    plain, rotors = coupled_world(), coupled_world(armature=3e-5)
    rng = np.random.default_rng(3)
    q = np.concatenate([rng.uniform(0.1, 0.5, 3), [0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0]])
    v = rng.normal(size=9)
    expected = np.diag([3e-5] * 3 + [0.0] * 6)
    found = [world.coupled for world in (plain, rotors)]
    assert not np.any(found[0].armature)
    for kind in (Snapshot, CompiledSnapshot):
        snapshots = [kind(world) for world in (plain, rotors)]
        for snapshot in snapshots:
            snapshot.update(q, v)
        np.testing.assert_allclose(np.triu(snapshots[1].M - snapshots[0].M), expected, atol=1e-18)
        np.testing.assert_array_equal(snapshots[1].nle, snapshots[0].nle)
    terms = [RigidTerms(world.model, world.coupled).mass_matrix(q) for world in (plain, rotors)]
    np.testing.assert_allclose(terms[1] - terms[0], expected, atol=1e-18)


def test_dynamics_of_coupled_joints_are_felt_by_their_motors(tmp_path: Any) -> None:
    """Power is the same: sum of d S^2 and of f |S| over the joints that a motor moves, whatever the sign of a ratio."""
    text = COUPLED.read_text()
    file = tmp_path / "hand.urdf"
    file.write_text(text.replace("<limit ", '<dynamics damping="0.2" friction="0.3"/><limit '))
    world = coupled_world(file, damping="urdf", friction="urdf")
    S = world.coupling.S
    assert np.any(np.abs(S) != np.round(np.abs(S))) and len(S) == 6
    np.testing.assert_allclose(world.mechanics.damping, 0.2 * np.sum(S**2, axis=0), rtol=1e-12)
    np.testing.assert_allclose(world.mechanics.friction, 0.3 * np.sum(np.abs(S), axis=0), rtol=1e-12)


def test_gears_that_cannot_be_driven_back_hold_the_box_alone() -> None:
    """Motors off: above the largest holding torque, 0.43 N m, no joint moves in 0.3 s; below it the hand gives way."""
    moved = {}
    for friction in (0.3, 0.43):
        values = {"hand.joints": {"friction": friction, "armature": 1e-4}, "duration": 0.3}
        simulation = softhand.build("target-a", overrides=values)
        start = simulation.state.q[:9].copy()
        simulation.reset()
        for _ in range(300):
            simulation.step(np.zeros(9))
        moved[friction] = np.max(np.abs(simulation.state.q[:9] - start))
    assert moved[0.43] == 0.0 and moved[0.3] > 1e-3
