"""Bodies that stand still: the force on the object against energy, statics by hand, and friction as it should be."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import softhand
from softhand.checks.scenario import _touch_rows
from softhand.contact.obstacles import Obstacle, object_on_obstacle
from softhand.derivatives.following import solvers_of
from softhand.model.shapes.box import Box
from softhand.model.shapes.cylinder import Cylinder
from softhand.model.shapes.ellipsoid import Ellipsoid
from softhand.model.shapes.mesh import as_polyhedron
from softhand.model.shapes.mesh_file import Mesh
from softhand.model.shapes.polyhedron import Polyhedron
from softhand.model.shapes.shape import CurvedShape, Shape
from softhand.model.shapes.sphere import Sphere
from softhand.numerics.layouts import Layouts
from softhand.steppers.midpoint import Midpoint
from softhand.steppers.rk4 import RungeKutta4
from softhand.validation.rigs import MU, RIGHT, Body, Carriage, G, Rig, make_rig, make_world, tip
from softhand.viewer.scene.recorded import RecordedScene

Array = np.ndarray
MASS = 0.2  # [kg]
SIZE = (0.056, 0.036, 0.060)  # [m]
INERTIA = (81.93e-6, 112.78e-6, 74.70e-6)  # [kg m^2]
K, C = 2e4, 10.0  # [N/m], [N s/m]


def turn(*rpy: float) -> Array:
    return pin.rpy.rpyToMatrix(*rpy)


def box(size: tuple[float, ...] = SIZE, at: tuple[float, ...] = (0, 0, 0), rpy: tuple[float, ...] = (0, 0, 0)) -> Box:
    return Box(turn(*rpy), np.array(at), 0.5 * np.array(size))


def wedge(at: tuple[float, ...] = (0.0, 0.0, 0.0), rpy: tuple[float, ...] = (0, 0, 0)) -> Polyhedron:
    points = np.array([[-1, -1, -1], [1, -1, -1], [-1, 1, -1], [1, 1, -1], [-0.2, -1, 0.8], [-0.2, 0.6, 0.8]]) * 0.03
    return as_polyhedron(Mesh(points, np.zeros((0, 3), np.int64), "wedge"), turn(*rpy), np.array(at), True)


def among(
    obstacles: list[Shape],
    position: tuple[float, ...],
    rotation: Array | None = None,
    shape: Shape | None = None,
    gravity: tuple[float, ...] = (0.0, 0.0, -G),
    damping: float = 0.0,
    friction: float = MU,
) -> Rig:
    """A free body among obstacles; a tip is far away."""
    away = Carriage("y", (5.0, 0.0, 1.0), mass=1.0, inertia=1.0)
    world = make_world([away], Body(MASS, INERTIA, SIZE), gravity)
    far = tip(world, RIGHT)
    if shape is not None:
        world = replace(world, shape=shape)
    found = [Obstacle(f"wall {k}", other, friction, K, damping) for k, other in enumerate(obstacles)]
    supports = [support for other in found for support in object_on_obstacle(world, other)]
    return make_rig(world, [far], position, rotation, supports)


def touching(rig: Rig) -> list[str]:
    rig.update()
    return [name for name, own in zip(rig.plant.contact_names[1:], rig.plant.support_contacts, strict=True)
            if own["force"][2] > 0.0]  # fmt: skip


def stored(rig: Rig) -> float:
    """By depth, of all springs [J]; where an edge dips into a round body, by its greatest depth along the edge."""
    rig.update()
    total, q, world = 0.0, rig.state.q, rig.plant.world
    for support, own in zip(rig.plant.supports, rig.plant.support_contacts, strict=True):
        depth, shape = max(own["deformation"][0], 0.0), support.shape
        if support.edge and isinstance(shape, CurvedShape) and depth > 0.0:
            place = own["tip"]
            if support.base:
                place = world.object_rotation(q).T @ (place - world.object_position(q))
            depth = -shape.near(place)[6]
        total += 0.5 * support.law.c * depth**2
    return total


def moved(rig: Rig, q: Array, twist: Array) -> Rig:
    """The same with the object moved from q by a small step in its own axes."""
    v = np.zeros(rig.plant.world.nv)
    v[-6:] = twist
    rig.state.q[:] = pin.integrate(rig.plant.world.model, q, v)
    return rig


SHAPES: dict[str, Shape] = {
    "box": box(),
    "wedge": wedge(),
    "ball": Sphere(np.eye(3), np.zeros(3), 0.03),
    "can": Cylinder(turn(0.3, 0.2, 0.1), np.array([0.003, -0.002, 0.001]), 0.028, 0.035),
    "egg": Ellipsoid(turn(0.1, 0.2, 0.3), np.zeros(3), (0.03, 0.02, 0.04)),
}
WALLS: dict[str, Shape] = {
    "block": box((0.2, 0.15, 0.1), (0.02, 0.01, -0.05), (0.1, 0.2, 0.3)),
    "stick": box((0.01, 0.2, 0.01), (0.005, 0.0, -0.005), (0.1, 0.5, 0.2)),
    "wedge": wedge((0.01, -0.01, 0.0), (0.2, -0.1, 0.4)),
    "ball": Sphere(np.eye(3), np.array([0.01, 0.0, -0.02]), 0.02),
    "post": Cylinder(turn(1.2, 0.1, 0.0), np.array([0.0, 0.0, -0.02]), 0.02, 0.05),
}
PAIRS = [(a, b) for a in SHAPES for b in WALLS if not (a in ("can", "egg") and b == "post")]


@pytest.mark.parametrize(("shape", "wall"), PAIRS)
def test_force_is_the_slope_of_the_energy(shape: str, wall: str) -> None:
    """In six directions, at many poses about 0.2 mm deep: direction, place and size of all forces at once."""
    rng, h, counted = np.random.default_rng(3), 1e-7, 0
    rig = among([WALLS[wall]], (0.0, 0.0, 0.0), shape=SHAPES[shape])
    for _ in range(25):
        way, rotation = rng.normal(size=3), turn(*rng.normal(size=3))
        place = just_inside(rig, way / np.linalg.norm(way), rotation)
        rig.plant.world.set_object_pose(place, rotation, rig.state.q)
        here, q = stored(rig), rig.state.q.copy()
        force = rig.contact_forces()[-6:]
        slope, bend = np.zeros(6), 0.0
        for k, twist in enumerate(h * np.eye(6)):
            up, down = (stored(moved(rig, q, side * twist)) for side in (1.0, -1.0))
            slope[k], bend = (up - down) / (2.0 * h), max(bend, abs(up - 2.0 * here + down) / h)
        if bend > 0.02 or here == 0.0:  # [N] a kink of the energy lies between
            continue
        counted += 1
        off = np.abs(force + slope) / np.linalg.norm(force)
        assert np.max(off) < 1e-6, (touching(rig), off)
    assert counted > 10


def just_inside(rig: Rig, way: Array, rotation: Array) -> Array:
    """A position 0.2 mm farther in than where the two first touch, coming along a way."""
    low, high = 0.0, 0.4
    for _ in range(30):
        middle = 0.5 * (low + high)
        rig.plant.world.set_object_pose(middle * way, rotation, rig.state.q)
        low, high = (middle, high) if touching(rig) else (low, middle)
    return (low - 2e-4) * way


def forces(rig: Rig) -> dict[str, Array]:
    """Of each obstacle on the object, in the world [N], shape (3,)."""
    rig.update()
    total: dict[str, Array] = {}
    for support, own in zip(rig.plant.supports, rig.plant.support_contacts, strict=True):
        side = -1.0 if support.joint else 1.0
        total[support.of] = total.get(support.of, np.zeros(3)) + side * own["rotation"] @ own["force"][:3]
    return total


LONG, THICK = 0.3, 0.01  # [m] of the plank below


def plank() -> Box:
    return box((THICK, 0.1, LONG))


@pytest.mark.parametrize("yaw", [0.0, 0.7])
def test_plank_leans_on_a_wall(yaw: float) -> None:
    """By moments about its foot the smooth wall bears m g tan(lean) / 2, but for the thickness of the plank."""
    lean, z = 0.3, turn(0.0, 0.0, yaw)
    floor = box((2.0, 2.0, 0.2), (0.0, 0.0, -0.1), (0.0, 0.0, 0.4))
    centre = np.array([0.5 * LONG * math.sin(lean) - 0.5 * THICK * math.cos(lean), 0.0, 0.0])
    top = centre[0] + 0.5 * LONG * math.sin(lean) + 0.5 * THICK * math.cos(lean)
    wall = replace(box((0.1, 1.0, 1.0)), rotation=z, centre=z @ [top + 0.05, 0.0, 0.5])
    centre[2] = 0.5 * LONG * math.cos(lean) + 0.5 * THICK * math.sin(lean)
    rig = among([floor, wall], tuple(z @ centre), z @ turn(0.0, lean, 0.0), plank(), damping=C, friction=0.9)
    smooth = [replace(s, friction=1e-9) if s.of == "wall 1" else s for s in rig.plant.supports]
    rig = make_rig(rig.plant.world, rig.plant.fingertips, z @ centre, z @ turn(0.0, lean, 0.0), smooth)
    rig.run(Midpoint(step=1e-3), 1.0)
    told = forces(rig)
    arm_of_weight = 0.5 * LONG * math.sin(lean) - 0.5 * THICK * math.cos(lean)
    arm_of_wall = LONG * math.cos(lean)
    expected = MASS * G * arm_of_weight / arm_of_wall
    np.testing.assert_allclose(z.T @ told["wall 1"], [-expected, 0.0, 0.0], atol=5e-3 * expected)
    np.testing.assert_allclose(z.T @ told["wall 0"], [expected, 0.0, MASS * G], atol=5e-3 * expected)
    assert np.linalg.norm(rig.velocity) < 1e-4


def test_slides_along_a_wall_against_friction() -> None:
    """Pressed on a wall by one part of the weight and drawn along it by another: a = g_along - mu g_across."""
    along, across, mu = 7.0, 5.0, 0.4
    wall = box((0.1, 2.0, 2.0), (0.05 + 0.5 * SIZE[0] - MASS * across / (4.0 * K), 0.0, 0.0))
    rig = among([wall], (0.0, 0.0, 0.0), None, None, (across, 0.6 * along, -0.8 * along), damping=C, friction=mu)
    rig.run(Midpoint(step=5e-4), 0.2)
    speed = (along - mu * across) * 0.2
    way = np.array([0.0, 0.6, -0.8])
    np.testing.assert_allclose((rig.position - [rig.position[0], 0.0, 0.0]) @ way, 0.1 * speed, rtol=2e-2)
    held = among([wall], (0.0, 0.0, 0.0), None, None, (across, 0.6, -0.8), damping=C, friction=mu)
    held.run(Midpoint(step=5e-4), 0.2)
    assert np.linalg.norm(held.position[1:]) < 2e-4


def drop(frame: Array, mirrored: bool = False) -> Rig:
    """A tilted box that falls into a slot beside a stick, all of it in another frame or in a mirror, y for -y."""
    flip = np.diag([1.0, -1.0, 1.0]) if mirrored else np.eye(3)
    walls = []
    for wall in (box((0.1, 0.3, 0.05), (0.079, 0.02, 0.0)), box((0.1, 0.3, 0.05), (-0.079, 0.0, 0.0)),
                 box((0.2, 0.01, 0.01), (0.0, 0.012, -0.01), (0.0, 0.0, 0.3))):  # fmt: skip
        walls.append(replace(wall, rotation=frame @ flip @ wall.rotation @ flip, centre=frame @ flip @ wall.centre))
    gravity = tuple(frame @ [0.0, 0.0, -G])
    rotation = frame @ flip @ turn(0.1, 0.25, 0.4) @ flip
    rig = among(walls, tuple(frame @ flip @ [0.002, 0.003, 0.07]), rotation, None, gravity, damping=C, friction=0.3)
    rig.run(Midpoint(step=1e-3), 0.25)
    return rig


def test_turned_and_mirrored_scenes_move_alike() -> None:
    plain, frame, flip = drop(np.eye(3)), turn(0.5, -0.8, 1.1), np.diag([1.0, -1.0, 1.0])
    assert sum(1 for force in forces(plain).values() if np.linalg.norm(force) > 0.1) >= 2
    turned, mirrored = drop(frame), drop(np.eye(3), mirrored=True)
    world = plain.plant.world
    R = np.array(world.object_rotation(plain.state.q))
    np.testing.assert_allclose(turned.position, frame @ plain.position, atol=1e-8)
    np.testing.assert_allclose(world.object_rotation(turned.state.q), frame @ R, atol=1e-6)
    np.testing.assert_allclose(mirrored.position, flip @ plain.position, atol=1e-8)
    np.testing.assert_allclose(world.object_rotation(mirrored.state.q), flip @ R @ flip, atol=1e-6)


@pytest.mark.parametrize("index", [1, 7])
def test_nothing_is_lost_without_damping_and_friction(index: int) -> None:
    """A box that falls on a beam and tumbles over it, on edges and corners, about 1 mm deep."""
    rng = np.random.default_rng(1)
    for _ in range(index + 1):
        rotation, x = turn(*rng.normal(size=3)), rng.uniform(-0.02, 0.02)
    rig = among([box((0.03, 0.3, 0.03), (0.0, 0.0, -0.02), (0.0, 0.6, 0.1))], (x, 0.0, 0.0), rotation, friction=1e-9)
    low, high = 0.0, 0.1
    for _ in range(20):
        middle = 0.5 * (low + high)
        rig.plant.world.set_object_pose((x, 0.0, middle), rotation, rig.state.q)
        low, high = (middle, high) if touching(rig) else (low, middle)
    rig.plant.world.set_object_pose((x, 0.0, high + 2e-3), rotation, rig.state.q)
    start, kinds, count = rig.energy(), set(), 0
    stepper = RungeKutta4(step=5e-5).start(rig.plant)
    for count in range(2000):
        stepper.advance(rig.state, rig.torque)
        if count % 20 == 0:
            kinds |= {name.split()[2] for name in touching(rig)}
    assert kinds == {"corner", "edge"}
    assert abs(rig.energy() - start) < 5e-6


@pytest.mark.parametrize("rpy", [(0.0, 0.0, 0.0), (0.03, 0.05, 0.2)])
def test_box_stands_in_a_hole(rpy: tuple[float, float, float]) -> None:
    """Four walls and a floor: a box that is let go above a hole 2 mm too wide comes to stand on the floor of it."""
    a, b, t = 0.5 * SIZE[0] + 1e-3, 0.5 * SIZE[1] + 1e-3, 0.04
    hole: list[Shape] = [box((t, 0.2, 0.04), (side * (a + 0.5 * t), 0.0, 0.02)) for side in (1.0, -1.0)]
    hole += [box((2.0 * a, t, 0.04), (0.0, side * (b + 0.5 * t), 0.02)) for side in (1.0, -1.0)]
    hole.append(box((0.2, 0.2, 0.02), (0.0, 0.0, -0.01)))
    rig = among(hole, (3e-4, -2e-4, 0.5 * SIZE[2] + 0.045), turn(0.0, 0.0, 0.02 * rpy[2]) @ turn(*rpy[:2], 0.0), None,
                damping=C, friction=0.1)  # fmt: skip
    rig.run(Midpoint(step=5e-4), 1.5)
    assert rig.position[2] == pytest.approx(0.5 * SIZE[2] - MASS * G / (4.0 * K), abs=2e-5)
    assert np.linalg.norm(rig.velocity[:3]) < 1e-3


def test_wedge_rests_between_two_edges() -> None:
    """A box on its edge in a gap that is narrower: the edges of both walls bear it at 45 deg, m g / sqrt(2) each."""
    gap, side = 0.03, 0.04
    walls = [box((0.1, 0.1, 0.05), (s * (0.5 * gap + 0.05), 0.0, -0.025)) for s in (1.0, -1.0)]
    height = 0.5 * math.sqrt(2.0) * side - 0.5 * gap
    rig = among(walls, (0.0, 0.0, height), turn(0.0, 0.25 * math.pi, 0.0), box((side, 0.06, side)), damping=C,
                friction=1e-9)  # fmt: skip
    rig.run(Midpoint(step=1e-3), 0.6)
    told = forces(rig)
    for name, sign in (("wall 0", -1.0), ("wall 1", 1.0)):
        np.testing.assert_allclose(told[name], [sign * 0.5 * MASS * G, 0.0, 0.5 * MASS * G], atol=2e-3)
    assert all("edge" in name for name in touching(rig))
    assert len(touching(rig)) == 8


def slot(**changes: object) -> softhand.Scenario:
    return softhand.load_scenario("insertion", changes)


@pytest.mark.slow
def test_insertion_in_both_loops_and_gone_on_with() -> None:
    """The walls turn the box and push it over; a run saved in touch goes on to the last bit; rollouts do the same."""
    scenario = slot(**{"duration": 2.0, "record.every": 0.01})
    recording = softhand.simulate(scenario)
    names = recording.labels["support"]
    force = recording.support_force[:, :, 2].max(axis=0)
    assert max(force[k] for k, name in enumerate(names) if name.startswith("right wall")) > 0.3
    assert abs(recording.object_position[-1, 0]) < 6e-4  # asked for 2 mm, let by the slot within 0.5 mm
    assert recording.object_position[-1, 2] > 0.158
    runs = softhand.rollout(scenario, {"object.mass": [0.2]}, variables=("object_position", "support_force"))
    assert runs.compiled.all()
    np.testing.assert_allclose(runs.object_position[0], recording.object_position, atol=1e-9)
    np.testing.assert_allclose(runs.support_force[0], recording.support_force, atol=1e-5)
    simulation = softhand.build(scenario)
    simulation.reset()
    while simulation.time < 1.6:
        simulation.sample()
        simulation.step()
    saved = simulation.save()
    ends = []
    for _ in range(2):
        simulation.reset(saved)
        while simulation.time < 1.7:
            simulation.sample()
            simulation.step()
        ends.append(simulation.state.q.copy())
    np.testing.assert_array_equal(*ends)


def test_links_collide_with_obstacles_and_the_picture_has_them() -> None:
    wall = {"shape": "box", "size": [0.05, 0.3, 0.3], "position": [0.09, 0.0, 0.1], "friction": 0.5}
    found = softhand.collisions(softhand.load_scenario("pinch", {"obstacle": [wall]}), shapes="visual")
    assert "obstacle 1" in {one.other for one in found.found}
    recording = softhand.simulate(slot(duration=0.01))
    items = {item.name for item in RecordedScene(recording).items}
    assert {"obstacles/left wall", "obstacles/right wall edges"} <= items
    assert dict(_touch_rows(softhand.build("insertion").plant))["left wall"] == "meets the object at 42 places"


def test_derivatives_refuse_obstacles() -> None:
    plant = softhand.build("insertion").plant
    with pytest.raises(softhand.ScenarioError, match="leave the obstacles out"):
        solvers_of(plant, Layouts())


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"position": [-0.010, 0.010, 0.175]}, r"obstacle 'obstacle 1': the object starts 7 mm deep in it"),
        ({"shape": "cone"}, r'obstacle 1\.shape.*"cone"'),
        ({"size": [0.02, 0.02]}, r"obstacle\.size: got .* of length 2; the size of \"box\" is \[x, y, z\]"),
        ({"size": [0.02, 0.02, 0.0]}, r"obstacle 1\.size"),
        ({"size": [0.02, 0.02, float("nan")]}, r"obstacle 1\.size"),
        ({"size": None}, r"obstacle\.size: missing"),
        ({"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]}, r"obstacle\.vertices: remove it"),
        ({"shape": "polyhedron", "size": None, "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]}, "is flat"),
        ({"friction": None}, r"obstacle 1\.friction"),
        ({"wall": 1}, r"obstacle 1\.wall"),
    ],
)
def test_wrong_obstacles_are_told(change: dict[str, object], said: str) -> None:
    table = {"shape": "box", "size": [0.02, 0.02, 0.02], "position": [0.0, 0.0, 0.3], "friction": 0.5} | change
    with pytest.raises(softhand.SofthandError, match=said):
        softhand.build("hold", overrides={"obstacle": [{k: v for k, v in table.items() if v is not None}]})


def test_names_are_unique_and_round_bodies_told() -> None:
    post = {"name": "post", "shape": "cylinder", "size": [0.01, 0.1], "position": [0.0, 0.0, 0.5], "friction": 0.5}
    with pytest.raises(softhand.ScenarioError, match=r"'post' is there twice"):
        softhand.build("hold", overrides={"obstacle": [post, post]})
    with pytest.raises(softhand.ModelError, match="a cylinder and an object that is round as well, a cylinder"):
        softhand.build("can", overrides={"obstacle": [post]})
