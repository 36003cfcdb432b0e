"""V of Theorem 1: its parts, its rate along the flow, L of (60), and the closed loop as a linear system."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from typing import ClassVar

import numpy as np
import pinocchio as pin
import pytest
from hands import Task, make_law, random_state

from softhand.assembly.build import build, simulate
from softhand.assembly.probe import Probe, recorded_state
from softhand.closed_loop.gain_loop import GainLoop, close_gain_loop
from softhand.closed_loop.gains import Gains
from softhand.closed_loop.invariant_set import examine
from softhand.closed_loop.linearize import LinearModel
from softhand.closed_loop.lyapunov import Lyapunov
from softhand.closed_loop.lyapunov import lyapunov as find_lyapunov
from softhand.closed_loop.scan import _scaling_fields, scan
from softhand.closed_loop.start import held_start
from softhand.closed_loop.storage import evaluate
from softhand.contact.kinematics import deformation_jacobian
from softhand.controllers.regulation import Regulation
from softhand.dampings.hunt_crossley import HuntCrossley
from softhand.dampings.kelvin_voigt import KelvinVoigt
from softhand.errors import LawError, RecordingError, SofthandError
from softhand.laws.law import Law
from softhand.laws.nakashima import Nakashima
from softhand.plant.state import State
from softhand.plots.lyapunov import draw_lyapunov
from softhand.plots.stability import draw_scan
from softhand.plots.style import save_figure
from softhand.recording.recording import Recording
from softhand.references.goal import Goal
from softhand.references.reference import resting
from softhand.scenario.scenario import Scenario, load_scenario, with_law

K_O = np.array([100.0] * 3 + [0.3] * 3)
GAINS = Gains.of(Regulation(), 9, 3)
HELD = {
    "reference.kind": "step",
    "reference.object_position": (0.0, 0.010, 0.142),
    "reference.object_rpy": (0.0, 0.0, 0.0),
    "reference.internal_force": (4.0, 4.0, 3.0),
}
"""Asks the reference grasp to stay where it is."""


def probe_of(task: Task, away: float = 0.0) -> Probe:
    """A probe of the reference hand; what is desired is the start, or a little away from it."""
    pose = np.array([*task.grasp.state.q[-7:-4], 0.0, 0.0, 0.0])
    target = pose + away * np.array([0.004, -0.003, 0.005, 0.05, -0.04, 0.06])
    force = np.array(task.internal_force)
    return Probe(task.plant(), resting(Goal(target, force + away)))


def flow(probe: Probe, state: State, time: float, gains: Gains = GAINS) -> State:
    """The state a moment later under (59), by a Taylor step whose error is of second order in time."""
    seen = probe.at(state, 0.0)
    torque = gains.law.torque(seen, gains.law.start(seen))[0].copy()
    probe.plant.update(state.q, state.v, state.z)
    acceleration = probe.plant.acceleration(torque, np.zeros(len(state.v)))
    rate = probe.plant.contacts["deformation_rate"][:, 1:]
    model = probe.plant.world.model
    return State(pin.integrate(model, state.q, time * state.v), state.v + time * acceleration, state.z + time * rate)


def along_flow(probe: Probe, state: State, quantity, time: float = 2e-7):
    """Time derivative of a function of the observation, by central differences along the flow."""
    ends = [quantity(probe.at(flow(probe, state, sign * time), 0.0)) for sign in (1.0, -1.0)]
    return (ends[0] - ends[1]) / (2.0 * time)


def moving(task: Task, rng: np.random.Generator) -> State:
    """A moving state in which every tip presses."""
    start = task.grasp.state
    state = random_state(task, rng)
    return State(pin.integrate(task.world.model, start.q, 0.1 * pin.difference(task.world.model, start.q, state.q)),
                 state.v, start.z + 0.3 * (state.z - start.z))  # fmt: skip


def test_laws_in_other_coordinates_are_refused(reference):
    """V and L are stated in the paper's coordinates; another law is named, with what takes it."""

    class Surface(Nakashima):
        """In other coordinates."""

        coordinates: ClassVar[str] = "surface"

    probe = probe_of(reference)
    probe.laws = [Surface(**dict(probe.laws[0]))]
    with pytest.raises(LawError, match=r"Surface.*softhand stability"):
        probe.require_polar()


# ----------------------------------------------------------------------------------------------------- V and its parts


def test_V_is_zero_at_rest_at_the_target(reference):
    """At the start, with nothing else desired, every part of V is zero."""
    probe = probe_of(reference)
    found = evaluate(probe, probe.at(reference.grasp.state, 0.0), GAINS)
    parts = (found.kinetic_hand, found.kinetic_object, found.spring, found.deformation, found.dissipation)
    assert np.abs(parts).max() < 1e-15
    assert found.desired_deformation == pytest.approx(reference.grasp.deformation[:, :3], abs=1e-12)


