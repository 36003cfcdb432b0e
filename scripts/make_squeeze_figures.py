"""Make the figures of docs/squeeze.md anew, and print the numbers that it gives.

Example: python scripts/make_squeeze_figures.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.lines import Line2D

import softhand
from softhand.plots.panels import draw_legend, draw_note, draw_title, finish, from_top, new_figure, panel
from softhand.plots.squeeze import draw_push
from softhand.plots.style import FINGERS, STYLE, WARNING, save_figure

IMAGES = Path(__file__).parent.parent / "docs" / "images"
DAMPED = {"name": "kelvin-voigt", "radial": 1.0, "tangential": 1.0, "torsional": 1e-4}
STAIRS, GROWS, BEGINS, PUSH = 40, 2.0, 0.5, (1.7, 1.7, 0.0)  # [1], [s], [s], [N]
NOTE = (
    "The box of target-a is held at its start and pushed sideways by a force that grows to 2.4 N from 0.5 to 2.5 s. "
    "Good: no tip slips, and no more squeeze than that takes."
)
NAMES = {"regulation": FINGERS[1], "least-squeeze": FINGERS[0]}


def grasp(**values: Any) -> softhand.Scenario:
    """That of target-a at rest, of damped tips that can slip."""
    return softhand.load_scenario("target-a").replace(
        {"fingertip.contact": "coulomb", "fingertip.damping": DAMPED, "reference": {"kind": "hold"}, **values}
    )


def pushed(name: str) -> softhand.Recording:
    """A run under a growing push."""
    step = GROWS / STAIRS
    pushes = [
        {"force": [part * (k + 1) / STAIRS for part in PUSH], "start": BEGINS + k * step,
         "duration": step if k + 1 < STAIRS else 10.0}
        for k in range(STAIRS)
    ]  # fmt: skip
    return softhand.simulate(grasp(duration=3.2, controller={"name": name}, push=pushes))


def main() -> None:
    """Both figures."""
    with rc_context(STYLE):
        figure = new_figure(4.6)
        room = draw_note(figure, NOTE, 0.34)
        handles = [Line2D([], [], color=color, label=name) for name, color in NAMES.items()]
        draw_legend(figure, handles, from_top(figure, 0.42 + room), loc="upper left")
        top = draw_title(figure, "A constant squeeze, and the least that holds", room=room)
        grid = figure.add_gridspec(2, 1, left=0.075, right=0.975, top=top - 0.03, bottom=0.1, hspace=0.25)
        above = panel(figure, grid[0], "[N]", "Sum of the normal forces")
        below = panel(figure, grid[1], "[%]", "Least margin to slip", bottom=True)
        for name, color in NAMES.items():
            run = pushed(name)
            slip, total = softhand.slip_margin(run), run.contact_force[:, :, 2].sum(axis=1)
            above.plot(run.time, total, color=color)
            below.plot(run.time, 100.0 * slip.least, color=color)
            print(f"{name}: mean squeeze {np.mean(total):.3g} N, slip {1e3 * np.max(run.slip_travel[-1]):.3g} mm, "
                  f"least margin {100.0 * np.min(slip.least):.3g} %")  # fmt: skip
        below.axhline(0.0, color=WARNING, lw=0.8)
        above.set_ylim(bottom=0.0)
        below.set_ylim(-5.0, 60.0)
        finish(figure, 3.2)
    save_figure(figure, IMAGES / "least-squeeze.png")
    found = softhand.worst_push(grasp())
    save_figure(draw_push(found, "Pushes that the grasp of target-a survives, tips damped"), IMAGES / "push.png")
    for row in found.rows():
        print(*row, sep=": ")


if __name__ == "__main__":
    main()
