"""Refresh tactile.png in docs/images: pads in the film, maps, markers and depth; needs Chromium.

Example: python scripts/make_tactile_figure.py
"""

from __future__ import annotations

import io
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from PIL import Image

import softhand
from softhand.viewer.browser.browser import Browser

IMAGES = Path(__file__).parent.parent / "docs" / "images"
AT, FINGER = 0.5, 1
LOOK = """
softhand.ready.then(() => {
  [...document.querySelectorAll('.views button')].find((b) => b.textContent === 'grasp').click();
  for (const text of ['Torsion', 'Contact forces', 'Internal forces', 'Desired pose', 'Trails'])
    [...document.querySelectorAll('.layers label')].find((l) => l.textContent === text).click();
  return true;
})"""


def main() -> None:
    """Run target A with taxels; the film beside what one finger feels and what a camera in it sees."""
    recording = softhand.simulate("target-a", overrides={"duration": 0.6, "tactile.count": 100})
    figure, axes = plt.subplots(2, 2, figsize=(11, 6.6), width_ratios=(1.25, 1), layout="constrained")
    axes[0, 0].remove(), axes[1, 0].remove()
    film = figure.add_subplot(axes[0, 0].get_gridspec()[:, 0])
    film.imshow(_film(recording))
    film.set_axis_off()
    film.set_title(f"taxels of the three tips, t = {AT:g} s")
    k = int(np.argmin(np.abs(recording.time - AT)))
    places = 10.0 * softhand.taxel_pattern(100)  # [mm]
    force = recording.tactile_normal_force[k, FINGER]
    dots = axes[0, 1].scatter(places[:, 1], places[:, 2], c=1e3 * force, cmap="Blues", s=70, edgecolors="0.7")
    _label(axes[0, 1], f"finger {FINGER + 1}: normal force of each taxel")
    figure.colorbar(dots, ax=axes[0, 1], label="mN")
    markers = softhand.marker_displacements(recording, at=AT)
    x, moved = 1e3 * markers.positions[FINGER], 1e3 * markers.displacements[FINGER]
    depth = 1e3 * softhand.depth_image(recording, at=AT, pixels=160)[FINGER]
    shown = axes[1, 1].imshow(depth, extent=(-10, 10, -10, 10), origin="lower", cmap="Greys", alpha=0.8)
    axes[1, 1].quiver(*x.T, *moved.T, color="#D55E00", angles="xy", scale_units="xy", scale=1.0, width=0.005)
    _label(axes[1, 1], "markers, and depth behind them")
    figure.colorbar(shown, ax=axes[1, 1], label="mm")
    figure.savefig(IMAGES / "tactile.png", dpi=100)


def _film(recording: softhand.Recording) -> Image.Image:
    with tempfile.TemporaryDirectory() as folder, Browser() as browser:
        report = Path(folder, "report.html")
        recording.to_html(report)
        page = browser.page(1440, 900)
        page.open(f"{report.as_uri()}#t={AT:g}")
        page.evaluate(LOOK)
        picture = Image.open(io.BytesIO(page.screenshot()))
    return picture.crop((14, 70, 594, 480))


def _label(axes: Axes, title: str) -> None:
    axes.set(title=title, xlabel="y of the tip [mm]", ylabel="z [mm]", aspect="equal", xlim=(-10.5, 10.5))


if __name__ == "__main__":
    main()