def test_kinetic_energy_is_that_of_the_rigid_bodies(reference, rng):
    """The two kinetic terms of (61), in q_F and q_O, add up to Pinocchio's kinetic energy."""
    state, probe = moving(reference, rng), probe_of(reference)
    found = evaluate(probe, probe.at(state, 0.0), GAINS)
    model = reference.world.model
    energy = pin.computeKineticEnergy(model, model.createData(), state.q, state.v)
    assert found.kinetic_hand + found.kinetic_object == pytest.approx(energy, rel=1e-12)


def test_P_is_the_integral_of_62_by_hand(reference, rng):
    """P for the paper's law in closed form: cubic in dr, quadratic in dtheta and dphi; none for the torsion."""
    state, probe = moving(reference, rng), probe_of(reference, away=1.0)
    seen = probe.at(state, 0.0)
    found = evaluate(probe, seen, GAINS)
    law = probe.laws[0]
    expected = 0.0
    for i in range(3):
        phi, f_d = seen.eta[i, 1], found.desired_force[i]
        unit = np.array(law.force(1.0, 1.0, 1.0, 0.0, phi, *law.parameters())[1:3])
        delta_d = np.array([np.sqrt(f_d[0] / (pi * law.k_r)), *(f_d[1:] / unit)])
        delta = seen.deformation[i, :3]
        expected += pi * law.k_r * (delta[0] ** 3 - delta_d[0] ** 3) / 3.0 - f_d[0] * (delta[0] - delta_d[0])
        expected += 0.5 * np.sum(unit * (delta[1:] - delta_d[1:]) ** 2)
    assert found.deformation == pytest.approx(expected, rel=1e-9) and expected > 0.0


def test_the_forces_asked_for_are_those_of_the_torque(reference, rng):
    """What V takes for the forces of (59) gives its torque, by the second half of (59)."""
    state, probe = moving(reference, rng), probe_of(reference, away=1.0)
    seen = probe.at(state, 0.0)
    f = GAINS.asked_forces(seen)
    torque = seen.J_CF_f.T @ f - 0.005 * seen.joint_velocity + seen.N_F + seen.J_CF_tau.T @ seen.tau_C
    assert GAINS.law.torque(seen, GAINS.law.start(seen))[0] == pytest.approx(torque, rel=1e-9, abs=1e-12)


def test_where_the_proof_leaves_nothing_out_V_falls_by_damping_alone(reference, rng):
    """With delta = delta_d both missing terms vanish whatever moves: V' = - q_F'^T K_v q_F' (70), along the flow."""
    start, probe = reference.grasp.state, probe_of(reference)
    state = State(start.q, rng.normal(0.0, 0.3, start.v.shape), start.z)
    rate = along_flow(probe, state, lambda seen: evaluate(probe, seen, GAINS).value)
    damped = evaluate(probe, probe.at(state, 0.0), GAINS)
    assert damped.contact_rate == pytest.approx(0.0, abs=1e-12)
    assert rate == pytest.approx(-0.005 * np.sum(state.v[:9] ** 2), rel=1e-6)


def test_the_rate_of_V_is_the_sum_of_its_terms(reference, rng):
    """At any moving state V' is the damping, the motion of f_d and the change of the contact angles, nothing else."""
    state, probe = moving(reference, rng), probe_of(reference, away=1.0)
    rate = along_flow(probe, state, lambda seen: evaluate(probe, seen, GAINS).value)
    f_d_rate = along_flow(probe, state, lambda seen: evaluate(probe, seen, GAINS).desired_force)
    seen = probe.at(state, 0.0)
    found = evaluate(probe, seen, GAINS)
    desired = -np.sum(f_d_rate * (seen.deformation[:, :3] - found.desired_deformation))
    assert rate == pytest.approx(found.dissipation + desired + found.contact_rate, rel=1e-5)
    assert abs(desired) > 1e-2 * abs(rate) and abs(found.contact_rate) > 1e-5 * abs(rate)


