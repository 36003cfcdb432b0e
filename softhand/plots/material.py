"""A tip of a material: finite elements and the law beside them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from softhand.laws.law import Law
from softhand.laws.tabulated import Tabulated
from softhand.numerics.arrays import Array
from softhand.plots.panels import draw_legend, draw_note, draw_title, from_top, new_figure
from softhand.plots.style import DASHED, FINGERS, STYLE, WARNING

_NOTE = (
    "Above: the rows of the table, with bars for what the mesh leaves open, and the laws. Below: by how much the laws "
    "are off the rows. Good: within the grey band, 10 % in force and torsion and 15 % in shear, to 0.3 of the radius."
)
_PANELS = (
    ("normal", "force [N]", 1.0, 0.10),
    ("shear", "shear [N/mm]", 1e-3, 0.15),
    ("torsion", "torsion [N mm/rad]", 1e3, 0.10),
)


def draw_material(table: Tabulated, law: Law | None, mesh: Mapping[str, Array] | None, title: str) -> Figure:
    """Force, shear and torsion by the depth, and by which share the laws are off.

    Args:
        table: rows, and the law that runs through them.
        law: of one modulus, if there is one.
        mesh: by column, the share that the mesh leaves open at each row.
        title: of the figure.
    """
    depths = np.array(table.depths)
    fine = np.linspace(0.0, depths[-1], 200)[1:]
    with rc_context(STYLE):
        figure = new_figure(4.8)
        room = draw_note(figure, _NOTE, 0.34)
        handles: list[Any] = [
            Line2D([], [], color=FINGERS[0], marker="o", ms=3.5, label="rows, and tabulated"),
            *([Line2D([], [], color=FINGERS[1], ls=DASHED, label="hemisphere")] if law is not None else []),
            Line2D([], [], color=WARNING, lw=0.8, label="0.3 of the radius"),
        ]
        draw_legend(figure, handles, from_top(figure, 0.42 + room), loc="upper left")
        top = draw_title(figure, title, room=room) - 0.02
        for k, (name, label, scale, band) in enumerate(_PANELS):
            left, width = 0.07 + 0.32 * k, 0.25
            middle = 0.42 * top + 0.06
            above = figure.add_axes((left, middle, width, top - middle))
            below = figure.add_axes((left, 0.11, width, middle - 0.17))
            rows = scale * np.array(getattr(table, name))
            error = None if mesh is None else rows * mesh[name]
            above.errorbar(1e3 * depths, rows, error, fmt="o", ms=3.5, color=FINGERS[0], capsize=2)
            above.plot(1e3 * fine, scale * _column(table, name, fine), color=FINGERS[0])
            below.axhspan(-100.0 * band, 100.0 * band, color="0.92")
            below.plot(1e3 * depths, 100.0 * (scale * _column(table, name, depths) / rows - 1.0), color=FINGERS[0])
            if law is not None:
                above.plot(1e3 * fine, scale * _column(law, name, fine), color=FINGERS[1], ls=DASHED)
                off = 100.0 * (scale * _column(law, name, depths) / rows - 1.0)
                below.plot(1e3 * depths, off, color=FINGERS[1], ls=DASHED, marker="o", ms=3)
            below.axvline(300.0 * table.radius, color=WARNING, lw=0.8)
            above.set(ylabel=label, ylim=(0.0, None), xlim=(0.0, 1.02e3 * depths[-1]))
            below.set(ylabel="off by [%]", xlabel="depth [mm]", xlim=above.get_xlim())
    return figure


def _column(law: Law, name: str, depths: Array) -> Array:
    """Force, shear or torsion of a law at depths."""
    moved = {"normal": [0.0, 0.0, 0.0], "shear": [1e-9, 0.0, 0.0], "torsion": [0.0, 0.0, 1e-9]}[name]
    place = {"normal": 0, "shear": 1, "torsion": 3}[name]
    size = 1.0 if name == "normal" else 1e-9
    return np.array([law([d, *moved], 0.5 * np.pi)[place] / size for d in depths])
