"""What strangers hand over, and where commands are run: one error of thing, value and remedy, soon."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numba
import numpy as np
import pytest
from commands import run_command
from test_recording import recording

import softhand.laws.first_call
from softhand.closed_loop import lyapunov as lyapunov_module
from softhand.errors import LawError, ModelError, RecordingError, ScenarioError, SofthandError
from softhand.files import read_regular
from softhand.laws.law import Law, compile_law
from softhand.model.shapes.mesh import as_polyhedron
from softhand.model.shapes.mesh_file import MOST_TRIANGLES, Mesh, read_mesh
from softhand.model.shapes.shape import fibonacci_sphere
from softhand.recording.recording import Recording
from softhand.recording.sound import require_sound
from softhand.scenario.file import find_scenario
from softhand.scenario.scenario import load_scenario
from softhand.viewer.live.pace import checked_speed

TARGET_A = find_scenario("target-a").read_text()


# ---------------------------------------------------------------------------------------- TOML


def refusal_of_text(text: str, folder: Path) -> str:
    (folder / "my.toml").write_text(text)
    with pytest.raises(ScenarioError) as caught:
        load_scenario(folder / "my.toml")
    return str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (".".join("a" * 5000) + " = 1\n" + TARGET_A, "a key of more than 20 parts"),
        (f"{TARGET_A}\n[{'.'.join('a' * 5000)}]\n", "a key of more than 20 parts"),
        ("x = " + "9" * 5000 + "\n" + TARGET_A, "a whole number of thousands of digits"),
        ("x = " + "[" * 5000 + "\n" + TARGET_A, "nested too deeply"),
        ("k" * 100_000 + " = 1\n" + TARGET_A, "kkk...: unknown key"),
        ("x = 0x" + "f" * 5000 + "\n" + TARGET_A, "with value a whole number of 6021 digits"),
    ],
)
def test_a_scenario_that_would_fill_the_memory_is_refused(text: str, words: str, tmp_path: Path) -> None:
    """Deep keys, endless numbers and names: named, and not repeated at their length."""
    said = refusal_of_text(text, tmp_path)
    assert words in said and len(said) < 1000


def test_of_many_unknown_keys_the_first_are_told(tmp_path: Path) -> None:
    """Ten keys and a count, in place of megabytes."""
    said = refusal_of_text("".join(f"k{k} = 1\n" for k in range(20_000)) + TARGET_A, tmp_path)
    assert said.count("unknown key") == 10 and said.endswith("And 19990 more keys are wrong.")


def test_a_mass_of_thousands_of_digits_is_refused() -> None:
    """Also where it is a value that a scenario has."""
    with pytest.raises(ScenarioError, match=r"object\.mass: got a whole number of 5001 digits"):
        load_scenario("target-a", {"object.mass": 10**5000})


def test_a_file_of_proc_is_empty_and_a_pipe_is_not_opened(tmp_path: Path) -> None:
    """What the kernel makes up is not read, though it calls it a regular file."""
    os.mkfifo(tmp_path / "pipe")
    assert read_regular(Path("/proc/self/status"), 1000) == b""
    for file, words in ((tmp_path / "pipe", "a pipe"), (tmp_path, "a directory"), (tmp_path / "a\0", "null character")):
        with pytest.raises(ValueError, match=words):
            read_regular(file, 1000)


# ---------------------------------------------------------------------------------------- meshes


def test_triangles_are_counted_before_they_are_read(tmp_path: Path) -> None:
    """Two million triangles, as OBJ and as STL: refused at once, with the count."""
    (tmp_path / "a.obj").write_bytes(b"v 0 0 0\nv 1 0 0\nv 0 1 0\n" + b"f 1 2 3\n" * 2_000_000)
    count = MOST_TRIANGLES + 1
    (tmp_path / "a.stl").write_bytes(bytes(80) + count.to_bytes(4, "little") + bytes(50 * count))
    (tmp_path / "b.stl").write_bytes(b"solid a\n" + b"vertex 0 0 0\n" * 3 * count)
    for name in ("a.obj", "a.stl", "b.stl"):
        start = time.process_time()
        with pytest.raises(ModelError, match=rf"it has \d+ triangles, at most {MOST_TRIANGLES} are read; simplify it"):
            read_mesh(tmp_path / name, np.ones(3))
        assert time.process_time() - start < 2.0


def test_faces_are_counted_while_they_are_found() -> None:
    """A ball of 60,000 triangles does not take minutes to be refused."""
    vertices = 0.03 * fibonacci_sphere(30_000)
    start = time.process_time()
    with pytest.raises(ModelError, match=r"more than 5000 faces, .* simplify it"):
        as_polyhedron(Mesh(vertices, np.zeros((0, 3), dtype=int), "ball.obj"), np.eye(3), np.zeros(3), True)
    assert time.process_time() - start < 8.0


# ---------------------------------------------------------------------------------------- recordings


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A recording to be altered."""
    recording().save(tmp_path / "run.nc")
    return tmp_path / "run.nc"


