"""A calibration: parameters with their intervals, and what is left of all that was measured."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from softhand.calibration.record import Calibration
from softhand.plots.panels import draw_legend, draw_note, draw_title, from_top, new_figure
from softhand.plots.style import FINGERS, STYLE

_NOTE = (
    "Left: each parameter with its interval, over the value that the fit began from, or less it where that is zero or "
    "without sign. Right: residuals over the noise, one dot a sample and component; they are noise where they fill the "
    "band evenly, also where the log was held out."
)
_MOST = 1500  # dots a component
_BAND = 2.0


def draw_calibration(found: Calibration) -> Figure:
    """Parameters on the left, residuals of each quantity over time on the right."""
    quantities = [one.quantity for one in found.residuals]
    rows = max(len(found.estimates), 3 * len(quantities))
    with rc_context(STYLE):
        figure = new_figure(1.6 + max(0.27 * rows, 1.3))
        room = draw_note(figure, _NOTE, 0.34)
        handles = [
            Line2D([], [], color=FINGERS[0], marker="o", ls="-", label=f"{100.0 * found.level:g} % interval"),
            Line2D([], [], color=FINGERS[2], marker=".", ls="", label="fitted"),
            Line2D([], [], color=FINGERS[1], marker=".", ls="", label="held out"),
        ]
        draw_legend(figure, handles, from_top(figure, 0.44 + room), loc="upper left")
        warning = "" if found.is_noise else "Residuals are no white noise: the model is not all that is in the log."
        top = draw_title(figure, f"Calibration from {found.source}", warning, room=room) - 0.02
        bottom = 0.5 / figure.get_figheight()
        _draw_parameters(figure.add_axes((0.27, bottom, 0.22, top - bottom)), found)
        height = (top - bottom) / len(quantities)
        for k, name in enumerate(quantities):
            axes = figure.add_axes((0.58, top - (k + 1) * height + 0.06 * height, 0.40, 0.74 * height))
            _draw_residuals(axes, found, name)
            axes.tick_params(labelbottom=k + 1 == len(quantities))
            if k + 1 == len(quantities):
                axes.set_xlabel("time [s]")
    return figure


def _draw_parameters(axes: Axes, found: Calibration) -> None:
    """Change since the start of each parameter over the largest change, with the interval."""
    names = []
    for k, one in enumerate(found.estimates):
        signed = one.start <= 0.0 or one.low < 0.0
        ends = np.array([one.low, one.value, one.high])
        shown = ends - one.start if signed else 100.0 * (ends / one.start - 1.0)
        scale = 1.0 if not signed else 50.0 / max(float(np.max(np.abs(shown))), 1e-300)
        low, middle, high = scale * shown
        axes.plot([low, high], [k, k], color=FINGERS[0], lw=2.2, solid_capstyle="butt")
        axes.plot([middle], [k], "o", color=FINGERS[0], ms=4.0)
        text = f"{one.value:.4g} {one.unit}".strip()
        names.append(f"{_short(one.name)}\n{text}{' (not to scale)' if signed else ''}")
    axes.axvline(0.0, color="0.3", lw=0.8)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.grid(False, axis="y")
    axes.set_xlabel("change from where the fit began [%]")


def _short(name: str) -> str:
    return name.removeprefix("fingertip.").removeprefix("sensing.")


def _draw_residuals(axes: Axes, found: Calibration, name: str) -> None:
    fitted = found.fitted
    problem = fitted.problem
    wanted = [k for k, (quantity, _) in enumerate(problem.channels) if quantity == name]
    for pieces, runs, color in (
        (fitted.which, fitted.left, FINGERS[2]),
        (fitted.held_out, fitted.left_held, FINGERS[1]),
    ):
        if not pieces:
            continue
        time, values = [], []
        for k, r in zip(pieces, runs, strict=True):
            for c in wanted:
                there = problem.channel[k] == c
                time.append(problem.times(k)[there])
                values.append(r[there] / fitted.solution.sigma[c])
        t, y = np.concatenate(time), np.concatenate(values)
        thin = max(1, len(t) // (_MOST * len(wanted)))
        axes.plot(t[::thin], y[::thin], ".", color=color, ms=1.2, mew=0, rasterized=True)
    axes.axhspan(-_BAND, _BAND, color="0.9", lw=0, zorder=0)
    axes.set_ylim(-5.0, 5.0)
    axes.set_title(name.replace("_", " "), loc="left", size=8.0)
