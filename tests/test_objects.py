"""Objects of any convex shape: the nearest point, rolling on curved surfaces, runs."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
from energy import ring
from hands import REPOSITORY, Array, Task, numerical_jacobian, random_state, start_acceleration
from test_contact import coordinates_along, observe, slip_coordinates, slipping

from softhand.assembly.build import build, simulate
from softhand.assembly.parts import read_law
from softhand.assembly.plant import read_grasp, read_world
from softhand.closed_loop.lyapunov import lyapunov
from softhand.errors import GraspError, ModelError, SimulationStopped, SofthandError
from softhand.model.shapes.box import Box
from softhand.model.shapes.cylinder import Cylinder
from softhand.model.shapes.ellipsoid import Ellipsoid
from softhand.model.shapes.mesh import as_polyhedron
from softhand.model.shapes.mesh_file import Mesh, read_mesh
from softhand.model.shapes.shape import CurvedShape, Shape
from softhand.model.shapes.sphere import Sphere
from softhand.numerics.spatial import rotation_of
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.recording.recording import Recording
from softhand.scenario.scenario import load_scenario, with_law
from softhand.start.grasp import faces_of
from softhand.steppers.rk4 import RungeKutta4

ROTATION, CENTRE = rotation_of((0.3, -0.4, 0.7)), np.array([0.002, -0.003, 0.004])
HALF = np.array([0.028, 0.018, 0.030])
PRISM = read_mesh(REPOSITORY / "urdf" / "meshes" / "prism.obj", np.ones(3))


def random_hull() -> Mesh:
    """Points on a bumpy ball; only their hull is convex."""
    directions = np.random.default_rng(4).normal(size=(60, 3))
    points = directions / np.linalg.norm(directions, axis=1, keepdims=True) * [0.03, 0.02, 0.04]
    return Mesh(points, np.zeros((0, 3), dtype=np.int64), "random")


SHAPES: dict[str, Shape] = {
    "box": Box(ROTATION, CENTRE, HALF),
    "sphere": Sphere(ROTATION, CENTRE, 0.03),
    "cylinder": Cylinder(ROTATION, CENTRE, 0.028, 0.045),
    "disc": Cylinder(ROTATION, CENTRE, 0.04, 0.006),
    "ellipsoid": Ellipsoid(ROTATION, CENTRE, (0.03, 0.02, 0.045)),
    "spheroid": Ellipsoid(ROTATION, CENTRE, (0.02, 0.02, 0.045)),
    "prism": as_polyhedron(PRISM, ROTATION, CENTRE),
    "hull": as_polyhedron(random_hull(), ROTATION, CENTRE, take_hull=True),
}
CURVED = {name: shape for name, shape in SHAPES.items() if isinstance(shape, CurvedShape)}
every_shape = pytest.mark.parametrize("shape", list(SHAPES.values()), ids=list(SHAPES))
every_curved = pytest.mark.parametrize("shape", list(CURVED.values()), ids=list(CURVED))


def points_about(count: int, seed: int = 1) -> Array:
    """Points of the object frame inside and around the shapes [m]."""
    return CENTRE + np.random.default_rng(seed).uniform(-0.06, 0.06, (count, 3))


@cache
def spread_over(shape: Shape, count: int) -> tuple[Array, Array]:
    """Points of the surface and normals there; an ellipsoid takes its time for them."""
    return shape.surface_points(count)


def nearest(shape: Shape, points: Array) -> tuple[Array, Array, Array]:
    """Nearest points, normals there, and how far out the points lie along these, shapes (n, 3), (n, 3), (n,)."""
    feet, normals = (np.array(values) for values in zip(*map(shape.nearest, points), strict=True))
    return feet, normals, np.einsum("ik,ik->i", points - feet, normals)


# ------------------------------------------------------------------------------------------------------ nearest points


@every_shape
def test_the_plane_at_the_nearest_point_bounds_the_shape(shape: Shape) -> None:
    """No point of the surface lies beyond the plane at the nearest point, and the normal there goes through the point.

    For a convex shape this is what makes the point the nearest.
    """
    points = points_about(1000)
    feet, normals, along = nearest(shape, points)
    surface = np.concatenate([feet, spread_over(shape, 400)[0]])
    beyond = surface @ normals.T - np.einsum("ik,ik->i", feet, normals)
    assert np.max(beyond) < 1e-12
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(points - feet, along[:, None] * normals, rtol=0.0, atol=1e-12)
    assert 300 < np.sum(along > 0.0) < 1000


@every_shape
def test_inside_no_surface_is_nearer(shape: Shape) -> None:
    """From inside, no point of the surface is nearer than the one that is given."""
    points = points_about(1000)
    feet, _, along = nearest(shape, points)
    inside = along < 0.0
    surface = np.concatenate([feet, spread_over(shape, 400)[0]])
    away = np.linalg.norm(points[inside, None] - surface[None], axis=2)
    assert np.all(-along[inside] <= np.min(away, axis=1) + 1e-12)
    assert np.sum(inside) > 10


def coal_shape(shape: Shape) -> Any:
    """The same shape in coal."""
    if isinstance(shape, Box):
        return coal.Box(*(2.0 * shape.half))
    if isinstance(shape, Sphere):
        return coal.Sphere(shape.radius)
    if isinstance(shape, Cylinder):
        return coal.Cylinder(shape.radius, 2.0 * shape.half)
    if isinstance(shape, Ellipsoid):
        return coal.Ellipsoid(*shape.semi_axes)
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for vertex in shape.vertices:
        points.append(vertex)
    for polygon in shape.polygons:
        for k in range(1, len(polygon) - 1):
            triangles.append(coal.Triangle(int(polygon[0]), int(polygon[k]), int(polygon[k + 1])))
    return coal.Convex(points, triangles)


@every_shape
def test_distance_is_that_of_coal(shape: Shape) -> None:
    """A collision library finds the same distance of a small sphere, and the same nearest point."""
    other, place = coal_shape(shape), coal.Transform3s(ROTATION, CENTRE)
    ball, request = coal.Sphere(1e-3), coal.DistanceRequest(True)
    request.gjk_tolerance = 1e-9
    points = points_about(1000, seed=2)
    feet, _, along = nearest(shape, points)
    clear = along > 2e-3
    distances, places = [], []
    for point in points[clear]:
        result = coal.DistanceResult()
        distances.append(coal.distance(other, place, ball, coal.Transform3s(np.eye(3), point), request, result))
        places.append(result.getNearestPoint1())
    np.testing.assert_allclose(np.array(distances) + 1e-3, along[clear], rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(places, feet[clear], rtol=0.0, atol=2e-5)
    assert np.sum(clear) > 500


@every_shape
def test_normal_and_distance_are_continuous(shape: Shape) -> None:
    """Around the shape, 4 mm above it, over faces, edges and vertices: no jump of distance or of normal."""
    points, rng = points_about(1500, seed=3), np.random.default_rng(5)
    feet, normals, along = nearest(shape, points)
    above = along > 4e-3
    moves = 1e-6 * rng.normal(size=(np.sum(above), 3))
    feet_2, normals_2, _ = nearest(shape, points[above] + moves)
    size = np.linalg.norm(moves, axis=1) * (1.0 + 1e-6)
    assert np.all(np.linalg.norm(normals_2 - normals[above], axis=1) <= size / 4e-3)
    # a projection onto a convex set never stretches
    assert np.all(np.linalg.norm(feet_2 - feet[above], axis=1) <= size)
    assert np.sum(above) > 500


@every_shape
def test_surface_points_lie_on_the_surface_and_are_spread(shape: Shape) -> None:
    """So many as asked for, on the surface, with its normals, and no patch of the surface is left out."""
    points, normals = spread_over(shape, 700)
    assert points.shape == normals.shape == (700, 3)
    some = slice(None, None, 2)  # each second one: they stand in no order
    np.testing.assert_allclose(nearest(shape, points[some])[0], points[some], rtol=0.0, atol=1e-12)
    out = points[some] + 1e-4 * normals[some]
    np.testing.assert_allclose(nearest(shape, out)[1], normals[some], rtol=0.0, atol=1e-9)
    many = nearest(shape, points_about(2000, seed=9))[0]
    assert np.max(np.min(np.linalg.norm(many[:, None] - points[None], axis=2), axis=1)) < 0.008


@every_shape
def test_feet_reach_as_far_as_the_shape(shape: Shape) -> None:
    """In every direction the farthest of its feet reaches as far as the shape; of a can, which is crowned, nearly.

    How far the shape reaches is told by the nearest point to a point that is very far out.
    """
    directions = np.random.default_rng(6).normal(size=(300, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    farthest = np.einsum("ik,ik->i", nearest(shape, CENTRE + 1e5 * directions)[0], directions)
    reach = [max(foot.reach(direction) for foot in shape.feet()) for direction in directions]
    slack = 1e-3 * min(shape.radius, shape.half) if isinstance(shape, Cylinder) else 1e-9
    np.testing.assert_allclose(reach, farthest, rtol=0.0, atol=slack)


@every_shape
def test_special_points(shape: Shape) -> None:
    """The centre, the axes and points of the surface itself give finite answers, with unit normals."""
    axes = [ROTATION @ (length * axis) for axis in np.vstack([np.eye(3), -np.eye(3)]) for length in (1e-12, 0.01, 0.2)]
    special = [CENTRE, *(CENTRE + axis for axis in axes)]
    special += [shape.nearest(point)[0] for point in special]
    for point in special:
        foot, normal = shape.nearest(point)
        assert np.isfinite(foot).all() and np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-12)


# ------------------------------------------------------------------------------------------------ surface coordinates


def frame_at(shape: CurvedShape, point: Array) -> tuple[Array, Array, Array]:
    """Contact point, alpha_o and the axes of C_O at the surface point nearest to a point."""
    io = shape.chart(point)
    x, z = io[10:13].copy(), io[3:6].copy()
    return io[:3].copy(), io[8:10].copy(), np.column_stack([x, np.cross(z, x), z])


@every_curved
def test_metric_curvature_and_torsion(shape: CurvedShape) -> None:
    """Along any small motion over the surface, point and frame move as M, K and T say, (34)."""
    rng, compared = np.random.default_rng(7), 0
    for point in points_about(300, seed=8):
        if shape.near(point)[6] < 3e-3 or abs(shape.near(point)[7] - 1) > 0:
            continue
        axes = frame_at(shape, point)[2]
        io = shape.chart(point)
        M, K = np.array([[io[13], io[14]], [0.0, io[15]]]), np.array([[io[16], io[17]], [io[17], io[18]]])
        if M[0, 0] < 3e-3:  # near a pole all turns fast
            continue
        move = 1e-6 * rng.normal(size=3)
        (f1, a1, A1), (f2, a2, A2) = frame_at(shape, point - move), frame_at(shape, point + move)
        d_alpha = a2 - a1
        d_alpha[0] = math.remainder(d_alpha[0], 2.0 * math.pi)
        shift, turn = axes.T @ (f2 - f1), axes.T @ pin.log3(A2 @ A1.T)
        scale = np.linalg.norm(move)
        np.testing.assert_allclose(M @ d_alpha / scale, shift[:2] / scale, atol=1e-5)
        bend = K @ M @ d_alpha
        np.testing.assert_allclose(turn[:2] / scale, np.array([-bend[1], bend[0]]) / scale, atol=1e-3)  # of 1/m
        assert turn[2] / scale == pytest.approx(io[19:21] @ M @ d_alpha / scale, abs=1e-3)
        np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-12)
        compared += 1
    assert compared > 40


@cache
def held(name: str, **changes: Any) -> Task:
    """The grasp of a scenario."""
    scenario = load_scenario(name, {key.replace("__", "."): value for key, value in changes.items()})
    world = read_world(scenario)
    fingertips, grasp = read_grasp(scenario, world, read_law(scenario))
    return Task(world, tuple(fingertips), grasp, scenario.grasp.contact_points, scenario.grasp.internal_force)


AXES = (0.030, 0.028, 0.040)


def on_ellipsoid(angle: float) -> tuple[float, float, float]:
    return AXES[0] * math.cos(angle), AXES[1] * math.sin(angle), 0.002


def held_ellipsoid() -> Task:
    """An ellipsoid in three fingers, a little off its equator."""
    shape = Ellipsoid(np.eye(3), np.zeros(3), AXES)
    points = tuple(tuple(shape.nearest(on_ellipsoid(math.radians(a)))[0].tolist()) for a in (30.0, 150.0, -90.0))
    return held("ball", object__ellipsoid=AXES, grasp__contact_points=points)


CURVED_TASKS = {
    "can": lambda: held("can"),
    "tilted can": lambda: held("can", fingertip__law="conservative", **dict.fromkeys(
        ("fingertip__k_r", "fingertip__k_phi", "fingertip__k_theta", "fingertip__k_psi"))),
    "ball": lambda: held("ball"),
    "ellipsoid": held_ellipsoid,
}  # fmt: skip


@pytest.mark.parametrize("name", list(CURVED_TASKS))
def test_coordinate_rates_on_curved_objects(name: str) -> None:
    """(38)-(41) are the rates of eta along a rolling motion in which everything moves."""
    task = CURVED_TASKS[name]()
    for seed in range(3):
        state = random_state(task, np.random.default_rng(seed))
        if "conservative" in str(type(task.fingertips[0].law)).lower():
            state.z[:, :2] *= 0.01
        seen = observe(task, state)
        rates = seen.deformation_rate[:, 1:].copy()
        expected = numerical_jacobian(coordinates_along(task, state, rates), 1)[..., 0]
        assert np.min(np.max(np.abs(expected), axis=0)) > 1e-3
        np.testing.assert_allclose(seen.eta_rate, expected, rtol=2e-6, atol=2e-6)


@pytest.mark.parametrize("name", ["can", "ball", "ellipsoid"])
def test_coordinate_rates_in_slip_on_curved_objects(name: str) -> None:
    """So they are while the tips slip and spin."""
    task = CURVED_TASKS[name]()
    rng = np.random.default_rng(9)
    state = random_state(task, rng)
    plant, rates = slipping(task, state, rng)
    _, rate = slip_coordinates(plant, state)
    expected = numerical_jacobian(coordinates_along(task, state, rates[:, 1:]), 1)[..., 0]
    np.testing.assert_allclose(rate, expected, rtol=2e-6, atol=2e-6)


def rolling_without_slip(task: Task) -> tuple[Plant, State]:
    """A state in which no tip moves against the object at its contact, but each turns on it."""
    rng = np.random.default_rng(10)
    state = random_state(task, rng)
    plant = task.plant()
    plant.update(state.q, state.v, state.z)
    first = plant.jacobian[0]
    v = state.v - np.linalg.pinv(first) @ (first @ state.v)
    state = State(state.q, v, state.z)
    plant.update(state.q, state.v, state.z)
    assert np.max(np.abs(plant.contacts["velocity"][0])) < 1e-12
    return plant, state


def relative_spin(plant: Plant, state: State) -> Array:
    """Angular velocity of the first tip relative to the object along x_C and y_C."""
    J, n = plant.snapshot.J[3:], plant.world.n_joints
    columns = list(plant.world.tips[0].columns)
    spin = J[:, columns] @ state.v[columns] - J[:, n:] @ state.v[n:]
    return plant.contacts["rotation"][0][:, :2].T @ spin


def test_rolling_on_a_sphere_is_montanas() -> None:
    """Sphere on sphere: the contact goes at |w| / (1/R + 1/rho) over both, and turns by tan phi and tan v."""
    plant, state = rolling_without_slip(held("ball"))
    eta, rate = slip_coordinates(plant, state)
    R, rho = plant.contacts["distance"][0], 0.030
    w = np.linalg.norm(relative_spin(plant, state))
    assert w > 0.5
    speed = w / (1.0 / R + 1.0 / rho)
    v, (theta_rate, phi_rate, u_rate, v_rate, psi_rate) = eta[0, 3], rate[0]
    Phi = plant.contacts["angles"][0, 1]
    assert math.hypot(rho * math.cos(v) * u_rate, rho * v_rate) == pytest.approx(speed, rel=1e-12)
    assert math.hypot(R * math.cos(Phi) * theta_rate, R * phi_rate) == pytest.approx(speed, rel=1e-12)
    assert psi_rate == pytest.approx(math.sin(Phi) * theta_rate + math.sin(v) * u_rate, rel=1e-12)


def test_rolling_on_a_cylinder_is_montanas() -> None:
    """Sphere on cylinder: R w along the axis, w / (1/R + 1/rho) around it."""
    plant, state = rolling_without_slip(held("can"))
    _, rate = slip_coordinates(plant, state)
    contact, R, rho = plant.contacts[0], plant.contacts["distance"][0], 0.028
    axis = pin.Quaternion(state.q[-4:]).matrix()[:, 2]
    around = np.cross(axis, -contact["rotation"][:, 2])
    w = contact["rotation"][:, :2] @ relative_spin(plant, state)
    # the centre of the tip moves with w cross the way from the contact to it
    velocity = np.cross(w, -R * contact["rotation"][:, 2])
    assert rate[0, 3] == pytest.approx(axis @ velocity, rel=1e-10)
    assert rho * rate[0, 2] == pytest.approx(around @ velocity * rho / (R + rho), rel=1e-10)
    assert abs(rate[0, 2]) > 0.1 and abs(rate[0, 3]) > 1e-3


def test_rolling_over_the_rim() -> None:
    """Over the rim of a can eta and (38)-(41) stay true: the point goes round, the normal turns, alpha_o goes on."""
    task = held("can")
    plant, world = task.plant(), task.world
    shape = world.shape
    rng = np.random.default_rng(11)
    for tip_at in ([0.033, 0.0, 0.049], [0.002, -0.031, 0.052], [0.0125, 0.0, 0.0530], [0.0, 0.02, -0.053]):
        state = random_state(task, rng)
        plant.update(state.q, state.v, state.z)
        rotation = pin.Quaternion(state.q[-4:]).matrix()
        state.q[-7:-4] = plant.contacts["tip"][0] - rotation @ tip_at
        seen = observe(task, state)
        rates = seen.deformation_rate[:, 1:].copy()
        expected = numerical_jacobian(coordinates_along(task, state, rates), 1)[..., 0]
        np.testing.assert_allclose(seen.eta_rate[0], expected[0], rtol=5e-6, atol=5e-6)
    assert isinstance(shape, Cylinder)
    below, above = shape.chart([0.033, 0.0, 0.04499999]), shape.chart([0.02799999, 0.0, 0.05])
    np.testing.assert_allclose(below[8:10], above[8:10], atol=2e-8)


# ------------------------------------------------------------------------------------------------------ contact kernels


@every_shape
def test_the_kernel_meets_the_nearest_point(shape: Shape) -> None:
    """Contact point, distance, normal and axes of a tip that can slip are those of the nearest point, also inside."""

    task = held("can", fingertip__contact="coulomb")
    task = replace(task, world=replace(task.world, shape=shape))
    plant, rng = task.plant(), np.random.default_rng(12)
    for point in points_about(200, seed=13):
        q, v = np.zeros(plant.world.model.nq), np.zeros(plant.world.model.nv)
        q[: plant.world.n_joints] = rng.normal(size=plant.world.n_joints)
        rotation = rotation_of(rng.normal(size=3))
        q[-4:] = pin.Quaternion(rotation).coeffs()
        z = np.zeros((3, plant.n_memory))
        plant.update(q, v, z)
        q[-7:-4] = plant.contacts["tip"][0] - rotation @ point
        plant.update(q, v, z)
        contact = plant.contacts[0]
        foot, normal = shape.nearest(point)
        np.testing.assert_allclose(contact["normal"], normal, atol=1e-9)
        np.testing.assert_allclose(rotation.T @ (contact["point"] - q[-7:-4]), foot, atol=1e-12)
        assert contact["distance"] == pytest.approx((point - foot) @ normal, abs=1e-12)
        np.testing.assert_allclose(contact["rotation"].T @ contact["rotation"], np.eye(3), atol=1e-12)


@pytest.mark.parametrize("name", ["target-a", "can", "prism", "ball"])
@pytest.mark.parametrize("law", ["nakashima", "conservative"])
def test_a_tip_inside_the_object_ends_the_run_by_name(name: str, law: str) -> None:
    """An object thrown into a finger, further than its radius in one step: the run ends there as pressed flat."""
    scenario = load_scenario(name, {"fingertip.contact": "coulomb", "duration": 0.1})
    simulation = build(scenario if law == "nakashima" else with_law(scenario, law))
    simulation.reset()
    simulation.state.v[-6] = 40.0  # [m/s]
    with pytest.raises(SimulationStopped, match="is pressed flat") as caught:
        for _ in range(100):
            simulation.sample()
            simulation.step()
    assert caught.value.reason == "flat"  # type: ignore[attr-defined]
    assert np.min(simulation.plant.contacts["distance"]) < 0.0


@every_shape
def test_a_tip_whose_centre_is_inside_has_finite_forces(shape: Shape) -> None:
    """Below, on and above the surface, even exactly on it, no force is NaN."""

    for law in ("nakashima", "conservative"):
        scenario = load_scenario("can", {"fingertip.contact": "coulomb"})
        scenario = scenario if law == "nakashima" else with_law(scenario, law)
        world = read_world(scenario)
        fingertips, grasp = read_grasp(scenario, world, read_law(scenario))
        plant = Plant(replace(world, shape=shape), fingertips)
        z = np.zeros((3, plant.n_memory))
        foot, normal = shape.nearest(CENTRE + np.array([0.05, 0.01, 0.02]))
        for height in (-0.02, -1e-3, -1e-9, -1e-15, 0.0, 1e-15, 1e-9, 1e-3):
            q = grasp.state.q.copy()
            plant.update(q, grasp.state.v, z)
            q[-7:-4], q[-4:] = plant.contacts["tip"][0] - (foot + height * normal), (0.0, 0.0, 0.0, 1.0)
            plant.update(q, grasp.state.v, z)
            assert np.isfinite(plant.contacts["force"][0]).all(), height
            assert np.isfinite(plant.contacts["rotation"][0]).all()


# -------------------------------------------------------------------------------------------------------------- start


def test_a_point_off_a_curved_surface_is_refused_with_the_nearest() -> None:
    """How far off, and which point of the surface is nearest."""
    world = held("can").world
    with pytest.raises(
        GraspError, match=r"0\.5 mm off the surface; the nearest point of it is \(28, 0, 10\) mm"
    ) as caught:
        faces_of(world, [[0.0285, 0.0, 0.010]] * 3)
    assert caught.value.value == pytest.approx(5e-4)  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", list(CURVED_TASKS))
def test_the_start_is_at_rest(name: str) -> None:
    """Under the holding torques nothing accelerates."""
    np.testing.assert_allclose(start_acceleration(CURVED_TASKS[name]()), 0.0, atol=1e-5)


def test_a_gripped_ball_stays() -> None:
    """A ball held by three fingers under the law (59) does not move in a second."""
    scenario = load_scenario("ball")
    rest = {
        "duration": 1.0,
        "reference.object_position": scenario.object.position,
        "reference.object_rpy": scenario.object.rpy,
        "reference.internal_force": scenario.grasp.internal_force,
    }
    run = simulate(scenario.with_values(rest))
    assert np.max(np.abs(run.object_position - run.object_position[0])) < 1e-9
    assert np.max(np.abs(run.object_rpy)) < 1e-8


# ---------------------------------------------------------------------------------------------------------------- runs


@pytest.mark.parametrize("name", ["can", "prism", "ball"])
def test_the_scenarios_reach_their_targets(name: str) -> None:
    """The object gets to its target within 0.05 mm and 0.02 deg, friction with torsion always below 1."""
    scenario = load_scenario(name)
    run = simulate(scenario)
    assert run.complete
    assert np.max(run.limit_surface_use) < 0.5
    np.testing.assert_allclose(run.object_position[-1], scenario.reference.object_position, atol=5e-5)
    np.testing.assert_allclose(run.object_rpy[-1], scenario.reference.object_rpy, atol=math.radians(0.02))


def with_mesh(folder: Path, urdf: str, vertices: Array, faces: list[list[int]]) -> Path:
    """A copy of a URDF that ships, with a mesh as collision shape."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(vertices).tolist()]
    lines += ["f " + " ".join(str(1 + k) for k in face) for face in faces]
    (folder / "shape.obj").write_text("\n".join(lines) + "\n")
    text = (REPOSITORY / "urdf" / urdf).read_text()
    start, end = text.index("<collision>"), text.index("</collision>")
    mesh = '<collision><geometry><mesh filename="shape.obj"/></geometry>'
    file = folder / "meshed.urdf"
    file.write_text(text[:start] + mesh + text[end:])
    return file


