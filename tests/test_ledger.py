"""The energy ledger closes, at the order of the stepper, with and without slip and damping."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from softhand import Recording, build, load_scenario
from softhand.analysis.energy import Ledger, energy_ledger, is_spring
from softhand.laws.bulk import Bulk
from softhand.laws.conservative import Conservative
from softhand.laws.parallel_distributed import ParallelDistributed
from softhand.laws.radial import Radial
from softhand.recording.events import find_events
from softhand.scenario.scenario import with_law

COULOMB = {"fingertip.contact": "coulomb", "fingertip.friction": 0.45}
ELEMENTS = {**COULOMB, "fingertip.slip_elements": 8}
DAMPED = {"fingertip.damping": {"name": "kelvin-voigt"}}
RELAXING = {"fingertip.damping": {"name": "fung"}}


def run(
    step: float, values: dict[str, Any], duration: float, law: str | None = "conservative"
) -> tuple[Recording, Any]:
    scenario = load_scenario("target-a")
    scenario = (with_law(scenario, law) if law else scenario).with_values(
        {**values, "stepper.step": step, "control_period": step, "duration": duration, "reference.duration": 0.4}
    )
    simulation = build(scenario)
    return simulation.run(), simulation.plant


def ledger_of(step: float, values: dict[str, Any], duration: float) -> Ledger:
    return energy_ledger(*run(step, values, duration))


@pytest.mark.parametrize(
    "values",
    [{}, DAMPED, COULOMB, {**COULOMB, **DAMPED}, {**COULOMB, **RELAXING}, ELEMENTS, {**ELEMENTS, **RELAXING}],
    ids=["free", "damped", "slip", "both", "relaxing", "elements", "elements that relax"],
)
def test_the_residual_falls_with_the_square_of_the_step(values: dict[str, Any]) -> None:
    """Midpoint: half the step, a quarter of the residual; and it is small beside every account in use."""
    coarse, fine = (ledger_of(step, values, 0.5) for step in (1e-3, 5e-4))
    assert fine.is_spring
    assert abs(coarse.residual[-1] / fine.residual[-1]) == pytest.approx(4.0, rel=0.25)
    used = [fine.work[-1], *([fine.damping[-1]] if DAMPED.keys() <= values.keys() else [])]
    used += [fine.slip[-1]] if COULOMB.keys() <= values.keys() else []
    assert abs(fine.residual[-1]) < 5e-3 * min(map(abs, used))
    assert all(value != 0.0 for value in used)


@pytest.mark.parametrize("values", [ELEMENTS, {**ELEMENTS, **RELAXING}], ids=["elements", "elements that relax"])
def test_it_closes_where_each_element_has_a_moment(values: dict[str, Any]) -> None:
    """Those of all elements make the moment of a leaning tip: that of one alone would leave work unexplained."""
    coarse, fine = (energy_ledger(*run(step, values, 0.4, law="bulk")) for step in (5e-4, 2.5e-4))
    assert fine.is_spring and fine.slip[-1] > 0.0
    assert abs(coarse.residual[-1] / fine.residual[-1]) == pytest.approx(4.0, rel=0.25)
    assert abs(fine.residual[-1]) < 5e-3 * min(abs(fine.work[-1]), fine.slip[-1])


def test_what_a_tip_stores_when_it_lets_go_is_lost() -> None:
    """A relaxing tip lets go with shear in it; without that loss the ledger leaves a twentieth of the work."""
    step = 2.5e-4
    values = {**COULOMB, **RELAXING, "stepper.step": step, "control_period": step, "duration": 0.02,
              "fingertip.friction": 0.9, "object.mass": 0.07, "grasp.internal_force": (5.0, 5.0, 5.0),
              "reference.kind": "step", "reference.internal_force": (8.0, 0.0, 1.0)}  # fmt: skip
    simulation = build(with_law(load_scenario("target-b"), "conservative").with_values(values))
    recording = simulation.run()
    assert "lift-off" in [event.kind for event in find_events(recording)]
    ledger = energy_ledger(recording, simulation.plant)
    assert abs(ledger.residual[-1]) < 0.01 * ledger.exchanged


def test_damping_and_slip_only_take() -> None:
    """At no time does either account shrink by more than rounding."""
    recording, plant = run(1e-3, {**COULOMB, **DAMPED}, 0.5)
    ledger = energy_ledger(recording, plant, np.arange(len(recording)))
    assert np.all(np.diff(ledger.damping) > -1e-15) and np.all(np.diff(ledger.slip) > -1e-15)
    assert ledger.slip[-1] > 1e-3
    assert ledger.slip[-1] == pytest.approx(np.sum(recording.slip_loss[-1]), rel=1e-12)


def test_the_ledger_of_a_file_is_that_of_the_run(tmp_path: Any) -> None:
    """Built from the recorded scenario, damping and law included."""
    recording, plant = run(1e-3, {**COULOMB, **DAMPED}, 0.1)
    recording.save(tmp_path / "run.nc")
    again = energy_ledger(Recording.load(tmp_path / "run.nc"))
    for label, value in energy_ledger(recording, plant).rows():
        assert dict(again.rows())[label] == value


def test_the_residual_of_the_papers_law_is_named_what_it_is() -> None:
    """It has no energy, so that what is left is not the stepper's alone."""
    recording, plant = run(1e-3, {}, 0.05, law=None)
    found = energy_ledger(recording, plant)
    assert not found.is_spring and found.residual_name == "lost by a law that is no spring"


