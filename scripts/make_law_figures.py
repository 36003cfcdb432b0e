"""Refresh the figures and the table of docs/laws.md: fingertip laws and dampings with their defaults, their energy.

Example: python scripts/make_law_figures.py
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import softhand
from softhand.assembly.parts import read_law
from softhand.plots.style import STYLE, save_figure
from softhand.plugins import find_plugin, plugin_names
from softhand.scenario.scenario import with_law

Array = NDArray[np.float64]

ROOT = Path(__file__).parent.parent
IMAGES, PAGE = ROOT / "docs/images", ROOT / "docs/laws.md"
sys.path.insert(0, str(ROOT / "tests"))

from energy import ring, task_with  # noqa: E402
from hands import STEPPERS  # noqa: E402

COLOURS = (
    "#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#A50026", "#7A7A7A", "#8C6D31",
    "#4B3F99", "#66A61E",
)  # fmt: skip
DEPTH = 0.0023  # [m], of a grasp of the reference hand
STEP = 1e-6  # [m]
TIME_STEPS = (1e-3, 5e-4, 2.5e-4, 1.25e-4)  # [s]
RINGS = (
    ("conservative", 0.0, "rk4", 1),
    ("conservative", 0.0, "midpoint", 0),
    ("conservative", 0.0, "semi-implicit-euler", 1),
    ("conservative", 5.1, "rk4", 1),
    ("nakashima", 0.0, "rk4", 1),
    ("nakashima", 0.0, "midpoint", 0),
)
"""Law, its growth, stepper, and the first of `TIME_STEPS` that it bears."""


def laws() -> dict[str, softhand.Law]:
    """Every law that ships, the paper's with the reference tip's parameters, the others with their defaults."""
    scenario = softhand.load_scenario("target-a")
    names = [name for name in plugin_names("laws") if name != "nakashima"]
    return {"nakashima": read_law(scenario), **{name: read_law(with_law(scenario, name)) for name in names}}


def contact_force(law: softhand.Law, dr: float, s: tuple[float, float], Phi: float) -> Array:
    """f_x, f_y, f_z [N] at displacements [m] along growing Theta and Phi, for either kind of coordinates."""
    if law.coordinates == "surface":
        f_n, f_1, f_2, _ = law([dr, *s, 0.0], Phi)
        return np.array([f_1, f_2, f_n])
    R, lever = law.radius - dr, (law.radius - dr) * np.cos(Phi)
    dtheta = s[0] / lever
    Fr, Ftheta, Fphi, Fpsi = law([dr, dtheta, s[1] / R, -np.sin(Phi) * dtheta], Phi)
    return np.array([(Ftheta - np.sin(Phi) * Fpsi) / lever, Fphi / R, Fr])


def stiffness(law: softhand.Law, dr: float, Phi: float) -> Array:
    """d f_x / d s_x, d f_y / d s_y, d f_z / d dr [N/m] without shear."""
    ends = [
        contact_force(law, dr + n * STEP, (x * STEP, y * STEP), Phi)[k]
        - contact_force(law, dr - n * STEP, (-x * STEP, -y * STEP), Phi)[k]
        for k, (x, y, n) in enumerate(np.eye(3))
    ]
    return np.array(ends) / (2.0 * STEP)


def draw_laws() -> Figure:
    """Force against compression, stiffness ratio against compression, tangential stiffness against Phi."""
    depths, angles = np.linspace(5e-5, 0.004, 80), np.radians(np.linspace(30.0, 89.9, 200))
    with rc_context(STYLE):
        figure = Figure(figsize=(9.0, 3.4), layout="constrained")
        force, ratio, pole = figure.subplots(1, 3)
        for (name, law), colour in zip(laws().items(), COLOURS, strict=True):
            style = {"color": colour, "lw": 1.5, "ls": "-" if law.coordinates == "surface" else "--"}
            force.plot(1e3 * depths, [law([d, 0.0, 0.0, 0.0], np.pi / 2)[0] for d in depths], label=name, **style)
            ratios = [stiffness(law, d, np.radians(60.0)) for d in depths]
            ratio.plot(1e3 * depths, [k[1] / k[2] for k in ratios], **style)
            along = np.array([stiffness(law, DEPTH, Phi)[:2] for Phi in angles]) / 1e3
            pole.plot(np.degrees(angles), along[:, 0], **style)
        _label(force, "dr [mm]", "normal force at Phi = 90 deg [N]")
        _label(ratio, "dr [mm]", "k_y / k_n at Phi = 60 deg [1]")
        _label(pole, "Phi [deg]", "k_x at dr = 2.3 mm [N/mm]")
        force.set(ylim=(0.0, 22.0))
        ratio.set(ylim=(0.0, 2.5))
        pole.set(yscale="log")
        pole.yaxis.set_major_formatter("{x:g}")
        figure.legend(*force.get_legend_handles_labels(), loc="outside upper center", ncols=5, fontsize=7.5)
    return figure


def draw_dampings() -> Figure:
    """Normal force over one and a half slow and fast cycles of compression, each damping with its defaults."""
    law = laws()["conservative"]
    with rc_context(STYLE):
        figure = Figure(figsize=(9.0, 2.8), layout="constrained")
        for axes, frequency in zip(figure.subplots(1, 3, sharey=True), (0.5, 5.0, 50.0), strict=True):
            time = np.linspace(0.0, 1.5 / frequency, 3000)
            depth = 0.002 + 0.0005 * np.sin(2.0 * np.pi * frequency * time)
            elastic = np.array([law([d, 0.0, 0.0, 0.0], np.pi / 2)[0] for d in depth])
            axes.plot(1e3 * depth, elastic, color="0.6", lw=1.0, label="none")
            for name, colour in zip(plugin_names("dampings"), COLOURS[1:], strict=False):
                axes.plot(1e3 * depth, _damped(name, time, depth, elastic), color=colour, label=name)
            _label(axes, "dr [mm]", "normal force [N]" if frequency < 1.0 else "")
            axes.set_title(f"{frequency:g} Hz")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


def _damped(name: str, time: Array, depth: Array, elastic: Array) -> Array:
    damping = find_plugin("dampings", name, "name")()
    step, force = time[1] - time[0], elastic.copy()
    for share, rate in damping.relaxation():
        w, followed = elastic[0], []
        for F in elastic:
            w += -np.expm1(-rate * step) * (F - w)
            followed.append(w)
        force -= share * np.array(followed)
    speed = np.gradient(depth, time)
    return np.maximum(force + (damping.viscosity()[0] + damping.viscosity_per_force()[0] * elastic) * speed, 0.0)


def _label(axes: Axes, x: str, y: str) -> None:
    axes.set(xlabel=x, ylabel=y)


def energy_table() -> str:
    """Drift of a grasp that rings for 2 s over the exchanged energy, as a table in Markdown."""
    lines = [["Law", "Stepper", *(f"{1e3 * step:g} ms" for step in TIME_STEPS)], ["---"] * (2 + len(TIME_STEPS))]
    for name, growth, stepper, first in RINGS:
        law = laws()[name]
        task = task_with(law.model_copy(update={"growth": growth}) if growth else law)
        drifts = [ring(task, STEPPERS[stepper](step=step), 2.0).drift for step in TIME_STEPS[first:]]
        named = f"`{name}`" + (f", growth {growth:g}" if growth else "")
        lines.append([named, f"`{stepper}`", *[""] * first, *(f"{drift:.1e}" for drift in drifts)])
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def main() -> None:
    """Draw both figures, write the table."""
    IMAGES.mkdir(parents=True, exist_ok=True)
    save_figure(draw_laws(), IMAGES / "laws.png")
    save_figure(draw_dampings(), IMAGES / "dampings.png")
    mark, table = r"(<!-- table energy -->\n).*?(<!-- end -->)", energy_table()
    text = re.sub(mark, lambda found: f"{found[1]}{table}\n{found[2]}", PAGE.read_text(), flags=re.DOTALL)
    PAGE.write_text(text)


if __name__ == "__main__":
    main()
