"""Laws and controllers side by side: every law with every controller on one scenario, in a table and a figure.

    rows = softhand.compare("target-a", controllers=["regulation", "blind(K_p=400)"])
    for row in rows:
        print(row.controller, row.performance.position_error if row.performance else row.outcome)

A name may have settings behind it in brackets, as in a scenario: `regulation(torsion_compensation=false, K_v=0.01)`.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from softhand.analysis.energy import energy_ledger
from softhand.analysis.performance import Performance, errors, measure
from softhand.assembly.build import build
from softhand.assembly.parts import read_controller, read_laws
from softhand.errors import ScenarioError, SimulationStopped, SofthandError
from softhand.plots.line_up import Lined, draw_line_up
from softhand.plugins import find_plugin
from softhand.recording.recording import Recording
from softhand.scenario.file import parse_override
from softhand.scenario.scenario import Scenario, as_scenario, with_law
from softhand.studies.workers import WorkerLost, in_workers

LINE_OF_WORK = (
    "regulation",
    "regulation(torsion_compensation=false)",
    "finger-only",
    "object-impedance",
    "computed-torque",
    "point-contact",
)
"""Controllers that are compared where nothing is named, before those for that number of fingers."""

FOR_TWO, FOR_MORE = ("opposing", "angle-feedback", "two-phase"), ("blind",)

LAWS = ("nakashima", "conservative", "radial", "parallel-distributed", "planar")
"""Laws for tips as soft as the paper's; under the scenario's controller where nothing is named."""

COLUMNS = (
    "settled\n[s]", "over\n[%]", "place\n[mm]", "turn\n[deg]", "force\n[N]", "slip\n[-]", "effort\n[N m]", "lost\n[mJ]",
)  # fmt: skip
"""Headings of `Row.cells`."""

CAPTION = (
    "Settled: within 5 % of the way, or 0.2 mm and 0.5 deg. Over: overshoot. Place, turn, force: errors of position, "
    "orientation and internal force, root mean square over the last 0.1 s. Slip: largest friction use; above 1 a real "
    "tip would have slipped. Effort: root mean square of all joint torques. Lost: energy that the tips took for good."
)
"""What the numbers of `Row.cells` mean; docs/controllers.md has the definitions."""


@dataclass(frozen=True, eq=False)
class Row:
    """One run.

    Attributes:
        law: fingertip law, with the settings that were given.
        controller: controller, likewise.
        recording: the run, incomplete if it stopped; None if it could not begin.
        performance: its figures; None for a run that stopped.
        energy_lost: energy that the tips took for good [J]; NaN for a run that stopped.
        outcome: "" for a complete run, else when and why it ended.
    """

    law: str
    controller: str
    recording: Recording | None
    performance: Performance | None
    energy_lost: float
    outcome: str

    def numbers(self) -> tuple[float, ...]:
        """The figures under `COLUMNS`, energy in mJ; NaN for a run that stopped."""
        shown = self.performance
        if shown is None:
            return (math.nan,) * len(COLUMNS)
        return (
            shown.settling_time, shown.overshoot, shown.position_error, shown.orientation_error, shown.force_error,
            shown.friction_use, shown.effort, 1e3 * self.energy_lost,
        )  # fmt: skip

    def cells(self) -> tuple[str, ...]:
        """The figures as text; "-" where there is none."""
        return tuple(map(_as_text, self.numbers()))


def headings(rows: Sequence[Row]) -> tuple[str, ...]:
    """`COLUMNS` for the hand of some rows: the effort of joints that slide is a force."""
    units = next((row.recording.units("joint_torque") for row in rows if row.recording is not None), ("N m",))
    unit = ", ".join(sorted(set(units), reverse=True))
    return tuple(name.replace("[N m]", f"[{unit}]") for name in COLUMNS)


def _as_text(value: float) -> str:
    if math.isnan(value) or math.isinf(value):
        return "-" if math.isnan(value) else "never"
    return f"{value:.3g}" if abs(value) >= 1e-3 else "<0.001"


def compare(
    scenario: Scenario | str | Path = "target-a",
    laws: Sequence[str] | None = None,
    controllers: Sequence[str] | None = None,
    progress: Callable[[float], None] | None = None,
    jobs: int = 1,
) -> list[Row]:
    """Run every law with every controller; where nothing is named, the line of work that the paper stands in.

    Args:
        scenario: the task, by name, path or as `load_scenario` gives it. Its own law and controller keep their
            settings; another law is that of all tips and takes those of the same name along, another controller has
            its defaults.
        laws: names; that of the scenario if None.
        controllers: names; that of the scenario if None. Without laws too, `LINE_OF_WORK` under the scenario's law and
            then the other `LAWS` under its controller.
        progress: called now and then with the number of runs done.
        jobs: processes to run in; a script then needs `if __name__ == "__main__":` around the call.

    Returns:
        One row a run, law by law.

    Raises:
        ScenarioError: a name or a setting is wrong. A run that cannot begin, or stops, makes a row that says so.
        SimulationStopped: interrupted by Ctrl-C, or a process was ended by others; carries `.rows` with the runs done
            so far.
    """
    task = as_scenario(scenario)
    cases = [(law, controller, _chosen(task, law, controller)) for law, controller in pairs(task, laws, controllers)]
    tell = progress or (lambda done: None)
    rows: list[Row] = []
    try:
        for row in _run_all(cases, tell, jobs):
            rows.append(row)
            tell(float(len(rows)))
    except (SimulationStopped, KeyboardInterrupt) as interrupt:
        message = f"interrupted after {len(rows)} of {len(cases)} runs."
        raise SimulationStopped(message, rows=rows, reason="interrupted") from interrupt
    except WorkerLost as lost:
        message = f"{lost} There are {len(rows)} of {len(cases)} runs."
        raise SimulationStopped(message, rows=rows, reason="lost") from lost
    return rows


def pairs(
    task: Scenario, laws: Sequence[str] | None = None, controllers: Sequence[str] | None = None
) -> list[tuple[str, str]]:
    """Law and controller of each run of `compare`."""
    law, controller = task.fingertip.law, task.controller.name
    if laws or controllers:
        return list(product(laws or [law], controllers or [controller]))
    work = LINE_OF_WORK + (FOR_TWO if len(task.hand.tips) == 2 else FOR_MORE)
    first = [(law, name) for name in dict.fromkeys([controller, *work])]
    given = {"radius", *task.fingertip.parameters}
    able = [other for other in LAWS if not _needed(other) - given]
    return first + [(other, controller) for other in able if other != law]


def _needed(law: str) -> set[str]:
    """Parameters of a law that have no default."""
    fields = find_plugin("laws", law, "fingertip.law").model_fields
    return {name for name, field in fields.items() if field.is_required()}


def draw(rows: Sequence[Row], title: str) -> Figure:
    """Errors and friction use of all runs against time."""
    return draw_line_up([_lined(row, label) for row, label in zip(rows, labels(rows), strict=True)], title)


def labels(rows: Sequence[Row]) -> list[str]:
    """What each row is called: law and controller, less what it shares with all others or with the first."""
    first, others = rows[0], rows[1:]
    same_law, same_controller = ([getattr(row, part) == getattr(first, part) for row in others]
                                 for part in ("law", "controller"))  # fmt: skip
    if all(same_law):
        return [row.controller for row in rows]
    if all(same_controller):
        return [row.law for row in rows]
    star = all(a or b for a, b in zip(same_law, same_controller, strict=True))
    return [
        f"{row.law}, {row.controller}" if row is first or not star
        else row.controller if row.law == first.law else row.law
        for row in rows
    ]  # fmt: skip


def to_csv(rows: Sequence[Row]) -> str:
    """The table with all digits, one row a run."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["law", "controller", *(name.replace("\n", " ") for name in headings(rows)), "outcome"])
    for row in rows:
        writer.writerow([row.law, row.controller, *row.numbers(), row.outcome])
    return text.getvalue()


