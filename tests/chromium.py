"""What the tests with a real Chromium share."""

import subprocess
import time
from collections.abc import Callable

import pytest

from softhand.errors import BrowserError
from softhand.viewer.browser.chromium import find_chromium


def _is_installed() -> bool:
    try:
        return bool(find_chromium())
    except BrowserError:
        return False


needs_chromium = pytest.mark.skipif(not _is_installed(), reason="Chromium is not installed")


def living(group: int | str) -> list[str]:
    """Processes of a group that are not dead."""
    lines = subprocess.run(
        ["ps", "-e", "-o", "pgid=", "-o", "stat="], capture_output=True, text=True, check=True
    ).stdout
    return [line for line in lines.splitlines() if line.split()[0] == str(group) and "Z" not in line]


def wait_until(true: Callable[[], object]) -> bool:
    """Whether it becomes true within half a minute."""
    end = time.monotonic() + 30.0
    while not true() and time.monotonic() < end:
        time.sleep(0.05)
    return bool(true())
