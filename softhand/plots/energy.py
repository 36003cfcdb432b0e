"""The energy ledger of a run against time."""

from __future__ import annotations

from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

from softhand.analysis.energy import Ledger
from softhand.plots.panels import draw_note, draw_title, finish, from_top, new_figure, panel
from softhand.plots.style import FINGERS, STYLE

_LOOKS: dict[str, tuple[str, float, Any]] = {
    "work": ("black", 3.4, "-"),
    "pushed": ("0.6", 3.0, "-"),
    "kinetic": (FINGERS[0], 2.6, "-"),
    "gravity": (FINGERS[4], 2.0, "-"),
    "elastic": (FINGERS[1], 1.4, "-"),
    "damping": (FINGERS[2], 2.0, (0, (4, 3))),
    "slip": (FINGERS[3], 1.4, (0, (1, 2))),
    "joint_damping": (FINGERS[2], 1.2, (0, (7, 2, 1, 2))),
    "joint_friction": (FINGERS[3], 1.2, (0, (7, 2, 1, 2))),
    "stops": (FINGERS[1], 1.2, (0, (7, 2, 1, 2))),
    "stop_damping": (FINGERS[0], 1.2, (0, (7, 2, 1, 2))),
}
"""Colour, width and dashes of each account, in the order in which they are drawn: of equal ones all are seen, as a
narrower or broken line leaves those below it in sight."""
_COLUMNS = 4  # of the legend
_NOTE = (
    "Work that went in (black, and pushes) and what became of it. In a good run the black curve is the sum of the "
    "others at all times, so that the residual stays far below them; what is damped and lost to slip never falls."
)


def draw_energy(ledger: Ledger, title: str) -> Figure:
    """All accounts since the start of the run, and the residual below."""
    accounts = [(name, ledger.accounts[name]) for name in _LOOKS if name in ledger.accounts]
    with rc_context(STYLE):
        figure = new_figure(6.1)
        rows = -(-len(accounts) // _COLUMNS)
        room = draw_note(figure, _NOTE, 0.34) + 0.17 * rows
        top = draw_title(figure, title, room=room - 0.14)
        grid = figure.add_gridspec(2, 1, left=0.085, right=0.975, top=top, bottom=0.075, hspace=0.25,
                                   height_ratios=(2.4, 1.0))  # fmt: skip
        axes = panel(figure, grid[0], "energy [mJ]", "Energy since the start")
        for name, label in accounts:
            color, width, style = _LOOKS[name]
            axes.plot(ledger.time, 1e3 * getattr(ledger, name), color=color, lw=width, ls=style, label=label)
        figure.legend(
            handles=list(axes.lines), loc="upper left", ncols=_COLUMNS, handlelength=3.0, columnspacing=1.4,
            borderpad=0.2, borderaxespad=0.0, bbox_to_anchor=(0.012, from_top(figure, 0.40 + room - 0.17 * rows)),
        )  # fmt: skip
        rest = panel(
            figure, grid[1], "residual [mJ]", f"Residual: {ledger.residual_name.removeprefix('residual, ')}", True
        )
        rest.plot(ledger.time, 1e3 * ledger.residual, color="black")
        finish(figure, float(ledger.time[-1]) or 1.0)
    return figure
