"""Films: what is asked for is what is shown, for how long; and nothing is left of one that was broken off."""

from __future__ import annotations

import dataclasses
import io
import os
import re
import signal
import subprocess
import sys
import tempfile
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from chromium import living, needs_chromium, wait_until
from commands import run_command
from PIL import Image

from softhand import BrowserError, RecordingError, SofthandError, load_scenario, simulate, write_film
from softhand.viewer.report import encoding, film
from softhand.viewer.scene import palette

SMALL = (320, 240)


@pytest.fixture(scope="module")
def run():
    return simulate(load_scenario("target-a", {"duration": 0.5}))


@pytest.fixture(scope="module")
def filmed(run, browser, tmp_path_factory) -> Path:
    """The run as a GIF of 8 pictures a second, in a folder of its own."""
    file = tmp_path_factory.mktemp("film") / "run.gif"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(film, "Browser", lambda: nullcontext(browser))
        write_film(run, file, fps=8, size=SMALL)
    return file


class Screen:
    """Stands for Chromium and its page: pictures of noise at once; `times` are those asked for."""

    def __init__(self) -> None:
        self.times: list[float] = []

    def __enter__(self) -> Screen:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def page(self, width: int, height: int) -> Screen:
        self.pixels = np.random.default_rng(0).integers(0, 255, (height, width, 3), np.uint8)
        return self

    def open(self, url: str) -> None:
        pass

    def evaluate(self, script: str) -> None:
        if found := re.match(r"softhand\.setTime\((.*)\)", script):
            self.times.append(float(found[1]))

    def screenshot(self) -> bytes:
        return png(self.pixels)


@pytest.fixture
def screen(monkeypatch) -> Screen:
    shown = Screen()
    monkeypatch.setattr(film, "Browser", lambda: shown)
    monkeypatch.setattr(film, "find_chromium", lambda: "")
    return shown


def png(pixels: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "PNG")
    return buffer.getvalue()


def pictures(content: bytes | Path) -> list[tuple[np.ndarray, int]]:
    """Pixels and duration [ms] of each picture of a GIF."""
    image = Image.open(content if isinstance(content, Path) else io.BytesIO(content))
    found = []
    for k in range(image.n_frames):
        image.seek(k)
        found.append((np.asarray(image.convert("RGB")).astype(int), image.info["duration"]))
    return found


@needs_chromium
def test_a_gif_shows_the_run(filmed):
    """0.5 s at 8 pictures a second: 5 pictures that move, and nothing else in the folder."""
    shown = pictures(filmed)
    assert len(shown) == 5 and shown[0][0].shape == (240, 320, 3)
    assert len(np.unique(shown[0][0].reshape(-1, 3), axis=0)) > 50
    assert np.mean(np.abs(shown[-1][0] - shown[0][0]).max(axis=2) > 24) > 0.01
    assert [file.name for file in filmed.parent.iterdir()] == ["run.gif"]


@needs_chromium
def test_no_slip_falls_between_two_pictures(run, filmed, browser, tmp_path, monkeypatch):
    """One of 1 ms changes the next picture of a film of 8 a second, and no other."""
    slips = np.zeros_like(run.is_slipping)
    slips[:, 0] = np.arange(len(run)) == 130
    slipped = dataclasses.replace(run, variables={**run.variables, "is_slipping": slips})
    monkeypatch.setattr(film, "Browser", lambda: nullcontext(browser))
    write_film(slipped, tmp_path / "slip.gif", 8, SMALL)
    pairs = zip(pictures(filmed), pictures(tmp_path / "slip.gif"), strict=True)
    changed = [np.mean(np.abs(one - two).max(axis=2) > 60) > 1e-3 for (one, _), (two, _) in pairs]
    assert changed == [False, False, True, False, False]


