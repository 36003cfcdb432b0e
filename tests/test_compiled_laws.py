"""Control laws as compiled code: the same run in the loop without Python, and what is said of a formula at fault."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hands import ARM_IN_THE_AIR, DATA, Array
from numpy.testing import assert_allclose

from softhand import Controller, ControllerError, SimulationStopped, build, load_scenario
from softhand.assembly.build import assemble
from softhand.assembly.resolve import resolve
from softhand.batch.asked import Asked
from softhand.batch.run import CompiledRun, Result
from softhand.controllers import blocks
from softhand.numerics.linear import least_norm_columns, truncated_solution
from softhand.plugins import SHIPPED
from softhand.simulation.keep import Keep

KEPT = ("joint_position", "object_position", "object_rpy", "contact_force", "joint_torque")
SCENARIOS = {
    **{name: name for name in SHIPPED["controllers"]},
    "regulation": "target-a",
    "state-feedback": "target-a",
    "least-squeeze": "target-a",
    "opposing": "pinch-opposing",
    "angle-feedback": "pinch-angle-feedback",
    "two-phase": "pinch-two-phase",
    "pick-and-place": "grasp-and-lift",
    "arm-pick-and-place": "arm-pick-and-place",
}
CASES: list[tuple[str, dict[str, Any]]] = [
    *((name, {}) for name in SHIPPED["controllers"] if name not in ("state-feedback", "least-squeeze")),
    ("least-squeeze", {"controller": {"name": "least-squeeze"}}),
    ("state-feedback", {"controller": {"name": "state-feedback", "gain_file": str(DATA / "state_feedback.toml")}}),
    *((name, {"controller.orientation_error": "euler"}) for name in ("finger-only", "computed-torque")),
    ("pick-and-place", {"duration": 1.2}),  # until the tips hold
    ("arm-pick-and-place", ARM_IN_THE_AIR),
]


def in_compiled_loop(scenario: str, values: dict[str, Any], controller: Controller | None = None) -> Result:
    """A run without Python."""
    task = load_scenario(scenario, values)
    keep = Keep.of(KEPT, task.control_period, task.control_period)
    run = CompiledRun(resolve(task, controller), keep, Asked())
    assert run.law is not None
    return run.go(lambda: False)


def must_agree(scenario: str, values: dict[str, Any], controller: Controller | None = None) -> Result:
    """The same run in both loops, within 1e-10 in SI units."""
    found = in_compiled_loop(scenario, values, controller)
    expected = assemble(resolve(load_scenario(scenario, values), controller)).run()
    assert found.outcome.reason == "finished"
    for name in KEPT:
        assert_allclose(found.variables[name], expected[name], rtol=0.0, atol=1e-10, err_msg=name)
    return found


@pytest.mark.parametrize(("name", "values"), CASES, ids=str)
def test_both_loops_run_the_same_law(name: str, values: dict[str, Any]) -> None:
    """Every controller that ships: one formula, called from Python and without it."""
    found = must_agree(SCENARIOS[name], {"duration": 0.2, **values})
    if "duration" in values:
        assert np.all(found.variables["contact_force"][-1, :, 2] > 0.1)


class Integrating(Controller):
    """Joint torques of the start, and an integral of the error of the height that pushes all tips up."""

    K_I: float = 40.0
    gains: tuple[float, ...] = (1.0, 0.5)

    def start(self, observation: Any) -> Any:
        """The integral, its time, and the torques that hold the grasp."""
        holding = observation.N_F + observation.J_CF.T @ observation.contact_force.ravel()
        return np.concatenate([[0.0, observation.time], holding])

    @staticmethod
    def formula(observed: Any, settings: Any, memory: Any, torque: Any) -> None:
        """Height to force, spread over the tips."""
        missing = observed.object_position_desired[2] - observed.q_O[2]
        memory[0] += missing * (observed.clock[0] - memory[1])
        memory[1] = observed.clock[0]
        force = settings.gains[0] * missing + settings.K_I * settings.gains[1] * memory[0]
        for j in range(torque.shape[0]):
            torque[j] = memory[2 + j] - 0.01 * observed.joint_velocity[j]
            for i in range(observed.tip_position.shape[0]):
                torque[j] += observed.tip_jacobian[i, 2, j] * force


def test_a_formula_with_memory_runs_in_both_loops() -> None:
    """An integrator of one's own; what it is handed as memory stays as it was."""
    must_agree("target-a", {"duration": 0.2}, Integrating())
    seen = build(load_scenario("target-a", {"duration": 0.001})).sample().copy()
    controller = Integrating()
    memory = controller.start(seen)
    seen.time = 0.01
    seen.object_position_desired += 0.01
    before = memory.copy()
    first, after = controller.torque(seen, memory)
    second, _ = controller.torque(seen, memory)
    assert np.array_equal(memory, before) and np.array_equal(first, second)
    assert after[0] == pytest.approx(0.01 * (0.01 + before_error(seen)), rel=1e-9) and after[1] == 0.01


