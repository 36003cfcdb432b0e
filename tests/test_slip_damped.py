"""Slip of tips with damping: the whole force obeys the limit of the whole normal force, and no dashpot gives work."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from softhand.assembly.build import simulate
from softhand.contact.limit import limit_use
from softhand.dampings.damping import Damping
from softhand.dampings.fung import Fung
from softhand.dampings.hunt_crossley import HuntCrossley
from softhand.dampings.kelvin_voigt import KelvinVoigt
from softhand.laws.power import Power
from softhand.laws.radial import Radial
from softhand.recording.recording import Recording
from softhand.scenario.scenario import load_scenario
from softhand.validation.every_law import LAWS, name_of
from softhand.validation.flow import leaning
from softhand.validation.rigs import IMMOVABLE, MU, RADIUS, Body, Rig, block
from softhand.validation.sliding import STEPPERS

BY_NAME = {name_of(law): law for law in LAWS}


class Everything(Fung):
    """Dashpots of both kinds and relaxation at once."""

    def viscosity(self) -> tuple[float, float, float]:
        return 4.0, 20.0, 1e-3

    def viscosity_per_force(self) -> tuple[float, float, float]:
        return 0.5, 2.0, 1e-4


DAMPINGS: dict[str, Damping] = {
    "kelvin-voigt": KelvinVoigt(radial=20.0, tangential=5.0, torsional=1e-3),
    "hunt-crossley": HuntCrossley(radial=2.0, tangential=1.0, torsional=1e-4),
    "fung": Fung(),
    "torsion only": KelvinVoigt(radial=0.0, tangential=0.0, torsional=1e-2),
    "everything": Everything(shares=(0.3, 0.2), rates=(200.0, 4.0)),
}


def scaled(contact: np.void, name: str = "force") -> tuple[float, float, float]:
    """(f_x, f_y, tau / l)."""
    force = contact[name]
    return float(force[0]), float(force[1]), float(force[3] / contact["lever"])


def thrown(name: str, damping: str, rng: np.random.Generator) -> tuple[Rig, float]:
    """A tip with anything stored and remembered, at any speed, and a lead."""
    law = BY_NAME[name]
    rig = leaning(
        law, 10 ** rng.uniform(-4.0, -2.7), math.radians(60.0), damping=DAMPINGS[damping], static_friction=0.6
    )
    unit = 0.1 * RADIUS if law.coordinates == "surface" else 0.1
    for k in range(3, rig.state.z.shape[1] - 1, 4):  # remembered: forces that it has had
        rig.state.z[0, :3] = rng.normal(size=3) * (unit, unit, 0.3)
        rig.update()
        rig.state.z[0, k : k + 4] = rng.uniform(0.0, 1.3) * rig.contact["deformation_force"]
    rig.state.z[0, :3] = 10 ** rng.uniform(-2.0, 0.5) * rng.normal(size=3) * (unit, unit, 0.3)
    rig.state.z[0, -1] = float(rng.integers(2))
    rig.velocity[:] = rng.normal(size=6) * (1.0, 1.0, 1.0, 50.0, 50.0, 50.0) * 10 ** rng.uniform(-3.0, 0.0)
    return rig, float(rng.choice([0.0, 2.5e-4]))


@pytest.mark.parametrize("damping", DAMPINGS)
@pytest.mark.parametrize("name", BY_NAME)
def test_the_whole_force_is_within_the_limit_of_the_whole_normal_force(name: str, damping: str) -> None:
    """In every state; and what the tip keeps and gives away at its dashpots is never negative."""
    rng, slid = np.random.default_rng(3), 0
    for _ in range(80):
        rig, lead = thrown(name, damping, rng)
        rig.update()
        rig.plant.touch(rig.state.v, rig.state.z, lead)
        contact = rig.contact
        f, v, slip = contact["force"], contact["velocity"], contact["slip_rate"]
        assert f[2] >= 0.0
        assert limit_use(contact, scaled(contact), 0.6 * f[2]) <= 1.0 + 1e-9
        moves = np.any(contact["slip"]) or np.any(slip)
        if moves:
            slid += 1
            assert limit_use(contact, scaled(contact), MU * f[2]) <= 1.0 + 1e-9
        viscous = (f - contact["elastic"])[[0, 1, 3]]
        if f[2] > 0.0:
            assert viscous @ (v[[0, 1, 3]] - slip) >= -1e-9 * max(1.0, abs(viscous @ v[[0, 1, 3]]))
            assert f[[0, 1, 3]] @ slip >= 0.0
    assert slid > 10


@pytest.mark.parametrize("name", BY_NAME)
def test_viscosity_takes_power_even_by_the_whole_velocity(name: str) -> None:
    """(f - f_el) . velocity, which counts what the dashpots add to the power of slip as well, is not negative."""
    rng = np.random.default_rng(5)
    for damping in ("kelvin-voigt", "hunt-crossley", "everything"):
        for _ in range(60):
            rig, _ = thrown(name, damping, rng)
            rig.update()
            f, v = rig.contact["force"][[0, 1, 3]], rig.contact["velocity"][[0, 1, 3]]
            power = (f - rig.contact["elastic"][[0, 1, 3]]) @ v
            assert power >= -1e-9 * max(1.0, float(np.abs(f) @ np.abs(v))) or rig.contact["force"][2] == 0.0


@pytest.mark.parametrize("stepper", STEPPERS)
@pytest.mark.parametrize(("c", "speed", "duration"), [(100.0, 0.003, 0.06), (100.0, 0.02, 0.02), (1.0, 0.02, 0.015)])
def test_slip_beside_a_dashpot(stepper: str, c: float, speed: float, duration: float) -> None:
    """k s + c s' = mu f_z from the onset on: s, travel and loss of every stepper go to that solution with the step."""
    law, depth = Radial(radius=RADIUS), 1e-3
    k, most = law.k_tangential, MU * law.K * depth**2
    onset = max(most / speed - c, 0.0) / k
    exact = most / k - (most / k - speed * onset) * math.exp(-(duration - onset) * k / c)
    errors = []
    for step in (1e-3, 2.5e-4):
        rig = block(depth, law, body=Body(mass=IMMOVABLE), gravity=np.zeros(3),
                    damping=KelvinVoigt(radial=0.0, tangential=c, torsional=0.0))  # fmt: skip
        rig.velocity[:2] = speed * math.cos(0.9), speed * math.sin(0.9)
        rig.run(STEPPERS[stepper](step=step), duration)
        contact, stored = rig.contact, math.hypot(rig.state.z[0, 0], rig.state.z[0, 1])
        assert contact["is_slipping"] == 1
        assert contact["slip_travel"] == pytest.approx(speed * duration - stored, rel=1e-9)
        assert contact["slip_loss"] == pytest.approx(most * contact["slip_travel"], abs=0.7 * most * speed * step)
        assert limit_use(contact, scaled(contact), most) == pytest.approx(1.0, abs=1e-9)
        errors.append(abs(stored - exact))
    assert errors[0] < 0.02 * exact
    assert errors[1] < 0.3 * errors[0]


