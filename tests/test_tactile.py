"""The field of taxels of one contact: sums, symmetry, growth, continuity, and the pressure that it goes over into."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tactile_rig import Rig, pointing

from softhand.errors import ScenarioError
from softhand.laws.hemisphere import Hemisphere
from softhand.laws.hertz import Hertz
from softhand.laws.nakashima import Nakashima
from softhand.laws.plain import Plain
from softhand.model.shapes.box import Box
from softhand.model.shapes.cylinder import Cylinder
from softhand.model.shapes.ellipsoid import Ellipsoid
from softhand.model.shapes.sphere import Sphere
from softhand.tactile.growth import pressure_exponent
from softhand.tactile.pattern import FEWEST, MOST, spacing, taxel_pattern
from softhand.tactile.solid import set_depths
from softhand.tactile.taxels import taxel_area

R = 0.01  # [m]
PAPER = Nakashima(radius=R, k_r=377e3, k_phi=166e3, k_theta=26.6e6, k_psi=48.8e6)
LAWS = [Hemisphere(radius=R), Hertz(radius=R), PAPER]
BOX = Box(np.eye(3), np.array([0.0, 0.0, -0.02]), np.array([0.02, 0.02, 0.02]))
CAN = Cylinder(np.eye(3), np.array([0.0, 0.0, -0.02]), 0.02, 0.02)
BALL = Sphere(np.eye(3), np.array([0.0, 0.0, -0.015]), 0.015)
DOWN = np.array([0.3, -0.2, -1.0])
LOAD = (0.6, -0.4, 2.0, 1.5e-3)
PLACES = {  # where a tip meets what, and from which side
    "face": (None, np.array([0.001, 0.002, 0.0]), np.array([0.0, 0.0, 1.0])),
    "edge": (BOX, np.array([0.02, 0.004, 0.0]), np.array([1.0, 0.0, 1.3])),
    "vertex": (BOX, np.array([0.02, 0.02, 0.0]), np.array([1.0, 0.8, 1.1])),
    "ball": (BALL, np.array([0.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])),
    "can": (CAN, np.array([0.0, 0.02, -0.01]), np.array([0.0, 1.0, 0.0])),
}


def felt_at(rig, place, depth, rotation, **given):
    """What is felt so deep in a place of `PLACES`."""
    _, foot, away = PLACES[place]
    return rig.feel(foot + away / np.linalg.norm(away) * (R - depth), rotation, **given)


@pytest.mark.parametrize("pattern", ["fibonacci", "rings"])
@pytest.mark.parametrize("count", [19, 37, 100, MOST])
def test_taxels_are_spread_evenly_over_the_hemisphere(pattern, count):
    """Unit vectors out of the flat face, as many as asked for, with their middle and second moments, none too near."""
    places = taxel_pattern(count, pattern)
    assert places.shape == (count, 3)
    np.testing.assert_allclose(np.linalg.norm(places, axis=1), 1.0, atol=1e-12)
    assert places[:, 0].min() > 0.0
    np.testing.assert_allclose(places.mean(axis=0), [0.5, 0.0, 0.0], atol=0.6 / count**0.9)
    np.testing.assert_allclose(places.T @ places / count, np.eye(3) / 3.0, atol=1.5 / count)
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1) + 9.0 * np.eye(count)
    assert 0.5 * spacing(count) < apart.min() and apart.min(axis=1).max() < 1.4 * spacing(count)


@pytest.mark.parametrize(("count", "pattern", "names"), [
    (11, "rings", "tactile.count: got 11"), (MOST + 1, "rings", "12 to 2000"), (True, "rings", "got True"),
    (50.0, "rings", "got 50.0"), (50, "ring", "did you mean 'rings'"), (50, "grid", "there are: fibonacci, rings"),
])  # fmt: skip
def test_a_pattern_that_there_is_not_is_named(count, pattern, names):
    """Too few, too many, no whole number, no such pattern."""
    with pytest.raises(ScenarioError, match=names):
        taxel_pattern(count, pattern)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
@pytest.mark.parametrize("place", PLACES)
def test_the_sum_of_all_taxels_is_the_contact_force_and_its_torsion(law, place):
    """Normal force, both shear forces and the moment of the shear about the contact point, to 1e-12, in any state."""
    rng = np.random.default_rng(3)
    for count in (FEWEST, 100):
        rig = Rig(law, PLACES[place][0], taxel_pattern(count))
        for _ in range(8):
            depth, force = 10.0 ** rng.uniform(-7.0, -2.5), rng.normal(size=4) * (1.0, 1.0, 2.0, 3e-3)
            shear = rng.normal(size=3) * ((1e-3, 1e-3, 0.2) if rig.pad["is_surface"] else (0.1, 0.1, 0.2))
            rotation = pointing(-PLACES[place][2] + 0.6 * rng.normal(size=3), rng.uniform(0.0, 6.0))
            felt = felt_at(rig, place, depth, rotation, shear=tuple(shear), force=tuple(force))
            assert abs(felt.tactile_normal_force.sum() - force[2]) < 1e-12
            np.testing.assert_allclose(felt.tactile_shear_force.sum(axis=0), force[:2], atol=1e-12)
            assert abs(rig.torsion(felt) - force[3]) < 1e-12
            assert np.sign(force[2]) * felt.tactile_normal_force.min() >= 0.0


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
@pytest.mark.parametrize("count", [FEWEST, 100])
def test_each_taxel_grows_as_long_as_the_load_grows(law, count):
    """On a face, wherever it is on the tip: no normal force falls while the tip is pressed on."""
    rng = np.random.default_rng(5)
    for pattern in ("fibonacci", "rings"):
        rig = Rig(law, places=taxel_pattern(count, pattern))
        for _ in range(4):
            rotation = pointing(DOWN + 0.5 * rng.normal(size=3) * (1.0, 1.0, 0.2), rng.uniform(0.0, 6.0))
            depths = np.linspace(1e-5, 0.9 * min(law.deepest, 0.4) * R, 60)
            forces = np.array([rig.press(depth, rotation).tactile_normal_force for depth in depths])
            assert np.all(np.diff(forces, axis=0) >= 0.0)


@pytest.mark.parametrize(("place", "most"), [("edge", 2e-3), ("vertex", 2e-3), ("ball", 1e-5), ("can", 1e-5)])
def test_on_edges_and_balls_hardly_a_taxel_falls(place, most):
    """There the contact grows otherwise than that of the law; nothing falls by more than 0.2 % of the highest."""
    rig, rotation = Rig(LAWS[0], PLACES[place][0]), pointing(-PLACES[place][2] + 0.3)
    forces = np.array([felt_at(rig, place, d, rotation).tactile_normal_force for d in np.linspace(1e-5, 0.0036, 90)])
    highest = np.maximum.accumulate(forces, axis=0)
    assert (highest - forces).max() < most * forces.max()


def test_shear_grows_with_the_tangential_force_and_the_torsion():
    """At one depth the field is linear in force and torsion, each a pattern of its own."""
    rig, rotation = Rig(LAWS[0]), pointing(DOWN)
    along, turning, both = (
        rig.press(0.002, rotation, force=load).tactile_shear_force
        for load in ((0.6, -0.4, 2.0, 0.0), (0.0, 0.0, 2.0, 1e-3), (1.2, -0.8, 2.0, 3e-3))
    )
    np.testing.assert_allclose(both, 2.0 * along + 3.0 * turning, atol=1e-15)
    assert np.all(np.abs(both) >= 0.0) and np.abs(turning.sum(axis=0)).max() < 1e-15
    x = rig.skin.moved[:2].T
    touched = np.linalg.norm(turning, axis=1) > 0.0
    assert np.all((x[:, 0] * turning[:, 1] - x[:, 1] * turning[:, 0])[touched & (np.hypot(*x.T) > 0.1)] > 0.0)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
@pytest.mark.parametrize("place", PLACES)
def test_a_pattern_that_is_turned_with_the_tip_feels_the_same(law, place):
    """The field knows no axes of the finger frame but through the taxels."""
    turn = Rotation.from_rotvec([0.4, 0.0, 0.0]).as_matrix()  # about x_F, so that a polar law sees the same Phi
    rotation, places = pointing(-PLACES[place][2] + 0.4), taxel_pattern(60)
    shear = (3e-4, -5e-4, 0.1) if law.coordinates == "surface" else (0.03, -0.05, 0.1)
    first, second = Rig(law, PLACES[place][0], places), Rig(law, PLACES[place][0], places @ turn)
    one = felt_at(first, place, 0.0021, rotation, shear=shear, force=LOAD, slip=(1e-3, 2e-3, 0.3))
    other = felt_at(second, place, 0.0021, rotation @ turn, shear=shear, force=LOAD, slip=(1e-3, 2e-3, 0.3))
    for a, b in zip(one, other, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-12)


@pytest.mark.parametrize("place", PLACES)
def test_turning_tip_and_object_together_changes_nothing(place):
    """The field does not know the world."""
    rig, shear = Rig(LAWS[0], PLACES[place][0]), (3e-4, -5e-4, 0.1)
    _, foot, away = PLACES[place]
    tip, rotation = foot + away / np.linalg.norm(away) * (R - 0.0021), pointing(-away + 0.4)
    Q, shift = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix(), np.array([0.3, -0.2, 0.5])
    one = rig.feel(tip, rotation, shear, LOAD, (1e-3, 2e-3, 0.3))
    other = rig.feel(Q @ tip + shift, Q @ rotation, shear, LOAD, (1e-3, 2e-3, 0.3), (Q, shift))
    for a, b in zip(one, other, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-9 * np.abs(a).max())


def test_a_mirrored_tip_feels_the_mirrored_field():
    """Mirrored at a plane through the normal: taxels, tangential force and torsion change their sides alike."""
    mirror, places = np.diag([1.0, -1.0, 1.0]), taxel_pattern(80)
    rotation = pointing(DOWN)
    one = Rig(LAWS[0], places=places).press(
        0.002, rotation, shear=(3e-4, 5e-4, 0.1), force=LOAD, slip=(1e-3, 2e-3, 0.3)
    )
    # C_F: x_C along x, y_C = z_C cross x_C = -y of the world; mirroring y turns the sign of y_C and of what is about z
    flipped = mirror @ rotation @ mirror
    other = Rig(LAWS[0], places=places @ mirror).press(
        0.002,
        flipped,
        shear=(3e-4, -5e-4, -0.1),
        force=(LOAD[0], -LOAD[1], LOAD[2], -LOAD[3]),
        slip=(1e-3, -2e-3, -0.3),
    )
    for name in ("tactile_normal_force", "tactile_slip", "penetration_depth"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-12)
    np.testing.assert_allclose(one.tactile_shear_force * (1.0, -1.0), other.tactile_shear_force, atol=1e-12)


@pytest.mark.parametrize("place", PLACES)
def test_tips_of_another_size_feel_the_same_shares(place):
    """All lengths twice as large: the same shares of the force, twice the depths."""
    _, foot, away = PLACES[place]
    z, rotation = away / np.linalg.norm(away), pointing(-away + 0.4)
    shape = PLACES[place][0]
    twice = shape and type(shape)(
        shape.rotation, *(2.0 * getattr(shape, one.name) for one in fields(shape) if one.name != "rotation")
    )
    small, large = Rig(Hemisphere(radius=R), shape), Rig(Hemisphere(radius=2.0 * R), twice)
    one = small.feel(foot + z * (R - 0.002), rotation, force=LOAD)
    other = large.feel(2.0 * (foot + z * (R - 0.002)), rotation, force=(*LOAD[:3], 2.0 * LOAD[3]))
    np.testing.assert_allclose(other.tactile_normal_force, one.tactile_normal_force, atol=1e-12)
    np.testing.assert_allclose(other.tactile_shear_force, one.tactile_shear_force, atol=1e-12)
    np.testing.assert_allclose(other.penetration_depth, 2.0 * one.penetration_depth, atol=1e-14)


@pytest.mark.parametrize(
    ("law", "m"), [(LAWS[0], 0.5), (LAWS[1], 0.5), (PAPER, 1.0), (Plain(radius=R, c=1e3, k_tangential=1e3), 0.0)]
)
def test_the_pressure_is_as_steep_as_the_force_grows(law, m):
    """m = n - 1 of f ~ d^n: Hertz's pressure for his force, the depth of columns for the paper's."""
    assert pressure_exponent(law) == pytest.approx(m, abs=1e-9)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_a_finer_pattern_goes_over_into_the_pressure_of_the_law(law):
    """p = w (m + 1) f_z / (2 pi r dr) y^m, y = 1 - w r (1 - v_z) / dr, on the skin: w = 2 is Hertz's, w = 1 columns."""
    depth, m, w, error = 0.002, pressure_exponent(law), 2.0 if law.torsion_share else 1.0, []
    for count in (100, 500, 2000):
        rig = Rig(law, places=taxel_pattern(count))
        felt = rig.press(depth, pointing(DOWN), force=(0.0, 0.0, 2.0, 0.0))
        pressure = felt.tactile_normal_force / taxel_area(R, count)
        y = np.maximum(1.0 - w * R * (1.0 - rig.skin.moved[2]) / depth, 0.0)
        expected = w * (m + 1.0) * 2.0 / (2.0 * np.pi * R * depth) * y**m * (y > 0.0)
        error.append(np.abs(pressure - expected).sum() * taxel_area(R, count) / 2.0)
    assert error[2] < 0.06 and error[2] < 0.7 * error[1] < 0.7 * error[0]


