"""Any number of runs of one task in the same axes: how far each is from what is desired."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from softhand.numerics.arrays import Array
from softhand.plots.panels import draw_title, finish, from_top, new_figure, panel, split
from softhand.plots.quantities import FRICTION_TOP
from softhand.plots.style import DASH_DOTTED, DASHED, FINGERS, SOLID, STYLE, finger_color

_STYLES = (SOLID, DASHED, DASH_DOTTED, (0, (1, 1)))
_SMALLEST = (1e-3, 1e-3, 1e-3)  # [mm, deg, N]: what is less is drawn there
_COLUMNS = 3  # of the legend


class Lined(NamedTuple):
    """One run: its name, and against time [s] its errors [mm], [deg], [N] and its friction use, shape (samples,)."""

    label: str
    time: Array
    position: Array
    orientation: Array
    force: Array
    friction_use: Array
    complete: bool


def draw_line_up(runs: Sequence[Lined], title: str) -> Figure:
    """Errors of position, orientation and internal force on logarithmic scales, and the friction use.

    A cross marks where an incomplete run stopped.

    Args:
        runs: each in its colour and dashes; one without samples is in the legend alone.
        title: heading of the figure.
    """
    rows = -(-len(runs) // _COLUMNS)
    with rc_context(STYLE):
        figure = new_figure(5.2 + 0.17 * rows)
        draw_title(figure, title)
        top = from_top(figure, 0.5 + 0.17 * rows)
        handles = []
        place = figure.add_gridspec(1, 1, left=0.075, right=0.98, top=top, bottom=0.08)[0]
        labels = ("position error [mm]", "orientation error [deg]", "internal-force error [N]", "friction use [-]")
        spots = split(place, 2, 2, wspace=0.2, hspace=0.14)
        panels = [
            panel(figure, spot, label, bottom=k > 1) for k, (label, spot) in enumerate(zip(labels, spots, strict=True))
        ]
        for k, run in enumerate(runs):
            color, style = finger_color(k), _STYLES[k // len(FINGERS) % len(_STYLES)]
            width = 1.0 + 2.4 * 0.6**k  # so that a curve below an equal one is seen
            handles.append(Line2D([], [], color=color, ls=style, lw=width, label=run.label))
            curves = [np.maximum(values, least) for values, least in zip(run[2:5], _SMALLEST, strict=True)]
            for axes, values in zip(panels, [*curves, run.friction_use], strict=True):
                axes.plot(run.time, values, color=color, ls=style, lw=width)
                if not run.complete:
                    axes.plot(run.time[-1:], values[-1:], "x", color=color, ms=6, mew=2, clip_on=False)
        for axes in panels[:3]:
            axes.set_yscale("log")
        panels[3].axhline(1.0, color="black", lw=0.8, ls=DASHED)
        panels[3].set_ylim(0.0, min(max(1.2, panels[3].get_ylim()[1]), FRICTION_TOP))
        figure.legend(
            handles=handles, loc="upper left", bbox_to_anchor=(0.012, from_top(figure, 0.36)), ncols=_COLUMNS,
            handlelength=2.8, columnspacing=1.4, borderpad=0.2, borderaxespad=0.0,
        )  # fmt: skip
        finish(figure, max((float(run.time[-1]) for run in runs if len(run.time)), default=1.0))
    return figure