@needs_chromium
def test_several_runs_are_side_by_side(run, browser, tmp_path, monkeypatch):
    """Left and right show each its own run, for as long as the longer one takes."""
    variables = {name: array[:1] for name, array in run.variables.items()}
    still = dataclasses.replace(run, variables=variables, stop_time=0.0)
    monkeypatch.setattr(film, "Browser", lambda: nullcontext(browser))
    write_film([run, still], tmp_path / "both.gif", fps=4, size=SMALL)
    shown = [picture for picture, _ in pictures(tmp_path / "both.gif")]
    half = SMALL[0] // 2
    moved = np.abs(shown[-1] - shown[0]).max(axis=2) > 24
    body = moved[SMALL[1] // 4 : 3 * SMALL[1] // 4]
    assert len(shown) == 3 and body[:, :half].mean() > 2e-3 and body[:, half:].mean() < 1e-3


def test_slow_motion_takes_longer(run, screen, tmp_path):
    """A quarter of the speed: four times the pictures, but for the last."""
    told = []
    write_film(run, tmp_path / "run.gif", fps=4, size=SMALL, speed=0.25, progress=told.append)
    assert screen.times == pytest.approx(np.arange(9) / 16)
    assert sum(duration for _, duration in pictures(tmp_path / "run.gif")) == 9 * 250
    assert told == sorted(told) and told[0] < 0.1
    assert told[-9:] == [pytest.approx(0.1 + 0.1 * (k + 1)) for k in range(9)]


def test_an_mp4_has_the_size_and_length_asked_for(run, screen, tmp_path):
    """ffmpeg reads back the size, the rate and the number of pictures."""
    try:
        ffmpeg = encoding.find_ffmpeg()
    except SofthandError:
        pytest.skip("ffmpeg is not installed")
    write_film(run, tmp_path / "run.mp4", fps=10, size=SMALL)
    read = subprocess.run(
        [ffmpeg, "-i", tmp_path / "run.mp4", "-f", "null", "-"], capture_output=True, text=True, check=True
    ).stderr
    assert "320x240" in read and "10 fps" in read and "frame=    6" in read


@needs_chromium
def test_interrupt_leaves_neither_file_nor_chromium(run, tmp_path):
    """Ctrl-C in a film: exit code 130, no half file, no temporary folder, no process."""
    brief = {name: array[:21] for name, array in run.variables.items()}
    dataclasses.replace(run, variables=brief).save(tmp_path / "run.nc")
    folder = Path(tempfile.mkdtemp(dir="/tmp"))  # short: a longer one is not taken for Chromium
    process = subprocess.Popen(
        [Path(sys.executable).with_name("softhand"), "film", "run.nc", "--out", "run.gif", "--speed", "2e-4",
         "--fps", "10"],
        cwd=tmp_path, env={**os.environ, "TMPDIR": str(folder)}, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # ignored where tests run in the background
    )  # fmt: skip

    def groups():
        """Of the children that have started processes of their own."""
        lines = subprocess.run(["ps", "-e", "-o", "ppid=", "-o", "pid="], capture_output=True, text=True, check=True)
        children = [pid for parent, pid in map(str.split, lines.stdout.splitlines()) if parent == str(process.pid)]
        return [child for child in children if len(living(child)) > 2]

    assert wait_until(groups), process.communicate(timeout=60)
    chromium = groups()
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130 and "interrupted" in errors and "Traceback" not in errors
    assert chromium and wait_until(lambda: not any(map(living, chromium)))
    assert [file.name for file in tmp_path.iterdir()] == ["run.nc"]
    folder.rmdir()


def test_an_ffmpeg_that_fails_is_told(run, screen, tmp_path, monkeypatch):
    """Its last words are in the message; no file is left."""
    broken = tmp_path / "bin" / "ffmpeg"
    broken.parent.mkdir()
    broken.write_text("#!/bin/sh\necho no such encoder 1>&2\nexit 1\n")
    broken.chmod(0o755)
    monkeypatch.setenv("PATH", str(broken.parent), prepend=os.pathsep)
    with pytest.raises(SofthandError, match="no such encoder"):
        write_film(run, tmp_path / "run.mp4", fps=10, size=SMALL)
    assert not list(tmp_path.glob("run*"))


def test_a_gif_keeps_the_time():
    """Thirty pictures a second last a second in all, though a GIF counts hundredths."""

    noise = (png(np.random.default_rng(k).integers(0, 255, (8, 8, 3), np.uint8)) for k in range(30))
    durations = [duration for _, duration in pictures(encoding.encode_gif(noise, 30.0))]
    assert sum(durations) == 1000 and set(durations) == {30, 40}


def test_a_gif_keeps_small_coloured_things():
    """Arrows and gauges cover little of a picture, and their hues mean something."""
    grey = np.add.outer(np.linspace(60, 250, 240), np.linspace(-30, 30, 320))[:, :, None]
    noise = np.random.default_rng(0).normal(0.0, 6.0, (240, 320, 3))
    pixels = np.clip(grey + noise, 0, 255).astype(np.uint8)
    colours = [palette.use_colour(use) for use in np.linspace(0.0, 1.0, 9)] + [palette.TORSION, palette.SLIPPING]
    patches = np.rint(255 * np.array(colours)).astype(np.uint8)
    for k, patch in enumerate(patches):
        pixels[20:30, 20 + 20 * k : 24 + 20 * k] = patch  # 40 of 76800 pixels
    ((shown, _),) = pictures(encoding.encode_gif(iter([png(pixels)]), 10.0))
    found = np.array([shown[25, 22 + 20 * k] for k in range(len(patches))])
    assert np.abs(found - patches.astype(int)).max() < 20


def test_the_last_sample_is_filmed(run):
    """0.5 s at 8 a second ends exactly; at 7 a second one more picture shows the end."""
    for fps, count in ((8.0, 5), (7.0, 5)):
        times = [time for time, _ in film._times([run], fps, 1.0)]
        assert len(times) == count and times[-1] == run.time[-1] and times[1] == pytest.approx(1.0 / fps)


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("run.avi", {}, r"unknown ending '\.avi'; choose \.mp4 or \.gif"),
        ("run", {}, "has no ending"),
        ("run.gif", {"fps": 60.0}, "fps: 60 is out of range.*1 to 50"),
        ("run.gif", {"fps": float("nan")}, "fps: nan"),
        ("run.gif", {"speed": 0.0}, "speed: 0 is out of range"),
        ("run.gif", {"size": (641, 480)}, "size: 641x480.*even"),
    ],
)
def test_what_cannot_be_filmed_is_told_first(run, tmp_path, name, options, words):
    """The value and what is allowed, before any work."""
    with pytest.raises(SofthandError, match=words) as caught:
        write_film(run, tmp_path / name, **options)
    assert hasattr(caught.value, "value")