@pytest.mark.parametrize("damping", [KelvinVoigt(radial=30.0, tangential=20.0, torsional=2e-3), HuntCrossley()])
def test_damped_tips_have_their_term(reference, rng, damping):
    """What the tips' damping takes is one more term of V'; without it the others do not add up."""
    tips = tuple(replace(tip, damping=damping) for tip in reference.fingertips)
    task = replace(reference, fingertips=tips)
    state, probe = moving(task, rng), probe_of(task, away=1.0)
    rate = along_flow(probe, state, lambda seen: evaluate(probe, seen, GAINS).value)
    f_d_rate = along_flow(probe, state, lambda seen: evaluate(probe, seen, GAINS).desired_force)
    seen = probe.at(state, 0.0)
    found = evaluate(probe, seen, GAINS)
    desired = -np.sum(f_d_rate * (seen.deformation[:, :3] - found.desired_deformation))
    expected = found.dissipation + desired + found.contact_rate + found.damping
    assert rate == pytest.approx(expected, rel=1e-4)
    assert found.damping < -1e-2 * abs(rate)


def test_V_is_not_defined_where_the_tips_would_have_to_pull(reference):
    """No deformation answers to a pulling f_d: P is NaN there, not a number."""
    state, probe = reference.grasp.state, probe_of(reference, away=1.0)
    strong = Gains.of(Regulation(K_O_position=3e4, K_O_orientation=90.0), 9, 3)
    found = evaluate(probe, probe.at(state, 0.0), strong)
    assert found.desired_force[:, 0].min() < 0.0 and np.isnan(found.value)


# --------------------------------------------------------------------------------------------------------- along a run


@pytest.fixture(scope="module")
def recording():
    """A quarter of a second towards target A."""
    return simulate(load_scenario("target-a", {"duration": 0.25, "reference.duration": 0.25}))


@pytest.fixture(scope="module")
def lyapunov(recording) -> Lyapunov:
    """V along it."""
    return find_lyapunov(recording, every=50)


@pytest.mark.parametrize("law", ["nakashima", "conservative"])
def test_recorded_states_are_those_of_the_run(law):
    """A plant put at a recorded state sees what was recorded: forces, internal forces, coordinates."""
    scenario = load_scenario("target-a", {"duration": 0.25, "reference.duration": 0.25})
    scenario = scenario if law == "nakashima" else with_law(scenario, law)
    recording, probe = simulate(scenario), Probe.of_scenario(scenario)
    for sample in (0, 120, 250):
        seen = probe.at(recorded_state(probe.plant, recording, sample), recording.time[sample])
        assert seen.contact_force == pytest.approx(recording.contact_force[sample], abs=1e-9)
        assert seen.internal_force == pytest.approx(recording.internal_force[sample], abs=1e-9)
        apart = seen.contact_coordinates - recording.contact_coordinates[sample]
        apart[:, [0, 4]] -= 2.0 * np.pi * np.round(apart[:, [0, 4]] / (2.0 * np.pi))  # a recording counts whole turns
        assert apart == pytest.approx(np.zeros_like(apart), abs=1e-9)


def test_the_terms_explain_the_rate_along_a_run(lyapunov):
    """What is left over is a thousandth of the rate; without any one of the large terms it would not be."""
    size = np.sqrt(np.mean(lyapunov.rate**2))
    assert np.sqrt(np.mean(lyapunov.remainder[2:-2] ** 2)) < 2e-3 * size
    for name in ("dissipation", "reference", "desired", "actuation"):
        without = lyapunov.remainder + getattr(lyapunov, name)
        assert np.sqrt(np.mean(without[2:-2] ** 2)) > 5e-3 * size, name


def test_it_is_said_where_V_rises(lyapunov):
    """The stretches are those in which V grows, and the moving reference is named as the cause of the largest."""
    begin, end, gain = max(lyapunov.spans(), key=lambda span: span[2])
    V = dict(zip(lyapunov.time, lyapunov.value, strict=True))
    assert gain == pytest.approx(V[end] - V[begin]) and gain > 0.0
    assert lyapunov.cause(begin, end) == "the motion of the reference"
    assert any("V rises during" in label for label, _ in lyapunov.rows())


def test_the_figure_is_drawn(lyapunov, tmp_path):
    """Energy, rate, terms, L and the share of the contact stiffness; the line of the rate is the rate in mW."""
    figure = draw_lyapunov(lyapunov, lyapunov.invariant, "a run")
    assert figure.axes[1].lines[0].get_ydata() == pytest.approx(1e3 * lyapunov.rate)
    assert len(figure.axes) == 5
    save_figure(figure, tmp_path / "figure.png")


