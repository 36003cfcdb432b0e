"""Friction with a limit: what a slipping tip remembers, and what it does to the reference grasp."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hands import Task, reference_task

from softhand.assembly.build import build, simulate
from softhand.contact.limit import limit_use
from softhand.contact.records import COLUMNS, ELLIPSE
from softhand.errors import ScenarioError
from softhand.laws.parallel_distributed import ParallelDistributed
from softhand.numerics.spatial import rotation_of
from softhand.plant.plant import Plant
from softhand.scenario.scenario import load_scenario
from softhand.validation.rigs import BOTTOM, Body, Carriage, make_rig, make_world, tip

R = 0.010  # [m]


def slipping(law: object = None, **fields: object) -> Task:
    """The reference grasp with tips that can slip."""
    task = reference_task()
    tips = tuple(
        replace(tip, can_slip=True, law=law or tip.law, **fields)  # type: ignore[arg-type]
        for tip in task.fingertips
    )
    return replace(task, fingertips=tips)


def evaluated(task: Task, z: np.ndarray) -> Plant:
    plant, state = task.plant(), task.grasp.state
    memory = np.zeros((len(z), plant.n_memory))
    memory[:, :3] = z
    plant.update(state.q, state.v, memory)
    return plant


@pytest.mark.parametrize("lean", [0.2, 0.5, 0.785])
def test_a_law_that_leans_slips_along_its_force(lean: float) -> None:
    """Without shear a tip that leans already pulls beyond mu 0.15, and slips; F_t = pi E d (d tan t + 2 s).

    The law is isotropic, so that without torsion the force comes back along itself, though the stored shear grows.
    """
    law, rng = ParallelDistributed(radius=R), np.random.default_rng(1)
    world = make_world([Carriage("Z")], Body(), np.zeros(3))
    turn, depth = rotation_of((0.0, lean, 0.0)), 1.5e-3
    rig = make_rig(world, [tip(world, BOTTOM, law, friction=0.15)], turn @ (0.0, 0.0, R - depth + 0.030), turn)
    slid = 0
    for stored in [np.zeros(3), *rng.normal(size=(20, 3)) * (1e-3, 1e-3, 0.0)]:
        rig.state.z[0, :3] = stored
        rig.update()
        contact = rig.contact
        uncut = np.array(law.force(depth, *stored, *contact["lean"], *law.parameters()))
        if np.hypot(*uncut[1:3]) <= 0.15 * uncut[0]:
            continue
        slid += 1
        back = contact["deformation_force"]
        assert np.hypot(*back[1:3]) == pytest.approx(0.15 * back[0], rel=1e-12)
        share = np.hypot(*back[1:3]) / np.hypot(*uncut[1:3])
        np.testing.assert_allclose(back[1:3], share * uncut[1:3], rtol=1e-9, atol=1e-12)
        assert 0.0 < share < 1.0
        assert contact["slip"][:2] @ back[1:3] > 0.0
    assert slid >= 10


def test_a_displacement_within_the_limit_stays() -> None:
    """Below the limit nothing is touched: stick stores and gives back exactly."""
    task = slipping()
    z = task.grasp.state.z[:, :3]
    contacts = evaluated(task, z).contacts
    np.testing.assert_array_equal(contacts["deformation"][:, 1:], z)
    assert not np.any(contacts["slip"])


def test_a_tip_that_does_not_touch_forgets() -> None:
    """Lifted off, a tip has neither force nor memory."""
    task = slipping()
    plant, state = task.plant(), task.grasp.state.copy()
    state.q[-7] += 0.02  # the box away from finger 1, which pressed from +x ... and into finger 2
    plant.update(state.q, state.v, state.z)
    away = plant.contacts["deformation"][:, 0] < 0.0
    assert np.any(away)
    plant.note_slip(state.z)
    assert not np.any(plant.contacts["force"][away])
    assert not np.any(state.z[away, :3])


def test_slip_loss_is_force_times_slip() -> None:
    """What is noted as lost is the force on the limit surface times what was cut off, and it is not counted twice."""
    task = slipping()
    state = task.grasp.state.copy()
    state.z[:, :3] += [0.0, 0.3, 0.4]
    plant = task.plant()
    plant.update(state.q, state.v, state.z)
    expected = np.einsum("ik,ik->i", plant.contacts["deformation_force"][:, 1:], plant.contacts["slip"])
    plant.contacts["force_before"] = plant.contacts["deformation_force"][:, 1:]  # as if it had slipped already
    plant.note_slip(state.z)
    np.testing.assert_allclose(plant.contacts["slip_loss"], expected, rtol=1e-14)
    assert np.all(expected > 0.0)
    plant.update(state.q, state.v, state.z)
    plant.note_slip(state.z)
    np.testing.assert_allclose(plant.contacts["slip_loss"], expected, rtol=1e-11)


def test_static_friction_holds_longer_and_drops() -> None:
    """Slip begins at the static coefficient, then the force is that of the kinetic one, until the tip sticks again."""
    task = slipping(static_friction=0.7)
    plant, state = task.plant(), task.grasp.state.copy()
    memory = np.zeros((3, plant.n_memory))
    memory[:, :3] = state.z[:, :3]
    assert plant.n_memory == state.z.shape[1] + 1

    def use(stored: np.ndarray) -> np.ndarray:
        plant.update(state.q, state.v, stored)
        plant.note_slip(stored)
        found = []
        for contact in plant.contacts:
            s = tuple(contact["force"][[0, 1, 3]] / (1.0, 1.0, contact["lever"]))
            found.append(limit_use(contact, s, 0.5 * contact["force"][2]))
        return np.array(found)

    below, above = memory.copy(), memory.copy()
    below[:, :3] *= (1.25 / use(memory.copy()))[:, None]
    above[:, :3] *= 5.0
    assert np.all((use(below) > 1.0) & (use(below) < 1.4))  # held, though beyond the kinetic limit
    np.testing.assert_allclose(use(above), 1.0, rtol=1e-11)
    assert np.all(above[:, -1] == 1.0)
    again = above.copy()
    again[:, :3] *= 1.2
    np.testing.assert_allclose(use(again), 1.0, rtol=1e-11)  # it goes on at the kinetic one
    again[:, :3] *= 0.5
    use(again)
    assert np.all(again[:, -1] == 0.0)


def test_enough_friction_changes_nothing() -> None:
    """At mu = 0.6 target A stays inside the coupled limit, and is the same as with rolling contact."""
    rolling, coulomb = (
        simulate(load_scenario("target-a", {"fingertip.friction": 0.6, "fingertip.contact": contact, "duration": 1.2}))
        for contact in ("rolling", "coulomb")
    )
    assert np.max(coulomb.limit_surface_use) < 1.0
    assert np.max(np.abs(coulomb.object_position - rolling.object_position)) < 1e-12
    assert np.max(np.abs(coulomb.joint_torque - rolling.joint_torque)) < 1e-10
    assert np.max(coulomb.slip_travel) == 0.0


@pytest.mark.parametrize("stepper", ["midpoint", "rk4", "adaptive", "semi-implicit-euler"])
def test_little_friction_slips_a_little(stepper: str) -> None:
    """At mu = 0.5 finger 2 slips by 0.5 mm, all steppers alike, and the limit is never exceeded."""
    step = 2.5e-4 if stepper == "semi-implicit-euler" else 1e-3
    recording = simulate(
        load_scenario("target-a", {"fingertip.contact": "coulomb", "stepper": {"name": stepper, "step": step}})
    )
    assert np.max(recording.limit_surface_use) < 1.0 + 1e-12
    np.testing.assert_allclose(recording.slip_travel[-1, [0, 2]], 0.0, atol=1e-9)
    assert recording.slip_travel[-1, 1] == pytest.approx(0.527e-3, rel=0.01)
    assert np.all(np.diff(recording.slip_loss, axis=0) >= 0.0)
    assert np.array_equal(np.any(recording.is_slipping, axis=0), [False, True, False])


@pytest.mark.parametrize(("limit", "travel", "loss"), [("ellipse", 0.423e-3, 1.06e-3), ("exact", 0.476e-3, 1.196e-3)])
def test_the_limit_is_chosen_in_the_scenario(limit: str, travel: float, loss: float) -> None:
    """Target B slips by 0.42 mm on the ellipse, and by 0.48 mm on the exact limit, which lies inside it."""
    recording = simulate(load_scenario("target-b", {"fingertip.contact": "coulomb", "fingertip.limit": limit}))
    assert recording.slip_travel[-1, 0] == pytest.approx(travel, rel=0.01)
    assert recording.slip_loss[-1, 0] == pytest.approx(loss, rel=0.01)
    assert np.max(recording.limit_surface_use) < 1.0 + 1e-12


def test_the_limit_may_differ_from_tip_to_tip() -> None:
    """A tip has the limit of its own table; `exact` is the default."""
    tips = {"fingertip.tips": {"finger_2_tip": {"limit": "ellipse"}}}
    found = build(load_scenario("target-a", {"fingertip.contact": "coulomb", **tips})).plant.pads["limit"]
    assert found.tolist() == [COLUMNS, ELLIPSE, COLUMNS]
    with pytest.raises(ScenarioError, match="limit"):
        build(load_scenario("target-a", {"fingertip.limit": "circle"}))