def before_error(seen: Any) -> float:
    """What was missing of the height before the desired one was moved by 0.01 m [m]."""
    return float(seen.object_position_desired[2] - 0.01 - seen.object_position[2])


class Unknown(Controller):
    """Reads a field that there is not."""

    @staticmethod
    def formula(observed: Any, settings: Any, memory: Any, torque: Any) -> None:
        """A typing error."""
        torque[0] = observed.joint_velocty[0]


class Beyond(Controller):
    """Reads beyond the end of an array after 0.01 s."""

    @staticmethod
    def formula(observed: Any, settings: Any, memory: Any, torque: Any) -> None:
        """An index that is too large."""
        k = 0 if observed.clock[0] < 0.0095 else 100
        torque[0] = observed.joint_velocity[k]


def test_a_formula_that_cannot_be_compiled_is_told_in_one_error() -> None:
    """Its controller, the cause, and what to write; the same in both loops."""
    words = r"controller 'Unknown': its formula cannot be compiled: .*joint_velocty.*did you mean 'joint_velocity'"
    with pytest.raises(ControllerError, match=words):
        in_compiled_loop("target-a", {"duration": 0.01}, Unknown())
    with pytest.raises(ControllerError, match=words):
        build(load_scenario("target-a", {"duration": 0.01}), Unknown()).run()


class Texts(Controller):
    """Beyond what numba compiles."""

    @staticmethod
    def formula(observed: Any, settings: Any, memory: Any, torque: Any) -> None:
        """An attribute that arrays do not have."""
        torque[0] = observed.joint_velocity.norm()


def test_a_formula_beyond_numba_is_told_in_one_error() -> None:
    """The cause in one line, and what to write."""
    with pytest.raises(
        ControllerError, match=r"'Texts': its formula cannot be compiled: .*norm.*plain numbers"
    ) as caught:
        in_compiled_loop("target-a", {"duration": 0.01}, Texts())
    assert len(str(caught.value)) < 500 and "\n" not in str(caught.value)


def test_a_formula_that_raises_ends_the_run_with_its_error() -> None:
    """Not with numbers from beyond the array; the same words in both loops."""
    outcome = in_compiled_loop("target-a", {"duration": 0.02}, Beyond()).outcome
    with pytest.raises(ControllerError, match=r"controller 'Beyond' raised IndexError: .*at t = 0.01 s") as caught:
        build(load_scenario("target-a", {"duration": 0.02}), Beyond()).run()
    assert outcome.reason == "controller" and outcome.message.startswith(str(caught.value)[:40])


def ways(**changes: Any) -> dict[str, Any]:
    """The waypoints of the scenario with another first one, or without some."""
    rows = load_scenario("grasp-and-lift").model_dump(exclude_none=True)["reference"]["waypoints"]
    without = changes.pop("without", ())
    left = [dict(row) for row in rows if row["phase"] not in without]
    return {"reference.waypoints": [{**left[0], **changes}, *left[1:]]}


@pytest.mark.parametrize(
    ("values", "words"),
    [(ways(opening=0.002), "finger_1_tip does not reach the object"),
     ({"fingertip.friction": 0.1}, "finger_3_tip"),
     ({"controller.lost": 1e-5}, "the object slipped out"),
     (ways(without=("lower", "put down")), "does not stand")],
    ids=["late", "let go", "lost", "in the air"],
)  # fmt: skip
def test_a_law_that_gives_up_says_the_same_in_both_loops(values: dict[str, Any], words: str) -> None:
    """With the memory at that time: the name of the tip, or the figure at fault."""
    outcome = in_compiled_loop("grasp-and-lift", values).outcome
    with pytest.raises(SimulationStopped, match=words) as caught:
        assemble(resolve(load_scenario("grasp-and-lift", values))).run()
    assert (outcome.reason, outcome.time) == (caught.value.reason, caught.value.time)
    assert outcome.message in str(caught.value)