def test_taxels_that_stick_keep_what_they_feel_while_they_are_sheared():
    """A polar contact that rolls on by dtheta, dphi and twists by dpsi over material that stays: the same field."""
    rig = Rig(PAPER)
    before = rig.feel(np.array([0.0, 0.0, R - 0.002]), _leaning(0.9, 1.0), force=LOAD)
    after = rig.feel(np.array([0.0, 0.0, R - 0.002]), _leaning(0.75, 1.08), shear=(0.15, -0.08, 0.0), force=LOAD)
    np.testing.assert_allclose(after.tactile_normal_force, before.tactile_normal_force, atol=1e-12)
    moved = rig.feel(np.array([0.0, 0.0, R - 0.002]), _leaning(0.75, 1.08), force=LOAD)
    assert np.abs(moved.tactile_normal_force - before.tactile_normal_force).max() > 0.03


def test_both_kinds_of_coordinates_move_the_material_alike():
    """Small s1, s2, psi of a surface law do what dtheta = s1 / (R cosPhi), dphi = s2 / R, dpsi do of a polar one."""
    polar, rotation = Rig(PAPER), _leaning(0.4, 1.1)
    surface = Rig(Hemisphere(radius=R))
    tip, small = np.array([0.0, 0.0, R - 0.002]), 1e-4
    polar.feel(tip, rotation, force=LOAD)
    x_C = polar.contacts[0]["rotation"][:, 0].copy()
    cosine = float(polar.contacts[0]["cos_Phi"])
    surface.pad["face_tangent"] = x_C  # the same axes
    for shear in ((small, 0.0, 0.0), (0.0, small, 0.0), (0.0, 0.0, 0.02)):
        there = (
            shear[0] / ((R - 0.002) * cosine),
            shear[1] / (R - 0.002),
            shear[2] + shear[0] * np.tan(1.1) / (R - 0.002),
        )
        polar.feel(tip, rotation, shear=there if shear[0] else (0.0, there[1], shear[2]), force=LOAD)
        surface.feel(tip, rotation, shear=shear, force=LOAD)
        if shear[0]:  # dtheta turns the material about the normal as well, by sinPhi dtheta
            polar.feel(tip, rotation, shear=(there[0], 0.0, -np.sin(1.1) * there[0]), force=LOAD)
        np.testing.assert_allclose(surface.skin.moved, polar.skin.moved, atol=3e-4)


