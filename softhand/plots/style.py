"""How all figures look, and how they are written to files."""

from __future__ import annotations

import io
import math
import os
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

from softhand.errors import SofthandError
from softhand.recording.whole_file import write_whole

FORMATS = ("png", "pdf", "svg")
"""Endings that `save_figure` takes."""

FINGERS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00")
"""One colour a finger, safe for the colour-blind [Okabe, Ito]; a sixth finger starts again."""

TARGETS = (("#0072B2", "#56B4E9"), ("#D55E00", "#E69F00"), ("#009E73", "#7CCBB2"))
"""Two colours a target: with compensation and without."""

SOLID, DASH_DOTTED, DASHED = "-", (0, (5, 1.5, 1, 1.5)), (0, (4, 2))
OBJECT, WARNING = "#56B4E9", "#A50026"
ON_TOP = 10  # zorder of desired values
DEGREES = 180.0 / math.pi
_FAST_PNG = {"compress_level": 1}  # a fifth larger, twice as fast

STYLE: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 9.0,
    "axes.titleweight": "bold",
    "axes.titley": 1.0,  # else each title asks all ticks for their extent
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "grid.color": "0.9",
    "grid.linewidth": 0.6,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "savefig.dpi": 150,
    "svg.fonttype": "none",
    "text.parse_math": False,  # a dollar in a name is a dollar
    "svg.hashsalt": "softhand",
    "pdf.fonttype": 42,
}


def finger_color(index: int) -> str:
    """Of the finger of an index from 0."""
    return FINGERS[index % len(FINGERS)]


def save_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure, whole or not at all; text stays text in PDF and SVG.

    Args:
        figure: what to write.
        path: file to write, its format by its ending: .png, .pdf or .svg; an older one is replaced.

    Raises:
        SofthandError: another ending. Carries `.value`.
        RecordingError: the file cannot be written.
    """
    ending = figure_format(Path(path))
    write_whole(Path(path), lambda: _encode(figure, ending))


def figure_format(path: Path) -> str:
    """png, pdf or svg, by the ending of a file's name; SofthandError for another."""
    ending = path.suffix.lower().removeprefix(".")
    if ending not in FORMATS:
        got = f"has the unknown ending {path.suffix!r}" if ending else "has no ending"
        allowed = ", ".join(f".{name}" for name in FORMATS)
        raise SofthandError(f"{path}: the name of the figure {got}; choose one of {allowed}.", value=path.suffix)
    return ending


def _encode(figure: Figure, ending: str) -> bytes:
    options: dict[str, dict[str, Any]] = {
        "png": {"pil_kwargs": _FAST_PNG},
        "pdf": {"metadata": {"CreationDate": None}},
        "svg": {"metadata": {"Date": None}},
    }
    buffer = io.BytesIO()
    with rc_context(STYLE):
        figure.savefig(buffer, format=ending, **options[ending])
    return buffer.getvalue()
