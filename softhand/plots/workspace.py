"""Planes of poses that a hand can hold, coloured by what stops the others."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from softhand.grasping.poses import COORDINATES, Poses
from softhand.grasping.workspace import PAPER_ANGLE, PAPER_POSITION
from softhand.plots.panels import draw_legend, draw_title, from_top, new_figure
from softhand.plots.style import DASHED, DEGREES, STYLE

_COLORS = {
    "held": "#BFE3F7",
    "out of reach": "0.78",
    "joint limit": "#E69F00",
    "rim of the tip": "#CC79A7",
    "apex of the tip": "#D55E00",
}
"""In the order of `Verdict`."""
_PLANES = ((0, 1), (0, 2), (1, 2), (3, 4), (3, 5), (4, 5))


def draw_workspace(
    workspace: Poses, title: str, half: tuple[float, float] = (0.060, np.radians(60.0)), count: int = 161
) -> Figure:
    """Six planes through the start: translations without rotation, rotations without translation.

    The dashed square is the workspace that the paper gives, +-2 cm and +-30 deg.

    Args:
        workspace: of a scenario.
        title: of the figure.
        half: how far the planes reach [m, rad].
        count: points along each side.
    """
    with rc_context(STYLE):
        figure = new_figure(6.6)
        handles: list[Any] = [Patch(facecolor=color, label=name) for name, color in _COLORS.items()]
        handles.append(Patch(facecolor="none", edgecolor="black", ls="--", label="±2 cm, ±30° of the paper"))
        draw_legend(figure, handles, from_top(figure, 0.34), loc="upper left")
        top = draw_title(figure, title)
        grid = figure.add_gridspec(2, 3, left=0.075, right=0.985, top=top - 0.01, bottom=0.07, wspace=0.3, hspace=0.28)
        for k, plane in enumerate(_PLANES):
            _draw_plane(figure.add_subplot(grid[k // 3, k % 3]), workspace, plane, half[k // 3], count)
    return figure


def _draw_plane(axes: Axes, workspace: Poses, plane: tuple[int, int], half: float, count: int) -> None:
    turns = plane[0] >= 3
    scale, unit = (DEGREES, "deg") if turns else (1e3, "mm")
    one, two, verdicts = workspace.map(*plane, (half, half), count)
    colors = ListedColormap(list(_COLORS.values()))
    axes.pcolormesh(scale * one, scale * two, verdicts.verdict.reshape(count, count).T, cmap=colors, shading="nearest",
                    norm=BoundaryNorm(np.arange(len(_COLORS) + 1) - 0.5, len(_COLORS)), rasterized=True)  # fmt: skip
    edge = scale * (PAPER_ANGLE if turns else PAPER_POSITION)
    axes.add_patch(Rectangle((-edge, -edge), 2 * edge, 2 * edge, fill=False, ls=DASHED, lw=1.1))
    axes.plot(0.0, 0.0, "+", color="black", ms=7, mew=1.2)
    axes.set_xlabel(f"{COORDINATES[plane[0]]} [{unit}]", labelpad=1.0)
    axes.set_ylabel(f"{COORDINATES[plane[1]]} [{unit}]", labelpad=1.0)
    axes.set_aspect("equal")
    axes.grid(False)
    ticks = np.linspace(-scale * half, scale * half, 5)
    axes.set_xticks(ticks)
    axes.set_yticks(ticks)
