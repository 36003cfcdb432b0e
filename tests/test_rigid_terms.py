"""The compiled rigid-body terms: those of Pinocchio, for any tree of joints and for whole runs."""

from __future__ import annotations

import importlib.util

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

import softhand
from softhand.assembly.plant import read_world
from softhand.errors import ModelError
from softhand.model.compiled_snapshot import CompiledSnapshot, room_for_terms
from softhand.model.rigid import rigid_poses, rigid_terms
from softhand.model.snapshot import Snapshot, Terms
from softhand.model.tree import read_tree
from softhand.model.world import World
from softhand.scenario.file import scenario_names
from softhand.scenario.scenario import load_scenario

Array = NDArray[np.float64]

needs_robots = pytest.mark.skipif(
    importlib.util.find_spec("example_robot_data") is None,
    reason='needs the extra robots: pip install "softhand[robots]"',
)

PRECISION = 1e-12
"""Of the largest entry of each array."""

ALIGNED = (
    pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ,
    pin.JointModelRUBX, pin.JointModelRUBY, pin.JointModelRUBZ,
    pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ,
)  # fmt: skip


def unit(rng: np.random.Generator) -> Array:
    """A random direction."""
    axis = rng.normal(size=3)
    return axis / np.linalg.norm(axis)


def continuous(axis: Array) -> pin.JointModel:
    """A joint without limits about an axis, which Pinocchio makes from a URDF alone."""
    return pin.buildModelFromXML(
        f"""<robot name="one"><link name="base"/><link name="body"><inertial><mass value="1"/>
        <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="joint" type="continuous"><parent link="base"/><child link="body"/>
        <axis xyz="{" ".join(map(repr, axis.tolist()))}"/></joint></robot>"""
    ).joints[1]


UNALIGNED = (pin.JointModelRevoluteUnaligned, pin.JointModelPrismaticUnaligned, continuous)


def random_tree(rng: np.random.Generator, n_joints: int) -> pin.Model:
    """Joints of all kinds on the world or on one another, each with a body or more, then a free-flyer."""
    model = pin.Model()
    for k in range(n_joints):
        kind = rng.choice(len(ALIGNED) + len(UNALIGNED))
        joint = ALIGNED[kind]() if kind < len(ALIGNED) else UNALIGNED[kind - len(ALIGNED)](unit(rng))
        before = list(model.supports[k])[::-1]  # Pinocchio wants each branch without gaps
        model.addJoint(before[min(rng.geometric(0.6) - 1, len(before) - 1)], joint, random_pose(rng), f"joint {k}")
        for _ in range(rng.integers(1, 3)):  # a further one is fixed to the first
            model.appendBodyToJoint(k + 1, random_inertia(rng), random_pose(rng))
    index = model.addJoint(0, pin.JointModelFreeFlyer(), random_pose(rng), "object")
    model.appendBodyToJoint(index, random_inertia(rng), random_pose(rng))
    model.armature = rng.uniform(0.0, 1e-3, model.nv)
    model.gravity.linear = 9.81 * unit(rng)
    return model


def random_pose(rng: np.random.Generator) -> pin.SE3:
    """Anywhere within some centimetres."""
    return pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(scale=0.05, size=3))


def random_inertia(rng: np.random.Generator) -> pin.Inertia:
    """Of a body of some grams and centimetres."""
    size = rng.uniform(0.01, 0.05, 3)
    return pin.Inertia.FromBox(rng.uniform(0.01, 0.3), *size)


def random_motion(model: pin.Model, rng: np.random.Generator) -> tuple[Array, Array]:
    """Configuration, joints beyond a whole turn and slides of a metre among them, and velocity."""
    q = pin.integrate(model, pin.neutral(model), rng.normal(scale=2.0, size=model.nv))
    return q, rng.normal(scale=3.0, size=model.nv)


def terms_of_pinocchio(model: pin.Model, q: Array, v: Array) -> Terms:
    """By the calls of `Snapshot`."""
    data = model.createData()
    M = np.array(pin.crba(model, data, q, pin.Convention.WORLD))
    nle = pin.nonLinearEffects(model, data, q, v)
    poses = np.array([[*pose.rotation.T.ravel(), *pose.translation] for pose in data.oMi])
    return Terms(M, np.array(data.J), np.array(nle), poses)


def assert_equal(found: Terms, expected: Terms) -> None:
    """Each array within `PRECISION` of its largest entry; of M the upper triangle."""
    for name, own, other in zip(Terms._fields, found, expected, strict=True):
        if name == "M":
            own, other = np.triu(own), np.triu(other)
        scale = np.abs(other).max()
        np.testing.assert_allclose(own / scale, other / scale, rtol=0.0, atol=PRECISION, err_msg=name)


