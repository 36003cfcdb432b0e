"""Make the figure of docs/envs.md anew: the learning curves of examples/learning.py for five seeds; prints its table.

Training takes minutes; curves that are kept are drawn again without it.

Example: python scripts/make_learning_figure.py --keep learned
"""

from __future__ import annotations

import argparse
import json
import runpy
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from softhand.plots.panels import draw_title, finish, new_figure, panel
from softhand.plots.style import FINGERS, STYLE

ROOT = Path(__file__).parent.parent
SEEDS = range(5)


def main(arguments: Sequence[str] | None = None) -> None:
    """Train what is not kept yet, draw, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--keep", type=Path, default=Path("learned"), help="folder of the policies, policy0.json ...")
    keep = parser.parse_args(arguments).keep
    keep.mkdir(exist_ok=True)
    learn = runpy.run_path(str(ROOT / "examples" / "learning.py"))["main"]
    curves = []
    for seed in SEEDS:
        file = keep / f"policy{seed}.json"
        if not file.exists():
            learn(["--seed", str(seed), "--out", str(file)])
        curves.append(np.array(json.loads(file.read_text())["curve"]))
    draw(curves).savefig(ROOT / "docs" / "images" / "learning.png", dpi=110)
    print("| seed | 0.9 of the tests succeed after [s] | at the end: succeed, mean reward | processor time [s] |")
    print("|---|---|---|---|")
    for seed, curve in enumerate(curves):
        first = curve[np.flatnonzero(curve[:, 3] >= 0.9)[:1], 1]
        told = f"{first[0]:.0f}" if first.size else "never"
        print(f"| {seed} | {told} | {curve[-1, 3]:.0%}, {curve[-1, 2]:.2f} | {curve[-1, 1]:.0f} |")


def draw(curves: Sequence[np.ndarray]) -> Figure:
    """Success and reward of the tests against processor time."""
    with rc_context(STYLE):
        figure = new_figure(3.2)
        top = draw_title(figure, "ReorientBox, set point moved by a matrix: CMA-ES from nothing, five seeds")
        grid = figure.add_gridspec(1, 2, left=0.07, right=0.975, top=top, bottom=0.16, wspace=0.22)
        for column, (index, label) in enumerate(((3, "share of tests at their goal [-]"), (2, "mean reward [-]"))):
            axes = panel(figure, grid[0, column], label, bottom=True)
            for seed, curve in enumerate(curves):
                axes.plot(
                    curve[:, 1], curve[:, index], "o-", ms=3, color=FINGERS[seed % len(FINGERS)], label=f"seed {seed}"
                )
            axes.set_ylim(-0.03, 1.03)
        axes.legend()
        finish(figure, max(curve[-1, 1] for curve in curves))
        for axes in figure.axes:
            axes.set_xlabel("processor time [s]")
    return figure


if __name__ == "__main__":
    main()