def split_choices(text: str) -> list[str]:
    """Names at the commas that are not in brackets: "a,b(k=1, l=[2, 3])" has two.

    Raises:
        ScenarioError: brackets that do not match, or nothing between two commas.
    """
    depth, found = 0, [""]
    for letter in text:
        depth += (letter in "([{") - (letter in ")]}")
        if letter == "," and not depth:
            found.append("")
        else:
            found[-1] += letter
        if depth < 0:
            break
    if depth or not all(map(str.strip, found)):
        raise ScenarioError(
            f"{text!r} is no list of names; write it as NAME,NAME(key=value, key=value).", key="choice", value=text
        )
    return [choice.strip() for choice in found]


def _parse(choice: str) -> tuple[str, dict[str, Any]]:
    """Name and settings of `NAME` or `NAME(key=value, ...)`."""
    name, bracket, rest = choice.partition("(")
    if bracket and not rest.endswith(")"):
        raise ScenarioError(f"{choice!r} must have the form NAME(key=value, ...).", key="choice", value=choice)
    settings = split_choices(rest[:-1]) if bracket else ()
    return name.strip(), dict(parse_override(setting, f"{setting.strip()}=2.5") for setting in settings)


def _chosen(task: Scenario, law: str, controller: str) -> Scenario:
    """The scenario with this law and this controller, checked."""
    name, settings = _parse(law)
    tip = task.fingertip
    if name != tip.law:
        fields = find_plugin("laws", name, "fingertip.law").model_fields
        kept = {key: value for key, value in tip.parameters.items() if key in fields}
        task = with_law(task, name, {**kept, **settings})
    else:
        task = task.with_values({f"fingertip.{key}": value for key, value in settings.items()})
    name, settings = _parse(controller)
    kept = task.controller.parameters if name == task.controller.name else {}
    chosen = task.with_values({"controller": {"name": name, **kept, **settings}})
    read_laws(chosen)
    read_controller(chosen)
    return chosen