@pytest.mark.parametrize("seed", range(10))
def test_any_tree_has_the_terms_of_pinocchio(seed: int) -> None:
    """100 random trees of 1 to 20 joints, ten states each: nothing of the last state stays behind."""
    rng = np.random.default_rng(seed)
    for n_joints in rng.integers(1, 21, 10):
        model = random_tree(rng, n_joints)
        tree, found = read_tree(model), room_for_terms(model)
        for _ in range(10):
            q, v = random_motion(model, rng)
            rigid_terms(tree, q, v, found)
            assert_equal(found, terms_of_pinocchio(model, q, v))


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[needs_robots] if "allegro" in name else []) for name in scenario_names()]
)
def test_every_shipped_scenario_has_the_terms_of_pinocchio(name: str) -> None:
    world, rng = read_world(load_scenario(name)), np.random.default_rng(0)
    by_pinocchio, compiled = Snapshot(world), CompiledSnapshot(world)
    for _ in range(20):
        q, v = random_motion(world.coordinates, rng)
        for snapshot in (by_pinocchio, compiled):
            snapshot.update(q, v)
        assert_equal(compiled.terms, by_pinocchio.terms)


def test_a_place_far_away_costs_no_digits(world: World) -> None:
    """The hand 100 m off: velocity terms and M of the joints are those of the hand at home."""
    far, rng = world.model.copy(), np.random.default_rng(1)
    for index in range(1, far.njoints):
        if far.parents[index] == 0:
            far.jointPlacements[index] = pin.SE3(np.eye(3), np.array([100.0, -50.0, 20.0])) * far.jointPlacements[index]
    q, v = random_motion(world.model, rng)
    here, there = room_for_terms(far), room_for_terms(far)
    rigid_terms(read_tree(world.model), q, v, here)
    rigid_terms(read_tree(far), q, v, there)
    for name in ("M", "nle"):
        scale = np.abs(getattr(here, name)).max()
        np.testing.assert_allclose(getattr(there, name), getattr(here, name), rtol=0.0, atol=PRECISION * scale)


def test_poses_alone_leave_the_rest_as_it_is() -> None:
    rng = np.random.default_rng(2)
    model = random_tree(rng, 12)
    tree, found = read_tree(model), room_for_terms(model)
    rigid_terms(tree, *random_motion(model, rng), found)
    M, nle = found.M.copy(), found.nle.copy()
    q, v = random_motion(model, rng)
    rigid_poses(tree, q, found)
    expected = terms_of_pinocchio(model, q, v)
    assert_equal(found, Terms(M, expected.J, nle, expected.poses))


def test_arrays_are_laid_out_as_those_of_pinocchio(world: World) -> None:
    """So that kernels are compiled once for both."""
    for own, other in zip(CompiledSnapshot(world).terms, Snapshot(world).terms, strict=True):
        assert (own.shape, own.strides, own.dtype) == (other.shape, other.strides, other.dtype)


def test_the_table_is_frozen(world: World) -> None:
    """Runs side by side may share it; what one of them writes is scratch."""
    tree = read_tree(world.model)
    for table in (tree.joints, tree.gravity):
        with pytest.raises(ValueError, match="read-only"):
            table[:] = 0
    other, found, alone = tree._replace(work=np.ones_like(tree.work)), *(room_for_terms(world.model) for _ in range(2))
    q, v = random_motion(world.model, np.random.default_rng(3))
    rigid_terms(tree, q, v, alone)
    rigid_terms(other, q, v, found)
    for own, expected in zip(found, alone, strict=True):
        np.testing.assert_array_equal(own, expected)


def test_other_joints_are_refused_by_name() -> None:
    carrying = pin.Model()
    base = carrying.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "floating base")
    carrying.addJoint(base, pin.JointModelRX(), pin.SE3.Identity(), "finger")
    screw = pin.Model()
    screw.addJoint(0, pin.JointModelHX(0.01), pin.SE3.Identity(), "screw")
    ball = pin.Model()
    ball.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    for model, name in ((carrying, "floating base"), (screw, "screw"), (ball, "ball")):
        with pytest.raises(ModelError, match=f"'{name}'.*pinocchio"):
            read_tree(model)


@pytest.mark.parametrize(("stepper", "step"), [("midpoint", 1e-3), ("rk4", 2.5e-4)])
def test_a_run_is_the_same_with_either(stepper: str, step: float) -> None:
    """50 ms under the law (59), pushed, saved and resumed half-way with the compiled terms."""
    push = {"push": [{"force": [0.0, 0.0, 0.5], "point": [0.01, 0.0, 0.0], "start": 0.01, "duration": 0.02}]}
    settings = {"stepper.name": stepper, "stepper.step": step, **push}
    states = []
    for terms in ("pinocchio", "compiled"):
        simulation = softhand.build("target-a", overrides={**settings, "stepper.terms": terms})
        assert f'terms = "{terms}"' in simulation.scenario
        assert isinstance(simulation.plant.snapshot, CompiledSnapshot) == (terms == "compiled")
        for k in range(50):
            if k == 25 and terms == "compiled":
                simulation.reset(simulation.save())
            simulation.sample()
            simulation.step()
        states.append(simulation.state)
    one, other = states
    assert np.abs(one.v).max() > 1e-2
    for name in ("q", "v", "z"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=0.0, atol=1e-9)


def test_another_word_for_the_terms_is_refused() -> None:
    with pytest.raises(softhand.ScenarioError, match=r'stepper\.terms.*"pinocchio", "compiled"'):
        load_scenario("target-a", {"stepper.terms": "mujoco"})
