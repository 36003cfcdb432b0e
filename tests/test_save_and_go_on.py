"""A run that is cut in two at a sample goes on as the uncut one would have, to the last bit."""

from __future__ import annotations

import pickle
import subprocess
import sys
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hands import HAND_URDF

from softhand import (
    Controller,
    ControllerError,
    Push,
    Recording,
    ScenarioError,
    Simulation,
    State,
    build,
    load_scenario,
)
from softhand.assembly.parts import read_controller, read_stepper
from softhand.plugins import SHIPPED


@dataclass(frozen=True)
class Case:
    """A run, where it is cut, and what must have happened in it so that the cut is a hard one."""

    scenario: str
    values: dict[str, Any] = field(default_factory=dict)
    cuts: tuple[int, ...] = (0, 1, 18, 40)
    pushes: tuple[Push, ...] = ()
    slips: bool = False

    @property
    def duration(self) -> float:
        """[s]"""
        return float(self.values.get("duration", 0.05))

    def make(self) -> Simulation:
        """A simulation of its own."""
        scenario = load_scenario(self.scenario, {**self.values, "duration": self.duration})
        made = build(scenario)
        if not self.pushes:
            return made
        return Simulation(made.plant, made.state, read_controller(scenario), read_stepper(scenario), made.reference,
                          scenario.duration, scenario.control_period, made.scenario, self.pushes)  # fmt: skip


STEP = {"reference.kind": "step"}  # a rough motion from the first sample on
SLIP = {**STEP, "fingertip.contact": "coulomb", "fingertip.friction": 0.42, "fingertip.static_friction": 0.5}
PUSHES = (
    Push(force=(1.0, -0.5, 0.7), moment=(0.01, 0.02, 0.0), point=(0.01, 0.0, 0.02), start=0.01, duration=0.02),
    Push(force=(0.2, 0.3, -0.5), on="finger_2_middle", point=(0.03, 0.0, 0.0), start=0.0155, duration=0.03),
)
CASES = {
    **{name: Case("target-a", {**SLIP, "stepper": {"name": name, "step": 2.5e-4}}, slips=True)
       for name in SHIPPED["steppers"]},
    "adaptive": Case("target-a", {**SLIP, "duration": 0.02, "stepper.name": "adaptive"}, (0, 5, 12), slips=True),
    **{name: Case("target-a", {**SLIP, "fingertip.damping": {"name": name}}, slips=True)
       for name in SHIPPED["dampings"]},
    **{f"elements, {name}": Case("target-a", {**SLIP, "fingertip.damping": {"name": "fung"},
                                              "fingertip.slip_elements": 5,
                                              "stepper": {"name": name, "step": 2.5e-4}}, slips=True)
       for name in ("midpoint", "rk4")},
    "rolling": Case("target-a", STEP),
    "surface": Case("target-a", {**STEP, "fingertip": {"law": "conservative", "radius": 0.010, "contact": "coulomb",
                                                       "friction": 0.42, "static_friction": 0.5}}, slips=True),
    "leaning": Case("target-a", {**STEP, "fingertip": {"law": "bulk", "radius": 0.010, "contact": "coulomb",
                                                       "friction": 0.42, "static_friction": 0.5,
                                                       "damping": {"name": "fung"}}}, slips=True),
    "leaning elements": Case("target-a", {**STEP, "fingertip": {"law": "bulk", "radius": 0.010, "contact": "coulomb",
                                                                "friction": 0.42, "damping": {"name": "fung"},
                                                                "slip_elements": 4}}, slips=True),
    "leaning, by rk4": Case("target-a", {**STEP, "fingertip": {"law": "bulk", "radius": 0.010, "friction": 0.5},
                                         "stepper": {"name": "rk4", "step": 2.5e-4}}),
    "relaxing rk4": Case("target-a", {**SLIP, "fingertip.damping": {"name": "fung"},
                                      "stepper": {"name": "rk4", "step": 2.5e-4}}, slips=True),
    "lift": Case("grasp-and-lift", {"duration": 1.8}, (400, 588, 590, 593, 810, 1310, 1591, 1592, 1700)),
    "lift by euler": Case("grasp-and-lift", {"duration": 0.65, "stepper": {"name": "semi-implicit-euler",
                                                                           "step": 2.5e-4}}, (589, 600)),
    "computed-torque": Case("computed-torque", {"reference.duration": 0.05}),
    "finger-only": Case("finger-only", {"reference.duration": 0.05}),
    "two-phase": Case("pinch-two-phase", {"reference.duration": 0.05}),
    "slow controller": Case("computed-torque", {**STEP, "controller.period": 0.005}, (0, 3, 5, 13, 40)),
    "pushed": Case("target-a", {**STEP, "stepper.step": 5e-4}, (0, 9, 10, 15, 16, 30, 40), PUSHES),
    "pushed, by rk4": Case("target-a", {"stepper": {"name": "rk4", "step": 2.5e-4}}, (5, 12, 20), PUSHES),
    "touching, then moved": Case("target-a", {**SLIP, "control_period": 0.002, "stepper.step": 5e-4}, (0, 7, 19),
                                 slips=True),
}  # fmt: skip
each_case = pytest.mark.parametrize("name", list(CASES))


