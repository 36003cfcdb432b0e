"""What can be chosen of an environment."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import ConfigDict, Field, field_validator

from softhand.envs.acting.kinds import KINDS
from softhand.envs.tasks import TASKS, Task
from softhand.errors import ScenarioError
from softhand.scenario.scenario import Scenario, as_scenario
from softhand.settings.guesses import did_you_mean
from softhand.settings.settings import NonNegative, Positive, Settings, read_settings

TAXELS = 40
"""Of each tip, where nothing else is asked for."""


class Options(Settings):
    """The keyword arguments of an environment."""

    model_config = ConfigDict(arbitrary_types_allowed=True)

    action: Literal["set-point", "internal-force", "joint-set-point", "torque", "plain-torque"] = "set-point"
    """Kind of action."""
    reward: Literal["dense", "sparse"] = "dense"
    """`dense` grows on the way to the goal; `sparse` is 1 where the goal is reached, 0 elsewhere."""
    touch: bool = False
    """Whether the observation has deformation, force and slip of each contact."""
    tactile: bool = False
    """Whether the observation has the forces of each taxel; the tips get a skin if the scenario has none."""
    randomise: dict[str, float] = Field(default={"friction": 0.1, "mass": 0.2, "stiffness": 0.1})
    """Largest share by which `mass`, `friction`, `stiffness`, or a dotted key of the scenario, differs in a world."""
    episodes_per_world: int = 1
    """Episodes in one world before another is drawn."""
    action_period: Positive = 0.01
    """How long an action is held [s], a whole number of control periods."""
    squeeze_cost: NonNegative = 0.0
    """Taken off the reward of each step for each newton of internal force, mean over the pairs of contacts [1/N]."""
    scenario: Any = None
    """Name, path or `Scenario` in place of that of the task: another hand, object, law."""
    overrides: dict[str, Any] = Field(default={})
    """Values of the scenario that differ, by dotted key."""

    @field_validator("episodes_per_world")
    @classmethod
    def _is_some(cls, value: int) -> int:
        if value < 1:
            raise ValueError(f"got {value}; give a whole number, at least 1.")
        return value


def read_options(task: str, given: Mapping[str, Any]) -> Options:
    """Options as a user gives them.

    Raises:
        ScenarioError: one is unknown or wrong, or does not go with the task.
    """
    if task not in TASKS:
        raise ScenarioError(
            f"task: there is none called {task!r}{did_you_mean(str(task), TASKS)}; there are: {', '.join(TASKS)}.",
            key="task", value=task,
        )  # fmt: skip
    options = read_settings(Options, given, "")
    if TASKS[task].begins_open and options.action == "internal-force":
        raise ScenarioError(
            f'action: got "internal-force", but in {task} the fingers begin off the object, where there is no internal '
            f"force; choose {', '.join(name for name in KINDS if name != 'internal-force')}.",
            key="action", value=options.action,
        )  # fmt: skip
    return options


def scenario_of(task: Task, options: Options) -> Scenario:
    """The world about which worlds are drawn, at rest at its start as long as nothing else is asked for.

    Raises:
        ScenarioError: there is no such scenario or key, or the times do not fit.
    """
    is_own = options.scenario is not None
    source = options.scenario if is_own else task.scenario
    if not isinstance(source, str | Path | Scenario):
        raise ScenarioError(
            f"scenario: got {source!r}; give a name, a path or a softhand.Scenario.", key="scenario", value=source
        )
    pushes = [{"force": [0.0, 0.0, 0.0], "start": 0.0, "duration": 0.1}] * task.pushes
    shared = {"duration": 3600.0, "reference": {"kind": "hold"}, "push": pushes, "stepper.terms": "compiled"}
    scenario = as_scenario(source, {**({} if is_own else task.overrides), **shared, **options.overrides})
    if options.tactile and scenario.tactile is None:
        scenario = scenario.replace({"tactile.count": TAXELS})
    periods = round(options.action_period / scenario.control_period)
    if periods < 1 or abs(periods * scenario.control_period - options.action_period) > 1e-9:
        raise ScenarioError(
            f"action_period: got {options.action_period:g} s; it must be a whole number of control periods of "
            f"{scenario.control_period:g} s.",
            key="action_period", value=options.action_period,
        )  # fmt: skip
    if bool(scenario.grasp.opening) != task.begins_open:
        how = "with the fingers off the object" if task.begins_open else "in the grasp"
        raise ScenarioError(
            f"scenario: this task begins {how}; give grasp.opening {'above 0' if task.begins_open else '= 0'}.",
            key="grasp.opening", value=scenario.grasp.opening,
        )  # fmt: skip
    return scenario
