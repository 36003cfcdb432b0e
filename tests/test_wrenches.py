"""What contacts can do to an object, and the least squeeze: against hand calculation and by symmetry."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from softhand.contact.grasp_map import grasp_map
from softhand.grasping.wrenches import (
    Contacts,
    grasp_matrix,
    least_squeeze,
    singular_values,
    tangents,
)


def opposite(half: float = 0.03, mu: float = 0.5, reach: float = 0.004, length: float = 0.025) -> Contacts:
    """Two fingers that press on the sides +x and -x of an object."""
    points = np.array([[half, 0.0, 0.0], [-half, 0.0, 0.0]])
    return Contacts(points, -points / half, np.full(2, mu), np.full(2, reach), length, np.zeros((2, 5)))


def ring_of(count: int, mu: float = 0.6, reach: float = 0.004) -> Contacts:
    """Fingers around a disc of 30 mm, a little above and below its plane in turn."""
    a = 2.0 * math.pi * np.arange(count) / count
    inward = -np.column_stack([np.cos(a), np.sin(a), np.zeros(count)])
    points = -0.03 * inward + np.outer(0.004 * (-1.0) ** np.arange(count), [0.0, 0.0, 1.0])
    return Contacts(points, inward, np.full(count, mu), np.full(count, reach), 0.03, np.zeros((count, 5)))


def turned(contacts: Contacts, rotation: np.ndarray) -> Contacts:
    return replace(contacts, points=contacts.points @ rotation.T, normals=contacts.normals @ rotation.T)


def enlarged(contacts: Contacts, factor: float) -> Contacts:
    """All lengths so many times as long."""
    lengths = ("points", "torsion_length", "length")
    return replace(contacts, **{name: factor * getattr(contacts, name) for name in lengths})


# ------------------------------------------------------------------------------------------------------ the grasp map


def test_the_wrench_of_one_force() -> None:
    """An upward force out on +x turns the object about -y: the moment is p x f."""
    G = grasp_map(np.array([[0.03, 0.0, 0.0]]))
    np.testing.assert_array_equal(G @ [0.0, 0.0, 2.0], [0.0, 0.0, 2.0, 0.0, -0.06, 0.0])


def test_the_wrenches_of_some_forces_add_up() -> None:
    """In general position: sum f and sum p x f, and the transpose is the velocity of the points of a moving body."""
    rng = np.random.default_rng(3)
    arms, forces, twist = rng.normal(size=(4, 3)), rng.normal(size=(4, 3)), rng.normal(size=6)
    G = grasp_map(arms)
    np.testing.assert_allclose(G @ forces.ravel(), [*forces.sum(axis=0), *np.cross(arms, forces).sum(axis=0)])
    np.testing.assert_allclose((G.T @ twist).reshape(4, 3), twist[:3] + np.cross(twist[3:], arms))


@pytest.mark.parametrize("seed", range(5))
def test_tangents_make_a_right_handed_frame(seed: int) -> None:
    """(t_1, t_2, n) is a rotation."""
    normal = np.random.default_rng(seed).normal(size=3)
    normal /= np.linalg.norm(normal)
    frame = np.column_stack([*tangents(normal), normal])
    np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-15)
    assert np.linalg.det(frame) == pytest.approx(1.0, abs=1e-12)


def test_the_grasp_map_is_dual_to_the_velocities() -> None:
    """G^T takes a twist of the object to v + w x p of the contact points along (t_1, t_2, n) and n . w."""
    contacts, rng = ring_of(3), np.random.default_rng(0)
    v, w = rng.normal(size=3), rng.normal(size=3)
    seen = (grasp_matrix(contacts).T @ np.concatenate([v, w])).reshape(3, 4)
    for row, point, normal in zip(seen, contacts.points, contacts.normals, strict=True):
        speed = v + np.cross(w, point)
        np.testing.assert_allclose(row, [*(axis @ speed for axis in (*tangents(normal), normal)), normal @ w])


def test_singular_values_of_two_opposite_fingers() -> None:
    """sqrt 2 for each force and for the torsion about the line, sqrt 2 a / L for the moments across it."""
    contacts = opposite(half=0.03, length=0.02)
    root = math.sqrt(2.0)
    np.testing.assert_allclose(singular_values(contacts), sorted([root] * 4 + [1.5 * root] * 2)[::-1], rtol=1e-12)
    hard = singular_values(contacts, has_torsion=False)
    np.testing.assert_allclose(hard, [1.5 * root, 1.5 * root, root, root, root, 0.0], atol=1e-12)


def test_the_singular_values_have_no_scale_and_no_direction() -> None:
    """All lengths three times as long, or everything turned: the same values."""
    small = ring_of(3)
    np.testing.assert_allclose(singular_values(enlarged(small, 3.0)), singular_values(small), rtol=1e-12)
    for rotation in Rotation.random(3, random_state=1).as_matrix():
        np.testing.assert_allclose(singular_values(turned(small, rotation)), singular_values(small), rtol=1e-12)


# ---------------------------------------------------------------------------------------------------- least squeeze


def pinched(weight: np.ndarray, mu: float = 0.5, **limits: float) -> np.ndarray | None:
    """Two opposite fingers that share a weight."""
    contacts = opposite(mu=mu)
    internal = contacts.normals[:, :, None]
    return least_squeeze(np.tile(-0.5 * weight, (2, 1)), internal, contacts.normals, contacts.friction, **limits)


@pytest.mark.parametrize("tilt", [0.0, 0.3, 0.7])
def test_two_fingers_squeeze_by_the_weight_over_twice_mu(tilt: float) -> None:
    """f_N = W / (2 mu), in whatever direction across the line the weight pulls: the cones are round."""
    weight = 3.0 * np.array([0.0, -math.sin(tilt), -math.cos(tilt)])
    np.testing.assert_allclose(pinched(weight, mu=0.4), [3.0 / 0.8], rtol=1e-6)
    np.testing.assert_allclose(pinched(weight, mu=0.4, use=0.5), [3.0 / 0.4], rtol=1e-6)


def test_a_weight_along_the_line_is_carried_by_one_side() -> None:
    """The finger that the weight pulls away from needs half of it more."""
    np.testing.assert_allclose(pinched(np.array([-2.0, 0.0, 0.0])), [1.0], rtol=1e-9)
    np.testing.assert_allclose(pinched(np.array([-2.0, 0.0, 0.0]), least_normal=0.3), [1.3], rtol=1e-9)


def test_no_squeeze_holds_where_the_cones_cannot() -> None:
    """A squeeze along a line outside the cones only makes it worse."""
    contacts = opposite(mu=0.1)
    line = np.array([[-1.0, 0.0, 0.5], [1.0, 0.0, -0.5]]) / math.hypot(1.0, 0.5)
    carried = np.tile([0.0, 0.0, 1.0], (2, 1))
    assert least_squeeze(carried, line[:, :, None], contacts.normals, contacts.friction) is None


@pytest.mark.slow
def test_fingers_on_one_face_spread_where_that_saves_squeeze() -> None:
    """Of a spreading and a squeezing internal force of one line the cheaper sign is taken: min |f_N|, not f_N >= 0."""
    contacts = opposite(mu=0.4)
    weight = np.tile([0.0, 0.0, -0.5], (2, 1))
    internal = contacts.normals[:, :, None]
    plain = least_squeeze(weight, internal, contacts.normals, contacts.friction)
    turned = least_squeeze(weight, -internal, contacts.normals, contacts.friction)
    assert plain is not None and turned is not None and plain[0] > 0.0
    np.testing.assert_allclose(turned, -plain, rtol=1e-9)
