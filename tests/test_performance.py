"""Figures of a run, on signals with known answers, and the energy balance on a law that is a spring."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from softhand import Controller, Law, Recording, build, load_scenario
from softhand.analysis.energy import energy_ledger, tip_energy
from softhand.analysis.performance import errors, measure
from softhand.assembly.parts import read_law
from softhand.contact.pads import Fingertip
from softhand.contact.records import CONTACT
from softhand.dampings.fung import Fung
from softhand.laws.conservative import Conservative
from softhand.model.shapes.face import Face
from softhand.plugins import SHIPPED, find_plugin

TIME = np.arange(2001) * 1e-3
WAY = np.array([30.0, 0.0, 40.0])  # [mm], 50 long


def recording(**arrays: Any) -> Recording:
    """Two seconds at rest on the target, but for the arrays given."""
    n = len(TIME)
    still = {
        "time": TIME,
        "joint_torque": np.zeros((n, 2)),
        "object_position": np.zeros((n, 3)),
        "object_position_desired": np.zeros((n, 3)),
        "object_rpy": np.zeros((n, 3)),
        "object_rpy_desired": np.zeros((n, 3)),
        "internal_force": np.zeros((n, 1)),
        "internal_force_desired": np.zeros((n, 1)),
        "friction_use": np.zeros((n, 2)),
    }
    labels = {"joint": ("a", "b"), "contact": ("left", "right"), "pair": ("12",)}
    return Recording({**still, **arrays}, labels, "", "0", True, "", 2.0)


def travelled(progress: Any, target: Any = WAY) -> Recording:
    """The object at start + progress * way [mm], the target asked for from the start."""
    s = progress(TIME)[:, None]
    desired = np.tile(1e-3 * np.asarray(target), (len(TIME), 1))
    return recording(object_position=1e-3 * s * target, object_position_desired=desired)


def test_settling_time_of_an_exponential() -> None:
    """exp(-t / T) is within 5 % from t = T log 20."""
    found = measure(travelled(lambda t: 1.0 - np.exp(-t / 0.2)))
    assert found.settling_time == pytest.approx(0.2 * np.log(20.0), abs=1e-3)
    assert found.overshoot == 0.0


def test_overshoot_of_an_oscillator() -> None:
    """A damping ratio of 0.2 goes exp(-pi 0.2 / sqrt(1 - 0.04)) too far, and settles after its last swing of 5 %."""
    ratio, w = 0.2, 20.0
    wd = w * np.sqrt(1.0 - ratio**2)

    def progress(t: Any) -> Any:
        return 1.0 - np.exp(-ratio * w * t) * (np.cos(wd * t) + ratio * w / wd * np.sin(wd * t))

    found = measure(travelled(progress))
    assert found.overshoot == pytest.approx(100.0 * np.exp(-np.pi * ratio / np.sqrt(1.0 - ratio**2)), abs=0.05)
    outside = TIME[np.abs(progress(TIME) - 1.0) > 0.05]
    assert found.settling_time == pytest.approx(outside[-1] + 1e-3)


def test_a_steady_error_never_settles() -> None:
    """6 % short of the target at the end is not there; 4 % is."""
    assert measure(travelled(lambda t: 0.94 * np.minimum(t, 1.0))).settling_time == np.inf
    assert measure(travelled(lambda t: 0.96 * np.minimum(t, 1.0))).settling_time < 1.0


def test_a_short_way_has_a_band_of_its_own() -> None:
    """Without a way, 0.2 mm and 0.5 deg; there is no overshoot to speak of."""
    n = len(TIME)
    for inside, turn in ((True, 0.4), (False, 0.6)):
        rpy = np.zeros((n, 3))
        rpy[:, 1] = np.radians(turn) * np.sin(2.0 * np.pi * 10.0 * TIME + 1.0)
        rpy[0] = 0.0
        found = measure(recording(object_rpy=rpy))
        assert np.isnan(found.overshoot)
        assert (found.settling_time == 0.0) == inside


def test_final_errors_are_root_mean_squares_over_the_last_tenth_of_a_second() -> None:
    """A sine of amplitude a has a / sqrt(2); what is before the window does not count."""
    swing = np.zeros((len(TIME), 3))
    swing[:, 0] = np.where(TIME > 1.9, 1e-3 * np.sin(2.0 * np.pi * 50.0 * TIME), 7.0)
    force = np.zeros((len(TIME), 1))
    force[:, 0] = np.where(TIME > 1.9, -0.3, 5.0)
    found = measure(recording(object_position=swing, internal_force=force))
    assert found.position_error == pytest.approx(np.sqrt(0.5), rel=1e-6)
    assert found.force_error == pytest.approx(0.3)


def test_orientation_error_is_the_angle_of_the_rotation() -> None:
    """Yaw at a pitch of 90 deg less 60: not the length of the difference of the angles; small angles keep digits."""
    n = len(TIME)
    rpy, desired = np.zeros((n, 3)), np.zeros((n, 3))
    desired[:, 1] = np.pi / 3.0
    rpy[:, 1], rpy[:, 0], rpy[:, 2] = np.pi / 3.0, 0.3, 0.3
    found = measure(recording(object_rpy=rpy, object_rpy_desired=desired))
    # roll about the tilted axis, yaw about z: half angles add as in a product of quaternions
    c, s = np.cos(0.15), np.sin(0.15)
    axis = np.array([np.cos(np.pi / 3.0), 0.0, -np.sin(np.pi / 3.0)])
    expected = 2.0 * np.degrees(np.arccos(c * c - s * s * axis[2]))
    assert found.orientation_error == pytest.approx(expected, rel=1e-9)
    tiny = np.zeros((n, 3))
    tiny[:, 2] = 1e-9
    assert errors(recording(object_rpy=tiny)).orientation[-1] == pytest.approx(np.degrees(1e-9), rel=1e-6)


def test_friction_and_effort() -> None:
    """The largest use of all tips; the root mean square of the length of the torque vector."""
    use = np.zeros((len(TIME), 2))
    use[700, 1] = 0.8
    torque = np.tile([3.0, 4.0], (len(TIME), 1))
    found = measure(recording(friction_use=use, joint_torque=torque))
    assert (found.friction_use, found.effort) == (0.8, pytest.approx(5.0))


# ------------------------------------------------------------------------------------------------------------ energy


class Springs(Law):
    """Four springs, of which one is not linear: a potential in the deformation."""

    k: float

    @staticmethod
    def force(dr: float, dtheta: float, dphi: float, dpsi: float, phi: float, radius: float, k: float) -> Any:
        bending = k * radius**2
        return 100.0 * k * max(dr, 0.0) ** 2, bending * dtheta, bending * dphi, 0.01 * bending * dpsi


class Push(Controller):
    """The torques of the start, and some more: the grasp rings."""

    def start(self, observation: Any) -> Any:
        return observation.N_F + observation.J_CF.T @ observation.contact_force.ravel()

    def torque(self, observation: Any, memory: Any) -> Any:
        return memory + 0.01, memory


def ring(law: Law, step: float) -> Any:
    values = {"duration": 0.1, "stepper": {"name": "rk4", "step": step}}
    simulation = build(load_scenario("target-a", values), Push(), law)
    return simulation.run(), simulation.plant


@pytest.mark.parametrize(
    "law", [Springs(radius=0.010, k=2500.0), Conservative(radius=0.010, k_r=2e5)], ids=("polar", "surface")
)
def test_springs_lose_nothing(law: Law) -> None:
    """What the joints put in is kinetic, in the height and in the tips, to a millionth of what is exchanged."""
    run, plant = ring(law, 1e-4)
    found = energy_ledger(run, plant)
    exchanged = abs(found.kinetic[-1]) + abs(found.gravity[-1]) + abs(found.elastic[-1])
    assert exchanged > 1e-3 and abs(found.elastic[-1]) > 1e-4 and found.kinetic[-1] > 1e-5
    assert abs(found.lost) < 1e-6 * exchanged


def test_work_that_is_not_stored_is_lost() -> None:
    """The same run with torques 10 % larger in the records: that much is missing, with a plus."""
    run, plant = ring(Springs(radius=0.010, k=2500.0), 1e-4)
    more = replace(run, variables={**run.variables, "joint_torque": 1.1 * run.joint_torque})
    found = energy_ledger(run, plant)
    assert energy_ledger(more, plant).lost - found.lost == pytest.approx(0.1 * found.work[-1], rel=1e-9)
    assert found.work[-1] > 0.0


def test_the_law_of_the_paper_is_no_spring() -> None:
    """Its balance does not close, at any step."""
    scenario = load_scenario("target-a")
    law = read_law(scenario)
    coarse, fine = (energy_ledger(*ring(law, step)) for step in (1e-4, 5e-5))
    assert abs(fine.lost) > 1e-4 * abs(fine.work[-1])
    assert coarse.lost == pytest.approx(fine.lost, rel=1e-2)


def contact_with(deformation: Any, Phi: float, bearing: float) -> np.void:
    """A contact as the kernel leaves it, as far as an energy reads it."""
    contact = np.zeros(1, CONTACT)[0]
    contact["deformation"], contact["angles"] = deformation, (0.0, Phi)
    contact["lean"] = np.cos(Phi) * np.array([np.cos(bearing), np.sin(bearing)])
    return contact


def test_energy_of_a_tip_is_that_of_its_spring() -> None:
    """100 k dr^3 / 3 + k r^2 (dtheta^2 + dphi^2 + dpsi^2 / 100) / 2; a share of it where the tip relaxes."""
    law, d = Springs(radius=0.010, k=2500.0), np.array([0.002, 0.1, -0.2, 0.3])
    expected = 100.0 * 2500.0 * 0.002**3 / 3.0 + 0.5 * 0.25 * (0.01 + 0.04 + 0.01 * 0.09)
    face = Face(np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), 0.0)
    contact = contact_with(d, 1.0, 0.3)
    assert tip_energy(Fingertip(law, 0.5, face), contact) == pytest.approx(expected, rel=1e-12)
    relaxing = Fung(shares=(0.2, 0.1), rates=(50.0, 5.0))
    assert tip_energy(Fingertip(law, 0.5, face, relaxing), contact) == pytest.approx(0.7 * expected, rel=1e-12)


@pytest.mark.parametrize("name", [name for name in SHIPPED["laws"] if find_plugin("laws", name, "").energy])
def test_an_energy_is_what_the_tip_gives_back(name: str) -> None:
    """For each law with an energy the work on a straight line is that energy, whichever way the tip leans."""
    law = find_plugin("laws", name, "")(radius=0.010)
    face = Face(np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), 0.0)
    contact = contact_with([0.002, 4e-4, -3e-4, 0.2], 1.1, 0.3)
    stored = tip_energy(Fingertip(law, 0.5, face), contact)
    d = contact["deformation"]
    share, step = np.linspace(0.0, 1.0, 20001), 1.0 / 20000
    power = [law(s * d, 1.1, 0.3) @ d for s in share]
    assert stored == pytest.approx(step * (np.sum(power) - 0.5 * (power[0] + power[-1])), rel=1e-6)
