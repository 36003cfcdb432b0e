"""The force along the finger's axis against the contact angle, beside the radial model: the paper's Remark 3."""

from __future__ import annotations

import math

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from softhand.identification.polar import polar_force
from softhand.laws.law import Law
from softhand.numerics.arrays import Array
from softhand.plots.panels import draw_legend, draw_title, from_top, new_figure
from softhand.plots.style import DASHED, DEGREES, FINGERS, STYLE

_TILT = np.radians(np.linspace(0.0, 40.0, 81))
_DPHI = np.radians([0.0, 5.0, 10.0, 15.0, 20.0])
_DEPTHS = {0.001: "0.7", 0.002: "0.5", 0.003: "0.3", 0.004: "0.0"}  # [m] and shade of grey


def axial_force(law: Law, dr: float, dphi: float, tilt: ArrayLike) -> Array:
    """F_x of [Nakashima] Remark 3, the contact force along the axis x_F of the finger.

        F_x = Fr sin(phi - dphi) + Fphi / (r - dr) cos(phi - dphi),   phi = pi/2 - theta_p

    Args:
        law: any law, with nothing deformed but dr and dphi.
        dr: radial compression [m].
        dphi: compressive angle [rad].
        tilt: theta_p, the angle between the axis of the finger and the normal of the plate before dphi [rad].

    Returns:
        F_x [N], in the shape of `tilt`.
    """
    result = [_force(law, dr, dphi, float(angle)) for angle in np.ravel(tilt)]
    return np.array(result).reshape(np.shape(tilt))


def _force(law: Law, dr: float, dphi: float, tilt: float) -> float:
    phi = 0.5 * math.pi - tilt
    Phi = phi - dphi
    Fr, _, Fphi, _ = polar_force(type(law), law.parameters().tolist(), (dr, 0.0, dphi, 0.0, phi))
    return float(Fr * math.sin(Phi) + Fphi / (law.radius - dr) * math.cos(Phi))


def draw_angle_force(law: Law, dr: float = 0.003) -> Figure:
    """F_x against the tilt at several dphi; and the dphi that keeps F_x from falling with the tilt.

    At dphi = 0 a law without moments is left with Fr sin phi: the radial model, whose F_x falls with the tilt.

    Args:
        law: any law.
        dr: radial compression of the left panel [m].
    """
    with rc_context(STYLE):
        figure = new_figure(3.9)
        top = draw_title(figure, "Force along the finger's axis against the tilt (Remark 3)")
        handles = [Line2D([], [], color="black", lw=1.4, ls=DASHED, label="radial model")]
        handles += [
            Line2D([], [], color=color, lw=1.6, label=f"δφ = {DEGREES * dphi:.0f}°")
            for dphi, color in zip(_DPHI[1:], FINGERS, strict=False)
        ]
        draw_legend(figure, handles, from_top(figure, 0.34), loc="upper left")
        left, right = figure.subplots(1, 2, gridspec_kw={"left": 0.075, "right": 0.985, "top": top - 0.03,
                                                         "bottom": 0.135, "wspace": 0.22})  # fmt: skip
        tilt = DEGREES * _TILT
        left.plot(tilt, axial_force(law, dr, 0.0, _TILT), color="black", ls=DASHED, lw=1.4, zorder=3)
        for dphi, color in zip(_DPHI[1:], FINGERS, strict=False):
            left.plot(tilt, axial_force(law, dr, dphi, _TILT), color=color)
        left.set_title(f"(a)  δr = {1e3 * dr:g} mm", loc="left", weight="normal")
        left.set_ylabel("F_x [N]")
        for depth, color in _DEPTHS.items():
            needed = np.array([_needed(law, depth, angle) for angle in _TILT])
            right.plot(tilt, DEGREES * needed, color=color)
            last = np.flatnonzero(np.isfinite(needed))
            if last.size:
                right.annotate(f"{1e3 * depth:g} mm", (tilt[last[-1]], DEGREES * needed[last[-1]]), color=color,
                               xytext=(4, 0), textcoords="offset points", va="center")  # fmt: skip
        right.set_title("(b)  δφ at which F_x is that without tilt, for δr = 1 to 4 mm", loc="left", weight="normal")
        right.set_ylabel("δφ [deg]")
        right.set_ylim(0.0, None)
        for axes in (left, right):
            axes.set_xlabel("tilt θp = 90° - φ [deg]")
            axes.set_xlim(0.0, tilt[-1])
        right.set_xlim(0.0, 1.1 * tilt[-1])
    return figure


def _needed(law: Law, dr: float, tilt: float) -> float:
    """Smallest dphi >= 0 at which F_x at a tilt is F_x at no tilt and no dphi [rad]; NaN if there is none."""
    wanted = _force(law, dr, 0.0, 0.0)
    trials = np.radians(np.linspace(0.0, 40.0, 81))
    excess = np.array([_force(law, dr, dphi, tilt) - wanted for dphi in trials])
    above = np.flatnonzero(excess >= -1e-12 * abs(wanted))
    if not above.size:
        return math.nan
    if above[0] == 0:
        return 0.0
    bracket = trials[above[0] - 1], trials[above[0]]
    return float(brentq(lambda dphi: _force(law, dr, dphi, tilt) - wanted, *bracket))