def test_a_missing_folder_is_told_first(run, tmp_path):
    """Before minutes of work, not after."""
    with pytest.raises(RecordingError, match="choose a folder that exists"):
        write_film(run, tmp_path / "nowhere" / "run.gif")


def test_a_missing_chromium_is_told_first(run, tmp_path, monkeypatch):
    """How to name it, before the pictures are prepared."""
    told = []
    monkeypatch.setenv("SOFTHAND_CHROMIUM", "/nowhere/chromium")
    with pytest.raises(BrowserError, match="SOFTHAND_CHROMIUM"):
        write_film(run, tmp_path / "run.gif", progress=told.append)
    assert told == []


def test_a_missing_ffmpeg_gives_both_remedies(run, tmp_path, monkeypatch):
    """The package of the system, and the extra of softhand."""
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(encoding, "find_spec", lambda name: None)
    with pytest.raises(SofthandError, match=r"apt install ffmpeg.*softhand\[film\]"):
        write_film(run, tmp_path / "run.mp4")


@pytest.mark.parametrize("size", ["720", "1280x", "axb", "1280x720x3", "-4x4"])
def test_a_wrong_size_is_one_line(tmp_path, size):
    """`softhand film --size` says how a size is written."""
    result = run_command("film", "run.nc", "--out", "run.gif", f"--size={size}", folder=tmp_path)
    assert result.returncode == 1 and "1280x720" in result.stderr and "Traceback" not in result.stderr
