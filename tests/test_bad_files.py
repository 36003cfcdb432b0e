"""Scenarios and recordings that are broken, huge, no files or up to something: one clear error each."""

from __future__ import annotations

import os
import random
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_recording import recording

from softhand.assembly.build import build
from softhand.errors import RecordingError, ScenarioError, SofthandError
from softhand.numerics.roots import find_root
from softhand.recording.recording import Recording
from softhand.scenario.file import find_scenario
from softhand.scenario.scenario import load_scenario

TARGET_A = find_scenario("target-a").read_text()


def refusal_of_file(file: Path) -> str:
    with pytest.raises(ScenarioError) as caught:
        load_scenario(file)
    return str(caught.value)


# ---------------------------------------------------------------------------------------- scenarios


def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    """A pipe and a device are no scenarios."""
    os.mkfifo(tmp_path / "pipe.toml")
    for file in (tmp_path / "pipe.toml", Path("/dev/zero")):
        assert "no regular file" in refusal_of_file(file)


def test_a_huge_scenario_is_not_read(tmp_path: Path) -> None:
    """More than a scenario can be is refused before it is parsed."""
    file = tmp_path / "huge.toml"
    with file.open("wb") as stream:
        stream.truncate(2_000_000)
    assert "longer than 1000000 bytes" in refusal_of_file(file)


@pytest.mark.parametrize("urdf", ["/dev/zero", "/dev/stdin", ".", "/proc/self/mem", "missing.urdf", "a\\u0000b"])
def test_a_urdf_that_is_no_file_is_refused(urdf: str, tmp_path: Path) -> None:
    """Whatever a scenario names as its hand: an error with the name, and no waiting."""
    file = tmp_path / "my.toml"
    file.write_text(TARGET_A.replace("package://softhand/urdf/three_finger_hand.urdf", urdf))
    with pytest.raises(SofthandError):
        build(load_scenario(file))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('law = "nakashima"', 'law = "os:system"'),
        ('law = "nakashima"', 'law = "softhand.laws.nakashima:Nakashima"'),
        ('name = "regulation"', 'name = "../../controller.py"'),
        ('name = "midpoint"', "name = \"__import__('os')\""),
    ],
)
def test_a_scenario_names_plugins_and_no_code(old: str, new: str, tmp_path: Path) -> None:
    """A module, a file or an expression in the place of a name is just an unknown name."""
    file = tmp_path / "my.toml"
    file.write_text(TARGET_A.replace(old, new))
    with pytest.raises(ScenarioError, match="is called"):
        build(load_scenario(file))


