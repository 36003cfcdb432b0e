"""softhand schema: the keys of a scenario for editors."""

from __future__ import annotations

import typer

from softhand.commands.app import app


@app.command(epilog="Example: softhand schema > scenario.schema.json")
def schema() -> None:
    """Print the JSON schema of scenarios, by which editors complete and check keys.

    Put the line `#:schema scenario.schema.json` at the top of a scenario.
    """
    import json

    from softhand.scenario.schema import scenario_schema

    typer.echo(json.dumps(scenario_schema(), indent=2, ensure_ascii=False))
