"""Refresh docs/images/grasp-and-lift.png, six moments of the scenario, with a headless Chromium.

Example: python scripts/make_grasp_images.py
"""

from __future__ import annotations

import io
import tempfile
from pathlib import Path

from PIL import Image

import softhand
from softhand.viewer.browser.browser import Browser
from softhand.viewer.report.report import report_page

IMAGES = Path(__file__).parent.parent / "docs" / "images"
MOMENTS = (0.1, 1.2, 2.2, 3.2, 4.55, 5.9)  # [s]
SIZE, COLUMNS = (420, 440), 3  # [px] of one picture


def main() -> None:
    """Run the scenario, take a picture of each moment and put them side by side."""
    recording = softhand.simulate(softhand.load_scenario("grasp-and-lift"))
    with tempfile.TemporaryDirectory() as folder, Browser() as browser:
        file = Path(folder, "film.html")
        file.write_text(report_page([recording], film_only=True), "utf-8")
        page = browser.page(*SIZE)
        page.open(file.as_uri())
        page.evaluate(
            "softhand.ready.then(() => document.querySelectorAll('.name, .legend').forEach((e) => e.remove()))"
        )
        pictures = []
        for moment in MOMENTS:
            page.evaluate(f"softhand.setTime({moment})")
            pictures.append(Image.open(io.BytesIO(page.screenshot())).convert("RGB"))
    strip = Image.new("RGB", (COLUMNS * SIZE[0], -(-len(pictures) // COLUMNS) * SIZE[1]))
    for k, picture in enumerate(pictures):
        strip.paste(picture, ((k % COLUMNS) * SIZE[0], (k // COLUMNS) * SIZE[1]))
    strip.save(IMAGES / "grasp-and-lift.png", optimize=True)


if __name__ == "__main__":
    main()
