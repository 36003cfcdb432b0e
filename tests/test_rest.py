"""Where an object rests by itself at a start with open fingers: on a table, on palms, on both; round ones too."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hands import write_box

import softhand
from softhand.assembly.build import build
from softhand.contact.supports import pad_on_hand, table_plane
from softhand.errors import GraspError
from softhand.model.shapes.cylinder import Cylinder
from softhand.model.shapes.ellipsoid import Ellipsoid
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of
from softhand.plant.plant import Plant
from softhand.start.rest import resting_pose
from softhand.steppers.midpoint import Midpoint
from softhand.validation.lying import cylinder_inertia, on_table
from softhand.validation.rigs import MASS, RIGHT, Body, Carriage, G, Rig, make_rig, make_world, tip

NORMAL = np.array([0.3, -0.5, 1.2]) / np.linalg.norm([0.3, -0.5, 1.2])
TABLE = table_plane(0.07, NORMAL)
UPRIGHT = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), NORMAL).toRotationMatrix()
AXES = (0.040, 0.025, 0.030)  # [m]
CAN, EGG = Cylinder(np.eye(3), np.zeros(3), 0.033, 0.05), Ellipsoid(np.eye(3), np.zeros(3), AXES)
BODY = Body(MASS, cylinder_inertia(MASS, 0.033, 0.1))
LYING = UPRIGHT @ rotation_of((0.5 * np.pi, 0.0, 0.0)) @ pin.exp3(np.array([0.0, 0.0, 0.8]))
ON_THE_SHORT_AXIS = UPRIGHT @ rotation_of((0.5 * np.pi, 0.0, 0.0))


def load_on_object(rig: Rig) -> Array:
    """What is left of the load on the object, over its weight."""
    rig.update()
    out = np.zeros(rig.plant.world.model.nv)
    rig.plant.acceleration(rig.torque, out)
    return np.asarray(out[-6:] / G)


@pytest.mark.parametrize(
    ("shape", "rotation"),
    [(CAN, UPRIGHT), (CAN, LYING), (EGG, ON_THE_SHORT_AXIS)],
    ids=["standing can", "lying can", "ellipsoid"],
)
def test_round_objects_come_to_rest(shape: Any, rotation: Array) -> None:
    """From 0.4 mm above and a little tilted: balanced, turned no further than it takes, no way along the table."""
    tilted = pin.exp3(np.array([0.006, -0.004, 0.003])) @ rotation
    rig = on_table(shape, BODY, tilted, TABLE, -G * NORMAL, depth=-4e-4)
    start = rig.position.copy()
    position, turned, stored = resting_pose(rig.plant, rig.state.q)
    assert not stored.any()
    rig.plant.world.set_object_pose(position, turned, rig.state.q)
    assert np.max(np.abs(load_on_object(rig))) < 1e-8
    moved = position - start
    assert np.linalg.norm(moved - (moved @ NORMAL) * NORMAL) < 5e-4
    assert np.linalg.norm(pin.log3(turned.T @ tilted)) < 0.02
    assert np.linalg.norm(pin.log3(turned.T @ rotation)) < 0.02


def test_an_ellipsoid_that_would_roll_over_is_refused() -> None:
    """Half-way between two axes there is no rest near by."""
    rig = on_table(EGG, BODY, UPRIGHT @ rotation_of((0.7, 0.0, 0.0)), TABLE, -G * NORMAL)
    with pytest.raises(GraspError, match="does not stand on the table"):
        resting_pose(rig.plant, rig.state.q)


def palms(places: list[tuple[float, float, float]], gravity: Array, height: float, friction: float = 0.5) -> Rig:
    """A box over balls that are fixed to the base, `height` [m] above the highest."""
    box = Body(MASS, (81.93e-6, 112.78e-6, 74.70e-6), (0.056, 0.036, 0.060))
    world = make_world([Carriage("Z", (1.0, 0.0, 0.0), mass=1.0, inertia=1.0)], box, gravity)
    supports = [
        pad_on_hand(world, f"palm {k + 1}", "base", place, 0.01, friction, 1e4, 5.0) for k, place in enumerate(places)
    ]
    return make_rig(world, [tip(world, RIGHT)], (0.0, 0.0, 0.04 + height), None, supports)


def test_a_box_lies_on_three_balls_of_a_palm() -> None:
    """Each bears what the lever asks of it; where they are of different heights the box is tilted as they are."""
    places = [(0.015, 0.010, 0.0), (-0.020, 0.004, 1e-4), (0.003, -0.012, -2e-4)]
    rig = palms(places, np.array([0.0, 0.0, -G]), 5e-4)
    position, rotation, rig.state.z[1:, :3] = resting_pose(rig.plant, rig.state.q)
    rig.plant.world.set_object_pose(position, rotation, rig.state.q)
    assert np.max(np.abs(load_on_object(rig))) < 1e-8
    forces = rig.plant.support_contacts["force"][:, 2]
    arms = rig.plant.support_contacts["point"] - position
    balance = np.linalg.solve(np.vstack([np.ones(3), arms[:, 0], arms[:, 1]]), [MASS * G, 0.0, 0.0])
    np.testing.assert_allclose(forces, balance, rtol=5e-3)  # the normals lean a little
    assert np.all(forces > 0.05)
    start = rig.state.q.copy()
    rig.run(Midpoint(step=1e-3), 0.2)
    np.testing.assert_allclose(rig.state.q, start, atol=1e-8)


def test_friction_must_hold_it_on_a_slope_of_palms() -> None:
    """Three balls in a plane that falls by 15 deg: held at mu 0.4, with all that it takes, and refused at mu 0.2."""
    slope = np.radians(15.0)
    gravity = G * np.array([np.sin(slope) * 0.6, np.sin(slope) * 0.8, -np.cos(slope)])
    for friction in (0.4, 0.2):
        rig = palms([(0.015, 0.010, 0.0), (-0.020, 0.004, 0.0), (0.003, -0.016, 0.0)], gravity, 2e-4, friction)
        if friction < np.tan(slope):
            with pytest.raises(GraspError, match="friction holds it"):
                resting_pose(rig.plant, rig.state.q)
            return
        position, rotation, rig.state.z[1:, :3] = resting_pose(rig.plant, rig.state.q)
        rig.plant.world.set_object_pose(position, rotation, rig.state.q)
        assert np.max(np.abs(load_on_object(rig))) < 1e-8
        start = rig.state.q.copy()
        rig.run(Midpoint(step=1e-3), 0.2)
        np.testing.assert_allclose(rig.state.q, start, atol=1e-8)
        forces = np.einsum(
            "kab,kb->ka", rig.plant.support_contacts["rotation"], rig.plant.support_contacts["force"][:, :3]
        )
        np.testing.assert_allclose(forces.sum(axis=0), -MASS * gravity, atol=1e-8)


def test_a_palm_under_one_end_does_not_carry() -> None:
    """The box would tip over it."""
    rig = palms([(0.020, 0.0, 0.0), (0.020, 0.010, 0.0)], np.array([0.0, 0.0, -G]), 0.0)
    with pytest.raises(GraspError, match="does not stand on the palm"):
        resting_pose(rig.plant, rig.state.q)


# -------------------------------------------------------------------------------------------------------- in a scenario

PALM = {"friction": 0.5, "radius": 0.010}
FINGERS_UP = {
    "gravity": (0.0, 0.0, -9.81),
    "table": None,
    "palm": tuple(
        {"frame": "palm", "position": (x, y, 0.142 - 0.030 - 0.010 - 2e-4), **PALM}
        for x, y in ((0.015, 0.020), (-0.015, 0.020), (0.0, 0.0))
    ),
}


def test_an_object_on_palm_pads_starts_with_open_fingers(tmp_path: Any) -> None:
    """The hand under it, no table: the scenario starts in balance, and the fingers close on it and lift it."""
    scenario = softhand.load_scenario("grasp-and-lift", FINGERS_UP)
    simulation = build(scenario)
    seen = simulation.sample()
    simulation.plant.update(simulation.state.q, simulation.state.v, simulation.state.z)
    acceleration = simulation.plant.acceleration(seen.gravity_torque.copy(), np.zeros(simulation.plant.world.model.nv))
    assert np.abs(acceleration).max() < 1e-7
    pressing = {
        support.name: contact["force"][2]
        for support, contact in zip(simulation.plant.supports, simulation.plant.support_contacts, strict=True)
    }
    assert sum(pressing[f"palm {k}"] for k in (1, 2, 3)) == pytest.approx(0.2 * 9.81, rel=1e-4)
    assert all(pressing[f"palm {k}"] > 0.1 for k in (1, 2, 3))
    recording = softhand.simulate(scenario.with_values({"duration": 0.2}))
    np.testing.assert_allclose(recording.object_position[100], recording.object_position[0], atol=1e-6)
    heavy = str(write_box(tmp_path, centre_of_mass=(0.0, 0.0, 0.004)))
    assert build(scenario.with_values({"object.urdf": heavy})).sample().object_position[2] == pytest.approx(
        0.1417, abs=1e-3
    )


def test_without_a_table_or_a_palm_it_would_fall() -> None:
    """The message says what may be added."""
    with pytest.raises(GraspError, match=r"it would fall; add a \[table\] below it, or a \[\[palm\]\]"):
        build(softhand.load_scenario("grasp-and-lift", {"table": None}))


def test_an_ellipsoid_may_stand_on_a_table() -> None:
    """As the object of a scenario: it lies on its shortest axis, and what may touch is said."""
    values = {"object.ellipsoid": (0.040, 0.036, 0.030), "table": {"height": 0.112, "friction": 0.5}}
    values |= {"grasp.contact_points": ((0.040, 0.0, 0.0), (-0.040, 0.0, 0.0), (0.0, -0.036, 0.0))}
    values |= {"grasp.opening": 0.01, "grasp.internal_force": (0.0, 0.0, 0.0), "fingertip.contact": "coulomb"}
    values |= {"reference.internal_force": (0.0, 0.0, 0.0)}
    plant: Plant = build(softhand.load_scenario("target-a", values)).plant
    assert plant.supports[0].name == "table ellipsoid"


@pytest.mark.parametrize("stiffness", [1e3, 2e4, 1e6])
@pytest.mark.parametrize("mass", [0.2, 1e-3])
def test_a_light_box_that_stands_askew(mass: float, stiffness: float) -> None:
    """It sinks less than it is askew, by 1 mrad: all corners carry it, and it does not turn about the vertical."""
    values = {"object.mass": mass, "table.stiffness": stiffness, "object.rpy": [1e-3, 0.0, 0.03]}
    simulation = build(softhand.load_scenario("grasp-and-lift", values))
    force = simulation.plant.support_contacts["force"][:, 2]
    assert force.sum() == pytest.approx(mass * 9.81, rel=1e-6)
    assert np.count_nonzero(force > 0.2 * mass * 9.81) == 4
    rotation = simulation.plant.world.object_rotation(simulation.state.q)
    assert np.linalg.norm(pin.log3(rotation_of((0.0, 0.0, 0.03)).T @ rotation)) < 1e-4


def test_a_rest_too_far_away_is_told_with_its_place() -> None:
    """On a soft table the box rests deeper than it may be off; the message has the position that would do."""
    values = {"table.stiffness": 1e3, "object.position": [0.0, 0.01, 0.1411]}
    with pytest.raises(GraspError, match=r"0\.9 mm above it .* rests 1\.39 mm and 0 deg from there") as caught:
        build(softhand.load_scenario("grasp-and-lift", values))
    assert "object.position is about" in str(caught.value) and ", 0.01, 0.14249]" in str(caught.value)
    build(softhand.load_scenario("grasp-and-lift", {**values, "object.position": [0.0, 0.01, 0.14249]}))