def test_the_field_is_continuous_where_the_tip_passes_an_edge():
    """From the middle of a face over an edge, a micrometre at a time: no taxel jumps by 1 % of the highest."""
    rig, rotation, last = Rig(LAWS[0], BOX), pointing(DOWN), None
    for x in np.linspace(0.017, 0.0215, 900):
        felt = rig.feel(np.array([x, 0.003, R - 0.0015]), rotation, force=(0.3, 0.2, 2.0, 1e-3))
        now = np.column_stack([felt.tactile_normal_force, felt.tactile_shear_force, 1e3 * felt.penetration_depth])
        assert last is None or np.abs(now - last).max() < 0.01
        last = now


def test_an_edge_is_felt_as_a_line():
    """Over an edge along y the pressure is spread along y twice as far as across it; on a face alike."""
    for place, least, most in (("edge", 1.8, 4.0), ("face", 0.9, 1.1)):
        rig = Rig(PAPER, PLACES[place][0], taxel_pattern(1000))
        felt = felt_at(rig, place, 0.0015, pointing(-PLACES[place][2]), force=(0.0, 0.0, 1.0, 0.0))
        world = rig.skin.moved.T @ rig.contacts[0]["rotation"].T
        along, up = world[:, 1], world @ np.cross([0.0, 1.0, 0.0], rig.contacts[0]["rotation"][:, 2])
        n = felt.tactile_normal_force
        spread = [np.sqrt(np.sum(n * x * x) - np.sum(n * x) ** 2) for x in (along, up)]
        assert least < spread[0] / spread[1] < most


