"""A fitted law against its measurements, in the layout of the paper's Figs. 9-12, with residuals."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from softhand.identification.fit import Fit
from softhand.identification.sweeps import DR, PHI, Sweep, find_sweeps
from softhand.plots.panels import draw_legend, draw_title, from_top, new_figure, split
from softhand.plots.style import DASHED, DEGREES, FINGERS, STYLE, WARNING

_NAMES = ("Radial force", "Shearing moment", "Compressive moment", "Torsion moment")
_LABELS = ("Fr [N]", "Fθ [N mm]", "Fφ [N mm]", "Fψ [N mm]")
_SCALE = np.array([1.0, 1e3, 1e3, 1e3])
_DEFORMATION = ("δr", "δθ", "δφ", "δψ", "φ")
_ORDER = (0, 2, 1, 3)  # of the paper's Figs. 9 to 12
_POINTS, _LAW = FINGERS[0], FINGERS[1]
_BLOCK = 2.5  # [in] height of one component
_BAND = 2.0  # standard deviations in the band of the residuals


def draw_fit(fit: Fit, name: str) -> Figure:
    """One row of panels for each measured component, one panel for each series.

    Circles are the means of repeats, bars reach from the lowest to the highest of them, lines are the fitted law. Below
    each panel are the residuals of the single measurements, and the band of twice their standard deviation.

    Args:
        fit: from `fit_law`.
        name: of the law, for the title.
    """
    measured = [c for c in _ORDER if np.isfinite(fit.measurements.force[:, c]).any()]
    with rc_context(STYLE):
        figure = new_figure(0.95 + _BLOCK * len(measured))
        handles = [
            Line2D([], [], color=_POINTS, marker="o", mfc="none", ls="", label="mean, lowest and highest of repeats"),
            Line2D([], [], color=_LAW, lw=1.6, label=f"law {name}, fitted"),
        ]
        draw_legend(figure, handles, from_top(figure, 0.34), loc="upper left")
        lost = [e.name for e in fit.estimates if not np.isfinite(e.value)]
        top = draw_title(figure, "Identification", f"Not told by the data: {', '.join(lost)}" if lost else "")
        bottom = 0.42 / float(figure.get_figheight())
        grid = figure.add_gridspec(len(measured), 1, left=0.075, right=0.985, bottom=bottom,
                                   top=top - 0.2 / float(figure.get_figheight()), hspace=0.5)  # fmt: skip
        for row, component in enumerate(measured):
            _draw_component(figure, grid[row], fit, component)
    return figure


def _draw_component(figure: Figure, place: SubplotSpec, fit: Fit, component: int) -> None:
    sweeps = find_sweeps(fit.measurements, component)
    label = _LABELS[component]
    box = place.get_position(figure)
    figure.text(box.x0, box.y1 + 0.27 / float(figure.get_figheight()), _NAMES[component], weight="bold", size=9.0)
    if not sweeps:
        _draw_parity(figure, place, fit, component, label)
        return
    first: tuple[Axes, Axes] | None = None
    for k, (sweep, spot) in enumerate(zip(sweeps, split(place, 1, len(sweeps), wspace=0.12), strict=True)):
        above, below = split(spot, 2, 1, height_ratios=(2.6, 1.0), hspace=0.1)
        upper = figure.add_subplot(above, sharey=first[0] if first else None)
        lower = figure.add_subplot(below, sharex=upper, sharey=first[1] if first else None)
        first = first or (upper, lower)
        _draw_sweep(upper, lower, fit, sweep)
        upper.set_title(f"({'abcd'[k]})  {_held(sweep)}", loc="left", weight="normal", size=8.5)
        upper.tick_params(labelbottom=False, labelleft=k == 0)
        lower.tick_params(labelleft=k == 0)
        lower.set_xlabel(f"{_DEFORMATION[sweep.varied]} [{'mm' if sweep.varied == DR else 'deg'}]", labelpad=1.0)
    assert first is not None
    first[0].set_ylabel(label)
    first[1].set_ylabel("residual")
    figure.align_ylabels(list(first))


def _draw_sweep(upper: Axes, lower: Axes, fit: Fit, sweep: Sweep) -> None:
    c, scale = sweep.component, _SCALE[sweep.component]
    unit = 1e3 if sweep.varied == DR else DEGREES
    x = unit * fit.measurements.imposed[sweep.rows, sweep.varied]
    force, residual = scale * fit.measurements.force[sweep.rows, c], scale * fit.residual[sweep.rows, c]
    places = np.unique(np.round(x, 6))
    groups = [force[np.isclose(x, place)] for place in places]
    mean = np.array([group.mean() for group in groups])
    reach = np.maximum(0.0, [mean - [group.min() for group in groups], [group.max() for group in groups] - mean])
    lowest, highest = min(0.0, places.min()), places.max()
    line = np.linspace(lowest, highest + 0.06 * (highest - lowest), 100)
    settings = np.tile(sweep.held, (len(line), 1))
    settings[:, sweep.varied] = line / unit
    upper.plot(line, scale * fit.force(settings)[:, c], color=_LAW, lw=1.4)
    upper.errorbar(places, mean, reach, fmt="o", color=_POINTS, mfc="white", ms=4.5, lw=1.0, capsize=2.5, zorder=3)
    band = _BAND * scale * fit.noise[c]
    lower.axhspan(-band, band, color="0.92", lw=0)
    lower.axhline(0.0, color=_LAW, lw=1.0)
    lower.plot(x, residual, "o", color=_POINTS, ms=2.2, alpha=0.7, mew=0)
    upper.set_xlim(line[0], line[-1])
    for axes, ticks in ((upper, 5), (lower, 3)):
        axes.yaxis.set_major_locator(MaxNLocator(ticks, steps=[1, 2, 2.5, 5, 10]))
        axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 4, 5, 10]))
    limit = max(1.6 * band, 1.15 * float(np.max(np.abs(residual))), *(abs(end) for end in lower.get_ylim()))
    lower.set_ylim(-limit, limit)


def _held(sweep: Sweep) -> str:
    """What does not change along a series and is not zero."""
    text = [f"φ = {DEGREES * sweep.held[PHI]:g}°"]
    for k, value in enumerate(sweep.held[:PHI]):
        if k != sweep.varied and value != 0.0:
            text.append(
                f"{_DEFORMATION[k]} = {1e3 * value:g} mm" if k == DR else f"{_DEFORMATION[k]} = {DEGREES * value:g}°"
            )
    return ", ".join(text)


def _draw_parity(figure: Figure, place: SubplotSpec, fit: Fit, component: int, label: str) -> None:
    """Measured against fitted, for measurements that vary everything at once."""
    left, right = split(place, 1, 2, wspace=0.2)
    force, scale = fit.measurements.force[:, component], _SCALE[component]
    there = np.isfinite(force)
    fitted = scale * fit.predicted[there, component]
    ends = np.array([min(fitted.min(), scale * force[there].min()), max(fitted.max(), scale * force[there].max())])
    axes = figure.add_subplot(left)
    axes.plot(ends, ends, color=_LAW, lw=1.0)
    axes.plot(fitted, scale * force[there], "o", color=_POINTS, ms=3, mfc="none")
    axes.set_ylabel(f"{label}, measured")
    axes.set_xlabel("fitted")
    axes = figure.add_subplot(right)
    axes.axhline(0.0, color=_LAW, lw=1.0)
    axes.axhline(_BAND * scale * fit.noise[component], color=WARNING, lw=0.8, ls=DASHED)
    axes.axhline(-_BAND * scale * fit.noise[component], color=WARNING, lw=0.8, ls=DASHED)
    axes.plot(fitted, scale * fit.residual[there, component], "o", color=_POINTS, ms=3, mfc="none")
    axes.set_ylabel("residual")
    axes.set_xlabel("fitted")
