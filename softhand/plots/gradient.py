"""What each parameter does to the cost of a run, as bars."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from softhand.derivatives.gradient_record import Gradient
from softhand.plots.panels import draw_note, draw_title, new_figure
from softhand.plots.style import FINGERS, STYLE

_NOTE = (
    "What one percent more of each parameter does to the cost, with the others as they are. Bars to the left make the "
    "run cheaper with more of it, those to the right with less."
)
_MOST = 30  # bars


def draw_gradient(found: Gradient, title: str) -> Figure:
    """One bar a parameter, the strongest on top.

    Args:
        found: with at least one parameter.
        title: of the figure.
    """
    one_percent = 0.01 * found.values * found.slopes
    shown = np.argsort(-np.abs(one_percent), kind="stable")[:_MOST]
    share = 100.0 * one_percent[shown] / (abs(found.value) or 1.0)
    with rc_context(STYLE):
        figure = new_figure(1.5 + 0.24 * max(len(shown), 3))
        room = draw_note(figure, _NOTE, 0.34)
        bottom = 0.5 / figure.get_figheight()
        top = draw_title(figure, title, room=room - 0.3) - 0.01
        axes = figure.add_axes((0.3, bottom, 0.67, top - bottom))
        axes.barh(np.arange(len(shown)), share, height=0.66, color=[FINGERS[int(one > 0.0)] for one in share])
        axes.axvline(0.0, color="0.3", lw=0.8)
        axes.set_yticks(np.arange(len(shown)), [found.parameters[k] for k in shown])
        axes.grid(False, axis="y")
        axes.invert_yaxis()
        axes.set_xlabel(f"change of the cost, {found.value:.4g}, by one percent more [%]")
        widest = float(np.max(np.abs(share), initial=0.0)) or 1.0
        axes.set_xlim(-1.1 * widest, 1.1 * widest)
    return figure
