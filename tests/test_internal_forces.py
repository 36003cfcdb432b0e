"""f_N = K^+ f_C for any number of contacts, anywhere."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from softhand.contact.pairs import contact_pairs
from softhand.contact.records import CONTACT
from softhand.numerics.arrays import Array
from softhand.sensing.internal_forces import internal_forces
from softhand.sensing.truss import truss_forces

PLACES = {
    "in space": lambda points: points,
    "in a plane": lambda points: points @ np.diag([1.0, 1.0, 0.0]) @ np.linalg.qr(points[:3].T)[0],
    "nearly in a plane": lambda points: points @ np.diag([1.0, 1.0, 1e-3]),
    "on a line": lambda points: points @ np.diag([1.0, 0.0, 0.0]),
    "two at one point": lambda points: points[[0, 0, *range(2, len(points))]],
}


def contacts_at(points: Array, rng: np.random.Generator) -> Array:
    """Contacts at these points with frames and forces of their own."""
    contacts = np.zeros(len(points), CONTACT)
    contacts["point"] = points + np.array([0.3, -0.2, 0.5])
    contacts["force"] = rng.normal(size=(len(points), 4))
    contacts["rotation"] = np.linalg.qr(rng.normal(size=(len(points), 3, 3)))[0]
    return contacts


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("count", [2, 3, 4, 5, 6, 10])
def test_internal_forces_are_those_of_the_pseudo_inverse(count: int, place: str) -> None:
    """Of numpy, with singular values that count as zero at the same share of the largest."""
    rng = np.random.default_rng(count)
    contacts = contacts_at(PLACES[place](0.05 * rng.normal(size=(max(count, 3), 3)))[:count], rng)
    pairs = np.array(contact_pairs(count), dtype=np.int64)
    K, f_N = np.zeros((3 * count, len(pairs))), np.zeros(len(pairs))
    internal_forces(contacts, pairs, K, f_N)
    expected = np.linalg.pinv(K, rcond=1e-6) @ contacts["force"][:, :3].ravel()
    assert_allclose(f_N, expected, rtol=0.0, atol=1e-8 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize(("place", "alone"), [("in space", True), ("in a plane", True), ("on a line", False)])
def test_where_the_truss_alone_tells_the_forces(place: str, alone: bool) -> None:
    """One factor is enough where the joints can only move together, or out of their plane."""
    rng = np.random.default_rng(7)
    contacts = contacts_at(PLACES[place](0.05 * rng.normal(size=(6, 3))), rng)
    pairs = np.array(contact_pairs(6), dtype=np.int64)
    assert truss_forces(contacts, pairs, np.zeros(len(pairs))) == alone
