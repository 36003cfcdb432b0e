"""Refresh docs/images/grasp-and-lift.png, six moments of the scenario, with a headless Chromium.

Example: python scripts/make_grasp_images.py
"""

from __future__ import annotations

import io
import tempfile
from collections.abc import Sequence
from pathlib import Path

from PIL import Image

import softhand
from softhand.viewer.browser.browser import Browser
from softhand.viewer.report.report import report_page

IMAGES = Path(__file__).parent.parent / "docs" / "images"
MOMENTS = (0.1, 1.2, 2.2, 3.2, 4.55, 5.9)  # [s]


def strip_of(scenario: str, moments: Sequence[float], columns: int, size: tuple[int, int]) -> Image.Image:
    """Run a scenario, take a picture of each moment [s] and put them side by side."""
    recording = softhand.simulate(softhand.load_scenario(scenario))
    with tempfile.TemporaryDirectory() as folder, Browser() as browser:
        file = Path(folder, "film.html")
        file.write_text(report_page([recording], film_only=True), "utf-8")
        page = browser.page(*size)
        page.open(file.as_uri())
        page.evaluate(
            "softhand.ready.then(() => document.querySelectorAll('.name, .legend').forEach((e) => e.remove()))"
        )
        pictures = []
        for moment in moments:
            page.evaluate(f"softhand.setTime({moment})")
            pictures.append(Image.open(io.BytesIO(page.screenshot())).convert("RGB"))
    strip = Image.new("RGB", (columns * size[0], -(-len(pictures) // columns) * size[1]))
    for k, picture in enumerate(pictures):
        strip.paste(picture, ((k % columns) * size[0], (k // columns) * size[1]))
    return strip


if __name__ == "__main__":
    strip_of("grasp-and-lift", MOMENTS, columns=3, size=(420, 440)).save(IMAGES / "grasp-and-lift.png", optimize=True)
