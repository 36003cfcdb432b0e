"""Force closure and its margin: against hand calculation, hulls that close in on it, and linear programs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation
from test_wrenches import enlarged, opposite, ring_of, turned

from softhand.contact.limit import limit_of
from softhand.grasping.margin import closure_margin, is_force_closure, supports, wrench_sets
from softhand.grasping.materials import read_materials
from softhand.grasping.quality import grasp_quality
from softhand.grasping.wrenches import Contacts
from softhand.scenario.scenario import load_scenario, with_law

SCENARIO = load_scenario("target-a")
TIPS = [
    read_materials(scenario)[0] for scenario in (SCENARIO, with_law(SCENARIO, "hertz"), with_law(SCENARIO, "power"))
]


def any_contacts(seed: int) -> Contacts:
    """Two to five soft fingers in general position, each with a friction and a torsion of its own.

    Odd ones with ellipses, even ones with the exact limit surface of a law at some depth.
    """
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 6))
    points = rng.normal(size=(count, 3))
    if count == 2:
        points[1] = -points[0] + 0.2 * rng.normal(size=3)
    points /= np.linalg.norm(points, axis=1)[:, None]
    normals = -points + 0.4 * rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    points *= rng.uniform(0.015, 0.05, (count, 1))
    curves = np.zeros((count, 5))
    if seed % 2 == 0:
        curves = np.array([TIPS[k % 3].torsion(rng.uniform(0.5e-3, 4e-3)).curve for k in range(count)])
        assert np.all(np.any(curves, axis=1))
    return Contacts(points, normals, rng.uniform(0.3, 1.2, count), rng.uniform(0.0005, 0.01, count), 0.025, curves)


ANGLES = np.linspace(0.0, 0.5 * math.pi, 2001)


def own_support(contacts: Contacts, i: int, along: np.ndarray) -> np.ndarray:
    """The point of the limit surface of one contact that is furthest along (x, y, z), by trying very many."""
    force, torsion = np.cos(ANGLES), np.sin(ANGLES)
    size = np.array(
        [math.sqrt(limit_of(contacts.curves[i], (f, 0.0, t))[0]) for f, t in zip(force, torsion, strict=True)]
    )
    a, b = math.hypot(along[0], along[1]), abs(along[2])
    k = int(np.argmax((a * force + b * torsion) / size))
    return np.array([*(force[k] / size[k] * along[:2] / max(a, 1e-300)), torsion[k] / size[k] * np.sign(along[2])])


def points_on(contacts: Contacts, directions: np.ndarray) -> np.ndarray:
    """What each contact can do along some directions of its own forces and torsion, shape (points, 6)."""
    found = []
    for centre, spread, curve in zip(*wrench_sets(contacts), strict=True):
        found += [centre + spread @ d / math.sqrt(limit_of(curve, tuple(d))[0]) for d in directions]
    return np.array(found)


def margin_by_hulls(contacts: Contacts) -> tuple[float, float]:
    """Two bounds of the margin 0.8 % apart: a hull of points, with more of them where it is nearest to zero.

    No facet of the hull is further out than what it stands for, and no support along a normal is less than the margin.
    """
    sets = wrench_sets(contacts)
    points, least = points_on(contacts, np.vstack([np.eye(3), -np.eye(3)])), math.inf
    for _ in range(60):
        hull = ConvexHull(points, qhull_options="QJ")
        nearest = np.argsort(-hull.equations[:, -1])[:60]
        normals, offsets = hull.equations[nearest, :-1], -hull.equations[nearest, -1]
        least = min(least, float(supports(sets, normals).max(axis=0).min()))
        if least < 1e-7:
            return 0.0, 0.0
        if offsets[0] > 0.992 * least:
            return float(offsets[0]), least
        for normal in normals[offsets < 0.992 * least][:15]:
            i = int(np.argmax(supports(sets, normal[None])))
            points = np.vstack(
                [points, sets.centres[i] + sets.spreads[i] @ own_support(contacts, i, sets.spreads[i].T @ normal)]
            )
    raise AssertionError("the hulls do not close in")


@pytest.mark.parametrize("seed", [0, 1, 2, 4])
def test_the_supports_are_those_of_the_limit_surfaces(seed: int) -> None:
    """Against very many points of each surface, ellipse or exact, and in directions without force or torsion."""
    contacts, rng = any_contacts(seed), np.random.default_rng(seed)
    sets, directions = wrench_sets(contacts), rng.normal(size=(20, 6))
    directions[0] = sets.spreads[0, :, 2]  # hardly any friction
    found = supports(sets, directions)
    for i, (centre, spread) in enumerate(zip(sets.centres, sets.spreads, strict=True)):
        for k, d in enumerate(directions):
            expected = d @ (centre + spread @ own_support(contacts, i, spread.T @ d))
            assert found[i, k] - d @ centre == pytest.approx(expected - d @ centre, rel=2e-5)


@pytest.mark.parametrize("seed", range(12))
def test_the_margin_is_that_of_ever_finer_hulls(seed: int) -> None:
    """In general position, to one per cent, for grasps with and without force closure."""
    below, above = margin_by_hulls(any_contacts(seed))
    margin = closure_margin(any_contacts(seed))
    assert below * 0.999 <= margin <= above * 1.002
    assert (margin == 0.0) == (above == 0.0)


def test_both_kinds_are_among_them() -> None:
    """Grasps that close and grasps that do not."""
    closed = [closure_margin(any_contacts(seed)) > 0.0 for seed in range(12)]
    assert 3 < sum(closed) < 11


@pytest.mark.parametrize("name", ["target-a", "prism", "pinch", "gripper"])
def test_the_margin_of_what_ships_is_that_of_hulls(name: str) -> None:
    """Symmetric grasps too, in which many contacts meet one plane of the hull."""
    contacts = grasp_quality(load_scenario(name)).contacts
    below, above = margin_by_hulls(contacts)
    assert 0.0 < below * 0.999 <= closure_margin(contacts) <= above * 1.002


def test_the_margin_of_target_a() -> None:
    """With ellipses, and with the exact limit surfaces inside; a bipyramid, inside of both, would give 0.0578."""
    for limit, margin in (("ellipse", 0.0693), ("exact", 0.0674)):
        quality = grasp_quality(load_scenario("target-a", {"fingertip.limit": limit}))
        assert quality.margin == pytest.approx(margin, abs=1e-4)


@pytest.mark.parametrize(("half", "reach"), [(0.03, 0.004), (0.01, 0.004), (0.03, 0.02), (0.002, 0.004)])
@pytest.mark.parametrize("mu", [0.2, 0.8])
def test_margin_of_two_opposite_fingers(half: float, reach: float, mu: float) -> None:
    """The least of mu l / L, of the torsion about their line, and mu / sqrt(1 + mu^2 + (L / a)^2).

    The latter is along (mu, 1, L / a) in force along the line, force across it and moment about the third axis: there
    the friction of one finger counts twice, that of the other not at all, and their pressures make up for it.
    """
    length = 0.025
    expected = min(mu * reach / length, mu / math.sqrt(1.0 + mu**2 + (length / half) ** 2))
    assert closure_margin(opposite(half, mu, reach, length)) == pytest.approx(expected, rel=2e-3)


def test_two_hard_fingers_do_not_close() -> None:
    """Without torsion nothing answers a moment about their line."""
    assert closure_margin(opposite(reach=0.0)) == 0.0
    assert not is_force_closure(opposite(reach=0.0)) and is_force_closure(opposite())


def test_three_hard_fingers_close() -> None:
    """Flat limit surfaces, without torsion, are none the less met."""
    contacts = ring_of(3, reach=0.0)
    below, above = margin_by_hulls(contacts)
    assert 0.1 < below * 0.999 <= closure_margin(contacts) <= above * 1.002


def test_fingers_on_one_side_do_not_close() -> None:
    """Three soft fingers that push the same way answer no pull along it."""
    points = np.array([[0.0, 0.0, 0.0], [0.02, 0.0, 0.0], [0.0, 0.02, 0.0]])
    contacts = Contacts(
        points, np.tile([0.0, 0.0, 1.0], (3, 1)), np.full(3, 0.9), np.full(3, 0.005), 0.02, np.zeros((3, 5))
    )
    assert closure_margin(contacts) == 0.0


@pytest.mark.parametrize(("apart", "closes"), [(30.0, True), (39.0, True), (41.0, False), (60.0, False)])
def test_two_soft_fingers_close_inside_each_others_cones(apart: float, closes: bool) -> None:
    """Nguyen's condition: the line between the contacts lies inside both cones; faces at 40 deg to each other are the
    border with mu = tan 20 deg."""
    half = math.radians(apart / 2.0)
    points = np.array([[0.03, 0.0, 0.0], [-0.03, 0.0, 0.0]])
    normals = np.array([[-math.cos(half), 0.0, math.sin(half)], [math.cos(half), 0.0, math.sin(half)]])
    mu = np.full(2, math.tan(math.radians(20.0)))
    contacts = Contacts(points, normals, mu, np.full(2, 0.005), 0.03, np.zeros((2, 5)))
    assert is_force_closure(contacts) is closes


@pytest.mark.parametrize("count", [3, 4, 5])
def test_removing_a_finger_lowers_the_margin(count: int) -> None:
    """Less can do less."""
    contacts = ring_of(count)
    for index in range(count):
        assert closure_margin(contacts.without(index)) < closure_margin(contacts)


def test_the_margin_has_no_scale_and_no_direction() -> None:
    """All lengths three times as long, or everything turned: the same margin."""
    contacts = any_contacts(3)
    margin = closure_margin(contacts)
    assert margin > 0.0 and closure_margin(enlarged(contacts, 3.0)) == pytest.approx(margin, rel=1e-9)
    for rotation in Rotation.random(5, random_state=1).as_matrix():
        assert closure_margin(turned(contacts, rotation)) == pytest.approx(margin, rel=2e-3)


def test_every_wrench_of_the_size_of_the_margin_is_answered() -> None:
    """By a linear program over many points of the limit surfaces: one newton of normal force makes s d for s of the
    margin and beyond, in every direction d, and hardly beyond in the worst of many."""
    contacts, rng = any_contacts(3), np.random.default_rng(0)
    sphere = rng.normal(size=(400, 3))
    points = points_on(contacts, sphere / np.linalg.norm(sphere, axis=1)[:, None])
    directions = rng.normal(size=(40, 6))
    reached = []
    for d in directions / np.linalg.norm(directions, axis=1)[:, None]:
        rows = np.vstack([np.column_stack([points.T, -d]), [*np.ones(len(points)), 0.0]])
        reached.append(linprog([*np.zeros(len(points)), -1.0], A_eq=rows, b_eq=[*np.zeros(6), 1.0]).x[-1])
    margin = closure_margin(contacts)
    assert margin > 0.0 and 0.97 * margin < min(reached) < 10.0 * margin
