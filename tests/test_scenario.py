"""Scenarios: reading, overriding, checking, writing, and the files that ship."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softhand.errors import ScenarioError
from softhand.scenario.file import parse_override, resolve_path, scenario_names
from softhand.scenario.scenario import Scenario, load_scenario

TARGET_A = load_scenario("target-a")
DEFAULTS = ["description", "duration", "control_period", "gravity", "stepper"]
DEFAULTS += ["object.mass", "grasp.joint_guess", "reference.duration"]


def refusal(overrides: dict[str, Any]) -> ScenarioError:
    """Return the error that target A with these values raises."""
    with pytest.raises(ScenarioError) as caught:
        load_scenario("target-a", overrides)
    return caught.value


def file_refusal(source: str | Path) -> str:
    """Return the message that loading the source raises."""
    with pytest.raises(ScenarioError) as caught:
        load_scenario(source)
    return str(caught.value)


def written(folder: Path, text: str | bytes) -> Path:
    """Return a scenario file with the text."""
    file = folder / "my.toml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return file


@pytest.mark.parametrize("name", scenario_names())
def test_shipped_scenario_loads_and_has_a_description(name: str) -> None:
    """Every shipped scenario is valid and has a line for the listing."""
    assert 10 < len(load_scenario(name).description) < 100


@pytest.mark.parametrize("name", scenario_names())
def test_shipped_urdfs_exist(name: str) -> None:
    """Every shipped scenario names URDF files that ship."""
    scenario = load_scenario(name)
    assert resolve_path(scenario.hand.urdf).is_file() and resolve_path(scenario.object.urdf).is_file()


def test_both_targets_ship() -> None:
    """The reference scenarios are in the list."""
    assert {"target-a", "target-b"} <= set(scenario_names())


@pytest.mark.parametrize(("name", "degrees"), [("target-a", (-15, 15, 15)), ("target-b", (15, -15, 0))])
def test_target_angles_have_full_precision(name: str, degrees: tuple[float, ...]) -> None:
    """The angles of the targets are those of the paper to the last digit."""
    assert load_scenario(name).reference.object_rpy == tuple(map(math.radians, degrees))


def test_the_targets_differ_in_the_reference_only() -> None:
    """Targets A and B start from the same grasp with the same hand, object, law and controller."""
    other = load_scenario("target-b").model_dump(exclude={"reference", "description"})
    assert TARGET_A.model_dump(exclude={"reference", "description"}) == other


def test_defaults() -> None:
    """What may be left out has the documented default."""
    scenario = TARGET_A.with_values(dict.fromkeys(DEFAULTS))
    assert (scenario.description, scenario.duration, scenario.control_period) == ("", 2.0, 0.001)
    assert (scenario.gravity, scenario.stepper.name, scenario.stepper.step) == ((0.0, 0.0, -9.81), "midpoint", 0.001)
    assert (scenario.object.mass, scenario.grasp.joint_guess, scenario.reference.duration) == (None, None, None)


def test_further_keys_of_plugins_are_parameters() -> None:
    """Keys that the section does not know are kept for the law, without the section's own."""
    assert set(TARGET_A.fingertip.parameters) == {"radius", "k_r", "k_phi", "k_theta", "k_psi"}


@pytest.mark.parametrize("name", scenario_names())
def test_round_trip(name: str, tmp_path: Path) -> None:
    """Reading what a scenario writes gives an equal scenario."""
    scenario = load_scenario(name)
    assert load_scenario(written(tmp_path, scenario.to_toml())) == scenario


numbers = st.floats(-1e15, 1e15).filter(lambda number: number == 0.0 or abs(number) >= 1e-30)
parameters = numbers | st.booleans() | st.text(st.characters(exclude_categories=["Cs"])) | st.lists(numbers)


@settings(max_examples=50, deadline=None)
@given(st.tuples(numbers, numbers, numbers), parameters, st.text(st.characters(exclude_categories=["Cs"])))
def test_round_trip_of_any_values(
    tmp_path_factory: pytest.TempPathFactory, position: tuple[float, ...], parameter: Any, description: str
) -> None:
    """Any numbers, parameters and texts survive writing and reading."""
    scenario = TARGET_A.with_values(
        {"object.position": position, "controller": {"name": "mine", "extra": parameter}, "description": description}
    )
    file = written(tmp_path_factory.mktemp("round"), scenario.to_toml())
    assert load_scenario(file) == scenario


def test_none_is_left_out_of_the_file() -> None:
    """A value that is not set is not written."""
    assert "mass" not in TARGET_A.to_toml()


def test_what_toml_cannot_hold_is_refused_when_writing() -> None:
    """A parameter that is no TOML value gives a ScenarioError when the scenario is written."""
    with pytest.raises(ScenarioError, match="cannot be written as TOML"):
        TARGET_A.with_values({"controller": {"name": "mine", "model": object()}}).to_toml()


