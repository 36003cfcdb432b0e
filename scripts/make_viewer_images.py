"""Refresh viewer.png, grasp.png, slip.png and allegro.png of docs/images; needs Chromium and the extra robots.

Example: python scripts/make_viewer_images.py
"""

from __future__ import annotations

import time
from pathlib import Path

import softhand
from softhand.viewer.browser.browser import Browser
from softhand.viewer.browser.page import Page

IMAGES = Path(__file__).parent.parent / "docs" / "images"
MOMENT = 0.62  # [s], when the desired pose is ahead of the object
SLIPPING = 0.9  # [s]
SIZE = (1200, 800)  # [px]


def wait(page: Page, claim: str) -> None:
    """Return when a JavaScript expression is true."""
    while not page.evaluate(claim):
        time.sleep(0.05)


def main() -> None:
    """Replay some runs, stop them and take the pictures, of the whole hand and from nearby."""
    for name, changes, moment, whole, nearby in (
        ("target-a", {}, MOMENT, "viewer.png", "grasp.png"),
        ("target-b", {"fingertip.contact": "coulomb"}, SLIPPING, None, "slip.png"),
        ("allegro-box", {}, MOMENT, "allegro.png", None),
    ):
        recording = softhand.simulate(softhand.load_scenario(name, changes))
        with softhand.view(recording) as replay, Browser() as browser:
            page = browser.page(*SIZE)
            page.open(replay.address)
            wait(page, "document.body.dataset.time !== undefined")
            page.evaluate(f"softhand.wind({moment})")
            wait(page, f"Math.abs(document.body.dataset.time - {moment}) < 1e-3")
            if whole:
                (IMAGES / whole).write_bytes(page.screenshot())
            if nearby:
                page.evaluate("softhand.stage.orbit.view('grasp')")
                (IMAGES / nearby).write_bytes(page.screenshot())


if __name__ == "__main__":
    main()
