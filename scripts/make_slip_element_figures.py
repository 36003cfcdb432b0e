"""Make the figure of slip elements of docs/patch.md anew, and print its table.

Example: python scripts/make_slip_element_figures.py
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import softhand
from softhand.laws.hertz import Hertz
from softhand.numerics.arrays import Array
from softhand.patch.mindlin import CattaneoMindlin
from softhand.plots.style import DASHED, FINGERS, STYLE, save_figure
from softhand.validation.rigs import MU, RADIUS, Rig, block

IMAGES = Path(__file__).parent.parent / "docs" / "images"
DEPTH = 8e-4


def pressed(elements: int) -> tuple[Rig, CattaneoMindlin]:
    """A ball of nu = 0 on a face, and its closed form."""
    law = Hertz(radius=RADIUS, nu=0.0)
    rig = block(DEPTH, law, elements=elements)
    rig.update()
    ball = CattaneoMindlin(MU, float(rig.contact["force"][2]), math.sqrt(RADIUS * DEPTH), 0.5 * law.E)
    return rig, ball


def moved(rig: Rig, places: Sequence[float] | Array, coordinate: int) -> tuple[Array, Array]:
    """Shear along x [N], or torsion [N m], at each place, and the loss up to there [J]."""
    found, last, stored = [], 0.0, rig.state.z[0].reshape(-1, 3)
    for place in places:
        stored[:, coordinate] += place - last
        last = float(place)
        rig.update()
        rig.plant.note_slip(rig.state.z)
        found.append((rig.contact["force"][0 if coordinate == 0 else 3], float(rig.contact["slip_loss"])))
    force, lost = np.array(found).T
    return force, lost


def cycle(elements: int, share: float, count: int = 200) -> tuple[Array, Array, float, float]:
    """Places and shear of a cycle between the displacements of a share of the limit; its loss, and the exact one."""
    rig, ball = pressed(elements)
    end = float(ball.loading(share * ball.most))
    up, down = np.linspace(0.0, end, count + 1), np.linspace(end, -end, 2 * count + 1)
    places = np.concatenate([up, down[1:], -down[1:]])
    force, lost = moved(rig, places, 0)
    return places, force, float(lost[-1] - lost[count]), ball.loss(share * ball.most)


def error(elements: int) -> float:
    """Largest gap to the closed form on the way to the limit, over the limit."""
    rig, ball = pressed(elements)
    x = np.linspace(0.0, ball.reach, 401)
    force, _ = moved(rig, x, 0)
    return float(np.max(np.abs(force / ball.most - 1.0 + (1.0 - x / ball.reach) ** 1.5)))


def step_time(elements: int) -> float:
    """Of a control period of 1 ms of target A in the compiled loop, the control law included [us]."""
    values = {"fingertip.contact": "coulomb", "fingertip.slip_elements": elements}
    best = {}
    for duration in (1.0, 3.0):
        scenario = softhand.load_scenario("target-a", {**values, "duration": duration})
        spent = []
        for _ in range(4):
            begin = time.process_time()
            softhand.rollout(scenario, {"object.mass": [0.2] * 4}, variables=("object_position",), threads=1)
            spent.append(time.process_time() - begin)
        best[duration] = min(spent)
    return 1e6 * (best[3.0] - best[1.0]) / 8000


def draw_loop(axes: Axes) -> None:
    """One cycle to 0.8 of the limit."""
    _, ball = pressed(1)
    turn = 0.8 * ball.most
    for elements, colour in zip((4, 8, 16), FINGERS, strict=False):
        x, force, _, _ = cycle(elements, 0.8)
        axes.plot(1e3 * x, force, color=colour, lw=1.1, label=f"{elements} elements")
    fine = np.linspace(-turn, turn, 400)
    style = {"color": "black", "lw": 1.0, "ls": DASHED}
    axes.plot(1e3 * ball.loading(fine[fine >= 0]), fine[fine >= 0], **style, label="Cattaneo, Mindlin")
    axes.plot(1e3 * ball.unloading(fine, turn), fine, **style)
    axes.plot(-1e3 * ball.unloading(-fine, turn), fine, **style)
    axes.set(xlabel="displacement [mm]", ylabel="shear [N]", title="A cycle to 0.8 of the limit")
    axes.legend(loc="upper left")


def draw_spin(axes: Axes) -> None:
    """A spin, beside Lubkin."""
    rig, ball = pressed(16)
    stick = np.linspace(1.0, 0.05, 400)
    angle = np.asarray(ball.spin(stick * ball.radius))
    middle = 0.5 * (stick[1:] + stick[:-1]) * ball.radius
    torsion = np.concatenate([[0.0], np.cumsum(16.0 / 3.0 * ball.G * middle**3 * np.diff(angle))])
    found, _ = moved(rig, angle, 2)
    axes.plot(np.degrees(angle), 1e3 * found, color=FINGERS[2], lw=1.1, label="16 elements")
    axes.plot(np.degrees(angle), 1e3 * torsion, color="black", lw=1.0, ls=DASHED, label="Lubkin")
    axes.set(xlabel="spin [deg]", ylabel="torsion [N mm]", title="A spin")
    axes.legend(loc="lower right")
    print(
        f"spin: at most {np.max(found - torsion) / (ball.most * rig.contact['lever']):.3f} of the largest torsion off"
    )


def draw_share(axes: Axes) -> None:
    """Share of the area that slips, against the shear."""
    _, ball = pressed(1)
    x = np.linspace(0.0, ball.reach, 300)
    for elements, colour in zip((4, 8, 16), FINGERS, strict=False):
        rig, _ = pressed(elements)
        shares = []
        last = 0.0
        for place in x:
            rig.state.z[0].reshape(-1, 3)[:, 0] += place - last
            last = float(place)
            rig.update()
            rig.plant.note_slip(rig.state.z)
            shares.append((rig.contact["force"][0] / ball.most, rig.contact["slipped_share"]))
        axes.plot(*np.array(shares).T, color=colour, lw=1.1, label=f"{elements} elements")
    use = np.linspace(0.0, 1.0, 200)
    exact = 1.0 - (ball.stick_radius(use * ball.most) / ball.radius) ** 2
    axes.plot(use, exact, color="black", lw=1.0, ls=DASHED, label="Cattaneo")
    axes.set(xlabel="shear over the limit [-]", ylabel="slipped share [-]", title="What slips already", ylim=(0.0, 1.0))
    axes.legend(loc="upper left")


def draw() -> Figure:
    """Three panels."""
    with rc_context(STYLE):
        figure = Figure(figsize=(9.6, 3.1))
        panels = figure.subplots(1, 3)
        figure.subplots_adjust(left=0.065, right=0.985, top=0.9, bottom=0.16, wspace=0.3)
        draw_loop(panels[0])
        draw_share(panels[1])
        draw_spin(panels[2])
    return figure


def main() -> None:
    """Write the figure, print the table."""
    save_figure(draw(), IMAGES / "slip-elements.png")
    times = {elements: step_time(elements) for elements in (1, 4, 8, 16, 32)}
    for elements, period in times.items():
        losses = [
            f"{100.0 * (lost / exact - 1.0):.2g} %"
            for _, _, lost, exact in (cycle(elements, share) for share in (0.8, 0.5, 0.3))
        ]
        off = f"{100.0 * error(elements):.2g} %"
        print(f"| {elements} | {off} | {', '.join(losses)} | {period / times[1]:.3g} |  {period:.2f} us")


if __name__ == "__main__":
    main()