@cache
def uncut(name: str) -> Recording:
    """The whole run."""
    return CASES[name].make().run()


def differing(whole: Recording, cut: int, rest: Recording) -> list[str]:
    """Variables of the rest that are not those of the whole run from the cut on.

    Angles that a recording lets go on beyond one turn are counted from its first sample: whole turns may be between.
    """
    assert list(rest.variables) == list(whole.variables) and len(rest)
    part = slice(cut, cut + len(rest))
    differ = []
    for name, values in rest.variables.items():
        apart = values - whole[name][part]
        if name in ("contact_angles", "contact_coordinates"):
            apart = apart - 2.0 * np.pi * np.round(apart[:1] / (2.0 * np.pi))
            apart[np.abs(apart) < 1e-14] = 0.0
        differ += [name] if np.any(apart) or not np.array_equal(np.isnan(values), np.isnan(whole[name][part])) else []
    return differ


def saved(name: str) -> dict[tuple[int, str], State]:
    """States of one run driven by hand: at each cut, after the step, and after the sample."""
    case, simulation, whole, states = CASES[name], CASES[name].make(), uncut(name), {}
    for k in range(len(whole)):
        if k in case.cuts:
            states[k, "step"] = simulation.save()
        simulation.sample()
        if k in case.cuts:
            states[k, "sample"] = simulation.save()
        assert np.array_equal(simulation.torque, whole.joint_torque[k]), "saving has disturbed the run"
        simulation.step()
    return states


@each_case
def test_the_rest_of_a_cut_run_is_that_of_the_whole(name: str) -> None:
    """Every recorded variable, from each cut on, in a simulation that has been elsewhere before."""
    whole, other = uncut(name), CASES[name].make()
    other.run(until=0.02)
    for (cut, after), state in saved(name).items():
        assert state.time == pytest.approx(whole.time[cut], abs=1e-12)
        until = min(state.time + 0.05, whole.time[-1])
        for given in (state, pickle.loads(pickle.dumps(state))) if after == "step" else (state,):
            rest = other.run(start=given, until=until)
            assert rest.time[-1] == pytest.approx(until) and differing(whole, cut, rest) == [], (cut, after)


@each_case
def test_the_cases_are_hard_ones(name: str) -> None:
    """There is slip, touch, a push at the cuts, so that each part of a state matters."""
    case, whole = CASES[name], uncut(name)
    assert whole.complete and np.max(np.abs(whole.joint_velocity)) > 0.02 and max(case.cuts) < len(whole) - 1
    if case.slips:
        slips = np.any(whole.is_slipping, axis=1)
        assert any(slips[cut] for cut in case.cuts) and not slips.all()
    assert ("external_force" in whole.variables) == bool(case.pushes)
    if name == "lift":  # before, at and after the touch of each finger, and as the box leaves the table
        touching = [int(np.sum(whole.contact_force[cut, :, 2] > 0.0)) for cut in case.cuts]
        standing = [int(np.sum(whole.support_force[cut, :, 2] > 0.0)) for cut in case.cuts]
        assert {0, 1, 3} <= set(touching) and {0, 4} <= set(standing)