class Silent(ParallelDistributed):
    """Its energy changes as a tip rolls, without work."""

    moment = None


class Reversed(ParallelDistributed):
    """As if the tip were pushed on by what it should pay for."""

    @staticmethod
    def moment(dr, s1, s2, psi, lean1, lean2, radius, E, k_torsional):  # type: ignore[no-untyped-def,override]
        first, second = ParallelDistributed.moment(dr, s1, s2, psi, lean1, lean2, radius, E, k_torsional)
        return -first, second


def test_a_law_whose_energy_depends_on_the_lean_is_a_spring_with_its_moment_alone() -> None:
    """Without `moment`, or with another than the slope of the energy, rolling makes or loses energy."""
    assert is_spring(Conservative(radius=0.010)) and is_spring(Radial(radius=0.010))
    assert is_spring(ParallelDistributed(radius=0.010)) and is_spring(Bulk(radius=0.010))
    assert not is_spring(Silent(radius=0.010)) and not is_spring(Reversed(radius=0.010))


@pytest.mark.parametrize("damping", ["none", "fung"])
@pytest.mark.parametrize("law", ["bulk", "parallel-distributed"])
def test_the_ledger_of_a_law_of_the_lean_closes(law: str, damping: str) -> None:
    """A thousandth of a percent of what is exchanged, half the step a quarter of that; without moments 2 to 4 %."""
    values = RELAXING if damping == "fung" else {}
    coarse, fine = (energy_ledger(*run(step, values, 0.5, law)) for step in (5e-4, 2.5e-4))
    assert fine.is_spring
    assert abs(coarse.residual[-1] / fine.residual[-1]) == pytest.approx(4.0, rel=0.25)
    assert abs(coarse.residual[-1]) < 1e-5 * coarse.exchanged


JOINTS = {
    "rotors": {"armature": 5e-5},
    "damped": {"damping": 0.01},
    "friction": {"friction": 0.01},
    "stops": {"stop_stiffness": 2.0, "stop_damping": 2.0},
    "all": {"armature": 2e-5, "damping": 0.002, "friction": 0.004, "stop_stiffness": 2.0, "stop_damping": 2.0},
}


@pytest.mark.parametrize("kind", list(JOINTS))
def test_what_joints_take_is_in_the_ledger(kind: str) -> None:
    """The residual falls with the step and is small beside what they take; each account is there where it is used.

    For the stops the upper limits of the proximal joints are put where the joints pass on their way.
    """
    given = JOINTS[kind]
    values: dict[str, Any] = {"hand.joints": given}
    coarse, fine = (_ledger_at_stops(step, values, "stop_stiffness" in given) for step in (1e-3, 5e-4))
    used = [name for name in ("joint_damping", "joint_friction", "stop_damping") if np.any(getattr(fine, name))]
    assert used == [
        name for name, key in (("joint_damping", "damping"), ("joint_friction", "friction"),
                               ("stop_damping", "stop_damping")) if key in given
    ]  # fmt: skip
    assert all(getattr(fine, name)[-1] > 2e-6 for name in used)
    smallest = min([fine.work[-1], *(getattr(fine, name)[-1] for name in used)], key=abs)
    assert abs(fine.residual[-1]) < 0.02 * abs(smallest)
    assert abs(fine.residual[-1]) < 0.6 * abs(coarse.residual[-1])


def _ledger_at_stops(step: float, values: dict[str, Any], at_stops: bool) -> Ledger:
    scenario = with_law(load_scenario("target-a"), "conservative").with_values(
        {**values, "stepper.step": step, "control_period": step, "duration": 0.5, "reference.duration": 0.4}
    )
    simulation = build(scenario)
    if at_stops:
        own = simulation.plant.touching.resistance
        start = simulation.state.q[own.places[:, 0]]
        own.limits[:, 0], own.limits[:, 1] = start - 0.02, start + 0.02
    recording = simulation.run()
    ledger_plant = simulation.plant
    if not at_stops:
        return energy_ledger(recording, ledger_plant)
    return _with_limits(recording, ledger_plant)


def _with_limits(recording: Recording, plant: Any) -> Ledger:
    """The ledger by the limits of that plant, which are not those of its URDF."""
    import softhand.analysis.energy as module

    moved, original = plant.touching.resistance, module.joint_energy
    try:
        module.joint_energy = lambda run, fresh: original(run, plant)  # type: ignore[assignment]
        assert np.any(moved.limits)
        return energy_ledger(recording, plant)
    finally:
        module.joint_energy = original