def test_with_values_leaves_the_original() -> None:
    """A changed copy does not change what it was made from."""
    TARGET_A.with_values({"fingertip.k_r": 1.0})
    assert TARGET_A.fingertip.parameters["k_r"] == 0.377e6


def test_with_values_checks_again() -> None:
    """A changed copy is checked like a file."""
    with pytest.raises(ScenarioError, match=r"object\.mass: got -1, but it must be a number > 0"):
        TARGET_A.with_values({"object.mass": -1})


def test_a_whole_section_can_be_replaced() -> None:
    """A section's name as key replaces the section with all its parameters."""
    assert TARGET_A.with_values({"controller": {"name": "mine"}}).controller.parameters == {}


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        ({"gravty": 3}, r"gravty: unknown key \(with value 3\)\. Did you mean gravity\? Valid keys at the top level: "),
        ({"fingertp.k_r": 3}, r"fingertp: unknown key \(a table\)\. Did you mean fingertip\?"),
        ({"mass": 3}, r"Did you mean object\.mass\?"),
        ({"reference.durations": 1}, r"Did you mean reference\.duration\? Valid keys in reference: kind, duration"),
        ({"fingertip": 3}, r"fingertip: got 3, but it must be a table with the keys law, friction"),
        ({"grasp": [1, 2]}, r"grasp: got \[1, 2\], but it must be a table"),
        ({"hand.urdf.x": 3}, r"hand\.urdf: got \"package:.*, but hand\.urdf\.x needs a table there"),
        ({"object..mass": 3}, r"\"object\.\.mass\" is no key"),
        ({"fingertip.friction": None, "fingertip.frction": 0.5}, r"friction: missing; .* Is it misspelt as frction\?"),
        ({"controller.name": None}, r"controller\.name: missing; it must be text"),
        (
            {"gravity": [0, 0, math.nan]},
            r"gravity: got \[0, 0, nan\] \(item 3 is nan\).*3 numbers, not NaN or infinite",
        ),
        ({"hand.tips": ["a"]}, r"hand\.tips: got \[\"a\"\], but it must be a list of at least 2 texts"),
        ({"hand.tips": ["a", "b", "a"]}, r"hand\.tips: .*\"a\" is there 2 times"),
        ({"hand.tips": ["a", "b"]}, r"grasp\.contact_points: got .* of length 3, but 2 fingertips need length 2"),
        ({"grasp.internal_force": [1.0]}, r"grasp\.internal_force: .*3 fingertips with 3 pairs need length 3"),
        ({"reference.internal_force": [1, 2]}, r"reference\.internal_force: got \[1\.0, 2\.0\] of length 2"),
        ({"stepper.step": 0.0007}, r"stepper\.step: got 0\.0007 s, .*the nearest good value is 0\.0005\."),
        ({"stepper.step": 0.002}, r"stepper\.step: got 0\.002 s, .*the nearest good value is 0\.001\."),
        ({"duration": 1.0007}, r"duration: got 1\.0007 s, .*the nearest good value is 1\.001\."),
        ({"duration": 1e12}, r"duration: got 1e\+12 s, but at most 1e\+09 steps"),
        ({"duration": 1e300}, r"duration: got 1e\+300: .*larger than 1e\+15"),
    ],
)
def test_refusal(overrides: dict[str, Any], message: str) -> None:
    """Each mistake gives one message that names the key, the value and what is allowed."""
    error = refusal(overrides)
    assert re.search(message, str(error)) and "\n" not in str(error)


def test_error_carries_key_and_value() -> None:
    """A program can read key and value of the mistake, also of a check across sections."""
    error: Any = refusal({"stepper.step": 0.002})
    assert (error.key, error.value, error.nearest) == ("stepper.step", 0.002, 0.001)


def test_message_names_the_scenario() -> None:
    """The message begins with the scenario that was asked for."""
    assert str(refusal({"gravity": 1})).startswith("Scenario target-a: gravity:")


@pytest.mark.parametrize("step", [0.001 / 3, 0.00025, 0.0001, 0.001 / 7])
def test_steps_that_divide_the_period_are_taken(step: float) -> None:
    """Rounding of a step that divides the control period is no mistake."""
    assert TARGET_A.with_values({"stepper.step": step}).stepper.step == step


def test_two_fingers_are_enough() -> None:
    """A scenario with two fingertips has one internal force."""
    values = {"hand.tips": ["a", "b"], "grasp.contact_points": [[0, 0, 0], [1, 0, 0]]}
    forces = {"grasp.internal_force": [1.0], "reference.internal_force": [2.0]}
    assert TARGET_A.with_values({**values, **forces}).grasp.internal_force == (1.0,)


def test_unknown_name_lists_the_shipped_scenarios() -> None:
    """An unknown name gives the nearest and all shipped names."""
    text = file_refusal("target_a")
    assert text.startswith('No scenario is called "target_a". Did you mean target-a? Shipped: ') and "target-b" in text


def test_missing_file_is_named(tmp_path: Path) -> None:
    """A file that is not there is named."""
    assert f"{tmp_path / 'no.toml'} does not exist" in file_refusal(tmp_path / "no.toml")


