"""Refresh docs/images/viewer.png and docs/images/grasp.png with a headless Chromium.

Example: python scripts/make_viewer_images.py
"""

from __future__ import annotations

import time
from pathlib import Path

import softhand
from softhand.viewer.browser import Browser, Page

IMAGES = Path(__file__).parent.parent / "docs" / "images"
MOMENT = 0.62  # [s], when the desired pose is ahead of the object
SIZE = (1200, 800)  # [px]


def wait(page: Page, claim: str) -> None:
    """Return when a JavaScript expression is true."""
    while not page.evaluate(claim):
        time.sleep(0.05)


def main() -> None:
    """Replay target A, stop it and take the pictures, of the whole hand and from nearby."""
    recording = softhand.simulate(softhand.load_scenario("target-a"))
    with softhand.view(recording) as replay, Browser() as browser:
        page = browser.page(*SIZE)
        page.open(replay.address)
        wait(page, "document.body.dataset.time !== undefined")
        page.evaluate(f"softhand.wind({MOMENT})")
        wait(page, f"Math.abs(document.body.dataset.time - {MOMENT}) < 1e-3")
        (IMAGES / "viewer.png").write_bytes(page.screenshot())
        page.evaluate("softhand.stage.orbit.view('grasp')")
        (IMAGES / "grasp.png").write_bytes(page.screenshot())


if __name__ == "__main__":
    main()
