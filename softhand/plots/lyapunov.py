"""V of Theorem 1 along a run, its rate against what the proof says, and L of (60)."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from softhand.closed_loop.invariant_set import InvariantSeries
from softhand.closed_loop.lyapunov import Lyapunov
from softhand.plots.panels import (
    draw_legend,
    draw_note,
    draw_title,
    finish,
    from_top,
    new_figure,
    panel,
    plain_powers,
    split,
)
from softhand.plots.style import DASHED, FINGERS, STYLE, WARNING

_PARTS = {"V": "black", "kinetic energy": FINGERS[0], "spring K_O": FINGERS[2], "P of the tips": FINGERS[1]}
_TERMS = {
    "f_d": ("desired", FINGERS[0]),
    "φ and δψ in P": ("contact", FINGERS[1]),
    "damped tips": ("damping", FINGERS[4]),
    "reference": ("reference", FINGERS[2]),
    "held torques": ("actuation", FINGERS[3]),
    "unexplained": ("remainder", "black"),
}
_NOTE = (
    "Theorem 1 holds the grasp at rest because V, a kind of energy of the closed loop, can only fall. Good: V falls "
    "over the whole run but where the reference moves; its rate (black) lies on what the proof gives (blue), and what "
    "makes the difference, by its causes, is small; the least singular value of L stays above 0, and the share of the "
    "contact stiffness that K_O takes below the dashed 1, above which L may be singular and the object lost."
)
_DECADES = 6
_UNSEEN = 1e-9  # [mW]


def draw_lyapunov(lyapunov: Lyapunov, series: InvariantSeries, title: str) -> Figure:
    """V and its parts; V' by differences and by (70); what makes the difference; L.

    Args:
        lyapunov: V along the run.
        series: L along the run.
        title: of the figure.
    """
    with rc_context(STYLE):
        figure = new_figure(10.2)
        room = draw_note(figure, _NOTE, 0.34)
        top = draw_title(figure, title, room=room)
        draw_legend(figure, [_rising()], from_top(figure, 0.42 + room), loc="upper left")
        grid = figure.add_gridspec(4, 1, left=0.085, right=0.975, top=top - 0.015, bottom=0.05, hspace=0.4,
                                   height_ratios=(1.25, 1.25, 1.25, 1.0))  # fmt: skip
        energy = panel(figure, grid[0], "V [mJ]", "V and its parts")
        _draw_energy(energy, lyapunov)
        rate = panel(figure, grid[1], "dV/dt [mW]", "Rate of V")
        rate.plot(lyapunov.time, 1e3 * lyapunov.rate, color="black", lw=1.4, label="by differences of V")
        rate.plot(lyapunov.time, 1e3 * lyapunov.dissipation, color=FINGERS[0], label="-q̇ᵀ K_v q̇, as (70) has it")
        terms = panel(figure, grid[2], "power [mW]", "What makes the difference", bottom=True)
        for label, (name, color) in _TERMS.items():
            values = 1e3 * getattr(lyapunov, name)
            if name == "damping" and np.nanmax(np.abs(values), initial=0.0) < _UNSEEN:
                continue
            terms.plot(lyapunov.time, values, color=color, label=label, lw=0.8 if name == "remainder" else 1.2,
                       zorder=1.5 if name == "remainder" else 2.0)  # fmt: skip
        for axes in (energy, rate, terms):
            _shade(axes, lyapunov)
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=6, borderpad=0.0, handlelength=1.6,
                        columnspacing=1.0)  # fmt: skip
        for axes in (rate, terms):
            _limit(axes)
        left, right = split(grid[3], 1, 2, wspace=0.22)
        singular = panel(
            figure, left, "least singular value · 10³", "L of (60), mended (Assumption 5): above 0", bottom=True
        )
        singular.plot(series.time, 1e3 * series.smallest, color=FINGERS[0])
        singular.set_ylim(0.0, 1.2e3 * float(np.max(series.smallest)))
        use = panel(figure, right, "λ_max(K_c⁻¹ K_O)", "Share of the contact stiffness: below 1", bottom=True)
        use.plot(series.time, series.use, color=FINGERS[0])
        use.axhline(1.0, color=WARNING, lw=0.8, ls=DASHED)
        use.set_ylim(0.0, max(1.1, 1.15 * float(np.max(series.use))))
        finish(figure, float(lyapunov.time[-1]))
    return figure


def _rising() -> Any:
    patch: Any = Patch(color=WARNING, alpha=0.14, lw=0, label="where V rises")
    return patch


def _draw_energy(axes: Axes, lyapunov: Lyapunov) -> None:
    values = (lyapunov.value, lyapunov.kinetic, lyapunov.spring, lyapunov.deformation)
    for (label, color), curve in zip(_PARTS.items(), values, strict=True):
        positive = np.where(curve > 0.0, curve, np.nan)
        axes.plot(lyapunov.time, 1e3 * positive, color=color, label=label, lw=1.6 if label == "V" else 1.0)
    top = 1e3 * float(np.nanmax(lyapunov.value, initial=0.0))
    if top > 0.0:
        axes.set_yscale("log")
        plain_powers(axes.yaxis)
        axes.set_ylim(top * 10.0**-_DECADES, 3.0 * top)


def _shade(axes: Axes, lyapunov: Lyapunov) -> None:
    for begin, end, _ in lyapunov.spans():
        axes.axvspan(begin, end, color=WARNING, alpha=0.14, lw=0)


def _limit(axes: Axes) -> None:
    """A logarithmic axis on both sides of zero, where a few large swings would hide the rest."""
    values = np.concatenate([np.abs(np.asarray(line.get_ydata(), dtype=float)) for line in axes.lines[:2]])
    values = values[np.isfinite(values)]
    largest = float(values.max(initial=0.0))
    if largest > 50.0 * float(np.median(values)):
        axes.set_yscale("symlog", linthresh=1e-3 * largest, linscale=0.4)
        powers = 10.0 ** np.arange(np.ceil(np.log10(2e-3 * largest)), np.floor(np.log10(largest)) + 1.0)
        axes.set_yticks([*-powers[::-1], 0.0, *powers])
        plain_powers(axes.yaxis)
