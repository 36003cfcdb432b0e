"""What is recorded: some variables, some samples; and runs that go to disk as they are made."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from commands import run_command
from numpy.testing import assert_array_equal

from softhand import Recording, ScenarioError, build, load_scenario, simulate
from softhand.recording import recording as files
from softhand.simulation import growing
from softhand.simulation.growing import Growing


def test_some_samples_of_some_variables() -> None:
    """Those of the whole run; the last sample of a run is always there."""
    whole = simulate("target-a", duration=0.025)
    some = simulate("target-a", duration=0.025, overrides={
        "record.every": 0.01, "record.variables": ["object_position", "deformation"],
    })  # fmt: skip
    assert set(some.variables) == {"time", "object_position", "deformation"}
    chosen = [0, 10, 20, 25]
    for name in some.variables:
        assert_array_equal(some[name], whole[name][chosen])


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"record.every": 0.0015}, "record.every"),
        ({"record.variables": ["object_positon"]}, "object_position"),
        ({"record.evry": 0.01}, "record.every"),
    ],
    ids=str,
)
def test_what_is_no_record_is_told(values: dict[str, object], told: str) -> None:
    """By key."""
    with pytest.raises(ScenarioError, match=told):
        load_scenario("target-a", values)


def test_a_long_run_lies_in_files(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """It is the same as one in memory, saved and read back too."""
    made = build("target-a", duration=1.2)
    expected = made.run()
    monkeypatch.setattr(growing, "IN_MEMORY", 10_000)
    monkeypatch.setattr(files, "_IN_MEMORY", 10_000)
    found = made.run()
    assert isinstance(found.object_position.base, np.memmap)
    found.save(tmp_path / "run.nc")
    for recording in (found, Recording.load(tmp_path / "run.nc")):
        assert recording.attributes["events"] == expected.attributes["events"]
        for name, array in expected.variables.items():
            assert_array_equal(recording[name], array, err_msg=name)


def test_where_the_disk_is_full_rows_stay_in_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is lost, and nothing is there twice."""
    monkeypatch.setattr(growing, "IN_MEMORY", 100)
    rows = {"a": np.arange(40.0).reshape(20, 2), "b": np.arange(20, dtype=np.int8)}
    kept, written, make = Growing(), [], tempfile.TemporaryFile

    class Full:
        """A file on a disk that is full after some bytes."""

        def __init__(self) -> None:
            self._file = make()

        def write(self, data: bytes) -> int:
            written.append(len(data))
            if sum(written) > 600:
                self._file.write(data[: len(data) // 2])
                raise OSError(28, "No space left on device")
            return self._file.write(data)

        def __getattr__(self, name: str) -> object:
            return getattr(self._file, name)

    monkeypatch.setattr(growing.tempfile, "TemporaryFile", lambda **_: Full())
    for _ in range(3):
        kept.add(rows)
    found = kept.arrays()
    assert sum(written) > 600
    assert_array_equal(found["a"], np.concatenate([rows["a"]] * 3))
    assert_array_equal(found["b"], np.concatenate([rows["b"]] * 3))


def test_the_command_says_what_it_wrote(tmp_path: Path) -> None:
    """With some variables alone there is neither summary nor figure."""
    done = run_command("simulate", "--set", "duration=0.02", "--set", 'record.variables=["object_position"]',
                       "--out", "run", folder=tmp_path)  # fmt: skip
    assert "run.nc" in done.stdout and "friction" not in done.stdout
    assert set(Recording.load(tmp_path / "run" / "run.nc").variables) == {"time", "object_position"}
    assert not (tmp_path / "run" / "figure.png").exists()
