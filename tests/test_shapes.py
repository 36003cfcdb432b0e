"""Geometry of the picture: closed shapes of the right volume, and the soft tip."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from softhand.tactile.tip_shape import Indentation, contact_axes, contact_turn, deformed
from softhand.viewer.scene.parts.torsion import torsion_arrow
from softhand.viewer.scene.parts.trails import tube
from softhand.viewer.scene.shapes.edges import feature_edges
from softhand.viewer.scene.shapes.mesh import Mesh, merged, moved
from softhand.viewer.scene.shapes.solids import box, capsule, cylinder, sphere
from softhand.viewer.scene.shapes.tip_mesh import net_segments, tip_faces, tip_net, tip_surface

RADIUS = 0.010  # [m]
PRESSED = Indentation(RADIUS, 0.0077, (0.4, 1.05), (0.0, 0.0, 0.0))
MOVED = Indentation(RADIUS, 0.0075, (-0.7, 0.95), (0.12, -0.08, 0.25))
CASES = [
    Indentation(RADIUS, RADIUS, (0.3, 1.0), (0.0, 0.0, 0.0)),
    PRESSED,
    MOVED,
    Indentation(RADIUS, 0.0065, (2.0, 0.6), (-0.1, 0.1, -0.3)),  # the disc reaches the rim
    Indentation(RADIUS, 0.008, (0.0, 1.5), (0.0, 0.15, 0.0)),  # phi beyond 90 deg
]


def volume(mesh: Mesh) -> float:
    """Signed volume, positive where the triangles are counter-clockwise seen from outside [m^3]."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.sum(a * np.cross(b, c)) / 6.0)


def tip(indentation: Indentation) -> Mesh:
    return Mesh(tip_surface(indentation), tip_faces())


def normal_of(indentation: Indentation) -> np.ndarray:
    return contact_axes(*indentation.angles)[:, 2]


@pytest.mark.parametrize(
    ("mesh", "expected"),
    [
        (box([0.1, 0.2, 0.3]), 0.006),
        (cylinder(0.1, 0.3), np.pi * 0.003),
        (sphere(0.1), 4.0 / 3.0 * np.pi * 1e-3),
        (capsule(0.1, 0.3), 4.0 / 3.0 * np.pi * 1e-3 + np.pi * 0.003),
    ],
    ids=["box", "cylinder", "sphere", "capsule"],
)
def test_rigid_shapes_enclose_their_volume(mesh, expected):
    """Triangles point outward and the facets lose little."""
    assert 0.97 * expected < volume(mesh) <= expected * (1.0 + 1e-9)


def wedge() -> Mesh:
    """A tetrahedron whose triangles share their vertices."""
    corners = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.3]])
    return Mesh(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32))


@pytest.mark.parametrize(
    ("mesh", "count"),
    [
        (box([0.1, 0.2, 0.3]), 12),
        (wedge(), 6),
        (cylinder(0.1, 0.3), 64),
        (sphere(0.1), 0),
        (capsule(0.1, 0.3), 0),
    ],
    ids=["box", "wedge", "cylinder", "sphere", "capsule"],
)
def test_edges_are_where_a_shape_bends(mesh, count):
    """One bar an edge, the rims of a cylinder facet by facet; none across a plane face or a smooth surface."""
    bars = feature_edges(mesh, 1e-3)
    assert len(bars.vertices) == count * 16 and np.isfinite(bars.vertices).all()


def test_bars_lie_on_the_edges_of_a_box():
    """Their middles are those of the edges; they reach their radius beyond the corners."""
    bars = feature_edges(box([0.2, 0.4, 0.6]), 1e-3).vertices
    middles = {tuple(middle) for middle in np.round(bars.reshape(12, 16, 3).mean(axis=1), 9) + 0.0}
    half = np.array([0.1, 0.2, 0.3])
    signs = [s for s in product((-1, 0, 1), repeat=3) if s.count(0) == 1]
    assert middles == {tuple(np.round(half * s, 9) + 0.0) for s in signs}
    np.testing.assert_allclose(bars.max(axis=0), half + 1e-3, atol=1e-9)