CUBE = [[1, 3, 2, 0], [6, 7, 5, 4], [4, 5, 1, 0], [3, 7, 6, 2], [2, 6, 4, 0], [5, 7, 3, 1]]


@pytest.mark.parametrize("contact", ["rolling", "coulomb"])
def test_a_box_as_mesh_is_the_box(contact: str, tmp_path: Path) -> None:
    """Target A with the box as a mesh of eight vertices is target A, sample by sample."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * HALF
    changes = {"fingertip.contact": contact}
    box = simulate(load_scenario("target-a", changes))
    mesh = simulate(
        load_scenario("target-a", {**changes, "object.urdf": str(with_mesh(tmp_path, "box.urdf", corners, CUBE))})
    )
    for name in ("object_position", "object_rpy", "joint_position", "contact_force", "contact_point"):
        np.testing.assert_allclose(getattr(mesh, name), getattr(box, name), atol=1e-9, err_msg=name)


def prism_of(sides: int, radius: float, height: float) -> tuple[Array, list[list[int]]]:
    """A regular prism about z, a face towards +x."""
    angles = 2.0 * np.pi * (np.arange(sides) + 0.5) / sides
    ring = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    vertices = np.concatenate([np.column_stack([ring, np.full(sides, z)]) for z in (-0.5 * height, 0.5 * height)])
    faces = [[k, (k + 1) % sides, (k + 1) % sides + sides, k + sides] for k in range(sides)]
    return vertices, [*faces, list(range(sides))[::-1], list(range(sides, 2 * sides))]


def test_a_prism_of_many_sides_becomes_the_cylinder(tmp_path: Path) -> None:
    """The nearest point nears that on the cylinder, and the run nears that with the can."""

    def run(**changes: Any) -> Recording:
        return simulate(load_scenario("can", {"fingertip.contact": "coulomb", "duration": 0.6, **changes}))

    can, cylinder, joints, gaps = run(), held("can").world.shape, [], []
    for sides in (12, 48, 192):
        vertices, faces = prism_of(sides, 0.028, 0.090)
        file = with_mesh(tmp_path, "can.urdf", vertices, faces)
        apothem = 0.028 * math.cos(math.pi / sides)
        angles = np.radians([30.0, 150.0, -90.0])
        points = tuple((apothem * math.cos(a), apothem * math.sin(a), 0.0) for a in angles)
        prism = run(**{"object.urdf": str(file), "grasp.contact_points": points})
        assert prism.complete
        joints.append(float(np.max(np.abs(prism.joint_position - can.joint_position))))
        shape = held("can", object__urdf=str(file), grasp__contact_points=points).world.shape
        around = [point for point in points_about(300) if cylinder.nearest(point)[1] @ (point - CENTRE) > 0.0]
        gaps.append(max(float(np.linalg.norm(shape.nearest(p)[0] - cylinder.nearest(p)[0])) for p in around))
    assert joints[0] > 3.0 * joints[1] > 9.0 * joints[2]
    assert joints[2] < 5e-4  # [rad]; the sides are 0.9 mm wide, and what a tip does on each is not smooth
    assert gaps[2] < 6e-4


def test_the_energy_closes_on_a_can() -> None:
    """A can that rings between lossless springs and conservative tips keeps its energy, to fourth order of the step."""
    task = CURVED_TASKS["tilted can"]()
    drifts = [ring(task, RungeKutta4(step=step), 0.1, every=4e-3).drift for step in (2e-4, 1e-4)]
    assert drifts[1] < 1e-7
    assert drifts[0] > 8.0 * drifts[1]


def test_what_needs_plane_faces_says_so() -> None:
    """The pose from joints and forces alone, and L of (60), are refused on a can."""
    own = {"name": "finger-only", **load_scenario("finger-only").controller.parameters}
    with pytest.raises(SofthandError, match="computed from its plane faces alone"):
        simulate(load_scenario("can", {"controller": own, "duration": 0.01}))
    run = simulate(load_scenario("can", {"duration": 0.01}))
    with pytest.raises(ModelError, match=r"L of \(60\) is written for plane faces"):
        lyapunov(run)
