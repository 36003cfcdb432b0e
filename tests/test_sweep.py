"""Sweeps: nothing lost, nothing doubled, whatever ends them, and the same numbers to the last bit in any way."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import run_command

import softhand
from softhand import Sweep, load_sweep, rollout, sweep
from softhand.errors import StudyError, SweepStopped
from softhand.recording import whole_file
from softhand.scenario.file import resolve_path
from softhand.studies.keys import values_at
from softhand.studies.samples import seed_keys
from softhand.studies.sweeps import store as store_module
from softhand.studies.sweeps import sweep as sweep_module
from softhand.studies.sweeps.store import find_store

STUDY = """\
scenario = "target-a"
description = "Short runs"

[set]
duration = 0.04

[vary]
mass = { range = [0.1, 0.3] }
K_v = { range = [0.003, 0.006] }
"object.position[0]" = { normal = [0.0, 0.001] }

[sample]
method = "latin-hypercube"
count = 14
seed = 5

[outcomes]
error = "position_error"
use = { variable = "limit_surface_use", over = "max" }

[success]
error = { below = 0.0078 }
"""


def write(folder: Path, text: str = STUDY) -> Path:
    """The study as a file."""
    file = folder / "study.toml"
    file.write_text(text)
    return file


@pytest.fixture(scope="module")
def serial(tmp_path_factory: pytest.TempPathFactory) -> Sweep:
    """The study, one run after another in one thread."""
    folder = tmp_path_factory.mktemp("serial")
    return sweep(write(folder), folder / "out", threads=1, chunk=100)


def assert_same(one: Sweep, other: Sweep) -> None:
    """Equal to the last bit."""
    for name in one.numbers:
        assert one.numbers[name].tobytes() == other.numbers[name].tobytes()
    for key, column in one.values.items():
        assert column.tobytes() == other.values[key].tobytes()
    assert one.outcome.tolist() == other.outcome.tolist() and one.message.tolist() == other.message.tolist()
    assert one.success.tolist() == other.success.tolist() and one.stop_time.tolist() == other.stop_time.tolist()


def chunks_done(folder: Path) -> list[str]:
    """Lines of the manifest."""
    return sorted(file.name for file in (folder / "manifest").glob("*.json"))


def test_runs_are_those_of_rollout(serial: Sweep) -> None:
    """With the values that the samples have; success is within the limits."""
    base = softhand.load_scenario("target-a", {"duration": 0.04})
    table = base.model_dump(exclude_none=True)
    rows = [dict(zip(serial.values, row, strict=True)) for row in zip(*serial.values.values(), strict=True)]
    runs = rollout(base, [values_at(row.items(), table) for row in rows], variables=(
        "object_position", "object_position_desired", "limit_surface_use"), threads=1)  # fmt: skip
    assert [outcome.reason for outcome in runs.outcomes] == serial.outcome.tolist()
    assert np.array_equal(np.nanmax(runs.limit_surface_use, axis=(1, 2)), serial.numbers["use"])
    off = 1e3 * np.linalg.norm(runs.object_position - runs.object_position_desired, axis=2)
    assert np.allclose(np.sqrt(np.mean(off**2, axis=1)), serial.numbers["error"], rtol=1e-12)
    assert np.array_equal(serial.success, serial.numbers["error"] <= 0.0078) and 0 < serial.success.sum() < 14
    assert len(np.unique(serial.values["object.mass"])) == 14


def test_chunks_threads_and_order_change_no_bit(serial: Sweep, tmp_path: Path) -> None:
    """Nor does what a thread has run before."""
    assert_same(serial, sweep(write(tmp_path), tmp_path / "a", threads=2, chunk=3))
    told: list[tuple[int, int]] = []
    found = sweep(write(tmp_path), tmp_path / "b", threads=3, progress=lambda done, runs: told.append((done, runs)))
    assert_same(serial, found)
    assert (
        told[0] == (0, 14) and told[-1] == (14, 14) and [done for done, _ in told] == sorted(done for done, _ in told)
    )


def test_a_second_call_makes_no_run(serial: Sweep, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is there is read; a chunk whose files are not as they were written is made again, and it alone."""
    file, out = write(tmp_path), tmp_path / "out"
    sweep(file, out, chunk=4)
    made: list[int] = []
    run = sweep_module.Work.run
    monkeypatch.setattr(
        sweep_module.Work, "run", lambda self, chunk, stop: (made.append(chunk), run(self, chunk, stop))[1]
    )
    assert_same(serial, sweep(file, out))
    assert made == []
    (out / "runs.zarr/error/2").write_bytes(b"cut")
    (out / "runs.zarr/error/0.12.partial").write_bytes(b"left by a process that was killed")
    (out / "runs.zarr/object.mass/0").unlink()
    assert_same(serial, sweep(file, out))
    assert made == [2] and not list(out.rglob("*.partial"))


