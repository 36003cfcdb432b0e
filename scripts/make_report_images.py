"""Refresh report.png, film.gif and lift.gif in docs/images; needs Chromium.

Example: python scripts/make_report_images.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import softhand
from softhand.viewer.browser.browser import Browser

IMAGES = Path(__file__).parent.parent / "docs" / "images"


def main() -> None:
    """Run target A, picture its report at 0.6 s, film it."""
    recording = softhand.simulate(softhand.load_scenario("target-a"))
    with tempfile.TemporaryDirectory() as folder, Browser() as browser:
        report = Path(folder, "report.html")
        recording.to_html(report)
        page = browser.page(1400, 900)
        page.open(f"{report.as_uri()}#t=0.6")
        page.evaluate("softhand.ready.then(() => true)")
        (IMAGES / "report.png").write_bytes(page.screenshot())
    softhand.write_film(recording, IMAGES / "film.gif", fps=15, size=(640, 480))
    softhand.write_film(softhand.simulate("grasp-and-lift"), IMAGES / "lift.gif", fps=12, size=(640, 480))


if __name__ == "__main__":
    main()