def test_merged_meshes_keep_their_volumes():
    """Faces of the second mesh point at its own vertices."""
    far = np.eye(4)
    far[:3, 3] = 1.0
    both = merged([box([1, 1, 1]), moved(box([1, 2, 1]), far)])
    assert volume(both) == pytest.approx(3.0)


@pytest.mark.parametrize("indentation", CASES)
def test_no_point_of_a_tip_lies_beyond_the_face(indentation):
    """The face plane is at R along the contact normal; surface and net stay on their side of it."""
    assert (tip_surface(indentation) @ normal_of(indentation)).max() <= indentation.distance + 1e-12


@pytest.mark.parametrize("indentation", CASES)
def test_the_rim_stays_bonded_to_the_flat_face(indentation):
    """The last ring lies on the circle of radius r in the plane x = 0, and nothing lies behind that plane."""
    surface = tip_surface(indentation)
    rim = surface[-49:-1]
    normal = normal_of(indentation)
    free = rim @ normal < indentation.distance - 1e-9  # not where the face has cut into it
    assert free.any()
    np.testing.assert_allclose(np.linalg.norm(rim[free], axis=1), RADIUS, rtol=1e-9)
    np.testing.assert_allclose(rim[:, 0], 0.0, atol=1e-12)
    assert surface[:, 0].min() >= 0.0


def test_material_points_of_the_rim_do_not_move():
    """Shear and twist are zero at the bonded rim, point by point."""
    angle = np.linspace(0.0, 2.0 * np.pi, 20)
    rim = np.stack([np.zeros(20), np.cos(angle), np.sin(angle)], axis=1)
    gentle = Indentation(RADIUS, 0.0095, (0.2, 1.2), (0.2, -0.1, 0.4))  # the face does not reach the rim
    np.testing.assert_allclose(deformed(gentle, rim), RADIUS * rim, atol=1e-15)


@pytest.mark.parametrize("indentation", [PRESSED, MOVED])
def test_the_flat_part_is_a_disc_of_the_contact_radius(indentation):
    """Vertices on the face fill a disc of radius sqrt(r^2 - R^2) around R z_C."""
    surface, normal = tip_surface(indentation), normal_of(indentation)
    flat = surface[surface @ normal > indentation.distance - 1e-9]
    away = np.linalg.norm(flat - indentation.distance * normal, axis=1)
    assert indentation.disc_radius == pytest.approx(np.sqrt(RADIUS**2 - indentation.distance**2))
    assert away.max() == pytest.approx(indentation.disc_radius, rel=0.03)


@pytest.mark.parametrize("indentation", CASES)
def test_the_volume_of_the_half_sphere_is_kept(indentation):
    """What the face cuts off bulges out beside it, within 8 %; the surface is closed and points outward."""
    assert volume(tip(indentation)) == pytest.approx(2.0 / 3.0 * np.pi * RADIUS**3, rel=0.08)


def test_without_contact_the_tip_is_a_half_sphere():
    """R = r: every vertex of the round part lies at r."""
    np.testing.assert_allclose(np.linalg.norm(tip_surface(CASES[0])[:-1], axis=1), RADIUS, rtol=1e-12)


def test_contact_axes_are_the_derivatives_of_the_contact_point():
    """x_C along dp/dTheta, y_C along dp/dPhi, z_C = p/R, with p of Eq. (14)."""
    theta, phi, h = 0.6, 0.8, 1e-6

    def p(a, b):
        return np.array([np.sin(b), np.cos(a) * np.cos(b), np.sin(a) * np.cos(b)])

    axes = contact_axes(theta, phi)
    np.testing.assert_allclose(axes[:, 0], (p(theta + h, phi) - p(theta - h, phi)) / (2 * h * np.cos(phi)), atol=1e-9)
    np.testing.assert_allclose(axes[:, 1], (p(theta, phi + h) - p(theta, phi - h)) / (2 * h), atol=1e-9)
    np.testing.assert_allclose(axes[:, 2], p(theta, phi), atol=1e-15)