def test_a_full_disk_loses_nothing(serial: Sweep, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is written stays, the message says what to do, and the same call goes on."""
    file, out = write(tmp_path), tmp_path / "out"
    sweep(file, out / "elsewhere", chunk=2)
    written, real = [0], Path.write_bytes

    def write_bytes(path: Path, data: bytes) -> int:
        written[0] += 1
        if written[0] > 40:
            real(path, data[: len(data) // 2])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return real(path, data)

    monkeypatch.setattr(whole_file.Path, "write_bytes", write_bytes)
    with pytest.raises(SweepStopped, match="No space left on device; free some space") as caught:
        sweep(file, out, chunk=2, threads=2)
    monkeypatch.undo()
    assert caught.value.reason == "lost" and 0 < caught.value.done < 14
    assert caught.value.done == 2 * len(chunks_done(out)) and "same command goes on" in str(caught.value)
    assert not list(out.rglob("*.partial"))
    assert_same(serial, sweep(file, out))


LONG = STUDY.replace("duration = 0.04", "duration = 0.1").replace("count = 14", "count = 120")


def wait_for(out: Path, chunks: int, is_over: Callable[[], bool]) -> None:
    """Until so many are done."""
    for _ in range(10_000):
        if len(chunks_done(out)) >= chunks or is_over():
            return
        time.sleep(0.01)


@pytest.mark.slow
def test_a_killed_driver_loses_nothing(tmp_path: Path) -> None:
    """Gone on with, each run is there once, and as it would have been. Two at a time are refused."""
    file, out = write(tmp_path, LONG), tmp_path / "out"
    program = f"import softhand; softhand.sweep({str(file)!r}, {str(out)!r}, threads=1, chunk=1)"
    process = subprocess.Popen([sys.executable, "-c", program], cwd=Path(__file__).parent.parent)
    wait_for(out, 3, lambda: process.poll() is not None)
    with pytest.raises(StudyError, match=f"process {process.pid} on .* is at work in it"):
        sweep(file, out)
    process.kill()
    assert process.wait() == -signal.SIGKILL
    done = len(chunks_done(out))
    assert 3 <= done < 120
    told: list[int] = []
    found = sweep(file, out, progress=lambda count, runs: told.append(count))
    assert told[0] == done and told[-1] == 120
    assert_same(sweep(file, tmp_path / "whole", threads=1, chunk=120), found)


def test_ctrl_c_loses_nothing(tmp_path: Path) -> None:
    """The command says how to go on, and ends with 130; the same command does."""
    file, out, over = write(tmp_path, LONG), tmp_path / "out", threading.Event()

    def interrupt() -> None:
        wait_for(out, 3, over.is_set)
        if not over.is_set():
            os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell has jobs in the background ignore it
    thread.start()
    result = run_command("sweep", str(file), "--out", str(out), "--chunk", "1", folder=tmp_path)
    over.set()
    thread.join()
    signal.signal(signal.SIGINT, before)
    count = len(chunks_done(out))
    assert result.returncode == 130 and 3 <= count < 120
    assert f"interrupted: {count} of 120 runs are done" in result.stderr
    assert "the same command goes on" in result.stderr
    told: list[int] = []
    assert (sweep(file, out, progress=lambda done, runs: told.append(done)).outcome == "finished").all()
    assert told[0] == count and told[-1] == 120


def test_other_studies_and_versions_are_not_mixed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are told by what differs, and the store is left as it is."""
    short = STUDY.replace("count = 14", "count = 4")
    file, out = write(tmp_path, short), tmp_path / "out"
    sweep(file, out, chunk=2)
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file() and path.name != "lock"}
    for change, told in {
        ("seed = 5", "seed = 6"): "sample was",
        ("duration = 0.04", "duration = 0.05"): "set was",
        ("below = 0.0078", "below = 0.03"): "success was",
        ("[0.1, 0.3]", "[0.1, 0.4]"): "vary was",
    }.items():
        with pytest.raises(StudyError, match=f"another study: {told}.*not overwritten; choose another folder"):
            sweep(write(tmp_path, short.replace(*change)), out)
    with pytest.raises(StudyError, match=r"chunk: got 3, and the store .* has chunks of 2 runs"):
        sweep(write(tmp_path, short), out, chunk=3)
    sweep(write(tmp_path, short.replace("Short runs", "The same runs")), out)
    monkeypatch.setattr(sweep_module, "made_with", lambda: {**store_module.made_with(), "softhand": "99.0"})
    assert len(sweep(file, out)) == 4  # a store that is done is read
    assert all(path.read_bytes() == data for path, data in before.items())
    (out / "manifest/0000001.json").unlink()
    with pytest.raises(StudyError, match=r"1 of 2 chunks were made with softhand .* \(here 99.0\).* not mixed"):
        sweep(file, out)
    text = (out / "runs.zarr/.zmetadata").read_text()
    (out / "runs.zarr/.zmetadata").write_text(text.replace('"softhand_sweep": 1', '"softhand_sweep": 7'))
    with pytest.raises(StudyError, match="is a store of format 7, and format 1 is read here"):
        sweep(file, out)
    (out / "runs.zarr/.zmetadata").write_text(text[:100])
    with pytest.raises(StudyError, match="cannot be read"):
        sweep(file, out)


