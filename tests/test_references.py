"""References as plugins: those that ship by their formulas, one's own in plain Python, and what is told of mistakes."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from math import cos, pi, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import softhand
from softhand.assembly.parts import read_motion, read_reference
from softhand.errors import ScenarioError, SimulationStopped
from softhand.references.goal import Goal
from softhand.references.reference import Reference, resting
from softhand.references.straight import MinimumJerk, Step
from softhand.settings.settings import Positive
from softhand.settings.toml import tomllib

START = Goal((0.0, 0.01, 0.142, 0.1, -0.2, 0.3), (1.0, 2.0, 3.0))
TARGET: dict[str, Any] = {
    "object_position": (0.02, 0.03, 0.12),
    "object_rpy": (0.3, 0.2, -0.1),
    "internal_force": (5.0, 1.0, 4.0),
}
GOAL = Goal((*TARGET["object_position"], *TARGET["object_rpy"]), TARGET["internal_force"])


def test_the_step_asks_for_the_target_at_once() -> None:
    """At all times, without a rate; fingers that start open are asked to touch."""
    motion = Step(**TARGET).start(Goal(START.coordinates, START.internal_force, opening=0.01, carried=0.0))
    for time in (0.0, 0.3, 5.0):
        desired = motion.update(time)
        np.testing.assert_allclose(desired.coordinates, GOAL.coordinates, rtol=0, atol=1e-16)
        np.testing.assert_allclose(desired.internal_force, GOAL.internal_force, rtol=0, atol=1e-15)
        assert not desired.coordinates_rate.any() and not desired.coordinates_acceleration.any()
        assert (desired.opening[0], desired.carried[0]) == (0.0, 1.0)


@pytest.mark.parametrize("time", [0.0, 0.31, 0.5, 0.77, 0.8, 2.0])
def test_the_minimum_jerk_follows_its_polynomial(time: float) -> None:
    """s = 10 x^3 - 15 x^4 + 6 x^5 and its derivatives by numpy's polynomials; the target from the duration on."""
    s = np.polynomial.Polynomial([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
    desired = MinimumJerk(**TARGET, duration=0.8, orientation_path="euler").start(START).update(time)
    change = np.subtract(GOAL.row(), START.row())
    x = min(time / 0.8, 1.0)
    np.testing.assert_allclose(desired.coordinates, (START.row() + s(x) * change)[:6], atol=1e-14)
    np.testing.assert_allclose(desired.internal_force, (START.row() + s(x) * change)[6:9], atol=1e-14)
    np.testing.assert_allclose(desired.coordinates_rate, s.deriv()(x) * change[:6] / 0.8, atol=1e-13)
    np.testing.assert_allclose(desired.coordinates_acceleration, s.deriv(2)(x) * change[:6] / 0.8**2, atol=1e-12)


def test_what_rests_asks_for_the_same() -> None:
    """`resting` gives the goal at all times."""
    goal = Goal(START.coordinates, START.internal_force, opening=0.02, carried=0.3, standoff=(0.1, 0.2, 0.3))
    desired = resting(goal).update(3.0)
    row = np.concatenate(
        [desired.coordinates, desired.internal_force, desired.opening, desired.carried, desired.standoff]
    )
    np.testing.assert_array_equal(row, goal.row())


class Circle(Reference):
    """Round a circle in the plane x, y, turning and squeezing on the way."""

    radius: Positive = 0.005
    period: Positive = 0.5
    tells_rates: bool = False

    def at(self, time: float, start: Goal) -> Goal:
        """A circle about the start."""
        w = 2.0 * pi / self.period
        c, s = cos(w * time), sin(w * time)
        across = self.radius * np.array([c - 1.0, s, 0.0, 0.0, 0.0, 10.0 * s])
        rate = self.radius * w * np.array([-s, c, 0.0, 0.0, 0.0, 10.0 * c])
        acceleration = -self.radius * w**2 * np.array([c, s, 0.0, 0.0, 0.0, 10.0 * s])
        told = {"rate": rate, "acceleration": acceleration} if self.tells_rates else {}
        force = np.add(start.internal_force, 1.0 - c)
        standoff = (0.1 * s, 0.0, 0.2 * c)
        return Goal(
            start.coordinates + across, force, opening=1e-3 * s, carried=0.5 + 0.5 * c, standoff=standoff, **told
        )


@pytest.mark.parametrize("time", [0.0, 0.04, 0.31])
def test_rates_of_ones_own_reference_come_from_differences(time: float) -> None:
    """They agree with those that it tells itself, and so do the values."""
    told, differences = (Circle(tells_rates=tells).start(START).update(time) for tells in (True, False))
    np.testing.assert_allclose(told.coordinates, Circle().at(time, START).coordinates)
    np.testing.assert_allclose(told.internal_force, Circle().at(time, START).internal_force)
    np.testing.assert_allclose(told.opening, 1e-3 * sin(4.0 * pi * time), atol=1e-18)
    w, s, c = 4.0 * pi, sin(4.0 * pi * time), cos(4.0 * pi * time)
    for one in (told, differences):
        np.testing.assert_allclose(one.standoff, (0.1 * s, 0.0, 0.2 * c), atol=1e-15)
        np.testing.assert_allclose(one.standoff_rate, (0.1 * w * c, 0.0, -0.2 * w * s), atol=1e-5)
        np.testing.assert_allclose(one.standoff_acceleration, (-0.1 * w * w * s, 0.0, -0.2 * w * w * c), atol=1e-3)
    np.testing.assert_array_equal(differences.coordinates, told.coordinates)
    np.testing.assert_allclose(differences.coordinates_rate, told.coordinates_rate, atol=1e-6)
    np.testing.assert_allclose(differences.coordinates_acceleration, told.coordinates_acceleration, atol=2e-5)
    assert np.abs(told.coordinates_rate).max() > 0.05 and np.abs(told.coordinates_acceleration).max() > 0.7


def late(wrong: Any, since: float = 0.01) -> type[Reference]:
    """A reference that asks for the start, and for something wrong from a time on."""

    class Late(Reference):
        def at(self, time: float, start: Goal) -> Any:
            return start if time < since else wrong(start)

    return Late


def fail(start: Goal) -> Goal:
    raise KeyError("lost")


MISTAKES: list[tuple[Callable[[Goal], Any], str]] = [
    (lambda start: Goal(start.coordinates[:5], start.internal_force), "5 coordinates and 3 internal forces are asked"),
    (lambda start: Goal((*start.coordinates[:5],), (1.0,) * 4), "5 coordinates and 4 internal forces are asked"),
    (lambda start: Goal(start.coordinates, (1.0, float("nan"), 2.0)), "NaN or infinity"),
    (lambda start: Goal(start.coordinates, start.internal_force, rate=(float("inf"),) * 6), "NaN or infinity"),
    (lambda start: start.coordinates, "a Goal is needed"),
    (fail, "raised KeyError: 'lost'"),
]


@pytest.mark.parametrize(("wrong", "words"), MISTAKES)
def test_a_mistake_is_told_at_the_start(wrong: Callable[[Goal], Any], words: str) -> None:
    """Before anything is run, with the name of the reference."""
    with pytest.raises(ScenarioError, match=words) as caught:
        late(wrong, -1.0)().start(START)
    assert "'Late'" in str(caught.value) and caught.value.key == "reference.kind"  # type: ignore[attr-defined]


@pytest.mark.parametrize(("wrong", "words"), MISTAKES)
def test_a_later_mistake_ends_the_run(wrong: Callable[[Goal], Any], words: str) -> None:
    """With its time."""
    motion = late(wrong)().start(START)
    motion.update(0.005)
    with pytest.raises(SimulationStopped, match=words) as caught:
        motion.update(0.02)
    assert caught.value.reason == "reference" and caught.value.time == 0.02  # type: ignore[attr-defined]


def test_a_reference_without_a_formula_is_told() -> None:
    """The name of the method that is missing."""
    with pytest.raises(ScenarioError, match="needs a method `at`"):
        Reference().start(START)


def test_an_unknown_kind_gives_the_nearest() -> None:
    """As for laws and controllers."""
    with pytest.raises(ScenarioError, match=r'Did you mean "minimum-jerk".*There are: hold, step, min') as caught:
        read_reference(softhand.load_scenario("target-a", {"reference.kind": "minimumjerk"}))
    assert caught.value.key == "reference.kind"  # type: ignore[attr-defined]


def test_the_duration_of_another_kind_may_stay() -> None:
    """A change of the kind leaves `duration` behind, in recordings of before as well; it has its default elsewhere."""
    ways = [{"duration": 0.1, "object_position": [0.0, 0.01, 0.145]}]
    values = {"reference": {"kind": "waypoints", "duration": 3.0, "waypoints": ways}}
    motion = read_motion(softhand.load_scenario("target-a", values))
    np.testing.assert_allclose(motion.update(0.1).coordinates[:3], [0.0, 0.01, 0.145])
    assert read_reference(softhand.load_scenario("target-a", {"reference.duration": None})).duration == 1.0


PLUGIN = '''"""A reference of one's own."""

from math import sin

import numpy as np

from softhand import Goal, Reference
from softhand.settings.settings import Positive


class SideStep(Reference):
    """To one side and back."""

    width: Positive = 0.002
    """How far [m]."""
    fails_at: Positive = 9.0

    def at(self, time, start):
        """Half a sine."""
        if time > self.fails_at:
            raise RuntimeError("over there")
        pose = np.array(start.coordinates)
        pose[0] += self.width * sin(20.0 * max(time, 0.0)) ** 2
        return Goal(pose, start.internal_force)
'''


def _run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    program = str(Path(sys.executable).with_name("softhand"))
    run = [program, "simulate", "target-a", "--plugin", "mine.py", "--no-plot", "-q", "--duration", "0.03"]
    return subprocess.run(
        [*run, *arguments], cwd=folder, capture_output=True, text=True, timeout=300, check=False
    )  # fmt: skip


def test_a_file_adds_a_reference(tmp_path: Path) -> None:
    """By the name of its class; its fields are keys of [reference], and the scenario that is kept has them all."""
    (tmp_path / "mine.py").write_text(PLUGIN)
    chosen = ("--out", "out", "--set", 'reference={kind="side-step"}')
    result = _run(tmp_path, *chosen)
    assert result.returncode == 0, result.stderr
    kept = tomllib.loads((tmp_path / "out/scenario.toml").read_text())["reference"]
    assert (kept["kind"], kept["width"]) == ("side-step", 0.002)
    recording = softhand.Recording.load(tmp_path / "out/run.nc")
    np.testing.assert_allclose(recording.object_position_desired[:, 0], 0.002 * np.sin(20.0 * recording.time) ** 2)
    for setting, words in (
        ("reference.widht=0.1", "reference.widht: unknown key (with value 0.1). Did you mean reference.width?"),
        ("reference.object_rpy=[0,0,0]", "reference.object_rpy: unknown key"),
        ("reference.width=-1", "reference.width: got -1, but it must be a number > 0"),
    ):
        result = _run(tmp_path, *chosen, "--set", setting)
        assert result.returncode == 1 and words in " ".join(result.stderr.split()), result.stderr


def test_a_run_that_its_reference_ends_is_kept(tmp_path: Path) -> None:
    """All samples before the mistake."""
    (tmp_path / "mine.py").write_text(PLUGIN)
    result = _run(tmp_path, "--out", "out", "--set", 'reference={kind="side-step", fails_at=0.0105}')
    words = f"raised RuntimeError: over there ({tmp_path}/mine.py, line 21) (at t = 0.011 s)"
    stderr = " ".join(result.stderr.split())
    assert "reference 'SideStep'" in stderr and words in stderr and "Traceback" not in stderr
    assert result.returncode != 0
    recording = softhand.Recording.load(tmp_path / "out/run.nc")
    assert len(recording) == 11 and not recording.complete
