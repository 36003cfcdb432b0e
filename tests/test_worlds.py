"""Worlds side by side: each is the run that `simulate` makes, in any company, and begins again as if it were new."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from softhand import Controller, Push, ScenarioError, load_scenario, simulate
from softhand.assembly.variations import Variations
from softhand.batch.worlds import IDLE, Worlds
from softhand.scenario.scenario import Scenario

FIELDS = ("configuration", "joint_velocity", "contact_force")
WANTED = [0.004, 0.012, 0.139, 0.1, -0.05, 0.08]  # [m, rad]
PUSHED = [{"force": [0.3, -0.2, 0.4], "start": 0.013, "duration": 0.03}]


def scenario(**more: Any) -> Scenario:
    return load_scenario("hold", {"duration": 100.0, "stepper.terms": "compiled", "push": PUSHED, **more})


def stepped(base: Scenario, duration: float) -> Scenario:
    """The same, where the reference jumps to `WANTED` at once."""
    step = {"kind": "step", "object_position": WANTED[:3], "object_rpy": WANTED[3:], "internal_force": [4.0, 4.0, 3.0]}
    return base.with_values({"duration": duration, "reference": step})


def test_a_world_is_the_run_of_its_scenario() -> None:
    """With a reference that is told from outside, a push at its time, and other masses, as near as rounding."""
    base = scenario()
    variations = Variations(base)
    worlds = Worlds(variations.setup, 3, FIELDS, threads=2)
    worlds.become(2, variations.at({"object.mass": 0.23}))
    worlds.wanted[1:, :6] = WANTED
    worlds.turns[:] = 10
    for _ in range(12):
        worlds.go_on()
    assert_array_equal(worlds.faults[:, 0], 0)
    assert_allclose(worlds.time(), 0.12)
    still = base.with_values({"duration": 0.12})
    cases = still, stepped(base, 0.12), stepped(base, 0.12).with_values({"object.mass": 0.23})
    for index, alone in enumerate(map(simulate, cases)):
        found = worlds.seen["configuration"][index]
        assert_allclose(found[9:12], alone.object_position[-1], rtol=0.0, atol=1e-12)
        assert_allclose(found[:9], alone.joint_position[-1], rtol=0.0, atol=1e-11)
        assert_allclose(worlds.seen["contact_force"][index], alone.contact_force[-1], rtol=0.0, atol=1e-9)
    assert np.ptp(worlds.seen["configuration"][:, 11]) > 1e-5
    worlds.close()


def test_a_world_begins_again_as_if_it_were_new() -> None:
    """After a push and a jump of the reference, to the last bit; so does one that has become another, alone."""
    base, other = scenario(), {"object.mass": 0.17, "fingertip.friction": 0.6}
    variations = Variations(base)
    worlds = Worlds(variations.setup, 4, FIELDS)

    def run(index: int) -> Any:
        worlds.wanted[index, :6] = WANTED
        worlds.turns[:] = IDLE
        found = []
        for turns in (0, 10, 5, 10):
            worlds.turns[index] = turns
            worlds.go_on()
            found.append(worlds.seen["configuration"][index].copy())
        return np.array(found)

    first = run(0)
    worlds.restart(0)
    assert_array_equal(run(0), first)
    for index in (1, 2):
        worlds.become(index, variations.at(other))
    worlds.push(1, [Push((0.0, 0.0, 2.0), start=0.0, duration=0.01)])
    pushed = run(1)
    assert np.abs(pushed - first)[1:].max() > 1e-6
    worlds.become(1, variations.at(other))
    assert_array_equal(run(1), run(2))
    assert np.ptp(worlds.seen["configuration"][3]) == 0.0  # it has never been told to go on


def test_a_world_that_ends_disturbs_no_other() -> None:
    """It keeps what was good, and says why it ended."""
    variations = Variations(scenario())
    worlds = Worlds(variations.setup, 2, FIELDS, threads=2)
    worlds.wanted[0, :3] += 0.5
    worlds.turns[:] = 10
    for _ in range(40):
        worlds.go_on()
    assert worlds.faults[0, 0] and not worlds.faults[1, 0]
    error = worlds.error(0)
    assert error.reason in ("apex", "rim", "flat", "diverged") and 0.0 < error.time < 0.4
    assert np.isfinite(worlds.seen["configuration"]).all()
    worlds.restart(0)
    worlds.turns[:] = 0
    worlds.go_on()
    assert not worlds.faults[0, 0]
    worlds.close()


class Plain(Controller):
    """A law without compiled code."""

    def torque(self, observation: Any, memory: Any) -> Any:
        return observation.gravity_torque, memory


@pytest.mark.parametrize(
    ("values", "controller", "told"),
    [({}, Plain(), "controller.name.*Plain"), ({"stepper": {"name": "adaptive"}}, None, "stepper.name.*adaptive")],
    ids=["law", "stepper"],
)
def test_what_is_not_compiled_is_told(values: dict[str, Any], controller: Controller | None, told: str) -> None:
    """By its name."""
    with pytest.raises(ScenarioError, match=told):
        Worlds(Variations(scenario(**values), controller).setup, 1, FIELDS)