def go_on(given: Path, found: Path) -> None:
    """What the other process does: simulate each state to its end, and write what it recorded."""
    found.write_bytes(pickle.dumps({
        key: CASES[key[0]].make().run(start=state, until=min(state.time + 0.02, CASES[key[0]].duration))
        for key, state in pickle.loads(given.read_bytes()).items()
    }))  # fmt: skip


def test_a_state_goes_on_in_another_process(tmp_path: Path) -> None:
    """One state of each case is pickled, and another Python ends its run to the same bits."""
    states = {}
    for name, case in CASES.items():
        cut = case.cuts[len(case.cuts) // 2]
        states[name, cut] = saved(name)[cut, "step"]
    (tmp_path / "states").write_bytes(pickle.dumps(states))
    program = "import sys, pathlib, test_save_and_go_on as t; t.go_on(*map(pathlib.Path, sys.argv[1:]))"
    files = tmp_path / "states", tmp_path / "found"
    subprocess.run([sys.executable, "-c", program, *files], cwd=Path(__file__).parent, check=True)
    rest = pickle.loads((tmp_path / "found").read_bytes())
    assert set(rest) == set(states)
    for (name, cut), recording in rest.items():
        assert differing(uncut(name), cut, recording) == [], (name, cut)


# ------------------------------------------------------------------------------------------------ what a state is not


def cut_state(simulation: Simulation, cut: int) -> State:
    """The state before a sample of a run from the start."""
    simulation.reset()
    for _ in range(cut):
        simulation.sample()
        simulation.step()
    return simulation.save()


def test_a_state_without_what_is_carried_starts_afresh() -> None:
    """From q, v, z and the time alone the motion goes on, but for an error of the third order of the step."""
    away = []
    for step in (1e-3, 5e-4):
        simulation = Case("target-a", {"stepper.step": step}).make()
        whole, state = simulation.run(), cut_state(simulation, 18)
        rest = simulation.run(start=State(state.q, state.v, state.z, state.time))
        assert np.array_equal(rest.time, whole.time[18:])
        assert np.array_equal(rest.joint_position[0], whole.joint_position[18])
        away.append(np.max(np.abs(rest.joint_position - whole.joint_position[18:])))
    assert away[0] / away[1] == pytest.approx(8.0, rel=0.2)


def test_without_what_is_carried_totals_begin_anew() -> None:
    """The way slipped is no part of q, v and z."""
    simulation = CASES["midpoint"].make()
    whole, state = uncut("midpoint"), cut_state(simulation, 18)
    rest = simulation.run(start=State(state.q, state.v, state.z, state.time))
    assert rest.slip_travel[0].max() == 0.0 < whole.slip_travel[18].max()


def test_reset_goes_back_to_a_state_and_to_the_start() -> None:
    """`reset(state)` puts time, motion and torque back; `reset()` the start."""
    simulation = CASES["rolling"].make()
    start = simulation.save()
    for _ in range(7):
        simulation.sample()
        simulation.step()
    state, torque = simulation.save(), simulation.torque.copy()
    simulation.sample()
    simulation.step()
    simulation.reset(state)
    assert simulation.time == 0.007 and np.array_equal(simulation.torque, torque)
    assert all(map(np.array_equal, simulation.state.arrays, state.arrays))
    simulation.reset()
    assert simulation.time == 0.0 and not simulation.torque.any()
    assert all(map(np.array_equal, simulation.state.arrays, start.arrays))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda state: State(state.q[1:], state.v, state.z), r"state\.q: it has shape \(15,\).*this plant is \(16,\)"),
        (lambda state: State(state.q, state.v[1:], state.z), r"state\.v: it has shape \(14,\)"),
        (lambda state: State(state.q, state.v, state.z[:2]), r"state\.z: it has shape \(2, 3\)"),
        (lambda state: State(state.q, np.nan * state.v, state.z), r"state\.v: it has NaN"),
        (lambda state: State(state.q, state.v, state.z, 0.0105), r"state\.time: 0\.0105 s is no whole number"),
        (lambda state: State(state.q, state.v, state.z, -0.01), r"state\.time: -0\.01 s"),
        (lambda state: State(state.q, state.v, state.z, float("nan")), r"state\.time: nan s"),
        (lambda state: build(load_scenario("pinch")).save(), r"state\.q: it has shape \(13,\)"),
        (lambda state: build(load_scenario("target-a", {"stepper.name": "rk4"})).save(), r"another stepper"),
    ],
)  # fmt: skip
def test_a_state_of_something_else_is_refused(change: Any, words: str) -> None:
    """By the name of what does not fit; the simulation stays where it is."""
    simulation = CASES["rolling"].make()
    simulation.sample()
    simulation.step()
    before = simulation.save()
    with pytest.raises(ScenarioError, match=words) as caught:
        simulation.reset(change(before))
    assert caught.value.key.startswith("state.")
    assert simulation.time == before.time and all(map(np.array_equal, simulation.state.arrays, before.arrays))


