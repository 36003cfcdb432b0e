"""Tips against the box as a solid: faces, edges and vertices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hands import Task, reference_task
from scipy.optimize import lsq_linear

from softhand.assembly.build import build
from softhand.errors import SimulationStopped
from softhand.laws.radial import Radial
from softhand.model.shapes.box import Box
from softhand.numerics.spatial import rotation_of
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.scenario.scenario import load_scenario, with_law

R = 0.010  # [m]
TILTED = Box(rotation_of((0.3, -0.4, 0.7)), np.array([0.002, -0.003, 0.004]), np.array([0.028, 0.018, 0.030]))


def task_with(box: Box | None = None) -> Task:
    """The reference hand with surface tips that can slip, and the object as another box."""
    task = reference_task()
    tips = tuple(replace(tip, can_slip=True, law=Radial(radius=R)) for tip in task.fingertips)
    world = replace(task.world, shape=box or task.world.shape)
    return replace(task, world=world, fingertips=tips)


def placed(plant: Plant, tip_in_object: np.ndarray, rng: np.random.Generator) -> State:
    """A state in which tip 0 is at that point of the object frame, turned and moving at random."""
    model = plant.world.model
    q, v = np.zeros(model.nq), rng.normal(size=model.nv)
    q[: plant.world.n_joints] = rng.normal(size=plant.world.n_joints)
    rotation = rotation_of(rng.normal(size=3))
    q[-4:] = pin.Quaternion(rotation).coeffs()
    state = State(q, v, np.zeros((plant.world.n_tips, plant.n_memory)))
    plant.update(q, v, state.z)
    state.q[-7:-4] = plant.contacts["tip"][0] - rotation @ tip_in_object
    return state


def nearest(box: Box, point: np.ndarray) -> np.ndarray:
    """The nearest point of a box, by bounded least squares."""
    found = lsq_linear(np.eye(3), box.rotation.T @ (point - box.centre), bounds=(-box.half, box.half), tol=1e-15)
    return box.centre + box.rotation @ found.x


@pytest.mark.parametrize("box", [None, TILTED], ids=["upright", "tilted"])
@pytest.mark.parametrize("outside", [(1, 0, 0), (0, -1, 0), (1, 1, 0), (0, -1, 1), (-1, 1, 1), (1, -1, -1)])
def test_the_contact_is_the_nearest_point(outside: tuple[int, int, int], box: Box | None) -> None:
    """Over a face, an edge or a vertex: point, distance and normal are those of the nearest point of the box."""
    rng = np.random.default_rng(1)
    task = task_with(box)
    plant, solid = task.plant(), task.world.shape
    for _ in range(5):
        local = np.where(outside, np.multiply(outside, solid.half + rng.uniform(1e-3, 9e-3, 3)),
                         rng.uniform(-0.9, 0.9, 3) * solid.half)  # fmt: skip
        point = solid.centre + solid.rotation @ local
        state = placed(plant, point, rng)
        plant.update(state.q, state.v, state.z)
        contact, close = plant.contacts[0], nearest(solid, point)
        away = point - close
        assert contact["distance"] == pytest.approx(np.linalg.norm(away), rel=1e-9)
        np.testing.assert_allclose(contact["normal"], away / np.linalg.norm(away), atol=1e-9)
        assert contact["feature"] == np.count_nonzero(outside)
        np.testing.assert_allclose(contact["rotation"] @ contact["rotation"].T, np.eye(3), atol=1e-12)
        assert np.linalg.det(contact["rotation"]) == pytest.approx(1.0)


@pytest.mark.parametrize("outside", [(1, 0, 0), (1, 1, 0), (-1, 1, 1)])
def test_the_depth_changes_with_the_normal_velocity(outside: tuple[int, int, int]) -> None:
    """d R / dt = -v_z on faces, edges and vertices, by finite differences: the normal force has an energy."""
    rng = np.random.default_rng(2)
    task = task_with(TILTED)
    plant, solid, model = task.plant(), task.world.shape, task.world.model
    for _ in range(5):
        local = np.where(outside, np.multiply(outside, solid.half + rng.uniform(2e-3, 8e-3, 3)),
                         rng.uniform(-0.8, 0.8, 3) * solid.half)  # fmt: skip
        state = placed(plant, solid.centre + solid.rotation @ local, rng)
        distances = []
        for time in (-1e-6, 1e-6):
            plant.update(pin.integrate(model, state.q, time * state.v), state.v, state.z)
            distances.append(float(plant.contacts["distance"][0]))
        plant.update(state.q, state.v, state.z)
        rate = (distances[1] - distances[0]) / 2e-6
        assert rate == pytest.approx(-plant.contacts["velocity"][0, 2], rel=1e-6)


def test_the_force_is_continuous_over_an_edge() -> None:
    """A tip that moves over an edge in steps of a micrometre meets no jump of its force, and the normal turns."""
    rng = np.random.default_rng(3)
    task = task_with()
    plant, half = task.plant(), task.world.shape.half
    forces, normals = [], []
    base = placed(plant, np.array([half[0] + 0.007, 0.0, half[2] - 0.002]), rng)
    rotation = None
    for k in range(6000):
        z = half[2] - 0.002 + 1e-6 * k
        state = State(base.q.copy(), 0.0 * base.v, base.z)
        if rotation is None:
            rotation = pin.Quaternion(base.q[-4:]).matrix()
        state.q[-7:-4] += rotation @ np.array([0.0, 0.0, half[2] - 0.002 - z])
        plant.update(state.q, state.v, state.z)
        forces.append(plant.contacts["rotation"][0] @ plant.contacts["force"][0, :3])
        normals.append(plant.contacts["normal"][0].copy())
    assert np.max(np.abs(np.diff(forces, axis=0))) < 2e-2  # of 10 N
    assert normals[0][2] == 0.0 and normals[-1][2] > 0.4


@pytest.mark.parametrize("law", ["nakashima", "conservative"])
def test_a_released_box_falls(law: str) -> None:
    """Opened fingers let go: no contact force is left and the box falls with g."""
    scenario = load_scenario("target-a", {"fingertip.contact": "coulomb"})
    simulation = build(scenario if law == "nakashima" else with_law(scenario, law))
    simulation.reset()
    speeds = []
    try:
        for k in range(120):
            seen = simulation.sample()
            if k >= 5:
                opening = np.tile([0.0, -0.1, -0.1], 3)
                simulation.torque[:] = seen.N_F - 0.02 * seen.joint_velocity + opening
            simulation.step()
            speeds.append(float(seen.object_twist[2]))
    except SimulationStopped as stop:
        pytest.fail(str(stop))
    assert not np.any(seen.contact_force)
    np.testing.assert_allclose(np.diff(speeds[-40:]), -9.81e-3, rtol=1e-6)