def refusal_of_recording(file: Path) -> str:
    with pytest.raises(RecordingError) as caught:
        Recording.load(file)
    return str(caught.value)


def test_labels_that_point_to_one_long_text_are_not_all_read(file: Path) -> None:
    """A text of 1 MB at each of many labels would fill the memory; so would very many labels."""
    with h5py.File(file, "r+") as hdf:
        del hdf["joint"]
        hdf["joint"] = np.array(["A" * 1_000_000] * 9, h5py.string_dtype())
    assert "labels 'joint' are longer than 100000 letters" in refusal_of_recording(file)
    with h5py.File(file, "r+") as hdf:
        del hdf["joint"]
        hdf["joint"] = np.array(["b"] * 60_000, h5py.string_dtype())
    assert "60000 labels 'joint', more than 1000" in refusal_of_recording(file)


def test_what_is_claimed_must_be_stored(file: Path) -> None:
    """A large attribute does not make an empty array of gigabytes believable."""
    with h5py.File(file, "r+") as hdf:
        del hdf["time"]
        hdf.create_dataset("time", (10**9,), "f8", chunks=(2**20,), compression="gzip")
        hdf["padding"] = np.zeros(1_000_000)
    assert "cannot hold" in refusal_of_recording(file)
    with h5py.File(file, "r+") as hdf:
        del hdf["time"]
        hdf.create_dataset("time", (7,), "f8", chunks=(10**9,), maxshape=(None,), compression="gzip")
    assert "packed in pieces of (1000000000,)" in refusal_of_recording(file)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("scenario", 5.0, "'scenario' is 5.0, not a text"),
        ("complete", "yes", "'complete' is 'yes', not a number"),
        ("stop_time", np.nan, "'stop_time' is nan, not a number"),
        ("reason", ["a", "b"], "'reason' is object of shape (2,), not one value"),
        ("hand_urdf", np.arange(3), "'hand_urdf' is int64 of shape (3,), not one value"),
        ("scenario", None, "'scenario' is missing"),
    ],
)
def test_attributes_of_another_type_are_named(name: str, value: Any, words: str, file: Path) -> None:
    """With what they are and what they must be."""
    with h5py.File(file, "r+") as hdf:
        del hdf.attrs[name]
        if value is not None:
            hdf.attrs[name] = value
    assert words in refusal_of_recording(file)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda hdf: hdf["time"].__setitem__(3, np.nan), "time is NaN in 1 sample, first at sample 3"),
        (lambda hdf: hdf["time"].__setitem__(3, 0.0), "time does not rise at sample 3"),
        (lambda hdf: hdf["joint_position"].__setitem__(2, 1e308), "joint_position is 1e+308 in 1 sample, first at"),
        (lambda hdf: hdf["joint_torque"].__setitem__(2, -np.inf), "joint_torque is infinity in 1 sample"),
    ],
)
def test_numbers_that_cannot_be_drawn_are_refused(change: Callable[[Any], None], words: str, file: Path) -> None:
    """By `check` and by what draws and sums alike."""
    with h5py.File(file, "r+") as hdf:
        change(hdf)
    for command in ("check", "plot", "energy", "report", "lyapunov"):
        ended = run_command(command, str(file), folder=file.parent)
        assert ended.returncode == 1 and words in ended.stderr and "Compute the run anew" in ended.stderr, command


def test_a_recording_without_samples_is_not_sound() -> None:
    """There is nothing to draw."""
    empty = Recording({"time": np.zeros(0)}, {}, "", "0.1.0", True, "", 0.0)
    with pytest.raises(RecordingError, match=r"run\.nc: it has no samples"):
        require_sound(empty, "run.nc")