def test_directory_is_refused(tmp_path: Path) -> None:
    """A directory in place of a file is refused as such."""
    assert "is a directory; a .toml file is needed" in file_refusal(str(tmp_path))


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("duration = 2.0\ngravity = [0 0]\n", "is not TOML (line 2, column 14): "),
        ("duration = 2.0\ngravity = [0,", "is not TOML (line 2, column 14): "),
        ("duration = 2.0\nduration = 2.0\nx = 1", "is not TOML (line 2, column 15): Cannot overwrite a value."),
        ("x = " + "[" * 100_000, "is not TOML"),
    ],
)
def test_broken_toml_gives_line_and_column(tmp_path: Path, text: str, where: str) -> None:
    """A file that is not TOML gives the place and the reason."""
    assert where in file_refusal(written(tmp_path, text))


def test_other_encodings_are_refused(tmp_path: Path) -> None:
    """A file that is not UTF-8 gives the line and the byte."""
    file = written(tmp_path, b'duration = 2.0\ndescription = "caf\xe9"\n')
    assert "is not UTF-8 text: byte 0xe9 in line 2" in file_refusal(file)


def test_byte_order_mark_is_ignored(tmp_path: Path) -> None:
    """A file that an editor began with a byte order mark is read."""
    assert load_scenario(written(tmp_path, b"\xef\xbb\xbf" + TARGET_A.to_toml().encode())) == TARGET_A


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read every file")
def test_unreadable_file_is_named(tmp_path: Path) -> None:
    """A file without permission to read gives one message."""
    file = written(tmp_path, "")
    file.chmod(0)
    assert "cannot be read" in file_refusal(file)


def test_empty_file_lists_what_is_missing(tmp_path: Path) -> None:
    """An empty file gives a line for each section that is missing."""
    lines = file_refusal(written(tmp_path, "")).splitlines()
    sections = ["hand", "object", "fingertip", "grasp", "controller", "reference"]
    assert [line.split(":")[0] for line in lines[1:]] == sections


def test_paths_in_a_file_are_relative_to_it(tmp_path: Path) -> None:
    """A relative URDF in a file is next to the file, wherever it is loaded from."""
    text = TARGET_A.to_toml().replace("package://softhand/urdf/box.urdf", "parts/../box.urdf")
    assert load_scenario(written(tmp_path, text)).object.urdf == str(tmp_path / "box.urdf")


def test_paths_in_overrides_are_relative_to_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A relative URDF given from outside is in the current folder."""
    monkeypatch.chdir(tmp_path)
    changed = load_scenario(
        "target-a", {"hand.urdf": "hand.urdf", "object": {**TARGET_A.object.model_dump(), "urdf": "b"}}
    )
    assert (changed.hand.urdf, changed.object.urdf) == (str(tmp_path / "hand.urdf"), str(tmp_path / "b"))


def test_package_path_resolves_to_a_shipped_file() -> None:
    """A package path is found from any folder."""
    assert resolve_path("package://softhand/urdf/box.urdf").read_text().startswith("<?xml")


@pytest.mark.parametrize("urdf", ["package://softhand/urdf/bx.urdf", "package://other/urdf/box.urdf", "package:box"])
def test_unknown_package_path_lists_the_shipped_files(urdf: str) -> None:
    """A package path to nothing gives the files that ship."""
    with pytest.raises(ScenarioError, match=r"Shipped: .*package://softhand/urdf/three_finger_hand\.urdf"):
        resolve_path(urdf)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 1e-3),
        ("[1, 2]", [1, 2]),
        ('"text"', "text"),
        ("true", True),
        ("step", "step"),
        ("minimum-jerk", "minimum-jerk"),
        ("~/box.urdf", "~/box.urdf"),
        ("two words", "two words"),
        ("a=b", "a=b"),
        ("{name = 'x'}", {"name": "x"}),
        ("1\nb = 2", "1\nb = 2"),
    ],
)
def test_override_values_are_toml_or_text(text: str, value: Any) -> None:
    """The value of an override is TOML, and a bare word is text."""
    assert parse_override(f" some.key = {text}") == ("some.key", value)


@pytest.mark.parametrize("text", ["object.mass", "=3", "object.mass=", ""])
def test_override_without_key_or_value_is_refused(text: str) -> None:
    """An override that is not key=value is refused with an example."""
    with pytest.raises(ScenarioError, match=r"must have the form key=value, such as object\.mass=0\.3"):
        parse_override(text)


@pytest.mark.parametrize("text", ["gravity=[0, 0", 'reference.kind="step'])
def test_override_that_does_not_end_is_refused(text: str) -> None:
    """A list or text that does not end is refused, not taken as text."""
    with pytest.raises(ScenarioError, match="is no TOML value: "):
        parse_override(text)


def test_equal_scenarios_write_the_same_text() -> None:
    """Two equal scenarios write the same text."""
    assert Scenario.model_validate(TARGET_A.model_dump()).to_toml() == TARGET_A.to_toml()
