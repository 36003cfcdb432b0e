"""Refresh docs/images/arm-pick-and-place.png, eight moments of the scenario, with a headless Chromium.

Example: python scripts/make_arm_images.py
"""

from __future__ import annotations

from make_grasp_images import IMAGES, strip_of

MOMENTS = (0.0, 1.3, 2.4, 3.6, 4.6, 5.7, 7.0, 9.4)  # [s]

if __name__ == "__main__":
    strip_of("arm-pick-and-place", MOMENTS, columns=4, size=(420, 400)).save(
        IMAGES / "arm-pick-and-place.png", optimize=True
    )