def test_a_long_run_is_thinned(monkeypatch: pytest.MonkeyPatch) -> None:
    """V is evaluated at so many samples at most, at equal distances, and the table says so."""
    from softhand import build, load_scenario

    run = build(load_scenario("target-a", {"duration": 0.02, "reference.duration": 0.02})).run()
    monkeypatch.setattr(lyapunov_module, "_MOST", 10)
    found = lyapunov_module.lyapunov(run)
    assert np.array_equal(found.time, run.time[::3]) and found.recorded == 21
    assert ("samples", "7 of 21, at equal distances") in found.rows()


# ---------------------------------------------------------------------------------------- laws


@numba.njit
def endless(x: float) -> float:
    """What machine code would never come back from."""
    while x < 1.0:
        x = x * 1.0
    return x


class Endless(Law):
    """Calls a compiled function that does not end."""

    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius):
        return endless(dr), dtheta, dphi, dpsi


class EndlessWhenDeep(Law):
    """Ends at a small deformation only."""

    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius):
        while dr > 0.1 * radius:
            dr = dr * 1.0
        return 1e3 * dr, dtheta, dphi, dpsi


@pytest.mark.parametrize("law", [Endless, EndlessWhenDeep])
def test_a_law_without_end_is_given_up(law: type[Law], monkeypatch: pytest.MonkeyPatch) -> None:
    """Before it is compiled, for machine code cannot be stopped."""
    monkeypatch.setattr(softhand.laws.first_call, "TIME_LIMIT", 0.3)
    with pytest.raises(LawError, match=f"law '{law.__name__}': a formula has not ended after 0.3 s"):
        compile_law(law(radius=0.01))


# ---------------------------------------------------------------------------------------- options


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        *((("identify", "--example", "--friction", value), "friction: got") for value in ("nan", "-5", "inf", "1e9")),
        *((("identify", "--example", "--level", value), "level: got") for value in ("nan", "1", "-1")),
        *((("simulate", "target-a", "--duration", value), "duration: got") for value in ("nan", "-1", "inf", "1e300")),
        *((("workspace", "target-a", "--phi-min", value), "--phi-min") for value in ("nan", "-5", "inf")),
        (("compare", "target-a", "--jobs", "100000"), "--jobs"),
        (("grasp", "target-a", "--count", "0"), "--count"),
    ],
)
def test_numbers_out_of_range_are_refused_by_name(arguments: tuple[str, ...], words: str, tmp_path: Path) -> None:
    """NaN and infinities too."""
    ended = run_command(*arguments, folder=tmp_path)
    assert ended.returncode in (1, 2) and words in ended.stderr


@pytest.mark.parametrize("speed", [float("nan"), 0.0, -1.0, 1e-300, 1e300])
def test_a_speed_out_of_range_is_refused(speed: float) -> None:
    """A replay that would last for ages is as useless as one that is over at once."""
    with pytest.raises(SofthandError, match=r"speed: got .* from 0\.0001 to 10000"):
        checked_speed(speed)


# ---------------------------------------------------------------------------------------- surroundings


def softhand_command(line: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """`softhand` in a shell, as `$SOFTHAND` in a line."""
    command = f"{sys.executable} -c 'from softhand.commands.main import main; main()'"
    surroundings = {**os.environ, "SOFTHAND": command}
    return subprocess.run(["sh", "-c", line.replace("$SOFTHAND", command)], cwd=folder, env=surroundings, text=True,
                          capture_output=True, timeout=60)  # fmt: skip


@pytest.mark.parametrize(
    ("line", "words", "code"),
    [
        ("mkdir gone; cd gone; rmdir ../gone; $SOFTHAND list laws", "current folder cannot be used", 1),
        ("LC_ALL=C PYTHONIOENCODING=ascii $SOFTHAND list laws", "", 0),
        ("$SOFTHAND list laws >/dev/full", "No space left on device", 1),
        ("$SOFTHAND hands >/dev/full", "No space left on device", 1),
        ("$SOFTHAND list nothing 2>&-", "", 1),
        ("$SOFTHAND list nothing 2>/dev/full", "", 1),
        ("$SOFTHAND list laws >&-", "", 0),
        ("$SOFTHAND list | head -1", "", 0),
        ("ulimit -v 500000; $SOFTHAND list laws", "memory is limited to 512 MB (ulimit -v); softhand needs 1000 MB", 1),
    ],
)
def test_streams_folders_and_memory_of_any_kind(line: str, words: str, code: int, tmp_path: Path) -> None:
    """The exit code says whether it went well; no traceback in any case."""
    ended = softhand_command(line, tmp_path)
    assert ended.returncode == code and words in ended.stderr, ended
    assert "Traceback" not in ended.stderr and "Exception ignored" not in ended.stderr
