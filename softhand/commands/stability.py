"""softhand stability: how fast small motions grow about a start or the end of a run, and where K_O loses the object."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import Plugins, Set, check_figure, print_table, progress, say, say_compiling
from softhand.errors import ScenarioError


@app.command(epilog="Example: softhand stability target-a --set controller.K_O_orientation=0.2 --out scan.pdf")
def stability(
    scenario: Annotated[
        str, typer.Argument(help="A scenario that ships (see: softhand list), a .toml file, or a run.nc.")
    ] = "target-a",
    changes: Set = [],  # noqa: B006  typer copies it
    out: Annotated[
        Path, typer.Option(help="Figure to write, .png, .pdf or .svg: the scan of K_O, of the controller regulation.")
    ] = Path("stability.png"),
    plugins: Plugins = [],  # noqa: B006
) -> None:
    """Say how fast small motions grow about the start, or where a run came to rest.

    With regulation the gain K_O is scanned against the stiffness of the tips, about the start of a scenario.
    """
    is_run = Path(scenario).suffix.lower() == ".nc"
    if is_run and changes:
        raise ScenarioError(f"--set changes a scenario; {scenario} is none.", key="set", value=changes)
    check_figure(out)
    say_compiling(False)
    from softhand.closed_loop.stability import stability as find_stability
    from softhand.plots.stability import draw_scan
    from softhand.plots.style import save_figure
    from softhand.recording.recording import Recording
    from softhand.scenario.file import parse_override
    from softhand.scenario.scenario import load_scenario

    if is_run:
        print_table(scenario, find_stability(Recording.load(Path(scenario))).rows())
        return
    chosen = load_scenario(scenario, dict(parse_override(change) for change in changes))
    with progress("scanning", 1.0, False) as report:
        found = find_stability(chosen, progress=report)
    if found.scan is not None:
        title = f"Where regulation is lost, about the start of {Path(scenario).stem}"
        save_figure(draw_scan(found.scan, title, found.period), out)
    print_table(scenario, found.rows())
    if found.scan is not None:
        say(f"wrote {out}")
