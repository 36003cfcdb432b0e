"""The surface of a box: points spread over it, and the nearest one to a point."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from softhand.model.faces import Box

BOX = Box(Rotation.from_euler("xyz", [0.3, -0.5, 1.1]).as_matrix(), np.array([0.01, -0.02, 0.03]),
          np.array([0.028, 0.018, 0.030]))  # fmt: skip


@pytest.mark.parametrize("count", [1, 50, 400])
def test_points_lie_on_their_faces(count: int) -> None:
    """Each point on a face with its normal, inside its edges."""
    points, normals = BOX.surface_points(count)
    for point, normal in zip(points, normals, strict=True):
        face = min(BOX.faces(), key=lambda face: np.linalg.norm(face.normal - normal))
        np.testing.assert_allclose(face.normal, normal, atol=1e-15)
        assert abs(face.distance(point)) < 1e-15 and face.overhang(point) < -1e-3


def test_points_are_spread_evenly() -> None:
    """About as many as asked for, and on each face in proportion to its area."""
    points, normals = BOX.surface_points(2000)
    assert len(points) == pytest.approx(2000, rel=0.05)
    sides = 2.0 * BOX.half
    areas = np.prod(sides) / sides
    for axis in range(3):
        share = np.mean(np.abs(normals @ BOX.rotation[:, axis]) > 0.5)
        assert share == pytest.approx(areas[axis] / areas.sum(), rel=0.1)


@pytest.mark.parametrize("inside", [True, False])
def test_the_nearest_point_is_the_nearest(inside: bool) -> None:
    """On the surface, and no point of many on the surface is nearer."""
    rng = np.random.default_rng(0)
    surface, _ = BOX.surface_points(4000)
    for _ in range(100):
        place = rng.uniform(-1.0, 1.0, 3) * BOX.half * (0.99 if inside else 3.0)
        point = BOX.centre + BOX.rotation @ place
        nearest, normal = BOX.nearest(point)
        assert max(face.distance(nearest) for face in BOX.faces()) == pytest.approx(0.0, abs=1e-15)
        assert any(np.array_equal(face.normal, normal) and abs(face.distance(nearest)) < 1e-15 for face in BOX.faces())
        assert np.linalg.norm(point - nearest) <= np.linalg.norm(surface - point, axis=1).min() + 1e-12
        assert ((point - nearest) @ normal > 0.0) == np.any(np.abs(place) > BOX.half)


def test_the_nearest_point_of_a_surface_point_is_itself() -> None:
    """With the same normal."""
    for point, normal in zip(*BOX.surface_points(60), strict=True):
        nearest, there = BOX.nearest(point)
        np.testing.assert_allclose(nearest, point, atol=1e-15)
        np.testing.assert_array_equal(there, normal)
