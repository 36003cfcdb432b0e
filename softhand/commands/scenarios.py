"""The scenario that a command is asked for: by its name, with what the options change."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softhand.errors import ScenarioError

if TYPE_CHECKING:
    from softhand.scenario.scenario import Scenario


def parse_changes(changes: Sequence[str]) -> dict[str, Any]:
    """Dotted keys and values of --set."""
    from softhand.scenario.file import parse_override

    return dict(parse_override(change) for change in changes)


def chosen_scenario(
    source: str,
    changes: Sequence[str] = (),
    law: str | None = None,
    controller: str | None = None,
    stepper: str | None = None,
    more: dict[str, Any] | None = None,
) -> Scenario:
    """A scenario with the values of --set, and then with another law, controller and stepper.

    Args:
        source: a scenario that ships, a file, or the folder of a run.
        changes: texts KEY=VALUE.
        law: name; its parameters are its defaults, radius and friction stay.
        controller: name; its parameters are its defaults.
        stepper: name; its parameters are its defaults, step and terms stay.
        more: further dotted keys and values; None is no change.
    """
    from softhand.scenario.scenario import load_scenario

    values = {**parse_changes(changes), **{key: value for key, value in (more or {}).items() if value is not None}}
    return with_options(load_scenario(scenario_file(source), values), law, controller, stepper)


def scenario_file(source: str) -> str:
    """The scenario in the folder of a run, or what was named."""
    file = Path(source) / "scenario.toml"
    return str(file) if file.is_file() else source


def with_options(
    scenario: Scenario, law: str | None = None, controller: str | None = None, stepper: str | None = None
) -> Scenario:
    """The scenario with another law, controller and stepper, where they are named and others than its own."""
    from softhand.scenario.scenario import with_law

    if law is not None and law != scenario.fingertip.law:
        scenario = with_law(scenario, law)
    if controller is not None and controller != scenario.controller.name:
        scenario = scenario.with_values({"controller": {"name": controller}})
    if stepper is not None and stepper != scenario.stepper.name:
        before = scenario.stepper
        scenario = scenario.with_values({"stepper": {"name": stepper, "step": before.step, "terms": before.terms}})
    return scenario


def refuse_changes(target: str, **options: Any) -> None:
    """Options that change a scenario, where there is none.

    Raises:
        ScenarioError: one is given.
    """
    for name, value in options.items():
        if value:
            raise ScenarioError(f"--{name} changes a scenario; {target} is none.", key=name, value=value)