def test_damped_runs_are_evaluated_with_their_damping_and_relaxing_ones_refused():
    """The plant of a recording has the damping of the run; what a relaxation remembers is not recorded."""
    changes = {"duration": 0.1, "reference.duration": 0.1, "fingertip.damping.name": "kelvin-voigt"}
    found = find_lyapunov(simulate(load_scenario("target-a", changes)))
    size = np.sqrt(np.mean(found.rate**2))
    assert np.sqrt(np.mean(found.remainder[2:-2] ** 2)) < 5e-3 * size
    assert np.max(found.damping) <= 0.0 and np.min(found.damping) < -1e-3 * size
    changes["fingertip.damping.name"] = "fung"
    with pytest.raises(LawError, match="relaxing damping"):
        find_lyapunov(simulate(load_scenario("target-a", changes)))


def test_other_runs_are_refused(recording):
    """Another controller, a recording without a scenario, or one of two samples: one error each."""
    other = recording.scenario.replace('name = "regulation"', 'name = "regulatoin"')
    for scenario, words in (("", "scenario"), ("x = 1", "scenario"), (other, "regulatoin")):
        with pytest.raises(SofthandError, match=words):
            find_lyapunov(Recording(recording.variables, recording.labels, scenario, "", True, "", 0.25))
    short = {name: array[:2] for name, array in recording.variables.items()}
    with pytest.raises(RecordingError, match="three samples"):
        find_lyapunov(Recording(short, recording.labels, recording.scenario, "", True, "", 0.0))


# ----------------------------------------------------------------------------------------------------------- L of (60)


def test_the_lower_blocks_of_L_are_the_motion_constraint(reference, rng):
    """J_O and J_delta of (43), computed here from the contact coordinates, are those of the plant."""
    state, probe = moving(reference, rng), probe_of(reference)
    seen = probe.at(state, 0.0)
    L = examine(probe, seen, np.diag(K_O)).L
    J_delta = np.zeros((4, 4))
    assert L[6:, :6] == pytest.approx(seen.J_O, abs=1e-12)
    for i, contact in enumerate(probe.plant.contacts):
        deformation_jacobian(contact["distance"], contact["sin_Phi"], contact["cos_Phi"], J_delta)
        assert L[6 + 4 * i : 10 + 4 * i, 6 + 4 * i : 10 + 4 * i] == pytest.approx(J_delta, abs=1e-12)


def test_L_is_the_derivative_of_71_along_rolling_motions(reference, rng):
    """For any q_O' with the fingers held, L (q_O', delta') is d/dt (F_O - N_O + K_O q_O), by differences."""
    state, probe = moving(reference, rng), probe_of(reference)
    world = reference.world
    seen = probe.at(state, 0.0)
    found = examine(probe, seen, np.diag(K_O))
    rate = rng.normal(0.0, 1.0, 6) * [0.01, 0.01, 0.01, 0.1, 0.1, 0.1]
    delta_rate = -np.linalg.solve(found.L[6:, 6:], found.L[6:, :6] @ rate)
    twist = seen.T_O @ rate
    body = np.concatenate([seen.object_rotation.T @ twist[:3], seen.object_rotation.T @ twist[3:]])
    v = np.concatenate([np.zeros(9), body])

    def excess(time):
        q = pin.integrate(world.model, state.q, time * v)
        now = probe.at(State(q, 0.0 * v, state.z + time * delta_rate.reshape(3, 4)[:, 1:]), 0.0)
        return now.J_O.T @ now.contact_force.ravel() - now.N_O + K_O * now.q_O

    differences = (excess(1e-5) - excess(-1e-5)) / 2e-5
    assert found.L[:6] @ np.concatenate([rate, delta_rate]) == pytest.approx(differences, rel=1e-5, abs=1e-6)
    assert found.contact_stiffness @ rate == pytest.approx(K_O * rate - differences, rel=1e-4, abs=1e-6)


def test_L_is_singular_where_K_O_is_the_contact_stiffness(reference):
    """At 1 / use times the gain the smallest singular value vanishes, on both sides it does not."""
    probe = probe_of(reference)
    seen = probe.at(reference.grasp.state, 0.0)
    found = examine(probe, seen, np.diag(K_O))
    at, below, above = (examine(probe, seen, share / found.use * np.diag(K_O)).smallest for share in (1.0, 0.9, 1.1))
    assert at < 1e-5 * min(below, above)


# --------------------------------------------------------------------------------------------------------- closed loop


def loop_of(scenario: Scenario) -> GainLoop:
    """The loop of (59) about the start."""
    return close_gain_loop(held_start(scenario))