def test_a_changed_urdf_is_another_study(tmp_path: Path) -> None:
    """The files that a scenario names are part of it."""
    box = tmp_path / "box.urdf"
    box.write_bytes(resolve_path("package://softhand/urdf/box.urdf").read_bytes())
    text = STUDY.replace("count = 14", "count = 2").replace("[vary]", 'object.urdf = "box.urdf"\n[vary]')
    text = text.replace('object.urdf = "box.urdf"', f'object.urdf = "{box}"')
    sweep(write(tmp_path, text), tmp_path / "out")
    box.write_text(box.read_text() + "\n<!-- another one -->\n")
    with pytest.raises(StudyError, match="a file that it names, a URDF or a plugin, has changed"):
        sweep(write(tmp_path, text), tmp_path / "out")


def test_runs_that_cannot_be_and_repeats(tmp_path: Path) -> None:
    """They are told by name beside the others; noise differs between repeats, and with the seed alone."""
    study: dict[str, Any] = {
        "scenario": "target-a",
        "set": {"duration": 0.04, "sensing.object_position.noise": 1e-4},
        "vary": {"mass": {"grid": [0.2, 9.0]}, "stepper.step": {"grid": [0.001, 0.0004]}},
        "sample": {"repeats": 2},
        "keep": {"variables": ["measured_object_position", "contact_force"], "every": 0.02},
    }
    # 0.0004 s alone is no part of a control period: the check before the first run says so
    with pytest.raises(StudyError, match=r"vary.stepper.step: .*0.0004"):
        sweep(study, tmp_path / "none")
    study["vary"]["stepper.step"] = {"grid": [0.001, 0.0005]}
    found = sweep(study, tmp_path / "out", threads=1, chunk=3)
    assert found.outcome.tolist() == ["finished"] * 4 + ["grasp"] * 4
    assert all(found.message[4:]) and not any(found.message[:4])
    assert (
        np.isnan(found.numbers["position_error"][4:]).all() and np.isfinite(found.numbers["position_error"][:4]).all()
    )
    seen = found.kept["measured_object_position"]
    assert seen.shape == (8, 3, 3) and np.isnan(seen[4:]).all()
    assert not np.array_equal(seen[0], seen[1])  # another seed
    assert found.kept["contact_force"].shape == (8, 3, 3, 4)
    seeds = seed_keys(found.base)
    assert seeds == ["sensing.seed"] and found.scenario(0).sensing.seed != found.scenario(1).sensing.seed
    runs = rollout(found.scenario(1), [{}], variables=("measured_object_position",), every=0.02)
    assert np.array_equal(runs.measured_object_position[0], seen[1])
    assert set(found.worst(4)) == {0, 1, 2, 3} and set(found.worst(8)) == set(range(8))


