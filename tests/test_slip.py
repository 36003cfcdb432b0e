"""Slip: along the normal of the limit, for every law, every stepper, in general position."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

from softhand.contact.answer import answer, answer_stiffness
from softhand.contact.limit import limit_of, limit_use
from softhand.contact.slip import slip_to_limit
from softhand.contact.tangent import stiffness_while_slipping
from softhand.dampings.fung import Fung
from softhand.dampings.hunt_crossley import HuntCrossley
from softhand.dampings.kelvin_voigt import KelvinVoigt
from softhand.laws.radial import Radial
from softhand.settings.settings import Positive
from softhand.steppers.midpoint import Midpoint
from softhand.validation.every_law import LAWS, name_of
from softhand.validation.flow import drag, leaning, misalignment
from softhand.validation.rigs import (
    DOWNWARD,
    IMMOVABLE,
    MU,
    RADIUS,
    TOP,
    Body,
    Carriage,
    Rig,
    make_rig,
    make_world,
    tip,
)
from softhand.validation.sliding import STEPPERS

BY_NAME = {name_of(law): law for law in LAWS}
DAMPINGS = {"none": None, "kelvin-voigt": KelvinVoigt(), "hunt-crossley": HuntCrossley(), "fung": Fung()}
NAKASHIMA, RADIAL = BY_NAME["Nakashima"], BY_NAME["Radial"]


def options_of(damping: str, **options: Any) -> dict[str, Any]:
    return options if DAMPINGS[damping] is None else {"damping": DAMPINGS[damping], **options}


# ------------------------------------------------------------------------------------------------------ steady sliding


def assert_against_the_velocity(rig: Rig, angle: float = 0.5) -> None:
    """Friction within an angle [deg] of the sliding velocity, with all of mu f_z, and no torsion without spin."""
    found, power = misalignment(rig)
    assert abs(found) < angle
    assert power == pytest.approx(1.0, abs=1e-3)
    assert abs(rig.contact["force"][3]) < 0.01 * rig.contact["force"][2] * rig.contact["lever"]
    assert rig.contact["is_slipping"] == 1


@pytest.mark.parametrize("direction", [20.0, 135.0, -70.0])
@pytest.mark.parametrize("Phi", [50.0, 60.0, 75.0])
@pytest.mark.parametrize("name", BY_NAME)
def test_friction_is_against_the_sliding_velocity(name: str, Phi: float, direction: float) -> None:
    """Whatever the law, the lean and the direction in the contact frame, after 8 mm of sliding."""
    rig = leaning(BY_NAME[name], 8e-4, math.radians(Phi))
    drag(rig, 0.04, math.radians(direction))
    rig.run(Midpoint(step=1e-3), 0.2)
    assert_against_the_velocity(rig)


@pytest.mark.parametrize("damping", DAMPINGS)
@pytest.mark.parametrize("stepper", STEPPERS)
@pytest.mark.parametrize("name", ["Nakashima", "Hertz", "Conservative"])
def test_friction_is_against_the_velocity_with_every_stepper_and_damping(name: str, stepper: str, damping: str) -> None:
    """And with a static coefficient above the kinetic one, which is that of the power."""
    rig = leaning(BY_NAME[name], 8e-4, math.radians(60.0), **options_of(damping, static_friction=0.7))
    drag(rig, 0.04, math.radians(20.0))
    rig.run(STEPPERS[stepper](step=5e-4), 0.15)
    assert_against_the_velocity(rig)


@pytest.mark.parametrize("stepper", STEPPERS)
@pytest.mark.parametrize("name", ["Radial", "Hertz", "Conservative", "ParallelDistributed"])
def test_force_and_torsion_share_by_the_motion(name: str, stepper: str) -> None:
    """A tip that slides at v and spins at -v / l: shares of sqrt(1/2), each against its own motion."""
    law, depth, speed = BY_NAME[name], 8e-4, 0.04
    carriage = Carriage("xyzZ", (0.0, 0.0, RADIUS - depth), DOWNWARD)
    world = make_world([carriage], Body(IMMOVABLE, size=(1.0, 1.0, 1.0)), np.zeros(3))
    rig = make_rig(world, [tip(world, TOP, law, limit="ellipse")], (0.0, 0.0, -0.5))
    rig.update()
    heading = np.array([math.cos(2.0), math.sin(2.0)])
    rig.state.v[:2] = speed * heading
    rig.state.v[3] = -speed / rig.contact["lever"]
    rig.run(STEPPERS[stepper](step=5e-4), 0.15)
    f, room = rig.contact["force"], MU * rig.contact["force"][2]
    on_box = rig.contact_forces()[-6:-3]
    np.testing.assert_allclose(on_box[:2] / room, math.sqrt(0.5) * heading, atol=5e-3)
    assert rig.contact["velocity"][3] * f[3] > 0.0  # power into the contact
    assert abs(f[3]) / (room * rig.contact["lever"]) == pytest.approx(math.sqrt(0.5), abs=5e-3)
    assert rig.contact_forces()[-1] < 0.0, "the tip turns clockwise seen from above, and so it pulls the box"


def test_every_tip_and_every_face_has_its_own_limit() -> None:
    """Two tips of their own mu on two faces of which one has its own: each slips to its limit, along its normal."""
    carriages = [
        Carriage("x", (0.0377, 0.0, 0.0), (0.0, 0.6, math.pi)),
        Carriage("x", (-0.0377, 0.0, 0.0), (0.0, -0.4, 0.0)),
    ]
    world = make_world(carriages, Body(IMMOVABLE), np.zeros(3))
    faces = (0.2, 0.0, 0.0, 0.0, 0.0, 0.0)  # mu of +x
    tips = [tip(world, 0, NAKASHIMA, 0.5, face_friction=faces), tip(world, 1, RADIAL, 0.7, face_friction=faces)]
    rig = make_rig(world, tips, np.zeros(3))
    rig.state.z[:, :3] = [[0.9, -0.4, 0.3], [4e-3, 2e-3, -0.5]]
    rig.update()
    for contact, mu in zip(rig.plant.contacts, (0.2, 0.7), strict=True):
        s = scaled(contact)
        assert limit_use(contact, s, mu * contact["force"][2]) == pytest.approx(1.0, abs=1e-12)
        assert_along_the_normal(contact, s)


def scaled(contact: np.void) -> tuple[float, float, float]:
    """(f_x, f_y, tau / l)."""
    return float(contact["force"][0]), float(contact["force"][1]), float(contact["force"][3] / contact["lever"])


def assert_along_the_normal(contact: np.void, s: tuple[float, float, float]) -> None:
    along_x = contact["slip"][0] / contact["theta_per_x"]
    twist = contact["slip"][2] - contact["psi_per_x"] * along_x
    y = np.array([along_x, contact["slip"][1] / contact["phi_per_y"], contact["lever"] * twist])
    normal = np.array(limit_of(contact["curve"], s)[1])
    assert np.linalg.norm(y) > 0.0
    np.testing.assert_allclose(y / np.linalg.norm(y), normal / np.linalg.norm(normal), atol=1e-8)


# ---------------------------------------------------------------------------------------------------------- the return


@pytest.mark.parametrize("limit", ["ellipse", "exact"])
def test_the_return_is_the_closest_point_in_the_norm_of_the_energy(limit: str) -> None:
    """For a linear law with a full stiffness: the force within the limit that needs the least energy for the change.

    By a search of another kind, over all forces within the limit. The law is Planar at small angles, whose
    stiffness in the contact frame couples shear and torsion.
    """
    rng, law = np.random.default_rng(4), BY_NAME["Planar"]
    rig = leaning(law, 1e-3, math.radians(70.0), limit=limit)
    rig.update()
    lever = float(rig.contact["lever"])
    for _ in range(6):
        rig.state.z[0, :3] = 0.02 * rng.normal(size=3) * (1.0, 0.02, 3.0)  # dphi is small, so that phi stays
        rig.plant.pads["can_slip"] = 0
        rig.update()
        rig.plant.touch(rig.state.v, rig.state.z, with_stiffness=True)
        scale = np.array([1.0, 1.0, lever])
        s0 = rig.contact["force"][[0, 1, 3]] / scale
        K = rig.contact["stiffness"][np.ix_([0, 1, 3], [0, 1, 3])] / np.outer(scale, scale)
        rig.plant.pads["can_slip"] = 1
        rig.update()
        room, curve = MU * float(rig.contact["force"][2]), rig.contact["curve"]
        found = rig.contact["force"][[0, 1, 3]] / scale
        if math.sqrt(limit_of(curve, tuple(s0))[0]) <= room:
            np.testing.assert_array_equal(found, s0)
            continue
        inverse = np.linalg.inv(0.5 * (K + K.T))
        best = minimize(
            lambda s, s0=s0, inverse=inverse: 1e4 * (s - s0) @ inverse @ (s - s0), 0.9 * s0 / np.linalg.norm(s0) * room,
            constraints={"type": "ineq", "fun": lambda s, r=room, curve=curve: r * r - limit_of(curve, tuple(s))[0]},
            method="SLSQP", options={"ftol": 1e-14, "maxiter": 500},
        )  # fmt: skip
        np.testing.assert_allclose(found, best.x, atol=2e-3 * room)


@pytest.mark.parametrize("name", BY_NAME)
def test_slip_takes_work_and_never_gives(name: str) -> None:
    """Force times slip is positive, whatever is stored and at whatever depth."""
    rng, law = np.random.default_rng(6), BY_NAME[name]
    unit = RADIUS if law.coordinates == "surface" else 1.0
    for Phi in (50.0, 75.0):
        rig = leaning(law, 10 ** rng.uniform(-4.5, -2.7), math.radians(Phi))
        for _ in range(60):
            rig.state.z[0, :3] = 10 ** rng.uniform(-2.5, 1.0) * rng.normal(size=3) * (unit, unit, 1.0)
            rig.update()
            slip, f = rig.contact["slip"].copy(), rig.contact["force"]
            along_x = slip[0] / rig.contact["theta_per_x"]
            work = f[0] * along_x + f[1] * slip[1] / rig.contact["phi_per_y"]
            work += f[3] * (slip[2] - rig.contact["psi_per_x"] * along_x)
            assert work > 0.0 or not np.any(slip)


def test_within_the_limit_nothing_is_touched() -> None:
    """Stick stores and gives back to the last bit, as long as it may last: no creep."""
    rig = leaning(NAKASHIMA, 1e-3, math.radians(65.0))
    rig.update()
    stored = np.array([0.004, 0.02, 0.01])
    rig.state.z[0, :3] = stored
    for _ in range(1000):
        rig.update()
        assert 0.2 < rig.contact["limit_surface_use"] < 0.99
        rig.plant.note_slip(rig.state.z)
    np.testing.assert_array_equal(rig.state.z[0, :3], stored)
    assert rig.contact["slip_travel"] == 0.0 and rig.contact["is_slipping"] == 0


@pytest.mark.parametrize("name", BY_NAME)
def test_what_has_slipped_stays(name: str) -> None:
    """Evaluated again, a tip at its limit sticks there: slip is done once."""
    law, rng = BY_NAME[name], np.random.default_rng(8)
    rig = leaning(law, 1e-3, math.radians(60.0))
    unit = 0.2 * RADIUS if law.coordinates == "surface" else 0.2
    for _ in range(20):
        rig.state.z[0, :3] = rng.normal(size=3) * (unit, unit, 0.3)
        rig.update()
        rig.plant.note_slip(rig.state.z)
        settled = rig.state.z[0, :3].copy()
        rig.update()
        rig.plant.note_slip(rig.state.z)
        np.testing.assert_array_equal(rig.state.z[0, :3], settled)


def test_a_contact_is_a_function_of_its_state() -> None:
    """What was evaluated before does not matter: no hidden memory in force, slip, limit or stiffness."""
    rng = np.random.default_rng(9)
    rigs = [leaning(NAKASHIMA, 1e-3, math.radians(60.0), damping=KelvinVoigt(), static_friction=0.6) for _ in range(2)]
    states = []
    for _ in range(8):
        z = np.zeros_like(rigs[0].state.z)
        z[0, :3] = rng.normal(size=3) * (0.05, 0.1, 0.2)
        z[0, -1] = float(rng.integers(2))
        states.append((z, 0.1 * rng.normal(size=rigs[0].state.v.shape)))
    names = ("force", "deformation", "slip", "slip_rate", "limit_surface_use", "stiffness", "damping", "grip", "curve")
    found: list[list[np.ndarray]] = [[], []]
    for rig, order, out in zip(rigs, (range(8), reversed(range(8))), found, strict=True):
        answers = {}
        for k in order:
            rig.plant.update(rig.state.q, *states[k][::-1])
            rig.plant.touch(*states[k][::-1], lead=5e-4, with_stiffness=True)
            answers[k] = np.concatenate([np.ravel(rig.contact[name]) for name in names])
        out.extend(answers[k] for k in range(8))
    for first, second in zip(*found, strict=True):
        np.testing.assert_array_equal(first, second)


EXTREME = [0.0, 1e-300, 1e-9, 1.0, 40.0, 1e4, 1e12]


@pytest.mark.parametrize("damping", DAMPINGS)
@pytest.mark.parametrize("name", BY_NAME)
def test_no_displacement_ends_in_nan_or_in_a_loop(name: str, damping: str) -> None:
    """From nothing to a million kilometres, at any depth and speed: numbers, within the limit."""
    rng, law = np.random.default_rng(10), BY_NAME[name]
    for depth in (1e-9, 1e-4, 5e-3, 9.99e-3):
        rig = leaning(law, depth, math.radians(60.0), **options_of(damping))
        for size in EXTREME:
            rig.state.z[0] = size * rng.normal(size=rig.state.z.shape[1])
            rig.velocity[:] = rng.normal(size=6) * 10 ** rng.uniform(-6.0, 2.0)
            for lead in (0.0, 5e-4):
                rig.update()
                rig.plant.touch(rig.state.v, rig.state.z, lead, True)
                contact = rig.contact
                if contact["is_broken"]:
                    continue  # a law that gives no number there, and says so
                assert np.all(np.isfinite(contact["force"])) and np.all(np.isfinite(contact["stiffness"]))
                s = (
                    float(contact["force"][0]),
                    float(contact["force"][1]),
                    float(contact["force"][3] / contact["lever"]),
                )
                assert limit_use(contact, s, MU * contact["force"][2]) <= 1.0 + 1e-9


class Brittle(Radial):
    """A law that has no number for more than some shear."""

    breaks: Positive
    """Shear [m]."""

    @staticmethod
    def force(dr, s1, s2, psi, lean1, lean2, radius, K, k_tangential, k_torsional, breaks):
        """As its parent, up to there."""
        if abs(s1) > breaks:
            return float("nan"), float("nan"), float("nan"), float("nan")
        return K * dr * dr, k_tangential * s1, k_tangential * s2, k_torsional * psi


def test_a_law_without_an_answer_is_named_where_it_should_have_one() -> None:
    """Out of its range a tip slips back into it; where it would stick, it is marked as broken. No loop, no silence."""
    for breaks, is_broken in ((1e-3, 0), (1e-4, 1)):  # it slips from 0.24 mm on
        rig = leaning(Brittle(radius=RADIUS, breaks=breaks), 1e-3, math.radians(60.0))
        rig.state.z[0, :3] = 5e-3, 1e-3, 0.1
        rig.update()
        assert rig.contact["is_broken"] == is_broken
        if not is_broken:
            assert limit_use(rig.contact, scaled(rig.contact), MU * rig.contact["force"][2]) == pytest.approx(1.0)


# ------------------------------------------------------------------------------------------- stiffness while it slips


@pytest.mark.parametrize("limit", ["ellipse", "exact"])
@pytest.mark.parametrize("name", ["Nakashima", "Planar", "Hertz"])
def test_stiffness_while_slipping_is_the_derivative_of_the_return(name: str, limit: str) -> None:
    """With twice the multiplier, which gives it back whole; by differences over x, y and the rotation."""
    law, rng = BY_NAME[name], np.random.default_rng(12)
    rig = leaning(law, 1e-3, math.radians(65.0), limit=limit)
    unit = 3e-3 if law.coordinates == "surface" else 0.25
    for _ in range(5):
        z = rng.normal(size=3) * (unit, unit, 0.5)

        def force(move: np.ndarray, z: np.ndarray = z) -> np.ndarray:
            contact = rig.contact
            turn = move[2] + contact["psi_per_x"] * move[0]
            rig.state.z[0, :3] = z + np.array([contact["theta_per_x"] * move[0], contact["phi_per_y"] * move[1], turn])
            rig.update()
            return rig.contact["force"][[0, 1, 3]].copy()

        steps = np.diag([1e-8, 1e-8, 1e-6])
        force(np.zeros(3))
        expected = np.column_stack([(force(d) - force(-d)) / (2.0 * d.max()) for d in steps])
        force(np.zeros(3))
        pad, contact = rig.plant.pads[0], rig.contact
        contact["deformation"][1:] = z
        m = returned(pad, contact, z)
        stiffness_while_slipping(contact, 2.0 * m, 0.0)
        found = contact["stiffness"][np.ix_([0, 1, 3], [0, 1, 3])]
        np.testing.assert_allclose(found, expected, atol=1e-5 * np.max(np.abs(expected)))
        slide = np.array(
            limit_of(contact["curve"], tuple(contact["force"][[0, 1, 3]] / (1.0, 1.0, contact["lever"])))[1]
        )
        assert np.linalg.norm(found @ (slide / (1.0, 1.0, contact["lever"]))) < 1e-8 * np.max(np.abs(expected))


def returned(pad: np.void, contact: np.void, z: np.ndarray) -> float:
    """The multiplier of the return from z, with the stiffness of the law at its end."""
    contact["deformation"][1:] = z
    answer(pad, contact)
    m = slip_to_limit(pad, contact, 0.0)
    answer_stiffness(pad, contact)
    return float(m)


@pytest.mark.parametrize("mass", [0.05, 0.01, 0.003])
@pytest.mark.parametrize("k", [1e5, 1e7])
def test_a_light_stiff_tip_slides_straight_on(k: float, mass: float) -> None:
    """Driven by mu f_z along x, at 3 to 300 mm/s in steps of 1 ms, a tip loses a push across it and its spin.

    Without a stiffness while it slips the same tip is thrown to 200 times its speed.
    """
    law, normal = Radial(radius=RADIUS, k_tangential=k, k_torsional=1e-5 * k), 2.0
    depth = math.sqrt(normal / law.K)
    carriage = Carriage("xyzZ", (0.0, 0.0, RADIUS - depth), DOWNWARD, mass, mass * RADIUS * depth)
    world = make_world([carriage], Body(IMMOVABLE, size=(1.0, 1.0, 1.0)), (0.0, 0.0, 0.0))
    rig = make_rig(world, [tip(world, TOP, law)], (0.0, 0.0, -0.5))
    rig.torque[2], rig.torque[0] = -normal, MU * normal
    for speed in (0.3, 0.03, 0.003):
        rig.state.q[:4], rig.state.v[:] = 0.0, 0.0
        rig.state.v[:2], rig.state.v[3] = (speed, 0.02 * speed), 3.0 * speed
        rig.wind_up()
        across: list[float] = []
        rig.run(Midpoint(step=1e-3), 0.3, lambda _, across=across: across.append(abs(float(rig.state.v[1]))))
        assert max(across) < 0.15 * speed
        assert across[-1] < 1e-4 * speed
        assert rig.state.v[0] == pytest.approx(speed, rel=0.1)
