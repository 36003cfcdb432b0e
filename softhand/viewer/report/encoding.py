"""Pictures into a film: GIF by Pillow, MP4 by ffmpeg."""

from __future__ import annotations

import io
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from PIL import Image

from softhand.errors import SofthandError

Encode = Callable[[Iterator[bytes], float], bytes]
"""From pictures as PNG and their rate [1/s] to the bytes of a film."""

_GIF_CLOCK = 100  # a GIF counts time in hundredths of a second


def encode_gif(pictures: Iterator[bytes], fps: float) -> bytes:
    """One palette for all pictures, so that what stands still does not flicker.

    It covers all hues: one by areas has greys alone, and torsion would look like slip.
    """
    frames: list[Image.Image] = []
    palette = None
    for picture in pictures:
        image = Image.open(io.BytesIO(picture)).convert("RGB")
        palette = palette or image.quantize(255, Image.Quantize.MAXCOVERAGE)
        frames.append(image.quantize(palette=palette, dither=Image.Dither.NONE))
    ends = np.rint(_GIF_CLOCK * np.arange(len(frames) + 1) / fps)
    durations = (1000 // _GIF_CLOCK * np.diff(ends)).astype(int).tolist()
    buffer = io.BytesIO()
    frames[0].save(buffer, "GIF", save_all=True, append_images=frames[1:], duration=durations, loop=0)
    return buffer.getvalue()


def mp4_encoder(ffmpeg: str) -> Encode:
    """An encoder that hands the pictures to a program.

    Raises:
        SofthandError: when it is called, if the program cannot make the film.
    """

    def encode(pictures: Iterator[bytes], fps: float) -> bytes:
        with tempfile.TemporaryDirectory(prefix="softhand-film-") as folder:
            film, log = Path(folder, "film.mp4"), Path(folder, "log")
            command = [ffmpeg, "-loglevel", "error", "-f", "image2pipe", "-framerate", f"{fps:g}", "-c:v", "png"]
            command += ["-i", "-", "-pix_fmt", "yuv420p", "-movflags", "+faststart", str(film)]
            with log.open("wb") as complaints:  # in a session of its own, so that Ctrl-C is ours alone
                process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=complaints, start_new_session=True)
            try:
                _feed(process, pictures)
            finally:
                process.kill()
                process.wait()
            if process.returncode or not film.is_file():
                said = log.read_text(errors="replace").strip().splitlines()
                raise SofthandError(
                    f"ffmpeg ({ffmpeg}) cannot make the film: {said[-1] if said else 'it ended early'}."
                )
            return film.read_bytes()

    return encode


def _feed(process: subprocess.Popen[bytes], pictures: Iterator[bytes]) -> None:
    """Hand over all pictures and wait; a process that has ended is judged by its caller."""
    assert process.stdin is not None
    try:
        for picture in pictures:
            process.stdin.write(picture)
        process.stdin.close()
        process.wait()
    except BrokenPipeError:
        process.wait()


def find_ffmpeg() -> str:
    """Path of the ffmpeg of the system, else of the package imageio-ffmpeg.

    Raises:
        SofthandError: there is none.
    """
    found = shutil.which("ffmpeg")
    if found is None and find_spec("imageio_ffmpeg") is not None:
        from imageio_ffmpeg import get_ffmpeg_exe

        found = str(get_ffmpeg_exe())
    if found is None:
        raise SofthandError(
            "An .mp4 needs ffmpeg: install it, for instance with `apt install ffmpeg`, or install softhand with its "
            "extra `film` (pip install 'softhand[film]'); a .gif needs neither."
        )
    return found