def test_two_masses_on_a_spring_lose_regulation_at_the_stiffness_of_the_spring():
    """One finger and one object: by Routh the loop is stable for K_O < k, and for no greater gain."""
    m1, m2, k, damping = 0.07, 0.2, 800.0, 0.4
    A = np.zeros((4, 4))
    A[:2, 2:] = np.eye(2)
    A[2], A[3] = [-k / m1, k / m1, -damping / m1, 0.0], [k / m2, -k / m2, 0.0, 0.0]
    B = np.array([[0.0], [0.0], [1.0 / m1], [0.0]])
    pull = np.zeros((6, 1, 4))
    pull[0, 0, 1] = -1.0
    loop = GainLoop(LinearModel(A, B, ("",) * 4, ("",), np.zeros(2)), np.zeros((1, 4)), pull, K_O, 0.0)
    gain = np.zeros(6)
    for share, stable in ((0.5, True), (0.999, True), (1.001, False), (2.0, False)):
        gain[0] = share * k
        assert (loop.growth(gain) < 0.0) is stable
        assert loop.held_growth([gain], 1e-7)[0] == pytest.approx(loop.growth(gain), abs=2e-3)


def test_the_grasp_loses_regulation_near_the_contact_stiffness(reference):
    """Reference grasp, no sampling: all motions die out at K_O of the paper, and not at 1.3 / use times it."""
    loop = loop_of(load_scenario("target-a"))
    probe = probe_of(reference)
    assert loop.use == pytest.approx(examine(probe, probe.at(reference.grasp.state, 0.0), np.diag(K_O)).use, rel=1e-5)
    assert loop.growth(K_O) < 0.0 < loop.growth(1.3 / loop.use * K_O)


def test_growth_is_that_of_the_simulation():
    """A disturbance of 1e-6 grows in a run at the rate of the linear loop with held torques, to five per cent."""
    factor, begin, end = 2.0, 0.4, 0.8
    tips = {f"fingertip.{name}": factor * value for name, value in dict(make_law()).items() if name != "radius"}
    changes = {**HELD, **tips, "stepper.name": "rk4", "stepper.step": 1e-4, "duration": end + 0.2}
    scenario = load_scenario("target-a", changes)
    simulation = build(scenario)
    simulation._start.v[:] = np.random.default_rng(0).normal(0.0, 1e-6, 15)
    speed = np.linalg.norm(simulation.run().joint_velocity, axis=1)
    early, late = (speed[round(1e3 * time) : round(1e3 * time) + 150].max() for time in (begin, end))
    growth = loop_of(scenario).held_growth([K_O], 1e-3)[0]
    assert np.log(late / early) / (end - begin) == pytest.approx(growth, rel=0.05) and growth > 1.0


def test_a_relaxing_tip_is_between_its_two_springs():
    """One that relaxes at once is a tip with c_0 times the coefficients; one that takes its time damps."""
    quick = {"name": "fung", "shares": (0.3,), "rates": (1e7,)}
    relaxing = loop_of(load_scenario("target-a", {"fingertip.damping": quick}))
    soft = {f"fingertip.{name}": 0.7 * value for name, value in dict(make_law()).items() if name != "radius"}
    elastic = loop_of(load_scenario("target-a", soft))
    assert len(relaxing.model.A) == len(elastic.model.A) + 12
    assert relaxing.use == pytest.approx(elastic.use, rel=1e-5)
    assert relaxing.growth(6.0 * K_O) == pytest.approx(elastic.growth(6.0 * K_O), rel=1e-3)
    slow = load_scenario("target-a", {"fingertip.damping": {**quick, "rates": (20.0,)}})
    assert loop_of(slow).growth(K_O) < elastic.growth(K_O) - 0.1


def test_a_scan_is_the_loop_at_each_stiffness(tmp_path):
    """Growth at the factor 1 is that of the scenario; a stiffer tip carries more gain; the figure is drawn."""
    scenario = load_scenario("target-a")
    found = scan(scenario, [1.0, 1.6], [0.5, 1.0, 2.0, 3.0, 4.0])
    assert found.growth[1, 0] == pytest.approx(loop_of(scenario).growth(K_O), abs=1e-6)
    assert found.largest_gain(0) < found.largest_gain(1)
    assert 1.0 / found.use[0] == pytest.approx(found.largest_gain(0), rel=0.2)
    save_figure(draw_scan(found, "a scan", 1e-3), tmp_path / "scan.png")


def test_a_law_that_cannot_be_scaled_is_refused():
    """A law whose force is not in proportion to any of its coefficients has no stiffness axis."""

    class Fixed(Law):
        """Springs without coefficients."""

        @staticmethod
        def force(dr, dtheta, dphi, dpsi, phi, radius):
            """See the class."""
            return 1e3 * dr, 0.1 * dtheta, 0.1 * dphi, 0.01 * dpsi

    with pytest.raises(LawError, match="Fixed"):
        _scaling_fields(Fixed(radius=0.01))