def _run_all(cases: list[tuple[str, str, Scenario]], tell: Callable[[float], None], jobs: int) -> Iterator[Row]:
    if jobs > 1:
        yield from in_workers(jobs, _run, cases)
        return
    for done, (law, controller, scenario) in enumerate(cases):
        yield _run(law, controller, scenario, _part(tell, done, scenario.duration))


def _part(tell: Callable[[float], None], done: int, duration: float) -> Callable[[float], None]:
    """Progress of one run, as a fraction of it, on top of the runs already done."""
    return lambda time: tell(done + time / duration)


def _run(law: str, controller: str, scenario: Scenario, tell: Callable[[float], None] | None = None) -> Row:
    try:
        simulation = build(scenario)
        recording = simulation.run(tell)
    except SofthandError as error:
        if getattr(error, "reason", "") == "interrupted":
            raise
        time = getattr(error, "time", None)
        when = "cannot begin" if time is None else f"stopped at {time:g} s"
        return Row(law, controller, getattr(error, "recording", None), None, math.nan, f"{when}: {error}")
    lost = energy_ledger(recording, simulation.plant).lost
    return Row(law, controller, recording, measure(recording), lost, "")


def _lined(row: Row, label: str) -> Lined:
    recording = row.recording
    if recording is None or not len(recording):
        none = np.zeros(0)
        return Lined(f"{label} (cannot begin)", none, none, none, none, none, True)
    off = errors(recording)
    stop = "" if recording.complete else f" (stopped at {recording.stop_time:g} s)"
    use = np.max(recording.friction_use, axis=1)
    return Lined(f"{label}{stop}", recording.time, off.position, off.orientation, off.force, use, recording.complete)