# ---------------------------------------------------------------------------------------------------------- blocks


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(4)


@pytest.mark.parametrize("shape", [(9, 9), (9, 6), (6, 16), (5, 5)])
def test_pseudo_inverses_are_those_of_numpy(rng: np.random.Generator, shape: tuple[int, int]) -> None:
    """Full rank and one less."""
    A, B = rng.normal(size=shape), rng.normal(size=(shape[0], 4))
    for rank in (min(shape), min(shape) - 1):
        U, s, V = np.linalg.svd(A, full_matrices=False)
        C = np.ascontiguousarray((U[:, :rank] * s[:rank]) @ V[:rank])
        X = np.empty((shape[1], 4))
        least_norm_columns(C, B, X)
        assert_allclose(X, np.linalg.pinv(C, rcond=1e-6) @ B, rtol=0.0, atol=1e-9)
        for share in (1e-3, 0.3):
            x = np.empty(shape[1])
            truncated_solution(C, B[:, 0].copy(), share, x)
            assert_allclose(x, np.linalg.lstsq(C, B[:, 0], rcond=share)[0], rtol=0.0, atol=1e-9)


def test_blocks_do_as_their_equations_say(rng: np.random.Generator) -> None:
    """From plain Python, on the read-only arrays of an observation."""
    seen = build(load_scenario("target-a", {"duration": 0.001})).sample()
    wrench, forces, torque = np.empty(6), np.empty(9), np.zeros(9)
    blocks.hold_weight(seen.object_mass, seen.object_lever, seen.object_rotation, seen.gravity, wrench)
    assert_allclose(wrench, seen.object_gravity, atol=1e-12)
    blocks.take_off_torsion(seen.object_torsion_jacobian, seen.tau_C, wrench)
    blocks.share_wrench(seen.object_force_jacobian, wrench, forces)
    assert_allclose(seen.object_force_jacobian.T @ forces + seen.object_torsion_jacobian.T @ seen.tau_C,
                    seen.object_gravity, atol=1e-12)  # fmt: skip
    squeeze = np.empty(3)
    blocks.feed_back_internal_forces(seen.internal_force, seen.internal_force + 1.0, np.array([1.5, 1.0, 0.0]), squeeze)
    assert_allclose(squeeze - seen.internal_force, [1.5, 1.0, 0.0])
    blocks.add_internal_forces(seen.internal_force_basis, squeeze, forces)
    blocks.push_contacts(seen.hand_force_jacobian, forces, torque)
    assert_allclose(torque, seen.J_CF_f.T @ forces)


def test_the_cone_cuts_what_would_slip() -> None:
    """The direction stays; what is inside is left alone; no tip pulls."""
    forces = np.array([3.0, 4.0, 5.0, 0.1, 0.0, 1.0, 0.2, 0.0, -1.0])
    blocks.clamp_to_cone(0.5, 0.0, forces)
    assert_allclose(forces, [1.5, 2.0, 5.0, 0.1, 0.0, 1.0, 0.0, 0.0, 0.0])


def test_the_filter_is_that_of_first_order() -> None:
    """A step, sampled unevenly: 1 - exp(-t / T)."""
    y = np.zeros(1)
    for dt in (0.01, 0.03, 0.06):
        blocks.low_pass(np.ones(1), 0.05, dt, y)
    assert y[0] == pytest.approx(1.0 - np.exp(-2.0), rel=1e-12)
    blocks.low_pass(np.full(1, 3.0), 0.0, 0.01, y)
    assert y[0] == 3.0


def test_minimum_jerk_has_the_rates_of_its_path() -> None:
    """By differences; at rest at both ends, held beyond."""

    def at(t: float) -> Array:
        return np.array(blocks.minimum_jerk(1.0, 3.0, 0.5, t))

    h = 1e-5
    for t in (0.05, 0.2, 0.45):
        assert_allclose((at(t + h)[:2] - at(t - h)[:2]) / (2.0 * h), at(t)[1:], rtol=1e-6, atol=1e-6)
    assert_allclose(at(0.0), [1.0, 0.0, 0.0])
    assert_allclose([at(0.5), at(0.7)], [[3.0, 0.0, 0.0]] * 2, atol=1e-12)
