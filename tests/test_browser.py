"""A headless Chromium: what a page says reaches us, and nothing of it is left behind."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
from io import BytesIO
from pathlib import Path

import pytest
from chromium import living, needs_chromium, wait_until
from PIL import Image

from softhand.errors import BrowserError
from softhand.viewer.browser import chromium as program
from softhand.viewer.browser.browser import Browser
from softhand.viewer.browser.chromium import find_chromium


def write(folder: Path, body: str) -> str:
    file = folder / "page.html"
    file.write_text(f"<!doctype html><meta charset=utf-8><body style='margin:0'>{body}")
    return file.as_uri()


@needs_chromium
def test_a_page_answers(new_page, tmp_path):
    """Values come back as plain data, also those of a promise."""
    page = new_page(300, 200)
    page.open(write(tmp_path, "<p id=a>grüß</p>"))
    assert page.evaluate("document.getElementById('a').textContent") == "grüß"
    assert page.evaluate("Promise.resolve({n: [1, 2.5]})") == {"n": [1, 2.5]}
    assert page.evaluate("[innerWidth, innerHeight]") == [300, 200]
    assert page.console_errors == []


@needs_chromium
def test_a_large_message_passes(new_page):
    """A script longer than a pipe holds goes there and back."""
    text = "x" * 1_000_000
    assert new_page().evaluate(f"'{text}'") == text


@needs_chromium
def test_a_screenshot_is_what_is_shown(new_page, tmp_path):
    """A blue page gives blue pixels in the size that was asked for."""
    page = new_page(120, 80)
    page.open(write(tmp_path, "<div style='background:#0000ff;height:80px'></div>"))
    picture = Image.open(BytesIO(page.screenshot())).convert("RGB")
    assert picture.size == (120, 80) and picture.getcolors() == [(9600, (0, 0, 255))]


@needs_chromium
def test_errors_and_requests_are_noted(new_page, tmp_path):
    """console.error, an exception, a missing file; and each address that was asked for."""
    page = new_page()
    url = write(tmp_path, "<script>console.error('one', 2); throw new Error('three')</script><img src=none.png>")
    page.open(url)
    assert page.requests == [url, url.replace("page.html", "none.png")]
    said = "\n".join(page.console_errors)
    assert "one 2" in said and "three" in said and "ERR_FILE_NOT_FOUND" in said


@needs_chromium
def test_a_script_that_throws_is_told(new_page):
    """The message holds the script and the exception."""
    with pytest.raises(BrowserError, match="no_such_thing"):
        new_page().evaluate("no_such_thing.at_all")


@needs_chromium
def test_a_missing_page_is_told(new_page, tmp_path):
    """The message names the address."""
    with pytest.raises(BrowserError, match=r"missing\.html: Chromium cannot open it"):
        new_page().open((tmp_path / "missing.html").as_uri())


@needs_chromium
def test_a_page_that_hangs_is_given_up():
    """An endless script ends in an error, and Chromium with it."""
    with Browser() as chromium:
        page, group = chromium.page(), chromium._chromium.group
        chromium.timeout = 1.0
        with pytest.raises(BrowserError, match="no answer in 1 s"):
            page.evaluate("(() => { for (;;); })()")
    assert wait_until(lambda: not living(group))


@needs_chromium
def test_nothing_is_left_behind():
    """After the block neither a process nor the profile is there, even where the block failed."""
    with pytest.raises(KeyboardInterrupt), Browser() as chromium:
        folder, group = chromium._chromium.folder, chromium._chromium.group
        chromium.page()
        assert len(living(group)) > 2
        raise KeyboardInterrupt
    assert wait_until(lambda: not living(group)) and not os.path.exists(folder)


@needs_chromium
def test_chromium_ends_with_a_killed_parent():
    """SIGKILL gives no time to tidy up: the closed pipe ends Chromium."""
    script = (
        "from softhand.viewer.browser.browser import Browser\n"
        "with Browser() as b:\n"
        "    b.page(); print(b._chromium.group, b._chromium.folder, flush=True); b.wait('the kill', lambda: False)"
    )
    parent = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    group, folder = parent.stdout.readline().split()
    assert living(group)
    parent.send_signal(signal.SIGKILL)
    parent.communicate()
    assert wait_until(lambda: not living(group))
    shutil.rmtree(folder, ignore_errors=True)


@needs_chromium
def test_a_dead_chromium_is_told():
    """Where Chromium dies, the next question says so."""
    with Browser() as chromium:
        page = chromium.page()
        os.killpg(chromium._chromium.group, signal.SIGKILL)
        with pytest.raises(BrowserError, match=r"ended"):
            page.evaluate("1")


@needs_chromium
def test_a_long_temporary_folder_is_no_obstacle(tmp_path, monkeypatch):
    """The sockets of Chromium have short paths alone: its folder is made elsewhere, and removed."""
    long = tmp_path / ("x" * 90)
    long.mkdir()
    monkeypatch.setenv("TMPDIR", str(long))
    monkeypatch.setattr(tempfile, "tempdir", None)
    with Browser() as chromium:
        folder = chromium._chromium.folder
        assert len(folder) <= 57 and chromium.page().evaluate("6 * 7") == 42
    assert not os.path.exists(folder) and not list(long.iterdir())


def test_no_place_for_the_profile_is_told(monkeypatch):
    """The folder that was tried, and what to set."""
    monkeypatch.setattr(program, "_SHORT_FOLDER", "/nowhere")
    monkeypatch.setattr(tempfile, "tempdir", "/" + "x" * 90)
    monkeypatch.setenv("SOFTHAND_CHROMIUM", sys.executable)
    with pytest.raises(BrowserError, match=r"/nowhere: cannot make a folder.*TMPDIR.*at most 30 characters"), Browser():
        pass


def test_what_ends_at_once_is_told(tmp_path, monkeypatch):
    """A program that is no Chromium: its last words are in the message, and no folder stays."""
    broken = tmp_path / "chromium"
    broken.write_text("#!/bin/sh\necho first\necho no display 1>&2\nexit 1\n")
    broken.chmod(0o755)
    (tmp_path / "t").mkdir()
    monkeypatch.setenv("SOFTHAND_CHROMIUM", str(broken))
    monkeypatch.setattr(tempfile, "tempdir", "/" + "x" * 90)
    monkeypatch.setattr(program, "_SHORT_FOLDER", str(tmp_path / "t"))
    with pytest.raises(BrowserError, match=r"ended .* no display"), Browser():
        pass
    assert not list((tmp_path / "t").iterdir())


def test_a_missing_chromium_is_told(monkeypatch):
    """Which package is missing, and how else to name it."""
    monkeypatch.delenv("SOFTHAND_CHROMIUM", raising=False)
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(program, "_APPLICATION", Path("/nowhere"))
    with pytest.raises(BrowserError, match=r"apt install chromium.*SOFTHAND_CHROMIUM"):
        find_chromium()


def test_a_wrong_path_of_chromium_is_told(monkeypatch):
    """What was asked for is named; nothing else is taken in its place."""
    monkeypatch.setenv("SOFTHAND_CHROMIUM", "/nowhere/chromium")
    with pytest.raises(BrowserError, match="SOFTHAND_CHROMIUM: '/nowhere/chromium' is no program"):
        find_chromium()
