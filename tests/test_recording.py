"""Recordings: what they accept, how they are written, that nothing is lost on the way to the disk and back."""

from __future__ import annotations

import csv
import errno
import os
import pickle
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from softhand.errors import RecordingError
from softhand.recording.recording import Recording
from softhand.recording.variables import COMPONENTS, LABELLED_DIMS, VARIABLES
from softhand.simulation.recorder import Recorder

SAMPLES = 7
LABELS = {
    "joint": tuple(f"finger_{i}_joint_{j}" for i in (1, 2, 3) for j in (1, 2, 3)),
    "contact": ("finger_1_tip", "finger_2_tip", "finger_3_tip"),
    "pair": ("23", "13", "12"),
    "support": ("table corner 1", "table corner 2"),
    "velocity": ("finger_1_joint_1", "object x", "object rz"),
    "coupled_joint": ("finger_1_joint_4",),
    "taxel": ("1", "2", "3", "4", "5"),
    "element": ("1", "2", "3"),
}


def arrays(samples: int = SAMPLES) -> dict[str, Any]:
    """Every variable of the table, filled at random."""
    rng = np.random.default_rng(1)
    sizes = {"time": samples} | {dim: len(names) for dim, names in {**LABELS, **COMPONENTS}.items()}
    filled: dict[str, Any] = {
        name: rng.normal(size=[sizes[dim] for dim in entry.dims]) for name, entry in VARIABLES.items()
    }
    filled["time"] = np.arange(samples) * 1e-3
    filled["torque_limited"] = rng.integers(0, 2, filled["torque_limited"].shape).astype(np.int8)
    return filled


def recording(**changes: Any) -> Recording:
    """Return a complete recording of invented numbers, with fields replaced by `changes`."""
    fields: dict[str, Any] = {
        "variables": arrays(),
        "labels": LABELS,
        "scenario": 'duration = 2.0\nname = "target-a"\n',
        "version": "0.1.0",
        "complete": True,
        "reason": "",
        "stop_time": 0.1 + 0.2,
        "attributes": {"steps_per_second": 12345.678, "steps": 2000, "stepper": "midpoint"},
    }
    return Recording(**{**fields, **changes})


