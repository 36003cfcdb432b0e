"""The energy ledger of a run against time."""

from __future__ import annotations

from matplotlib import rc_context
from matplotlib.figure import Figure

from softhand.analysis.energy import ACCOUNTS, Ledger
from softhand.plots.panels import draw_legend, draw_title, finish, from_top, new_figure, panel
from softhand.plots.style import FINGERS, STYLE

_COLORS = dict(zip(ACCOUNTS, ("black", "0.6", FINGERS[0], FINGERS[4], FINGERS[1], FINGERS[2], FINGERS[3]), strict=True))


def draw_energy(ledger: Ledger, title: str) -> Figure:
    """All accounts since the start of the run, and the residual below."""
    with rc_context(STYLE):
        figure = new_figure(5.6)
        top = draw_title(figure, title)
        grid = figure.add_gridspec(2, 1, left=0.085, right=0.975, top=top, bottom=0.08, hspace=0.25,
                                   height_ratios=(2.4, 1.0))  # fmt: skip
        axes = panel(figure, grid[0], "energy [mJ]", "Energy since the start")
        for name, label in ledger.accounts.items():
            axes.plot(ledger.time, 1e3 * getattr(ledger, name), color=_COLORS[name], label=label)
        draw_legend(figure, list(axes.lines), from_top(figure, 0.34), loc="upper left", handlelength=1.4)
        rest = panel(
            figure, grid[1], "residual [mJ]", f"Residual: {ledger.residual_name.removeprefix('residual, ')}", True
        )
        rest.plot(ledger.time, 1e3 * ledger.residual, color="black")
        finish(figure, float(ledger.time[-1]) or 1.0)
    return figure
