"""softhand lyapunov: the function V of Theorem 1 along a run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import Quiet, check_figure, console, print_table, progress, say_compiling

if TYPE_CHECKING:
    from softhand.stability.invariant_set import InvariantSeries
    from softhand.stability.lyapunov import Lyapunov

_LONGEST = 3  # stretches that are named


@app.command(epilog="Example: softhand lyapunov runs/target-a/run.nc")
def lyapunov(
    recording: Annotated[Path, typer.Argument(help="A recording, run.nc, of a run with the controller regulation.")],
    out: Annotated[
        Path | None,
        typer.Option(help="Figure to write, .png, .pdf or .svg; by default lyapunov.png beside the recording."),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Evaluate V of Theorem 1 along a run: its rate against the paper's (70), where it rises, and L of (60)."""
    target = out or recording.parent / "lyapunov.png"
    check_figure(target)
    say_compiling(quiet)
    from softhand.plots.lyapunov import draw_lyapunov
    from softhand.plots.style import save_figure
    from softhand.recording.recorded import scenario_of
    from softhand.recording.recording import Recording
    from softhand.stability.invariant_set import examine_run
    from softhand.stability.lyapunov import evaluate_run

    run = Recording.load(recording)
    with progress("evaluating V", float(len(run)), quiet) as report:
        found = evaluate_run(run, report)
    with progress("evaluating L", float(len(run)), quiet) as report:
        series = examine_run(run, progress=report)
    save_figure(draw_lyapunov(found, series, scenario_of(run).title), target)
    if not quiet:
        _print(recording, found, series)
        console().print(f"wrote {target}", highlight=False)


def _print(recording: Path, found: Lyapunov, series: InvariantSeries) -> None:
    rows = found.rows()
    rows.append(("smallest singular value of L", f"{series.smallest.min():.4g} (SI)"))
    rows.append(("largest share of the contact stiffness", f"{series.use.max():.3g}  (L is singular at 1)"))
    print_table(f"{recording}", rows)
    spans = sorted(found.spans(), key=lambda span: -span[2])
    for begin, end, gain in spans[:_LONGEST]:
        console().print(
            f"[yellow]note:[/] V rises by {1e3 * gain:.3g} mJ from t = {begin:.4g} s to {end:.4g} s, most by "
            f"{found.cause(begin, end)}.",
            highlight=False,
        )
    if len(spans) > _LONGEST:
        console().print(f"      And in {len(spans) - _LONGEST} shorter or smaller stretches.", highlight=False)
    if spans:
        console().print("      By (70) it never rises; see docs/stability.md.", highlight=False)