def test_the_undeformed_place_of_the_contact_moves_to_the_contact():
    """(theta, phi) = (Theta + dtheta, Phi + dphi) of the undeformed tip is at R z_C, Eq. (15)."""
    (Theta, Phi), (dtheta, dphi, _) = MOVED.angles, MOVED.shear
    place = contact_axes(Theta + dtheta, Phi + dphi)[:, 2]
    np.testing.assert_allclose(deformed(MOVED, place[None])[0], MOVED.distance * normal_of(MOVED), atol=1e-15)


@pytest.mark.parametrize("dpsi", [0.2, -0.35])
def test_the_material_at_the_contact_is_twisted_by_dpsi_against_the_finger(dpsi):
    """A point of the disc turns by -dpsi about the outward normal: the finger turns by +dpsi against the object."""
    still, twisted = PRESSED, PRESSED._replace(shear=(0.0, 0.0, dpsi))
    axes = contact_axes(*still.angles)
    beside = np.cos(0.2) * axes[:, 2] + np.sin(0.2) * axes[:, 0]
    before, after = deformed(still, beside[None])[0] @ axes, deformed(twisted, beside[None])[0] @ axes
    turned = np.arctan2(after[1], after[0]) - np.arctan2(before[1], before[0])
    assert turned == pytest.approx(-dpsi, abs=1e-12)


def test_the_turn_of_the_contact_follows_the_velocities_of_the_kinematics():
    """The patch moves in F against the finger's velocity over the object.

    v_x = R cosPhi dtheta', v_y = R dphi', w_z = dpsi' + sinPhi dtheta' of [Nakashima] Eqs. (37), (42): with the object
    fixed in F's contact frame, the material there has -v_x, -v_y and -w_z.
    """
    Theta, Phi, h = 0.5, 0.9, 1e-6
    rates = np.array([0.3, -0.4, 0.7])
    axes = contact_axes(Theta, Phi)
    # a deformation grown from rest at the place that is (Theta, Phi) before it and Theta - h dtheta' after it
    moved = Indentation(1.0, 1.0, (Theta - h * rates[0], Phi - h * rates[1]), tuple(h * rates))
    spin = (contact_turn(moved) - np.eye(3)) / h
    omega = axes.T @ np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
    velocity = axes.T @ (spin @ axes[:, 2])  # for R = 1
    np.testing.assert_allclose(velocity[:2], [-np.cos(Phi) * rates[0], -rates[1]], atol=1e-5)
    assert omega[2] == pytest.approx(-(rates[2] + np.sin(Phi) * rates[0]), abs=1e-5)


def test_topology_never_changes():
    """Faces and segments refer to vertices that are there for every deformation."""
    sizes = {(len(tip_surface(case)), len(tip_net(case))) for case in CASES}
    assert len(sizes) == 1
    surface, net = sizes.pop()
    assert tip_faces().max() == surface - 1
    assert net_segments().max() == net - 1


@pytest.mark.parametrize("angle", [0.5, -2.0])
def test_the_gauge_ends_at_its_angle(angle):
    """The head's point lies at the angle about z, right-handed; the arc starts on the x axis."""
    rings = torsion_arrow(angle, 1.0).vertices.reshape(-1, 8, 3)
    start, end = rings[0].mean(axis=0), rings[-1].mean(axis=0)
    assert np.arctan2(start[1], start[0]) == pytest.approx(0.0, abs=1e-12)
    assert np.arctan2(end[1], end[0]) == pytest.approx(angle)


def test_a_tube_follows_its_path():
    """Each ring is about a point of the path, across it, of the radius asked for."""
    path = np.stack([np.linspace(0.0, 1.0, 50), np.zeros(50), np.zeros(50)], axis=1)
    rings = tube(path, np.array([0.0, 0.0, 1.0]), 0.2).reshape(-1, 6, 3)
    np.testing.assert_allclose(rings.mean(axis=1)[[0, -1]], [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(np.ptp(rings[:, :, 0], axis=1), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.hypot(rings[:, :, 1], rings[:, :, 2]), 0.2)


@pytest.mark.parametrize("samples", [0, 1, 2])
def test_a_tube_of_a_short_or_resting_path_is_finite(samples):
    """No direction is needed where nothing moved."""
    assert np.isfinite(tube(np.zeros((samples, 3)), np.array([0.0, 0.0, 1.0]), 0.1)).all()