@settings(max_examples=300, deadline=None, derandomize=True)
@given(data=st.data())
def test_a_mutated_scenario_is_read_or_refused(data: st.DataObject, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Text cut out of a scenario or put into it: a scenario or one ScenarioError."""
    text = TARGET_A
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(text)))
        end = start + data.draw(st.integers(0, 20))
        pieces = st.sampled_from(["nan", "inf", "-1", "0", "[", "]", '"', "=", "\n[x]\n", "1e400", "true", "{}", "é"])
        text = text[:start] + data.draw(pieces | st.text(max_size=5)) + text[end:]
    file = tmp_path_factory.getbasetemp() / "mutated.toml"
    file.write_bytes(text.encode("utf-8", "replace"))
    try:
        load_scenario(file)
    except ScenarioError as error:
        assert "mutated.toml" in str(error)


KEYS = [
    "object.mass", "object.position", "object.rpy", "fingertip.friction", "fingertip.radius", "fingertip.k_r",
    "grasp.contact_points", "grasp.internal_force", "grasp.joint_guess", "gravity", "hand.tips", "controller.K_v",
    "reference.duration", "reference.object_position",
]  # fmt: skip
VALUES = st.sampled_from([0, -1, 1e-300, 1e300, "x", [], [0.0] * 3, [1e300] * 3, [[0.0] * 3] * 3, [1.0] * 9, True])
VALUES |= st.floats(allow_nan=False, allow_infinity=False)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@settings(max_examples=150, deadline=None, derandomize=True)
@given(changes=st.dictionaries(st.sampled_from(KEYS), VALUES, min_size=1, max_size=2))
def test_a_start_is_refused_or_finite(changes: dict[str, object]) -> None:
    """Any values in a scenario: a SofthandError, or a start that is made of numbers."""
    try:
        simulation = build(load_scenario("target-a", changes))
        simulation.sample()
    except SofthandError:
        return
    assert np.isfinite(simulation.state.q).all() and np.isfinite(simulation.torque).all()


PLACED = {"frame": "finger_1_tip", "name": "y"}
BALL = {"frame": "palm", "position": [0.0, 0.0, 0.0], "radius": 1e300, "friction": 0.5}


@pytest.mark.parametrize(
    ("name", "changes", "words"),
    [
        ("ball", {"object.ellipsoid": [1e300] * 3}, r"object\.ellipsoid: .*larger than 1e\+15"),
        ("target-a", {"object.mass": 10**40}, r"object\.mass: .*larger than 1e\+15"),
        ("prism", {"palm": [BALL]}, r"palm: .*larger than 1e\+15"),
        (
            "grasp-and-lift",
            {"fingertip.tips.finger_1_tip.radius": 1e300},
            r"finger_1_tip\.radius: .*larger than 1e\+15",
        ),
        ("grasp-and-lift", {"fingertip.radius": 10}, r"fingertip\.radius: got 10, .* <= 1"),
        ("grasp-and-lift", {"fingertip.k_r": 1e15}, r"law 'Nakashima' away from the object.*larger than 1e\+15"),
        ("grasp-and-lift", {"table.normal": [1e-300] * 3}, r"table\.normal: .*smaller than 1e-30"),
        ("can", {"hand.tips": ["finger_1_tip", "finger_2_tip", PLACED]}, "no joint moves this tip without another one"),
    ],
)
def test_numbers_and_tips_beyond_reason_are_refused(name: str, changes: dict[str, object], words: str) -> None:
    """One error that names the key, in place of an overflow somewhere in the start."""
    with pytest.raises(SofthandError, match=words):
        build(load_scenario(name, changes))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_start_that_is_no_number_is_out_of_reach() -> None:
    """Where an equation is no number at any start there is no root: no error of the solver gets out."""
    bad = np.full(2, np.nan)
    point, gap = find_root(lambda x: bad * x, lambda x: np.diag(bad), [np.zeros(2)], -np.ones(2), np.ones(2), 1e-9)
    assert np.array_equal(point, np.zeros(2)) and gap == np.inf


# ---------------------------------------------------------------------------------------- recordings


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A recording as it is on disk."""
    path = tmp_path_factory.mktemp("saved") / "run.nc"
    recording().save(path)
    return path.read_bytes()


@pytest.mark.parametrize("seed", range(100))
def test_a_mutated_recording_is_read_or_refused(seed: int, saved: bytes, tmp_path: Path) -> None:
    """Bytes changed or cut off anywhere: a recording or one RecordingError, never a crash."""
    rng, data = random.Random(seed), bytearray(saved)
    for _ in range(rng.choice([1, 5, 50, 200])):
        data[rng.randrange(len(data))] = rng.choice([0, 255, rng.randrange(256)])
    if rng.random() < 0.2:
        del data[rng.randrange(len(data)) :]
    (tmp_path / "run.nc").write_bytes(data)
    try:
        Recording.load(tmp_path / "run.nc")
    except RecordingError as error:
        assert "run.nc" in str(error)


@pytest.fixture
def altered(saved: bytes, tmp_path: Path) -> Path:
    """A recording to be altered."""
    (tmp_path / "run.nc").write_bytes(saved)
    return tmp_path / "run.nc"


def test_a_link_to_another_file_is_not_followed(altered: Path, saved: bytes) -> None:
    """A recording whose array lies in another file is refused, though the array is a good one."""
    (altered.parent / "other.nc").write_bytes(saved)
    with h5py.File(altered, "r+") as file:
        del file["joint_torque"]
        file["joint_torque"] = h5py.ExternalLink("other.nc", "joint_torque")
    with pytest.raises(RecordingError, match="'joint_torque' is not in the file itself"):
        Recording.load(altered)


def test_data_of_another_file_are_not_read(altered: Path) -> None:
    """A recording whose numbers are the bytes of another file is refused."""
    secret = altered.parent / "secret"
    secret.write_bytes(bytes(8000))
    with h5py.File(altered, "r+") as file:
        shape = file["joint_torque"].shape
        del file["joint_torque"]
        size = 8 * int(np.prod(shape))
        file.create_dataset("joint_torque", shape, "f8", external=[(str(secret), 0, size)])
    with pytest.raises(RecordingError, match="'joint_torque' is not in the file itself"):
        Recording.load(altered)


def test_arrays_larger_than_their_file_are_not_allocated(altered: Path) -> None:
    """A small file that claims terabytes is refused before they are allocated."""
    with h5py.File(altered, "r+") as file:
        shape = file["joint_torque"].shape
        del file["joint_torque"]
        file.create_dataset("joint_torque", (10**11, *shape[1:]), "f8", chunks=(1000, *shape[1:]))
    with pytest.raises(RecordingError, match=r"claim .* bytes, which a file of"):
        Recording.load(altered)


def test_a_pipe_is_no_recording(tmp_path: Path) -> None:
    """A pipe is not waited for."""
    os.mkfifo(tmp_path / "run.nc")
    with pytest.raises(RecordingError, match="not a file"):
        Recording.load(tmp_path / "run.nc")