def test_a_hand_of_the_same_size_is_told_by_its_names(tmp_path: Path) -> None:
    """As many joints and contacts, but others: the message has both lists."""
    text = HAND_URDF.read_text().replace("finger_2_abduction", "thumb_abduction")
    (tmp_path / "hand.urdf").write_text(text)
    other = build(load_scenario("target-a", {"hand.urdf": str(tmp_path / "hand.urdf")}))
    with pytest.raises(ScenarioError, match=r"state\.carried: .*thumb_abduction.*but those of this plant.*finger_2_ab"):
        CASES["rolling"].make().reset(other.save())


class Counting(Controller):
    """Its memory is a list that it changes in place, which it should not, and holds the start."""

    def start(self, observation: Any) -> Any:
        return [observation.J_CF.T @ observation.contact_force.ravel(), 0]

    def torque(self, observation: Any, memory: Any) -> Any:
        memory[1] += 1
        return memory[0] + observation.N_F + 1e-3 * memory[1], memory


def test_a_memory_is_copied() -> None:
    """What a controller does to its memory later, in place, does not reach a state that was saved after a step."""
    simulation = build(load_scenario("target-a", {"duration": 0.02}), Counting())
    whole, state = simulation.run(), cut_state(simulation, 6)
    for _ in range(2):
        assert differing(whole, 6, simulation.run(start=state)) == []


def test_a_memory_that_cannot_be_copied_is_named() -> None:
    """With the controller and the reason."""

    class Streaming(Controller):
        def start(self, observation: Any) -> Any:
            return (value for value in range(1000))

        def torque(self, observation: Any, memory: Any) -> Any:
            return np.full(9, 1e-6 * next(memory)), memory

    simulation = build(load_scenario("target-a", {"duration": 0.02}), Streaming())
    simulation.save()  # nothing to copy yet
    simulation.sample()
    simulation.step()
    with pytest.raises(ControllerError, match=r"'Streaming' has a memory that cannot be copied.*generator"):
        simulation.save()


def test_without_and_with_a_controller() -> None:
    """A state of a run without a controller: one that goes on from it starts there."""
    case = CASES["rolling"]
    simulation = case.make()
    bare = Simulation(simulation.plant, simulation.state, None, read_stepper(load_scenario("target-a")),
                      simulation.reference, 0.05, 0.001)  # fmt: skip
    hold = simulation.sample().J_CF.T @ simulation.observation.contact_force.ravel() + simulation.observation.N_F
    bare.reset()
    for _ in range(5):
        bare.step(hold)
    state = bare.save()
    rest = case.make().run(start=state)
    assert rest.complete and rest.time[0] == 0.005
    assert np.array_equal(rest.joint_position[0], state.q[:9])
