"""softhand schema: the keys of a scenario for editors."""

from __future__ import annotations

from softhand.commands.app import command
from softhand.commands.console import Printer


@command("softhand schema > scenario.schema.json")
def schema() -> None:
    """Print the JSON schema of scenarios, for editors.

    They complete and check keys by it. Put the line `#:schema scenario.schema.json` at the top of a scenario.
    """
    from softhand.scenario.schema import scenario_schema

    Printer(as_json=True).json(scenario_schema())
