"""The squeeze that holds a set of loads: closed forms, symmetries, duality, brute force, and what is refused."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from commands import run_command
from hands import Array
from numpy.testing import assert_allclose
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull

import softhand
from softhand.contact.limit import limit_of
from softhand.contact.pairs import contact_pairs
from softhand.grasping.wrenches import Contacts, grasp_matrix, tangents
from softhand.holding.held import Held, held_there, limit_use, look
from softhand.holding.loads import Loads, ball, loads_of
from softhand.holding.program import Found, Program, Terms
from softhand.holding.squeeze import squeeze_of
from softhand.holding.surface import facets

MASS, GRAVITY = 0.2, np.array([0.0, 0.0, -9.81])
COLUMNS = np.array([0.4013, 0.1555, -0.3408, 0.8888, -0.3974])  # an exact surface, dr = 0


def grip(
    points: ArrayLike,
    normals: ArrayLike,
    mu: float = 0.5,
    lever: float = 0.003,
    curve: Array | None = None,
    effort: float = np.inf,
    arm: float = 0.1,
    length: float = 0.025,
) -> Held:
    """Tips at points about the centre of mass, each pushed along its normal by a joint at an arm [m]."""
    points, normals = np.array(points, dtype=float), np.array(normals, dtype=float)
    nc = len(points)
    curves = np.zeros((nc, 5)) if curve is None else np.tile(curve, (nc, 1))
    G = grasp_matrix(Contacts(points, normals, np.full(nc, mu), np.full(nc, lever), length, curves))
    pairs = contact_pairs(nc)
    K = np.zeros((3 * nc, len(pairs)))
    for k, (i, j) in enumerate(pairs):
        way = (points[j] - points[i]) / np.linalg.norm(points[j] - points[i])
        for tip, sign in ((i, 1.0), (j, -1.0)):
            K[3 * tip : 3 * tip + 3, k] = sign * np.array([*tangents(normals[tip]), normals[tip]]) @ way
    hand = np.zeros((3 * nc, nc))
    hand[2::3] = arm * np.eye(nc)
    forces = [k for k in range(4 * nc) if k % 4 < 3]
    return Held(
        tips=tuple(f"tip {i}" for i in range(nc)), joints=tuple(f"joint {i}" for i in range(nc)),
        force_map=G[:, forces], torsion_map=G[:, 3::4], basis=K, hand_force=hand, hand_torsion=np.zeros((nc, nc)),
        hand_weight=np.zeros((nc, 3)), gravity=GRAVITY, effort=np.full(nc, effort), friction=np.full(nc, mu),
        lever=np.full(nc, lever), curve=curves, mass=MASS, length=length, force=np.zeros(3 * nc), torsion=np.zeros(nc),
        position=np.zeros(3),
    )  # fmt: skip


def pinch(**settings: float | Array | None) -> Held:
    """Two tips that oppose each other along x."""
    return grip([[0.028, 0, 0], [-0.028, 0, 0]], [[-1, 0, 0], [1, 0, 0]], **settings)


def tripod(turn: Array | None = None, order: Sequence[int] = (0, 1, 2), scale: float = 1.0, mu: float = 0.5) -> Held:
    """Three tips about a prism."""
    R = np.eye(3) if turn is None else turn
    angles = np.array([0.3, 2.4, 4.3])[list(order)]
    out = np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    points = scale * (0.03 * out + np.array([0.0, 0.0, 0.004]) * np.arange(3)[list(order), None])
    return grip(points @ R.T, -out @ R.T, mu=mu, lever=0.003 * scale, length=0.025 * scale, curve=COLUMNS)


def of_wrench(*wrench: ArrayLike) -> Loads:
    """Wrenches from outside, nothing else."""
    rows = -np.array(wrench, dtype=float)
    return Loads(tuple(f"load {k}" for k in range(len(rows))), rows, np.zeros((len(rows), 3)))


def least(held: Held, loads: Loads, **terms: float) -> Found:
    found = Program(held, loads, Terms(**terms)).least()
    assert found is not None
    return found


@cache
def start(name: str) -> Held:
    return held_there(look(softhand.load_scenario(name)))


# ------------------------------------------------------------------------------------------------------- closed forms


@pytest.mark.parametrize("use", [1.0, 0.7])
@pytest.mark.parametrize("mu", [0.2, 0.9])
def test_two_tips_hold_a_weight_with_half_of_it_over_mu(mu: float, use: float) -> None:
    """F = m g / (2 mu), and 1 / use of it with a margin."""
    found = least(pinch(mu=mu), loads_of(pinch()), use=use)
    assert_allclose(found.internal_force, [MASS * 9.81 / (2.0 * mu * use)], rtol=1e-6)


def test_a_moment_about_their_line_is_held_by_torsion() -> None:
    """With ellipses F = sqrt((m g)^2 + (M / l)^2) / (2 mu)."""
    mu, lever, moment = 0.5, 0.003, 0.004
    held = pinch(mu=mu, lever=lever)
    found = least(held, loads_of(held, wrenches=[[0, 0, 0, moment, 0, 0]]))
    assert_allclose(found.internal_force, [np.hypot(MASS * 9.81, moment / lever) / (2.0 * mu)], rtol=1e-6)
    assert_allclose(np.abs(found.torsion[0]), 0.5 * moment, rtol=1e-4)


@pytest.mark.parametrize("moment", [0.0, 0.002, 0.006])
def test_the_exact_surface_is_kept_and_nearly_used_up(moment: float) -> None:
    """F = sqrt(H(m g / 2, M / 2 l)) / mu of the exact surface; the cones ask for no less, and 0.4 % more at most."""
    mu, lever = 0.5, 0.003
    held = pinch(mu=mu, lever=lever, curve=COLUMNS)
    found = least(held, loads_of(held, wrenches=[[0, 0, 0, moment, 0, 0]]))
    exact = np.sqrt(limit_of(COLUMNS, (MASS * 9.81 / 2.0, 0.0, moment / (2.0 * lever)))[0]) / mu
    assert exact * (1.0 - 1e-6) <= found.internal_force[0] <= 1.004 * exact
    assert np.max(limit_use(held, found.force, found.torsion)) <= 1.0 + 1e-6


def test_joint_torques_limit_the_largest_squeeze() -> None:
    """A joint at an arm d gives E / d."""
    held = pinch(effort=1.5, arm=0.1)
    largest = Program(held, loads_of(held), Terms()).largest()
    assert largest is not None
    assert_allclose(largest.internal_force, [15.0], rtol=1e-6)
    assert Program(pinch(), loads_of(pinch()), Terms()).largest() is None  # nothing limits it


def test_the_curve_is_the_closed_form_at_each_margin() -> None:
    """Both tips together press with m g / mu over what the margin leaves, and with 2 E / d at most."""
    held = pinch(mu=0.3, effort=2.5, arm=0.1)
    found = squeeze_of(held, loads_of(held), Terms(use=0.8))
    curve = found.curve()
    wanted = MASS * 9.81 / (0.3 * (1.0 - curve.margin))
    holds = wanted <= 2.0 * 25.0
    assert 5 < np.count_nonzero(holds) < len(holds) and curve.chosen == pytest.approx(0.2)
    assert_allclose(curve.least[holds], wanted[holds], rtol=1e-6)
    assert_allclose(curve.largest[holds], 50.0, rtol=1e-6)
    assert np.all(np.isnan(curve.least[~holds])) and np.all(np.isnan(curve.largest[~holds]))


def test_nearest_feasible_figures_in_closed_form() -> None:
    """Of two tips with too little effort: load, effort and friction that would do."""
    mu, effort, arm = 0.1, 0.5, 0.1
    held = pinch(mu=mu, effort=effort, arm=arm)
    found = squeeze_of(held, loads_of(held), Terms())
    weight, press = MASS * 9.81, effort / arm
    assert not found.holds and np.all(np.isnan(found.least))
    assert_allclose(found.load_factor, 2.0 * mu * press / weight, rtol=1e-5)
    assert_allclose(found.least_effort, weight / (2.0 * mu * press), rtol=1e-5)
    assert_allclose(found.least_friction, weight / (2.0 * press), rtol=1e-4)
    assert "0.509 times the load" in str(found.refusal) and "0.197" in str(found.refusal)


# ------------------------------------------------------------------------------------------------- properties


def test_every_facet_is_inside_the_surface() -> None:
    """Points on the polygon have H <= 1, its corners H = 1, whatever the pressure."""
    angle = np.linspace(0.0, np.pi / 2.0, 500)
    for depth in (0.0, 0.1, 0.3):
        curve = start("target-a").curve[0] if depth == 0.1 else COLUMNS * (1.0 + depth)
        rows = facets(curve)
        way = np.column_stack([np.sin(angle), np.cos(angle)])
        points = way / np.max(way @ rows.T, axis=1)[:, None]
        H = np.array([limit_of(curve, (F, 0.0, T))[0] for F, T in points])
        assert np.max(H) <= 1.0 + 1e-9
        assert np.min(H) > 0.992  # 0.4 % of the radius


def test_turning_the_world_changes_no_force() -> None:
    """Points, normals, gravity and loads turned alike."""
    R = pin.exp3(np.array([0.4, -1.1, 0.7]))
    wrench = np.array([0.5, -0.3, -1.9, 0.002, -0.001, 0.003])
    turned = np.concatenate([R @ wrench[:3], R @ wrench[3:]])
    one, two = least(tripod(), of_wrench(wrench)), least(tripod(R), of_wrench(turned))
    assert_allclose(two.internal_force, one.internal_force, rtol=1e-4)
    assert_allclose(two.value, one.value, rtol=1e-6)


def test_the_order_of_the_fingers_does_not_matter() -> None:
    """Pairs go with them."""
    wrench = np.array([0.5, -0.3, -1.9, 0.002, -0.001, 0.003])
    one, two = least(tripod(), of_wrench(wrench)), least(tripod(order=(2, 0, 1)), of_wrench(wrench))
    assert_allclose(two.value, one.value, rtol=1e-6)
    assert_allclose(two.force[0].reshape(3, 3)[:, 2], one.force[0].reshape(3, 3)[[2, 0, 1], 2], rtol=1e-4)


def test_a_mirror_changes_no_normal_force() -> None:
    """y to -y: moments about x and z turn their sign."""
    M = np.diag([1.0, -1.0, 1.0])
    angles = np.array([0.3, 2.4, 4.3])
    out = np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    wrench = np.array([0.5, -0.3, -1.9, 0.002, -0.001, 0.003])
    mirrored = wrench * np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    one = least(grip(0.03 * out, -out, curve=COLUMNS), of_wrench(wrench))
    two = least(grip(0.03 * out @ M, -out @ M, curve=COLUMNS), of_wrench(mirrored))
    assert_allclose(two.force[0, 2::3], one.force[0, 2::3], rtol=1e-4)


def test_scale() -> None:
    """An object twice as large with moments twice as large needs the same forces; twice the load twice the forces."""
    wrench = np.array([0.5, -0.3, -1.9, 0.002, -0.001, 0.003])
    large = wrench * np.repeat([1.0, 2.0], 3)
    one, two = least(tripod(), of_wrench(wrench)), least(tripod(scale=2.0), of_wrench(large))
    assert_allclose(two.internal_force, one.internal_force, rtol=1e-4)
    assert_allclose(least(tripod(), of_wrench(2.0 * wrench)).value, 2.0 * one.value, rtol=1e-6)


def test_more_friction_needs_less_squeeze() -> None:
    """Strictly, for three tips under a load that slides and turns."""
    wrench = [0.5, -0.3, -1.9, 0.002, -0.001, 0.003]
    values = [least(tripod(mu=mu), of_wrench(wrench)).value for mu in (0.3, 0.4, 0.6, 0.9)]
    assert np.all(np.diff(values) < -1e-3)


def test_more_loads_need_no_less() -> None:
    """What holds a set holds each of its loads."""
    loads = loads_of(tripod(), attitudes="any")
    whole = least(tripod(), loads).value
    each = [least(tripod(), loads.some([k])).value for k in range(0, 160, 13)]
    assert max(each) <= whole + 1e-6


# ---------------------------------------------------------------------------------------------------------- duality


@pytest.mark.parametrize("name", ["target-a", "pinch", "gripper"])
def test_the_multipliers_certify_the_least(name: str) -> None:
    """Their value is that of the squeeze: by weak duality none does better. Limits not reached cost nothing."""
    held = start(name)
    program = Program(held, loads_of(held, attitudes="any"), Terms(use=0.8))
    found = program.least()
    assert found is not None
    assert_allclose(found.dual, found.value, rtol=1e-5)
    far = np.max(limit_use(held, found.force, found.torsion), axis=1) < 0.7
    pressed = np.min(found.force[:, 2::3], axis=1) > 0.1
    idle = far & pressed & np.all(np.abs(found.joint_torque) < 0.9 * held.effort, axis=1)
    assert np.any(idle)
    assert np.max(np.abs(found.prices[idle])) < 1e-4 * np.max(np.abs(found.prices))


def test_nearest_figures_are_the_edge_of_what_holds() -> None:
    """A thousandth to one side some squeeze holds, to the other none."""
    held, terms = start("target-a"), Terms(use=0.8, touch=0.1)
    loads = loads_of(held, force=14.0)
    factor, binding = Program(held, loads, terms).load_factor()
    assert 0.5 < factor < 1.0 and binding

    def holds(size: float = 1.0, mu: float = 0.5, effort: float = 1.0) -> bool:
        scaled = Loads(loads.names, size * loads.wrenches, loads.gravity)
        return Program(held.with_friction(mu), scaled, Terms(0.8, effort, 0.1)).least() is not None

    assert holds(0.999 * factor) and not holds(1.001 * factor)
    assert not Program(held, loads.some(binding), terms).least()  # those that limit it are too much by themselves
    most = Program(held, loads, terms).effort_factor()
    if np.isfinite(most):
        assert holds(effort=1.001 * most) and not holds(effort=0.999 * most)


# --------------------------------------------------------------------------------------------- against brute force


def test_the_polytope_is_around_the_ball_and_close_to_it() -> None:
    """Every direction is inside; no corner is further out than 2 %."""
    ways = np.random.default_rng(0).normal(size=(500, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    corners = ball(2)
    assert np.max(np.linalg.norm(corners, axis=1)) < 1.025
    hull = ConvexHull(corners)
    assert np.max(ways @ hull.equations[:, :3].T + hull.equations[:, 3]) <= 1e-9


def test_the_squeeze_of_a_ball_is_that_of_many_directions() -> None:
    """Between that of 400 random forces of this size, and 4 % above."""
    held = start("target-a")
    ways = np.random.default_rng(1).normal(size=(400, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    pushes = np.hstack([ways, 0.0 * ways])
    brute = Program(held, loads_of(held, wrenches=pushes), Terms(use=0.8)).least()
    found = Program(held, loads_of(held, force=1.0), Terms(use=0.8)).least()
    assert brute is not None and found is not None
    assert brute.value <= found.value <= 1.04 * brute.value


def test_uses_are_those_of_the_simulation() -> None:
    """`limit_use` of the start is `limit_surface_use` of its observation."""
    there = look(softhand.load_scenario("target-a"))
    assert_allclose(held_there(there).limit_use, there.probe.at(there.state, 0.0).limit_surface_use, rtol=1e-12)


def test_forces_balance_the_loads() -> None:
    """G c = W for each load of a shipped grasp, and the torques follow."""
    found = softhand.squeeze(softhand.load_scenario("ball"))
    held = start("ball")
    f, tau = found.contact_force[0, :, :3].ravel(), found.contact_force[0, :, 3]
    assert_allclose(held.force_map @ f + held.torsion_map @ tau, found.wrenches[0], atol=1e-6)
    torque = held.hand_weight @ held.gravity + held.hand_force.T @ f + held.hand_torsion.T @ tau
    assert_allclose(found.joint_torque[0], torque, atol=1e-12)


# ----------------------------------------------------------------------------------------------------------- refused


def test_a_frictionless_grasp_is_refused_with_the_friction_that_would_do() -> None:
    """mu = 0 holds nothing; the refusal names the contacts, the load and the figure, and that figure holds."""
    scenario = softhand.load_scenario("pinch")
    found = softhand.squeeze(scenario, friction=0.0)
    assert not found.holds and found.load_factor < 1e-6
    assert "finger_1_tip, finger_2_tip holds: gravity" in str(found.refusal)
    assert "at all contacts would do (it is 0)" in str(found.refusal)
    assert softhand.squeeze(scenario, friction=1.001 * found.least_friction).holds
    assert not softhand.squeeze(scenario, friction=0.99 * found.least_friction).holds


def test_contacts_that_do_not_oppose_are_named_so() -> None:
    """Two tips on one side: no friction, no effort, no part of the load."""
    held = grip([[0.028, 0.01, 0], [0.028, -0.01, 0]], [[-1, 0, 0], [-1, 0, 0]], effort=1.0)
    found = squeeze_of(held, loads_of(held), Terms())
    assert not found.holds
    assert "do not oppose each other" in str(found.refusal)


def test_mistakes_are_told(tmp_path: Path) -> None:
    """Open tips, unknown attitudes, wrenches of five numbers, a margin of 1."""
    scenario = softhand.load_scenario("pinch")
    with pytest.raises(softhand.GraspError, match="not pressing on the object at t = 0 s"):
        softhand.squeeze(softhand.load_scenario("grasp-and-lift"))
    with pytest.raises(softhand.ScenarioError, match=r"attitudes: got 'anny'; allowed .* did you mean 'any'"):
        softhand.squeeze(scenario, attitudes="anny")
    with pytest.raises(softhand.ScenarioError, match=r"wrenches: got .*six finite numbers"):
        softhand.squeeze(scenario, wrenches=[[0.0] * 5])
    with pytest.raises(softhand.ScenarioError, match="margin: got 1"):
        softhand.squeeze(scenario, margin=1.0)
    with pytest.raises(softhand.ScenarioError, match="force: got -1"):
        softhand.squeeze(scenario, force=-1.0)
    refused = run_command("squeeze", "pinch", "--friction", "0.01", folder=tmp_path)
    assert refused.returncode == 1 and "no squeeze of finger_1_tip, finger_2_tip holds: gravity" in refused.errors
    wrong = run_command("squeeze", "pinch", "--wrench", "1,2", folder=tmp_path)
    assert wrong.returncode == 2 and "give 6 numbers" in wrong.errors


def test_the_command_draws_and_prints(tmp_path: Path) -> None:
    """A table, a figure, and JSON with units."""
    shown = run_command("squeeze", "pinch", "--attitude", "30,0,0", "--out", "a.png", folder=tmp_path)
    assert shown.returncode == 0 and "least that holds" in shown.stdout
    assert (tmp_path / "a.png").stat().st_size > 10_000
    told = run_command("squeeze", "pinch", "--json", "--out", "b.png", folder=tmp_path)
    assert json.loads(told.stdout)["units"]["least"] == "N"
    assert_allclose(json.loads(told.stdout)["least"], [MASS * 9.81 / (2.0 * 0.5 * 0.8)], rtol=1e-4)
