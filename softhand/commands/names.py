"""softhand list: what there is to choose from."""

from __future__ import annotations

from typing import Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import print_table
from softhand.errors import ScenarioError


@app.command("list", epilog="Example: softhand list controllers")
def list_names(
    what: Annotated[
        str | None, typer.Argument(help="scenarios, laws, dampings, controllers, references or steppers; all without.")
    ] = None,
) -> None:
    """List scenarios, fingertip laws, dampings, controllers, references and steppers."""
    from softhand.plugins import SHIPPED, describe_plugin, plugin_names
    from softhand.scenario.file import scenario_names
    from softhand.scenario.scenario import load_scenario

    kinds = ["scenarios", *SHIPPED]
    if what is not None and what not in kinds:
        raise ScenarioError(f"There is no list of {what!r}; choose from {', '.join(kinds)}.", key="list", value=what)
    for kind in [what] if what else kinds:
        if kind == "scenarios":
            rows = [(name, load_scenario(name).description) for name in scenario_names()]
        else:
            rows = [(name, describe_plugin(kind, name)) for name in plugin_names(kind)]
        print_table(kind, rows)