def test_depth_is_that_below_the_surface():
    """On a face r u.n - R, over a ball by the distance from its middle; 0 outside."""
    tip, rotation = np.array([0.001, -0.002, R - 0.002]), pointing(DOWN)
    points = tip + R * taxel_pattern() @ rotation.T
    felt = Rig(PAPER).feel(tip, rotation, force=LOAD)
    np.testing.assert_allclose(felt.penetration_depth, np.maximum(-points[:, 2], 0.0), atol=1e-15)
    felt = Rig(PAPER, BALL).feel(tip, rotation, force=LOAD)
    depth = BALL.radius - np.linalg.norm(points - BALL.centre, axis=1)
    np.testing.assert_allclose(felt.penetration_depth, np.maximum(depth, 0.0), atol=1e-15)


def test_slip_is_the_speed_of_each_taxel_over_the_object():
    """|v + w cross x| where a taxel touches, in the coordinates of the law, and 0 where none does."""
    for rig, per in ((Rig(LAWS[0]), (1.0, 1.0)), (Rig(PAPER), None)):
        v, w = np.array([2e-3, -1e-3]), 0.4
        felt = rig.press(0.002, pointing(DOWN), force=LOAD)
        contact = rig.contacts[0]
        per = contact["theta_per_x"], contact["phi_per_y"]
        slip = per[0] * v[0], per[1] * v[1], w + contact["psi_per_x"] * v[0]
        felt = rig.press(0.002, pointing(DOWN), force=LOAD, slip=tuple(map(float, slip)))
        x = R * rig.skin.moved[:2].T
        speed = np.hypot(v[0] - w * x[:, 1], v[1] + w * x[:, 0])
        inside = rig.skin.work[0] == 1.0
        assert np.all(felt.tactile_slip <= speed + 1e-15)
        np.testing.assert_allclose(felt.tactile_slip[inside], speed[inside], atol=1e-15)
        assert inside.sum() > 6 and np.all(felt.tactile_slip[felt.tactile_normal_force == 0.0] == 0.0)


