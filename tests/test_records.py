"""What the analyses return: frozen records, whose JSON any reader takes, with the unit of each number."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

import softhand
from softhand import load_scenario, simulate
from softhand.closed_loop.start import held_start
from softhand.grasping import workspace as workspace_module
from softhand.margins import stability as stability_module
from softhand.numerics.record import Record, plain
from softhand.scenario.file import resolve_path


@pytest.fixture(scope="module")
def results() -> dict[str, Any]:
    """One of each call."""
    scenario = load_scenario("target-a")
    start = held_start(scenario)
    run = simulate(load_scenario("target-a", {"duration": 0.03, "reference.kind": "step"}))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stability_module, "STIFFNESS", np.array([1e-4, 1.0]))  # the first has no grasp: NaN
        patch.setattr(stability_module, "GAIN", np.array([1.0, 2.0]))
        patch.setattr(workspace_module, "POSES", 64)
        return {
            "stability": softhand.stability(scenario, with_scan=True),
            "stability margins": softhand.stability("pinch", with_margins=True),
            "stability_along": softhand.stability_along(run, 4),
            "linearize": softhand.linearize_plant(start.probe.plant, start.state, np.zeros(9)),
            "workspace": softhand.workspace(scenario),
            "lyapunov": softhand.lyapunov(run),
            "energy_ledger": softhand.energy_ledger(run, samples=range(0, 31, 10)),
            "check scenario": softhand.check(scenario),
            "check recording": softhand.check(run),
            "check urdf": softhand.check(resolve_path("package://softhand/urdf/three_finger_hand.urdf")),
            "grasp_quality": softhand.grasp_quality(scenario),
            "grasp_quality far": softhand.grasp_quality(load_scenario("target-a", {"object.position": [0, 0, 0.3]})),
            "grasp_stiffness": softhand.grasp_stiffness(scenario, joints="controller"),
            "propose_grasps": softhand.propose_grasps(scenario, count=1, points=80),
            "place_object": softhand.place_object(load_scenario("pinch"), span=0.002),
        }


NAMES = ["stability", "stability margins", "stability_along", "linearize", "workspace", "lyapunov", "energy_ledger",
         "check scenario", "check recording", "check urdf", "grasp_quality", "grasp_quality far", "grasp_stiffness",
         "propose_grasps", "place_object"]  # fmt: skip


def forbidden(text: str) -> float:
    raise AssertionError(f"{text} is no JSON")


def tables(value: Any) -> Iterator[dict[str, Any]]:
    """Every record in a JSON value."""
    if isinstance(value, dict):
        yield value
        for key, entry in value.items():
            if key not in value.get("units", {}):
                yield from tables(entry)
    elif isinstance(value, list):
        for entry in value:
            yield from tables(entry)


def has_numbers(value: Any) -> bool:
    """Whether a JSON value is a number or a list of numbers, however deep."""
    if isinstance(value, list):
        return any(map(has_numbers, value))
    return isinstance(value, float) or (isinstance(value, int) and not isinstance(value, bool))


@pytest.mark.parametrize("name", NAMES)
def test_results_are_frozen_records_that_parse(results, name):
    """Strict JSON without NaN, in which every number stands under a name that has a unit."""
    result = results[name]
    assert isinstance(result, Record)
    with pytest.raises(dataclasses.FrozenInstanceError):
        result.note = ""
    read = json.loads(result.to_json(), parse_constant=forbidden)
    counted = [table for table in tables(read) if any(map(has_numbers, table.values()))]
    for table in counted:
        without = [key for key, value in table.items() if has_numbers(value) and key not in table.get("units", {})]
        assert not without
    assert set(read.get("units", {})) <= set(read) and (counted or name.startswith("check"))


@pytest.mark.parametrize("name", [name for name in NAMES if name != "linearize"])
def test_results_have_rows(results, name):
    """What the commands print, as texts."""
    result = results[name]
    rows = [row for _, rows in result.tables("it") for row in rows] if name.startswith("check") else result.rows()
    assert rows and all(isinstance(text, str) for row in rows for text in row)


def test_numbers_go_out_as_they_are(results):
    """To the last digit; what is not known is null; what has no bound says so."""
    quality, read = results["grasp_quality"], json.loads(results["grasp_quality"].to_json())
    assert read["margin"] == quality.margin and read["fingers"][2]["torque"] == quality.fingers[2].torque.tolist()
    assert read["units"]["margin"] == "N/N" and read["fingers"][0]["units"]["depth"] == "m"
    far = json.loads(results["grasp_quality far"].to_json())
    assert far["fingers"][0]["depth"] is None and "out of reach" in far["refusal"]
    stability = json.loads(results["stability"].to_json())
    assert stability["scan"]["growth"][0][0] is None
    assert stability["held_growth"] == results["stability"].held_growth


def test_what_json_cannot_say():
    """Infinity is a text that every language reads back; an object of another kind is our mistake."""

    @dataclass(frozen=True)
    class Odd(Record):
        units: ClassVar = {"numbers": "m", "twice": "m"}
        unreported: ClassVar = frozenset({"secret"})

        numbers: np.ndarray
        secret: object
        flag: np.bool_

        @property
        def twice(self) -> float:
            return 2.0 * float(self.numbers[0])

    odd = Odd(np.array([1.0, math.nan, math.inf, -math.inf]), object(), np.bool_(True))
    assert json.loads(odd.to_json()) == {
        "numbers": [1.0, None, "Infinity", "-Infinity"], "flag": True, "twice": 2.0,
        "units": {"numbers": "m", "twice": "m"},
    }  # fmt: skip
    with pytest.raises(TypeError, match="object"):
        plain([object()])


def test_the_calls_are_public():
    """By the names of the commands."""
    for name in ("stability", "workspace", "lyapunov", "energy_ledger", "check", "grasp_quality", "propose_grasps",
                 "place_object", "linearize"):  # fmt: skip
        assert name in softhand.__all__ and callable(getattr(softhand, name)) and getattr(softhand, name).__doc__