@pytest.mark.parametrize("stepper", STEPPERS)
@pytest.mark.parametrize("damping", [Fung(), Everything(shares=(0.2, 0.1), rates=(50.0, 5.0))], ids=["fung", "all"])
def test_a_tip_that_is_held_still_does_not_pull_more_and_more(stepper: str, damping: Damping) -> None:
    """Retracted by 1 mm in 2 ms, its normal force is below what it will be; sheared by 0.5 mm it slips to that limit.

    Then its shear relaxes and does not grow with the normal force that comes back.
    """
    rig = block(3e-3, Power(radius=RADIUS), body=Body(mass=IMMOVABLE), gravity=np.zeros(3), damping=damping)
    rig.update()
    for k in range(2):
        rig.state.z[0, 3 + 4 * k : 7 + 4 * k] = rig.contact["deformation_force"]
    shears: list[tuple[float, float]] = []

    def watch(_time: float) -> None:
        f = rig.contact["force"]
        shears.append((math.hypot(f[0], f[1]), float(f[2])))

    run = STEPPERS[stepper](step=5e-4)
    rig.velocity[2] = 0.5
    rig.run(run, 2e-3)
    rig.velocity[:3] = 0.08, -0.06, 0.0
    rig.run(run, 5e-3, watch)
    assert shears[-1][0] == pytest.approx(MU * shears[-1][1], rel=1e-9)
    assert rig.contact["is_slipping"] == 1 and rig.contact["slip_travel"] > 5e-5
    rig.velocity[:] = 0.0
    rig.run(run, 1e-3)
    travel, shears[:] = float(rig.contact["slip_travel"]), []
    rig.run(run, 0.3, watch)
    held = np.array(shears)
    assert np.all(np.diff(held[:, 0]) <= 1e-12)
    assert held[-1, 1] > 1.4 * held[0, 1]
    assert rig.contact["slip_travel"] == travel


# ------------------------------------------------------------------------------------------------------------ the hand


def slipping(damping: str | None, **values: Any) -> Recording:
    table = {} if damping is None else {"fingertip.damping": {"name": damping}}
    return simulate(load_scenario("target-a", {"fingertip.contact": "coulomb", **table, **values}))


def test_a_relaxing_grasp_is_marked_where_it_slips() -> None:
    """Target A with `fung`: whoever stands at the limit slips, and goes further than 0.3 mm."""
    recording = slipping("fung")
    at_limit = recording.limit_surface_use > 1.0 - 1e-9
    assert np.count_nonzero(at_limit) > 100
    assert np.all(recording.is_slipping[at_limit] == 1.0)
    assert np.max(recording.limit_surface_use) < 1.0 + 1e-9
    assert recording.slip_travel[-1, 1] == pytest.approx(0.377e-3, rel=0.02)


@pytest.mark.parametrize("damping", ["kelvin-voigt", "hunt-crossley"])
def test_light_dashpots_change_the_way_little(damping: str) -> None:
    """They take no part in steady slip."""
    plain, damped = slipping(None, duration=1.0), slipping(damping, duration=1.0)
    assert damped.slip_travel[-1, 1] == pytest.approx(plain.slip_travel[-1, 1], rel=0.01)
    assert damped.slip_loss[-1, 1] == pytest.approx(plain.slip_loss[-1, 1], rel=0.01)