def test_a_tip_that_does_not_touch_feels_nothing():
    """All zeros above the surface; nothing of before is left."""
    rig = Rig(LAWS[0], BOX)
    rig.press(0.002, pointing(DOWN), force=LOAD)
    assert all(np.all(array == 0.0) for array in rig.press(-1e-6, pointing(DOWN), force=(0.0, 0.0, 0.0, 0.0)))


def _leaning(Theta, Phi):
    """Axes of F over the face z = 0 that touch it at these angles: z_C = -z is (sinPhi, cosTheta cosPhi, ...) in F."""
    z_C = np.array([np.sin(Phi), np.cos(Theta) * np.cos(Phi), np.sin(Theta) * np.cos(Phi)])
    x_C = np.array([0.0, -np.sin(Theta), np.cos(Theta)])
    in_F = np.column_stack([x_C, np.cross(z_C, x_C), z_C])
    return np.column_stack([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]) @ in_F.T


@pytest.mark.parametrize("kind", ["box", "ball", "can", "ellipsoid"])
def test_depths_are_those_that_the_shape_tells_point_by_point(kind):
    """Inside, outside and beside edges, of a shape that is turned in a body that is turned."""
    turn = Rotation.from_rotvec([0.5, -0.3, 0.9]).as_matrix()
    centre = np.array([0.003, -0.002, 0.001])
    shape = {
        "box": Box(turn, centre, np.array([0.007, 0.009, 0.012])),
        "ball": Sphere(turn, centre, 0.009),
        "can": Cylinder(turn, centre, 0.007, 0.011),
        "ellipsoid": Ellipsoid(turn, centre, (0.007, 0.009, 0.012)),
    }[kind]
    rig = Rig(LAWS[0], shape, taxel_pattern(400))
    rng, below = np.random.default_rng(1), np.zeros(400)
    contact, body = rig.contacts[0], np.zeros(12)
    C, B = (Rotation.from_rotvec(rng.normal(size=3)).as_matrix() for _ in range(2))
    shift = rng.normal(size=3)
    body[:9], body[9:] = B.T.ravel(), shift
    contact["rotation"], contact["tip"] = C, shift + B @ (centre + np.array([0.004, -0.005, 0.003]))
    rig.skin.moved[...] = 1.2 * rng.normal(size=(3, 400))
    set_depths(rig.skin.solid, rig.pad, contact, body, rig.skin.moved, np.arange(400), 400, below)
    points = (contact["tip"] + R * rig.skin.moved.T @ C.T - shift) @ B
    expected = []
    for point in points:
        foot, normal = shape.nearest(point)
        expected.append((foot - point) @ normal)
    np.testing.assert_allclose(below, expected, atol=1e-15)
    assert 20 < np.sum(below > 0.0) < 380
