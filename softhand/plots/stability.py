"""Where regulation is lost: the gain K_O against the stiffness of the tips."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from softhand.closed_loop.scan import Scan
from softhand.plots.panels import draw_legend, draw_note, draw_title, from_top, new_figure, plain_powers
from softhand.plots.style import DASHED, STYLE

_NOTE = (
    "Rate of the fastest growing small motion about the grasp at rest, over the gain K_O and the stiffness of the "
    "tips, both as factors on those of the scenario. Good: the cross lies in the white, where all motions die out, "
    "and well below the dashed line, where K_O takes up the whole contact stiffness in one direction. In colour a "
    "motion grows by a factor e in 1/rate: slow to be seen at 0.1 1/s, the object is lost at once at 100 1/s."
)
_SLOWEST, _FASTEST = 0.1, 300.0  # [1/s] ends of the colours


def draw_scan(scan: Scan, title: str, period: float) -> Figure:
    """Rate of the fastest growing motion about the grasp at rest: without sampling, and with held torques.

    White is where all motions die out. The dashed line is where L of (60) becomes singular: K_O takes up the whole of
    the contact stiffness in one direction.

    Args:
        scan: from `analysis.loop.scan`.
        title: of the figure.
        period: control period of the right panel [s].
    """
    with rc_context(STYLE):
        figure = new_figure(5.2)
        room = draw_note(figure, _NOTE, 0.34)
        handles: list[Any] = [
            Line2D([], [], color="black", lw=1.4, ls=DASHED, label="L of (60) singular: λ_max(K_c⁻¹ K_O) = 1"),
            Line2D([], [], color="black", marker="+", ms=8, mew=1.6, ls="", label="the scenario"),
            Patch(facecolor="white", edgecolor="0.5", lw=0.6, label="stable"),
        ]
        draw_legend(figure, handles, from_top(figure, 0.42 + room), loc="upper left")
        top = draw_title(figure, title, room=room) - 0.035
        left, right, bar = figure.subplots(1, 3, width_ratios=(1.0, 1.0, 0.035), gridspec_kw={
            "left": 0.075, "right": 0.935, "top": top, "bottom": 0.115, "wspace": 0.12})  # fmt: skip
        mesh = _draw(left, scan, scan.growth)
        _draw(right, scan, scan.held_growth)
        left.set_title("(a)  without sampling: the theory", loc="left", weight="normal")
        right.set_title(f"(b)  torque held for {1e3 * period:g} ms: what runs", loc="left", weight="normal")
        left.set_ylabel("factor on K_O")
        right.tick_params(labelleft=False)
        figure.colorbar(mesh, cax=bar, extend="both", label="growth rate [1/s]")
        plain_powers(bar.yaxis)
    return figure


def _draw(axes: Axes, scan: Scan, growth: NDArray[np.float64]) -> Any:
    """Growth rates of one panel; returns the mesh."""
    shown = np.ma.masked_less_equal(np.nan_to_num(growth, nan=-1.0), 0.0)
    mesh = axes.pcolormesh(scan.stiffness, scan.gain, shown, norm=LogNorm(_SLOWEST, _FASTEST), cmap="YlOrRd",
                           shading="nearest", rasterized=True)  # fmt: skip
    axes.plot(scan.stiffness, 1.0 / scan.use, color="black", ls=DASHED, lw=1.4)
    axes.plot(1.0, 1.0, "+", color="black", ms=10, mew=1.8)
    axes.set_xscale("log")
    axes.set_yscale("log")
    plain_powers(axes.xaxis)
    plain_powers(axes.yaxis)
    axes.set_xlim(scan.stiffness[0], scan.stiffness[-1])
    axes.set_ylim(scan.gain[0], scan.gain[-1])
    axes.set_xlabel("factor on the coefficients of the tips")
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(True)
        spine.set_color("0.3")
    return mesh
