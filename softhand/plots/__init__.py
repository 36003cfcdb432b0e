"""Figures of recordings: one run in all its quantities, and runs against each other as in the paper's Fig. 16.

Drawn on `matplotlib.figure.Figure` without pyplot: no display, no window, no state left behind.
"""

from softhand.plots.comparison import Compared, draw_comparison
from softhand.plots.line_up import Lined, draw_line_up
from softhand.plots.run import contact_quantities, draw_run, joints_of_fingers, settings_line
from softhand.plots.style import (
    CONTACT_ARRAYS,
    DASH_DOTTED,
    DASHED,
    FINGERS,
    FORMATS,
    FRICTION_TOP,
    OBJECT,
    OBJECT_ARRAYS,
    SOLID,
    TARGETS,
    WARNING,
    check,
    quantities,
    save_figure,
)
from softhand.recording.recorded import is_coulomb, scenario_of

__all__ = [
    "CONTACT_ARRAYS",
    "DASHED",
    "DASH_DOTTED",
    "FINGERS",
    "FORMATS",
    "FRICTION_TOP",
    "OBJECT",
    "OBJECT_ARRAYS",
    "SOLID",
    "TARGETS",
    "WARNING",
    "Compared",
    "Lined",
    "check",
    "contact_quantities",
    "draw_comparison",
    "draw_line_up",
    "draw_run",
    "is_coulomb",
    "joints_of_fingers",
    "quantities",
    "save_figure",
    "scenario_of",
    "settings_line",
]
