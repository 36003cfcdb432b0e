"""softhand stability: where the gain K_O loses the object."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import Set, check_figure, console, print_table, progress, say_compiling

_ROUNDING = 1e-6  # [1/s] of a growth that is zero


@app.command(epilog="Example: softhand stability target-a --set controller.K_O_orientation=0.2 --out scan.pdf")
def stability(
    scenario: Annotated[
        str, typer.Argument(help="A scenario with the controller regulation: one that ships or a .toml file.")
    ] = "target-a",
    changes: Set = [],  # noqa: B006  typer copies it
    out: Annotated[Path, typer.Option(help="Figure to write, .png, .pdf or .svg.")] = Path("stability.png"),
) -> None:
    """Scan the gain K_O against the stiffness of the tips, about the grasp at rest."""
    check_figure(out)
    say_compiling(False)
    import numpy as np

    from softhand.plots.stability import draw_scan
    from softhand.plots.style import save_figure
    from softhand.scenario.file import parse_override
    from softhand.scenario.scenario import load_scenario
    from softhand.stability.loop import linearise
    from softhand.stability.scan import scan, scenario_gains

    chosen = load_scenario(scenario, dict(parse_override(change) for change in changes))
    K_O = scenario_gains(chosen)
    loop = linearise(chosen)
    stiffness, gain = np.geomspace(0.3, 30.0, 41), np.geomspace(0.1, 100.0, 61)
    with progress("scanning", float(len(stiffness)), False) as report:
        found = scan(chosen, stiffness.tolist(), gain.tolist(), report)
    save_figure(
        draw_scan(found, f"Where regulation is lost, about the start of {Path(scenario).stem}", chosen.control_period),
        out,
    )
    held = float(loop.held_growth([K_O], chosen.control_period)[0])
    rows = [
        ("share of the contact stiffness that K_O takes", f"{loop.use:.3g}"),
        ("L of (60) singular at K_O times", f"{1.0 / loop.use:.3g}"),
        ("growth without sampling", _growth(loop.growth(K_O))),
        (f"growth with torques held for {1e3 * chosen.control_period:g} ms", _growth(held)),
    ]
    print_table(scenario, rows)
    console().print(f"wrote {out}", highlight=False)


def _growth(rate: float) -> str:
    if abs(rate) < _ROUNDING:
        return "none  (some motion stays as it is)"
    return f"{rate:+.3g} 1/s" + ("  (all motions die out)" if rate < 0.0 else "  (unstable)")
