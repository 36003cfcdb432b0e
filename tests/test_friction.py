"""Friction with a limit: the limit surface, the return to it, and what a slipping tip remembers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hands import Task, reference_task
from scipy.integrate import quad

from softhand.assembly.build import simulate
from softhand.contact.limit import limit_surface_use, spin_length
from softhand.contact.records import PAD
from softhand.laws.conservative import Conservative
from softhand.laws.hertz import Hertz
from softhand.laws.parallel_distributed import ParallelDistributed
from softhand.numerics.spatial import rotation_of
from softhand.plant.plant import Plant
from softhand.scenario.scenario import load_scenario
from softhand.validation.rigs import BOTTOM, Body, Carriage, make_rig, make_world, tip

R = 0.010  # [m]


def pad_of(radius: float = R, **fields: float) -> np.void:
    pad = np.zeros(1, PAD)
    pad["radius"] = radius
    for name, value in fields.items():
        pad[name] = value
    return pad[0]


@pytest.mark.parametrize("depth", [1e-6, 2e-5, 4.9e-5, 5.1e-5, 1e-3, 2e-3, 3e-3, 4e-3])
def test_spin_length_is_the_mean_lever_of_the_columns(depth: float) -> None:
    """The columns of the paper's Fig. 4, dN = k_r (cos b - c) r^2 sin b db dg, press at R tan b from the middle."""
    c = 1.0 - depth / R
    top = np.arccos(c)
    force = quad(lambda b: (np.cos(b) - c) * np.sin(b), 0.0, top, epsabs=0.0, epsrel=1e-12)[0]
    moment = quad(lambda b: (np.cos(b) - c) * np.sin(b) * R * c * np.tan(b), 0.0, top, epsabs=0.0, epsrel=1e-12)[0]
    assert spin_length(pad_of(), R - depth) == pytest.approx(moment / force, rel=2e-8)


def test_spin_length_of_hertz() -> None:
    """The pressure p_0 sqrt(1 - (rho / a)^2) acts at 3 pi / 16 of the contact radius on average."""
    force = quad(lambda x: 2.0 * np.pi * x * np.sqrt(1.0 - x * x), 0.0, 1.0)[0]
    moment = quad(lambda x: 2.0 * np.pi * x * x * np.sqrt(1.0 - x * x), 0.0, 1.0)[0]
    assert Hertz.torsion_share == pytest.approx(moment / force, rel=1e-10)
    a = np.sqrt(R * 0.002)  # that of Hertz, a^2 = r dr
    assert spin_length(pad_of(torsion_share=Hertz.torsion_share), 0.008) == pytest.approx(moment / force * a, rel=1e-10)


def test_limit_surface_is_an_ellipse() -> None:
    """1 at (mu f_z, 0), at (0, mu f_z length) and on the ellipse between; a load without normal force is beyond it."""
    mu, length, pressing = 0.5, 0.003, 8.0
    for angle in np.linspace(0.0, 0.5 * np.pi, 7):
        tangential, torsion = mu * pressing * np.cos(angle), mu * pressing * length * np.sin(angle)
        force = np.array([0.6 * tangential, -0.8 * tangential, pressing, -torsion])
        assert limit_surface_use(force, mu, length) == pytest.approx(1.0, rel=1e-12)
    assert limit_surface_use(np.array([0.0, 0.0, pressing, 0.0]), mu, length) == 0.0
    assert limit_surface_use(np.array([1e-9, 0.0, 0.0, 0.0]), mu, length) == np.inf


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


@pytest.mark.parametrize("law", [None, Conservative(radius=R)], ids=["polar", "surface"])
def test_force_returns_to_the_limit_surface(law: object) -> None:
    """A stored displacement beyond the limit is cut back in proportion until the force lies on the limit surface."""
    rng = np.random.default_rng(0)
    task = slipping(law)
    size = np.array([4e-3, 4e-3, 0.5]) if law else np.array([0.4, 0.4, 0.5])
    for _ in range(20):
        z = rng.normal(size=(3, 3)) * size
        contacts = evaluated(task, z).contacts
        kept = contacts["deformation"][:, 1:] / z
        np.testing.assert_allclose(kept, kept[:, :1] * np.ones(3), rtol=1e-9)
        assert np.all(contacts["limit_surface_use"] < 1.0 + 1e-12)
        for contact, pad in zip(contacts, task.plant().pads, strict=True):
            length = spin_length(pad, contact["distance"])
            use = limit_surface_use(contact["force"], 0.5, length)
            assert use == pytest.approx(min(use, 1.0), abs=1e-12)
            np.testing.assert_allclose(
                contact["slip"] + contact["deformation"][1:], z[contact == contacts][0], rtol=1e-12, atol=1e-15
            )


@pytest.mark.parametrize("lean", [0.2, 0.5, 0.785])
def test_a_law_that_leans_returns_towards_its_force_free_point(lean: float) -> None:
    """Without shear a tip that leans already pulls beyond mu 0.15; the force still comes back along itself.

    F_t = pi E d (d tan t + 2 s) vanishes at s = -d tan t / 2, so that cutting s back to any share of its distance from
    there keeps the direction of F_t.
    """
    law, rng = ParallelDistributed(radius=R), np.random.default_rng(1)
    world = make_world([Carriage("Z")], Body(), np.zeros(3))
    turn, depth = rotation_of((0.0, lean, 0.0)), 1.5e-3
    rig = make_rig(world, [tip(world, BOTTOM, law, friction=0.15)], turn @ (0.0, 0.0, R - depth + 0.030), turn)
    slid = 0
    for stored in [np.zeros(3), *rng.normal(size=(20, 3)) * (1e-3, 1e-3, 0.1)]:
        rig.state.z[0, :3] = stored
        rig.update()
        contact = rig.contact
        lean1, lean2 = contact["lean"]
        uncut = np.array(law.force(depth, *stored, lean1, lean2, *law.parameters()))
        if limit_surface_use(uncut[[1, 2, 0, 3]], 0.15, spin_length(rig.plant.pads[0], R - depth)) <= 1.0:
            continue
        slid += 1
        assert contact["limit_surface_use"] == pytest.approx(1.0, abs=1e-12)
        back = contact["deformation_force"][1:]
        share = np.linalg.norm(back) / np.linalg.norm(uncut[1:])
        np.testing.assert_allclose(back, share * uncut[1:], rtol=1e-9, atol=1e-12)
        assert 0.0 < share < 1.0
        assert contact["slip"] @ back > 0.0
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
        return np.array([
            limit_surface_use(contact["force"], 0.5, spin_length(pad, contact["distance"]))
            for contact, pad in zip(plant.contacts, plant.pads, strict=True)
        ])  # fmt: skip

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
    """At mu = 0.5 finger 2 slips by 0.4 mm, all steppers alike, and the limit is never exceeded."""
    step = 2.5e-4 if stepper == "semi-implicit-euler" else 1e-3
    recording = simulate(
        load_scenario("target-a", {"fingertip.contact": "coulomb", "stepper": {"name": stepper, "step": step}})
    )
    assert np.max(recording.limit_surface_use) < 1.0 + 1e-12
    np.testing.assert_allclose(recording.slip_travel[-1, [0, 2]], 0.0, atol=1e-9)
    assert recording.slip_travel[-1, 1] == pytest.approx(0.424e-3, rel=0.02)
    assert np.all(np.diff(recording.slip_loss, axis=0) >= 0.0)
    assert np.array_equal(np.any(recording.is_slipping, axis=0), [False, True, False])
