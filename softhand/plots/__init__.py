"""Figures of recordings: one run in all its quantities, and runs against each other as in the paper's Fig. 16.

Drawn on `matplotlib.figure.Figure` without pyplot: no display, no window, no state left behind.
"""

from softhand.plots.comparison import Compared, draw_comparison
from softhand.plots.line_up import Lined, draw_line_up
from softhand.plots.run import draw_run
from softhand.plots.style import FORMATS, save_figure

__all__ = ["FORMATS", "Compared", "Lined", "draw_comparison", "draw_line_up", "draw_run", "save_figure"]
