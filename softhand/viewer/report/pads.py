"""Maps of what taxels feel, for the report: each tip seen from outside, at its highest and at the end."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from softhand.numerics.arrays import Array
from softhand.plots.quantities import finger_name
from softhand.recording.recording import Recording
from softhand.tactile.pattern import spacing
from softhand.viewer.scene.palette import Colour, pressure_colours
from softhand.viewer.scene.recorded import recorded_taxels
from softhand.viewer.scene.samples import FELT

_SIZE, _ROOM = 100.0, 1.08  # of a map, and over its rim


def pads_html(recordings: Sequence[Recording]) -> str:
    """The section, or nothing where no run has taxels.

    Args:
        recordings: the runs, in the order of the page.
    """
    felt = [recording for recording in recordings if FELT in recording.variables]
    if not felt:
        return ""
    most = max(float(np.abs(recording[FELT]).max()) for recording in felt) or 1e-6
    maps = [figure for k, run in enumerate(recordings) for figure in _maps_of(run, "ABCD"[k], len(recordings), most)]
    ramp = ", ".join(_css(colour) for colour in pressure_colours(5))
    title = (
        f"<h2>Taxels, normal force <i style='background:linear-gradient(90deg,#fff,{ramp})'></i> 0 to {most:.2g} N;"
        " tips seen from outside, y of the tip to the right, z up</h2>"
    )
    return f'<section class="pads">{title}<div>{"".join(maps)}</div></section>'


def _maps_of(recording: Recording, label: str, runs: int, most: float) -> list[str]:
    places = recorded_taxels(recording)
    if places is None:
        return []
    figures = []
    for i, tip in enumerate(recording.labels["contact"]):
        force = recording[FELT][:, i]
        highest = int(np.argmax(force.max(axis=1)))
        for k, when in ((highest, "highest"), (len(force) - 1, "end")):
            run = f"{label}, " if runs > 1 else ""
            text = f"{run}{finger_name(tip)}: {when}, {recording.time[k]:.3g}\u00a0s, {force[k].sum():.3g}\u00a0N"
            figures.append(f"<figure>{pad_map(places, force[k], most)}<figcaption>{escape(text)}</figcaption></figure>")
    return figures


def pad_map(places: Array, force: Array, most: float) -> str:
    """The taxels of a tip as an SVG: an azimuthal map of equal areas, the apex in its middle.

    Args:
        places: unit vectors in F, shape (taxels, 3).
        force: [N], shape (taxels,).
        most: force of the darkest [N].
    """
    flat = np.hypot(places[:, 1], places[:, 2])
    out = np.sqrt(np.maximum(1.0 - places[:, 0], 0.0)) / np.maximum(flat, 1e-12)  # the rim at 1
    x, y = 0.5 * _SIZE * (1.0 + out[:, None] * places[:, 1:] * (1.0, -1.0) / _ROOM).T
    radius = 0.5 * _SIZE / _ROOM * 0.5 * spacing(len(places)) / np.sqrt(2.0)
    rim = f'<circle cx="50" cy="50" r="{0.5 * _SIZE / _ROOM + radius:.1f}" fill="#f6e3d9"/>'
    dots = [
        f'<circle cx="{a:.1f}" cy="{b:.1f}" r="{radius:.1f}" fill="{_css(colour_of(abs(f) / most))}"/>'
        for a, b, f in zip(x, y, force, strict=True)
    ]
    return f'<svg viewBox="-4 -4 108 108" role="img">{rim}{"".join(dots)}</svg>'


def colour_of(share: float) -> Colour:
    """White for nothing, then the colours of the taxels in the film."""
    colours = [(1.0, 1.0, 1.0), *pressure_colours(5)]
    red, green, blue = (
        float(np.interp(share, np.linspace(0.0, 1.0, len(colours)), [c[k] for c in colours])) for k in range(3)
    )
    return red, green, blue


def _css(colour: Colour) -> str:
    return "#" + "".join(f"{round(255 * part):02x}" for part in colour)