def disk_is_full(path: Path, content: bytes) -> int:
    """Stand in for Path.write_bytes: half of the content, then no space."""
    with open(path, "wb") as file:
        file.write(content[: len(content) // 2])
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give a saved recording, written once."""
    path = tmp_path_factory.mktemp("saved") / "run.nc"
    recording().save(path)
    return path


@pytest.fixture(scope="module")
def loaded(saved: Path) -> Recording:
    """Give the saved recording, loaded again."""
    return Recording.load(saved)


@pytest.fixture(scope="module")
def dataset(saved: Path) -> Iterator[xr.Dataset]:
    """Give the saved recording as xarray sees it."""
    with xr.open_dataset(saved, engine="h5netcdf") as data:
        yield data


# The table


@pytest.mark.parametrize("name", VARIABLES)
def test_every_dimension_of_the_table_has_labels(name: str) -> None:
    """Each dimension after time is labelled, by the module or by the recording."""
    assert set(VARIABLES[name].dims[1:]) <= {*COMPONENTS, *LABELLED_DIMS}


@pytest.mark.parametrize("name", VARIABLES)
def test_units_are_one_or_one_a_component(name: str) -> None:
    """A list of units has exactly one unit for each component of the last dimension."""
    entry = VARIABLES[name]
    count = len(entry.units.split(", "))
    assert count == 1 or count == len(COMPONENTS[entry.dims[-1]])


# Access


def test_an_array_is_found_by_key_and_by_attribute() -> None:
    """Key and attribute give the same array."""
    run = recording()
    assert run["deformation"] is run.deformation


def test_a_mistyped_key_names_the_nearest() -> None:
    """KeyError of a near miss says what was meant."""
    with pytest.raises(KeyError, match="did you mean 'deformation'"):
        recording()["deformatoin"]


def test_a_mistyped_attribute_names_the_nearest() -> None:
    """AttributeError of a near miss says what was meant."""
    with pytest.raises(AttributeError, match="did you mean 'contact_force'"):
        _ = recording().contact_forces


def test_a_key_like_none_lists_all() -> None:
    """KeyError of a name that resembles nothing lists the arrays that there are."""
    with pytest.raises(KeyError, match="there are: time, joint_position"):
        recording()["qqqq"]


def test_length_is_the_number_of_samples() -> None:
    """`len` counts samples."""
    assert len(recording()) == SAMPLES


def test_repr_of_a_complete_run() -> None:
    """The repr shows duration, samples and contacts."""
    assert repr(recording(stop_time=2.0)) == "<Recording: 2 s, 7 samples, 3 contacts, complete>"


def test_repr_of_an_interrupted_run_gives_the_reason() -> None:
    """The repr of an incomplete run says why it ended."""
    run = recording(complete=False, reason="interrupted", stop_time=0.31)
    assert repr(run) == "<Recording: 0.31 s, 7 samples, 3 contacts, incomplete: interrupted>"


def test_a_recording_can_be_pickled() -> None:
    """Looking up names does not stand in the way of pickle, so runs can come back from other processes."""
    copy = pickle.loads(pickle.dumps(recording()))
    np.testing.assert_array_equal(copy.deformation, recording().deformation)


# Validation


def test_a_wrong_shape_is_refused_with_both_shapes() -> None:
    """The error names the variable, the shape got and the shape expected."""
    wrong = {**arrays(), "deformation": np.zeros((SAMPLES, 4, 3))}
    with pytest.raises(RecordingError, match=re.escape("'deformation' has shape (7, 4, 3), expected (7, 3, 4)")):
        recording(variables=wrong)


def test_a_wrong_number_of_samples_is_refused() -> None:
    """All arrays have as many samples as time."""
    wrong = {**arrays(), "object_position": np.zeros((SAMPLES - 1, 3))}
    with pytest.raises(RecordingError, match="object_position"):
        recording(variables=wrong)


def test_an_unknown_variable_is_refused_with_the_nearest() -> None:
    """A name that is not in the table is an error with the nearest name."""
    with pytest.raises(RecordingError, match="did you mean 'object_rpy'"):
        recording(variables={**arrays(), "object_rpj": np.zeros((SAMPLES, 3))})


def test_time_is_required() -> None:
    """Without time there is no recording."""
    with pytest.raises(RecordingError, match="time"):
        recording(variables={})


def test_missing_labels_are_refused() -> None:
    """A variable along contacts needs the names of the contacts."""
    with pytest.raises(RecordingError, match="needs labels for dimension 'contact'"):
        recording(labels={dim: LABELS[dim] for dim in ("joint", "pair", "coupled_joint")})


def test_a_reserved_attribute_is_refused() -> None:
    """An extra figure cannot overwrite a field."""
    with pytest.raises(RecordingError, match="reason"):
        recording(attributes={"reason": "other"})


def test_an_attribute_that_no_file_can_hold_is_refused() -> None:
    """Extra figures are float, int or str."""
    with pytest.raises(RecordingError, match="attribute 'x' is a list"):
        recording(attributes={"x": [1]})


# NetCDF


@pytest.mark.parametrize("name", VARIABLES)
def test_arrays_survive_bit_for_bit(name: str, loaded: Recording) -> None:
    """What is loaded has the bytes and the dtype of what was saved."""
    before, after = recording()[name], loaded[name]
    assert (after.dtype, after.tobytes()) == (before.dtype, before.tobytes())


@pytest.mark.parametrize("field", ["labels", "scenario", "version", "complete", "reason", "stop_time", "attributes"])
def test_fields_survive(field: str, loaded: Recording) -> None:
    """Labels, texts and figures come back as they were."""
    assert getattr(loaded, field) == getattr(recording(), field)


def test_an_interrupted_run_stays_incomplete_with_its_reason(tmp_path: Path) -> None:
    """A run that ended early comes back as such, with the reason in any language."""
    recording(complete=False, reason="finger 3: µ exceeded").save(tmp_path / "run.nc")
    run = Recording.load(tmp_path / "run.nc")
    assert (run.complete, run.reason) == (False, "finger 3: µ exceeded")


def test_infinity_and_nan_survive(tmp_path: Path) -> None:
    """Values of a diverging run, and a friction use without load, are kept."""
    values = {**arrays(), "friction_use": np.full((SAMPLES, 3), [np.inf, np.nan, -0.0])}
    recording(variables=values).save(tmp_path / "run.nc")
    assert Recording.load(tmp_path / "run.nc").friction_use.tobytes() == values["friction_use"].tobytes()


def test_a_run_without_a_sample_survives(tmp_path: Path) -> None:
    """A run stopped before its first sample can be saved and loaded."""
    recording(variables=arrays(0)).save(tmp_path / "run.nc")
    assert Recording.load(tmp_path / "run.nc").contact_rotation.shape == (0, 3, 3, 3)


def test_a_long_scenario_survives(tmp_path: Path) -> None:
    """The scenario may exceed the 64 kB that HDF5 allows an attribute in the header."""
    recording(scenario="# x\n" * 50_000).save(tmp_path / "run.nc")
    assert len(Recording.load(tmp_path / "run.nc").scenario) == 200_000


def test_a_relative_path_like_an_address_is_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder whose name begins with http is no web address."""
    monkeypatch.chdir(tmp_path)
    Path("http_runs").mkdir()
    recording().save("http_runs/run.nc")
    assert len(Recording.load("http_runs/run.nc")) == SAMPLES


@pytest.mark.parametrize("name", VARIABLES)
def test_xarray_shows_units_and_long_name(name: str, dataset: xr.Dataset) -> None:
    """Each array carries one unit of all, or one for each place along its last dimension, and a long name."""
    attributes, units = dict(dataset[name].attrs), recording().units(name)
    assert attributes.pop("long_name") == VARIABLES[name].long_name
    assert attributes == ({"units": units[0]} if len(units) == 1 else {"component_units": list(units)})
    assert all(UNIT.fullmatch(unit) for unit in units)
    assert len(units) in (1, dataset[name].shape[-1])


UNIT = re.compile(r"1|(?:kg|rad|N|J|m|s)(?: m)?(?:/s)?")
"""One unit, as programs read it."""

SLIDE = '<robot name="hand"><joint name="{}" type="prismatic"/><joint name="other" type="revolute"/></robot>'


def test_a_slide_has_the_units_of_a_slide() -> None:
    """m, m/s and N; by each joint where some slide, one alone where all do; those of a hinge without a URDF."""
    joints = recording().labels["joint"]
    for urdf, torque in (
        ("", ("N m",)),
        (SLIDE.format(joints[1]), ("N m", "N", *("N m",) * (len(joints) - 2))),
        (
            "<robot name='hand'>" + "".join(f"<joint name='{name}' type='prismatic'/>" for name in joints) + "</robot>",
            ("N",),
        ),
        ("<robot>", ("N m",)),
    ):
        assert recording(hand_urdf=urdf).units("joint_torque") == torque
    mixed = recording(hand_urdf=SLIDE.format(joints[1]))
    assert mixed.units("joint_position")[:2] == ("rad", "m") and mixed.units("joint_velocity")[1] == "m/s"
    assert mixed.units("torque_limited") == ("1",) and mixed.units("object_position") == ("m",)


@pytest.mark.parametrize("name", VARIABLES)
def test_xarray_shows_the_dims_of_the_table(name: str, dataset: xr.Dataset) -> None:
    """Each array has the dims of the table."""
    assert dataset[name].dims == VARIABLES[name].dims


def test_xarray_selects_by_label(dataset: xr.Dataset) -> None:
    """Component and contact names are coordinates to select by."""
    dphi = dataset.deformation.sel(contact="finger_2_tip", deformation_component="dphi").to_numpy()
    np.testing.assert_array_equal(dphi, recording().deformation[:, 1, 2])


def test_xarray_reads_labels_as_text(dataset: xr.Dataset) -> None:
    """Labels are str, not bytes."""
    assert dataset.pair.to_numpy().tolist() == ["23", "13", "12"]


def test_xarray_reads_the_attributes(dataset: xr.Dataset) -> None:
    """The reserved attributes and the extra ones are all there."""
    assert set(dataset.attrs) == {
        *("title", "softhand_version", "scenario", "complete", "reason", "stop_time", "hand_urdf", "object_urdf"),
        *("steps_per_second", "steps", "stepper"),
    }


def test_what_xarray_saves_again_loads(tmp_path: Path) -> None:
    """A recording passed through xarray, with an array of the user's added, is still a recording."""
    recording().save(tmp_path / "run.nc")
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as data:
        data.assign(mine=data.time * 2).to_netcdf(tmp_path / "again.nc", engine="h5netcdf")
    loaded = Recording.load(tmp_path / "again.nc")
    assert loaded.deformation.tobytes() == recording().deformation.tobytes()


def test_hdf5_is_not_loaded_with_the_module() -> None:
    """Start-up does not wait for HDF5."""
    code = "import sys, softhand.recording; sys.exit('h5py' in sys.modules or 'h5netcdf' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


# Failures of writing, the same for both formats


@pytest.fixture(params=["save", "to_csv"])
def write(request: pytest.FixtureRequest) -> Any:
    """Give a function that writes a recording to a path."""
    return getattr(recording(), request.param)


def test_no_partial_file_stays_after_success(write: Any, tmp_path: Path) -> None:
    """Only the file asked for is in the folder."""
    write(tmp_path / "run.out")
    assert os.listdir(tmp_path) == ["run.out"]


def test_a_full_disk_is_named(write: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The error of a full disk says so and what to do."""
    monkeypatch.setattr(Path, "write_bytes", disk_is_full)
    with pytest.raises(RecordingError, match=r"run\.out: .*No space left on device; free some space"):
        write(tmp_path / "run.out")


def test_a_full_disk_leaves_nothing(write: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The partial file is removed."""
    monkeypatch.setattr(Path, "write_bytes", disk_is_full)
    with pytest.raises(RecordingError):
        write(tmp_path / "run.out")
    assert os.listdir(tmp_path) == []


def test_a_full_disk_keeps_the_older_file(write: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file of the same name is not touched by a failed write."""
    (tmp_path / "run.out").write_text("older")
    monkeypatch.setattr(Path, "write_bytes", disk_is_full)
    with pytest.raises(RecordingError):
        write(tmp_path / "run.out")
    assert (tmp_path / "run.out").read_text() == "older"


def test_the_original_error_is_attached(write: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The error carries the file and comes from the error of the system."""
    monkeypatch.setattr(Path, "write_bytes", disk_is_full)
    with pytest.raises(RecordingError) as caught:
        write(tmp_path / "run.out")
    assert (caught.value.file, type(caught.value.__cause__)) == (tmp_path / "run.out", OSError)  # type: ignore[attr-defined]


def test_ctrl_c_while_writing_leaves_nothing(write: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An interrupt goes through as it is, and the partial file is removed."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path / "run.out")
    assert os.listdir(tmp_path) == []


def test_a_missing_folder_is_named(write: Any, tmp_path: Path) -> None:
    """The error says that the folder does not exist."""
    with pytest.raises(RecordingError, match="No such file or directory; choose a folder that exists"):
        write(tmp_path / "nowhere" / "run.out")


def test_a_folder_as_target_is_refused(write: Any, tmp_path: Path) -> None:
    """A folder is not replaced, and no partial file stays beside it."""
    (tmp_path / "runs").mkdir()
    with pytest.raises(RecordingError, match="it is a folder"):
        write(tmp_path / "runs")
    assert os.listdir(tmp_path) == ["runs"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_as_target_is_refused(write: Any, tmp_path: Path) -> None:
    """What is no regular file, such as /dev/null, is not replaced by one."""
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(RecordingError, match="device"):
        write(tmp_path / "pipe")


def test_a_forbidden_folder_is_named(write: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The error of a missing permission says so and what to do."""

    def forbid(path: Path, _: bytes) -> int:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))

    monkeypatch.setattr(Path, "write_bytes", forbid)
    with pytest.raises(RecordingError, match="Permission denied; choose a folder"):
        write(tmp_path / "run.out")


def test_text_that_netcdf_cannot_hold_is_our_error(tmp_path: Path) -> None:
    """A failure of the NetCDF library comes as RecordingError too."""
    with pytest.raises(RecordingError, match="NULL"):
        recording(reason="a\0b").save(tmp_path / "run.nc")


# Failures of reading


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    """Loading what is not there says so."""
    with pytest.raises(RecordingError, match=r"none\.nc: .*no such file"):
        Recording.load(tmp_path / "none.nc")


def test_a_folder_is_no_recording(tmp_path: Path) -> None:
    """Loading a folder says so."""
    with pytest.raises(RecordingError, match="not a file"):
        Recording.load(tmp_path)


@pytest.mark.parametrize("content", [b"", b"duration = 2\n", b"CDF\x01" + bytes(100)])
def test_another_file_is_called_so(content: bytes, tmp_path: Path) -> None:
    """The message is in words of the user, not of HDF5."""
    (tmp_path / "other.nc").write_bytes(content)
    with pytest.raises(RecordingError, match=r"cannot be read as a recording: it is no NetCDF-4 file; give the run.nc"):
        Recording.load(tmp_path / "other.nc")


@pytest.mark.parametrize("content", [b"\x89HDF\r\n\x1a\n", b"\x89HDF\r\n\x1a\n" + bytes(1000)])
def test_another_file_is_no_recording(content: bytes, tmp_path: Path) -> None:
    """Loading any other file, even one that begins like NetCDF, is a RecordingError."""
    (tmp_path / "other.nc").write_bytes(content)
    with pytest.raises(RecordingError, match="cannot be read as a recording"):
        Recording.load(tmp_path / "other.nc")


@pytest.mark.parametrize("share", [0.01, 0.3, 0.9, 0.9999])
def test_a_truncated_file_is_no_recording(share: float, saved: Path, tmp_path: Path) -> None:
    """A recording cut short anywhere is a RecordingError."""
    whole = saved.read_bytes()
    (tmp_path / "run.nc").write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(RecordingError, match="cannot be read as a recording: a part of it is missing"):
        Recording.load(tmp_path / "run.nc")


def test_netcdf_of_others_is_no_recording(tmp_path: Path) -> None:
    """A NetCDF file without our attributes is refused as such."""
    xr.Dataset({"time": ("time", np.zeros(3))}).to_netcdf(tmp_path / "other.nc", engine="h5netcdf")
    with pytest.raises(RecordingError, match="not written by softhand"):
        Recording.load(tmp_path / "other.nc")


def test_a_changed_shape_in_the_file_is_refused(tmp_path: Path) -> None:
    """A file whose arrays lost components does not load, and the array is named."""
    recording().save(tmp_path / "run.nc")
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as data:
        data.isel(xyz=[0, 1]).to_netcdf(tmp_path / "cut.nc", engine="h5netcdf")
    with pytest.raises(RecordingError, match="object_position"):
        Recording.load(tmp_path / "cut.nc")


# CSV


def table(path: Path) -> tuple[list[str], list[list[str]]]:
    """Header and rows of a CSV file."""
    with open(path, newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    return header, rows


@pytest.mark.parametrize(
    "column",
    [
        *("time_s", "object_position_x_m", "contact_force_finger_1_tip_f_x_N", "contact_force_finger_1_tip_tau_N_m"),
        *("object_twist_w_z_rad_per_s", "friction_use_finger_1_tip", "contact_rotation_finger_3_tip_x_y"),
        *("internal_force_23_N", "torque_limited_finger_1_joint_1", "contact_coordinates_finger_2_tip_alpha_o_1_m"),
    ],
)
def test_csv_column_names(column: str, tmp_path: Path) -> None:
    """A column is named by array, labels and unit; a number without unit has no suffix."""
    recording().to_csv(tmp_path / "run.csv")
    assert column in table(tmp_path / "run.csv")[0]


def test_csv_columns_are_distinct(tmp_path: Path) -> None:
    """No two columns share a name."""
    recording().to_csv(tmp_path / "run.csv")
    header, _ = table(tmp_path / "run.csv")
    assert len(set(header)) == len(header)


def test_csv_keeps_all_digits(tmp_path: Path) -> None:
    """Each number of the CSV reads back to the same float, under the right column."""
    recording().to_csv(tmp_path / "run.csv")
    header, rows = table(tmp_path / "run.csv")
    column = header.index("contact_rotation_finger_2_tip_z_x")
    assert [float(row[column]) for row in rows] == recording().contact_rotation[:, 1, 2, 0].tolist()


def test_csv_has_one_row_a_sample(tmp_path: Path) -> None:
    """Rows are samples, each with as many cells as the header."""
    recording().to_csv(tmp_path / "run.csv")
    header, rows = table(tmp_path / "run.csv")
    assert [len(row) for row in rows] == [len(header)] * SAMPLES


def test_csv_of_a_run_without_a_sample_is_a_header(tmp_path: Path) -> None:
    """A run stopped before its first sample gives the header alone."""
    recording(variables=arrays(0)).to_csv(tmp_path / "run.csv")
    header, rows = table(tmp_path / "run.csv")
    assert (header[0], rows) == ("time_s", [])


# Recorder


def test_recorder_copies_what_is_updated_in_place() -> None:
    """Each row holds the values at its own call, 0-d arrays included."""
    time = np.zeros(())
    recorder = Recorder({"time": time}, 5)
    for value in (1.0, 2.0, 3.0):
        time[...] = value
        recorder.record()
    assert recorder["time"].tolist() == [1.0, 2.0, 3.0]


def test_recorder_follows_views() -> None:
    """A strided view of a larger array is recorded as it changes."""
    state = np.arange(12.0).reshape(3, 4)
    recorder = Recorder({"column": state[:, 1]}, 2)
    recorder.record()
    state *= 2
    recorder.record()
    assert recorder["column"].tolist() == [[1, 5, 9], [2, 10, 18]]


def test_recorder_takes_structured_arrays() -> None:
    """Fields of a structured array are there by name, with the samples as first axis."""
    contacts = np.zeros(3, [("flag", np.int8), ("deformation", float, 4), ("rotation", float, (3, 3))])
    recorder = Recorder({"contacts": contacts}, 4)
    contacts["deformation"][1] = (1, 2, 3, 4)
    recorder.record()
    assert recorder["contacts"]["deformation"][0, 1].tolist() == [1, 2, 3, 4]


def test_recorder_takes_every_second_structured_element() -> None:
    """A strided view of a structured array is recorded too."""
    contacts = np.zeros(4, [("flag", np.int8), ("force", float, 2)])
    recorder = Recorder({"contacts": contacts[::2]}, 1)
    contacts["force"][:, 0] = (1, 2, 3, 4)
    recorder.record()
    assert recorder["contacts"]["force"][0, :, 0].tolist() == [1, 3]


def test_recorder_gives_only_the_samples_so_far() -> None:
    """An interrupted run has no rows that were never written."""
    recorder = Recorder({"time": np.zeros(()), "position": np.zeros((2, 3))}, 10)
    recorder.record()
    assert {name: array.shape for name, array in recorder.variables().items()} == {"time": (1,), "position": (1, 2, 3)}


def test_recorder_refuses_a_sample_too_many() -> None:
    """Beyond its capacity the recorder raises, rather than losing a sample."""
    recorder = Recorder({"time": np.zeros(())}, 1)
    recorder.record()
    with pytest.raises(IndexError):
        recorder.record()
