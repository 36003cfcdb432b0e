"""softhand remark3: the force along the finger's axis against the contact angle."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import Set, check_figure, say


@app.command(epilog="Example: softhand remark3 target-a --out angle.pdf")
def remark3(
    scenario: Annotated[
        str, typer.Argument(help="A scenario whose fingertip is drawn: one that ships or a .toml file.")
    ] = "target-a",
    changes: Set = [],  # noqa: B006  typer copies it
    out: Annotated[Path, typer.Option(help="Figure to write, .png, .pdf or .svg.")] = Path("remark3.png"),
) -> None:
    """Draw the force along the finger's axis against the tilt, beside the radial model (Remark 3 of the paper)."""
    check_figure(out)
    from softhand.assembly.parts import read_law
    from softhand.plots.angle_force import draw_angle_force
    from softhand.plots.style import save_figure
    from softhand.scenario.file import parse_override
    from softhand.scenario.scenario import load_scenario

    chosen = load_scenario(scenario, dict(parse_override(change) for change in changes))
    save_figure(draw_angle_force(read_law(chosen)), out)
    say(f"wrote {out}")
