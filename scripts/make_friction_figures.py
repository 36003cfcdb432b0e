"""Make the figures of docs/friction.md anew, and print its numbers.

Example: python scripts/make_friction_figures.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

import softhand
from softhand.analysis.energy import energy_ledger
from softhand.plots.energy import draw_energy
from softhand.plots.panels import draw_title, finish, new_figure, panel
from softhand.plots.style import DASHED, FINGERS, STYLE
from softhand.validation.pressures import columns, lever, limit_curve
from softhand.validation.rigs import RADIUS

IMAGES = Path(__file__).parent.parent / "docs" / "images"
TARGETS = {"target-a": "finger_2_tip", "target-b": "finger_1_tip"}


def run(target: str, contact: str, friction: float) -> softhand.Recording:
    """One target with a contact and a coefficient."""
    return softhand.simulate(
        softhand.load_scenario(target, {"fingertip.contact": contact, "fingertip.friction": friction})
    )


def difference(one: softhand.Recording, other: softhand.Recording) -> tuple[np.ndarray, np.ndarray]:
    """Distance [mm] and largest of roll, pitch, yaw [deg] between two runs, against time."""
    way = np.linalg.norm(one.object_position - other.object_position, axis=1)
    turn = np.max(np.abs(one.object_rpy - other.object_rpy), axis=1)
    return 1e3 * way, np.degrees(turn)


def draw() -> Figure:
    """Use of the limit at the tip that slips, its travel, and what that costs the pose; prints the table."""
    with rc_context(STYLE):
        figure = new_figure(6.4)
        top = draw_title(figure, "Coulomb friction at mu 0.5, the minimum-jerk targets")
        grid = figure.add_gridspec(3, 2, left=0.085, right=0.975, top=top, bottom=0.07, hspace=0.3, wspace=0.25)
        print("| target | mu | tip | slip [mm] | twist [deg] | lost [mJ] | moved [mm, deg] | final error [mm, deg] |")
        print("|---|---|---|---|---|---|---|---|")
        for column, (target, tip) in enumerate(TARGETS.items()):
            name = target.replace("-", " ").capitalize().replace(" a", " A").replace(" b", " B")
            i = int(tip[7]) - 1
            rolling, slipping = run(target, "rolling", 0.5), run(target, "coulomb", 0.5)
            for friction, one, other in (
                (0.5, slipping, rolling),
                (0.6, run(target, "coulomb", 0.6), run(target, "rolling", 0.6)),
            ):
                way, turn = difference(one, other)
                end = softhand.summarize(one)
                print(
                    f"| {name} | {friction} | {tip} | {1e3 * one.slip_travel[-1, i]:.3g} | "
                    f"{np.degrees(one.slip_twist[-1, i]):.3g} | {1e3 * one.slip_loss[-1, i]:.3g} | "
                    f"{way.max():.2g}, {turn.max():.2g} | {end.position_error:.3g}, {end.orientation_error:.3g} |"
                )
            end = softhand.summarize(rolling)
            print(f"| {name} | 0.5, rolling | | 0 | 0 | 0 | | {end.position_error:.3g}, {end.orientation_error:.3g} |")
            use = panel(figure, grid[0, column], "limit-surface use [-]", f"{name}, {tip.replace('_', ' ')}")
            use.plot(rolling.time, rolling.limit_surface_use[:, i], color="0.5", label="rolling")
            use.plot(slipping.time, slipping.limit_surface_use[:, i], color=FINGERS[1], label="coulomb")
            use.axhline(1.0, color="black", lw=0.8, ls=DASHED)
            use.legend()
            slip = panel(figure, grid[1, column], "slip [mm], [deg]")
            slip.plot(slipping.time, 1e3 * slipping.slip_travel[:, i], color=FINGERS[0], label="travel [mm]")
            slip.plot(slipping.time, np.degrees(slipping.slip_twist[:, i]), color=FINGERS[2], label="twist [deg]")
            slip.legend()
            way, turn = difference(slipping, rolling)
            cost = panel(figure, grid[2, column], "object moved [mm], [deg]", bottom=True)
            cost.plot(slipping.time, way, color=FINGERS[0], label="position [mm]")
            cost.plot(slipping.time, turn, color=FINGERS[2], label="orientation [deg]")
            cost.legend()
        finish(figure, 2.0)
    return figure


def draw_limit() -> Figure:
    """The ellipse and the exact limit of the pressure of columns; prints how far apart they are."""
    with rc_context(STYLE):
        figure = new_figure(4.6)
        top = draw_title(figure, "Limit of tangential force and torsion")
        grid = figure.add_gridspec(1, 1, left=0.3, right=0.7, top=top, bottom=0.12)
        axes = panel(figure, grid[0], "torsion / largest torsion [-]", bottom=True)
        angle = np.linspace(0.0, 0.5 * np.pi, 200)
        axes.plot(np.cos(angle), np.sin(angle), color="black", lw=0.8, ls=DASHED, label="ellipse")
        for color, depth in zip(FINGERS, (1e-4, 1e-3, 3e-3), strict=False):
            pressure = columns(depth, RADIUS)
            curve = limit_curve(pressure, np.tan(0.5 * np.pi * np.linspace(0.0, 0.9999, 60))) / (1.0, lever(pressure))
            print(f"dr = {1e3 * depth:g} mm: {100.0 * np.max(1.0 - np.hypot(*curve.T)):.3g} % inside the ellipse")
            axes.plot(*curve.T, color=color, label=f"exact, dr = {1e3 * depth:g} mm")
        axes.set(xlim=(0.0, 1.05), ylim=(0.0, 1.05), aspect="equal", xlabel="tangential force / (mu f_z) [-]")
        axes.legend(loc="lower left")
    return figure


def main() -> None:
    """All figures."""
    softhand.save_figure(draw_limit(), IMAGES / "limit.png")
    softhand.save_figure(draw(), IMAGES / "friction.png")
    recording = run("target-a", "coulomb", 0.5)
    ledger = energy_ledger(recording, samples=np.arange(0, len(recording), 10))
    softhand.save_figure(draw_energy(ledger, "Target A with Coulomb friction, mu 0.5"), IMAGES / "energy.png")
    for label, value in ledger.rows():
        print(f"{label:<36}{value}")


if __name__ == "__main__":
    main()
