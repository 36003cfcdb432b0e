"""softhand list: what there is to choose from."""

from __future__ import annotations

from typing import Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer
from softhand.commands.options import Json, Plugins
from softhand.errors import ScenarioError


def _kinds() -> list[str]:
    from softhand.plugins import SHIPPED

    return ["scenarios", *SHIPPED]


@command("softhand list controllers", "list")
def list_names(
    what: Annotated[
        str | None,
        typer.Argument(
            metavar="KIND",
            autocompletion=_kinds,
            help="scenarios, laws, dampings, controllers, references or steppers; all without.",
        ),
    ] = None,
    plugins: Plugins = [],  # noqa: B006  typer copies it
    as_json: Json = False,
) -> None:
    """List scenarios, laws, dampings, controllers, references, steppers."""
    from softhand.plugins import describe_plugin, plugin_names
    from softhand.scenario.file import scenario_names
    from softhand.scenario.scenario import load_scenario

    kinds = _kinds()
    if what is not None and what not in kinds:
        raise ScenarioError(f"There is no list of {what!r}; choose from {', '.join(kinds)}.", key="list", value=what)
    found = {
        kind: {name: load_scenario(name).description for name in scenario_names()}
        if kind == "scenarios"
        else {name: describe_plugin(kind, name) for name in plugin_names(kind)}
        for kind in ([what] if what else kinds)
    }
    printer = Printer(as_json=as_json)
    printer.json(found)
    for kind, texts in found.items():
        printer.table(kind, list(texts.items()))
