"""What the tests with a real Chromium share."""

import subprocess
import time
from collections.abc import Callable, Iterator

import pytest

from softhand.errors import BrowserError
from softhand.viewer.browser.browser import Browser
from softhand.viewer.browser.chromium import find_chromium
from softhand.viewer.browser.page import Page


def _is_installed() -> bool:
    try:
        return bool(find_chromium())
    except BrowserError:
        return False


needs_chromium = pytest.mark.skipif(not _is_installed(), reason="Chromium is not installed")


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """One Chromium for all tests that do not end it."""
    with Browser() as browser:
        yield browser


def open_coarse(browser: Browser, width: int, height: int) -> Page:
    """A page of a size [px], drawn with half as many pixels each way: without a graphics card pixels take time."""
    page = browser.page(width, height)
    page.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=0.5, mobile=False)
    return page


@pytest.fixture
def new_page(browser: Browser) -> Iterator[Callable[[int, int], Page]]:
    """Function that makes a page of a size [px]; it is closed after the test."""
    yield from _pages(browser.page)


@pytest.fixture
def coarse_page(browser: Browser) -> Iterator[Callable[[int, int], Page]]:
    """The same with fewer pixels, see `open_coarse`."""
    yield from _pages(lambda *size: open_coarse(browser, *size))


def _pages(make: Callable[..., Page]) -> Iterator[Callable[[int, int], Page]]:
    pages: list[Page] = []

    def note(width: int = 900, height: int = 600) -> Page:
        pages.append(make(width, height))
        return pages[-1]

    yield note
    for page in pages:
        page.close()


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