def test_the_command_writes_what_repeats_the_worst(tmp_path: Path) -> None:
    """Figures, table and scenarios, by default below runs/; a scenario of the worst runs gives its numbers again."""
    write(tmp_path, STUDY.replace("count = 14", "count = 9"))
    result = run_command("sweep", "study.toml", "--worst", "2", folder=tmp_path)
    assert result.returncode == 0, result.stderr
    out = tmp_path / "runs/sweep-study"
    assert {file.name for file in out.iterdir()} == {
        "runs.zarr", "manifest", "lock", "worst", "runs.csv", "success.png", "map.png", "scatter.png",
        "sensitivity.png",
    }  # fmt: skip
    assert "with 95 % confidence" in result.stdout and "error [mm]" in result.stdout
    found = load_sweep(out)
    worst = found.worst(1)[0]
    assert found.numbers["error"][worst] == found.numbers["error"].max()
    recording = softhand.simulate(out / "worst/1.toml")
    use = float(np.nanmax(recording.limit_surface_use[::10]))
    assert use == pytest.approx(found.numbers["use"][worst], rel=1e-9)
    lines = (out / "runs.csv").read_text().splitlines()
    assert len(lines) == 10 and lines[0].startswith("run,object.mass,controller.K_v,object.position[0],outcome")
    assert float(lines[1 + worst].split(",")[-3]) == found.numbers["error"][worst]
    again = run_command("sweep", "study.toml", "--worst", "0", "--json", folder=tmp_path)
    assert again.returncode == 0 and "all 9 runs are there already" in again.stderr
    told = json.loads(again.stdout)
    assert told["runs"] == 9 and told["worst"] == [] and told["outcomes"]["error"]["unit"] == "mm"
    assert list((out / "worst").iterdir()) == []


def test_mistakes_of_the_command(tmp_path: Path) -> None:
    """One message each, and no traceback."""
    write(tmp_path, STUDY.replace("[0.1, 0.3]", "[0.3, 0.1]"))
    for arguments, told in {
        ("study.toml",): "study.toml, line 8: vary.mass.range: got [0.3, 0.1]: the range is empty",
        ("nothing.toml",): "Study file nothing.toml does not exist",
        (".",): "Study file . is a directory",
    }.items():
        result = run_command("sweep", *arguments, folder=tmp_path)
        assert result.returncode == 1 and told in result.stderr and "Traceback" not in result.stderr
    write(
        tmp_path,
        STUDY.replace('error = "position_error"', 'message = "position_error"').replace("error = {", "message = {"),
    )
    result = run_command("sweep", "study.toml", folder=tmp_path)
    assert "line 18: outcomes.message: this name is taken by the store" in result.stderr
    write(tmp_path)
    (tmp_path / "file").write_text("")
    result = run_command("sweep", "study.toml", "--out", "file", folder=tmp_path)
    assert result.returncode == 1 and "cannot make this folder" in result.stderr


def test_an_unfinished_store_is_read_as_far_as_it_is(tmp_path: Path) -> None:
    """What is missing is NaN, or said to be not run."""
    out = tmp_path / "out"
    sweep(write(tmp_path), out, chunk=5)
    for file in out.glob("runs.zarr/*/1"):
        file.unlink()
    found = load_sweep(out)
    assert found.outcome.tolist() == ["finished"] * 5 + ["not run"] * 5 + ["finished"] * 4
    assert np.array_equal(np.isnan(found.numbers["error"]), found.outcome == "not run")
    assert not found.success[5:10].any()
    assert find_store(tmp_path) is None
    with pytest.raises(StudyError, match="holds no sweep"):
        load_sweep(tmp_path)
