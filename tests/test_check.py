"""softhand check and softhand schema: what they say of scenarios and URDFs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from commands import Outcome, run_command
from hands import HAND_URDF, make_named_task

from softhand.assembly.build import build
from softhand.assembly.resolve import resolve
from softhand.checks.scenario import Checkup, check_scenario, fastest_frequency
from softhand.commands.simulate import _of_urdfs
from softhand.dampings.kelvin_voigt import KelvinVoigt
from softhand.errors import ModelError
from softhand.model.body import ObjectModel
from softhand.plugins import SHIPPED, find_plugin
from softhand.scenario.file import find_scenario, resolve_path, scenario_names
from softhand.scenario.scenario import load_scenario, with_law
from softhand.scenario.schema import scenario_schema
from softhand.settings.toml import tomllib

DATA = Path(__file__).parent / "data"


def checked(**changes: Any) -> Checkup:
    return check_scenario(load_scenario("target-a", {key.replace("__", "."): value for key, value in changes.items()}))


def run(*arguments: str) -> Outcome:
    return run_command("check", *arguments, folder=DATA)


# ---------------------------------------------------------------------------------------- a scenario explained


def test_every_value_has_its_unit() -> None:
    """All keys, those of plugins and defaults included, with the unit of their docstring."""
    values = {key: (value, unit) for key, value, unit in checked().values}
    assert values["fingertip.k_r"] == ("377000.0", "N/m^2")
    assert values["controller.K_O_orientation"] == ("0.3", "N m/rad")
    assert values["stepper.step"] == ("0.001", "s") and values["gravity"] == ("[0.0, 0.0, -9.81]", "m/s^2")
    assert set(values) >= {"duration", "hand.tips", "grasp.joint_guess", "reference.kind", "controller.name"}


def test_damping_is_explained_too() -> None:
    """A table in a table."""
    values = {key: unit for key, _, unit in checked(**{"fingertip.damping": {"name": "kelvin-voigt"}}).values}
    assert values["fingertip.damping.radial"] == "N s/m"


@pytest.mark.parametrize("name", scenario_names())
def test_what_ships_gives_no_warning(name: str) -> None:
    """The scenarios that ship are beyond doubt; so are the URDFs, but not those of other packages."""
    scenario = load_scenario(name)
    if not scenario.hand.urdf.startswith("package://softhand/"):
        pytest.importorskip("example_robot_data", reason='needs the extra robots: pip install "softhand[robots]"')
    foreign = "" if scenario.hand.urdf.startswith("package://softhand/") else str(resolve_path(scenario.hand.urdf))
    assert [text for text in check_scenario(scenario).warnings if not (foreign and text.startswith(foreign))] == []


def test_friction_near_its_limit_is_a_warning() -> None:
    """A start with friction use above 0.9 is told with the finger."""
    use = float(checked().start[0][1].split("friction use ")[1].split(",")[0])
    warnings = checked(fingertip__friction=0.5 * use / 0.95).warnings
    assert any("finger_1_tip: friction use is 0.9" in warning for warning in warnings)


def test_a_target_that_cannot_be_held_is_a_warning() -> None:
    """A target out of reach does not keep the scenario from being run."""
    warnings = checked(reference__object_position=[0.0, 0.0, 0.4]).warnings
    assert len(warnings) == 1 and "at the target, finger_" in warnings[0] and "out of reach" in warnings[0]


def test_warnings_of_the_urdfs_are_told(tmp_path: Path) -> None:
    """What is doubtful in the hand is doubtful in the scenario."""
    hand = HAND_URDF.read_text()
    (tmp_path / "hand.urdf").write_text(hand.replace('velocity="20"', 'velocity="0"', 1))
    warnings = checked(hand__urdf=str(tmp_path / "hand.urdf")).warnings
    assert len(warnings) == 1 and "hand.urdf, line" in warnings[0] and "could not move" in warnings[0]


@pytest.mark.parametrize(
    ("joints", "told"),
    [
        (None, ["damping", "friction"]),
        ({"armature": 1e-5}, ["damping", "friction"]),
        ({"friction": "urdf"}, ["damping"]),
        ({"damping": 0.0, "armature": 1e-5}, ["friction"]),
        ({"damping": "urdf", "friction": 0.01}, []),
    ],
)
def test_dynamics_are_told_that_the_scenario_says_nothing_of(
    joints: dict[str, Any] | None, told: list[str], tmp_path: Path
) -> None:
    """Each of the two as long as its own key is not there, by check and in the count of simulate."""
    file = tmp_path / "hand.urdf"
    file.write_text(HAND_URDF.read_text().replace("<limit ", '<dynamics damping="0.2" friction="0.3"/><limit '))
    scenario = load_scenario("target-a", {"hand.urdf": str(file), "hand.joints": joints})
    found = [line for line in check_scenario(scenario).warnings if "<dynamics>" in line]
    assert [line.partition("hand.joints.")[2] for line in found] == [f'{name} = "urdf".' for name in told]
    counted = list(_of_urdfs(resolve(scenario)))
    assert [line.partition(";")[0] for line in counted] == (
        [f"hand.urdf: {len(told)} warning{'s' * (len(told) > 1)}"] if told else []
    )


def test_a_tip_near_the_apex_is_a_warning() -> None:
    """The paper's law beyond 80 deg; a law in surface coordinates has no apex."""
    low = {"object.position": [0.0, 0.010, 0.120]}
    angles = np.degrees(build(load_scenario("target-a", low)).sample().contact_angles[:, 1])
    assert list(angles > 80.0) == [True, True, False]
    told = [warning for warning in check_scenario(load_scenario("target-a", low)).warnings if "apex" in warning]
    assert [warning[:12] for warning in told] == ["finger_1_tip", "finger_2_tip"]
    scenario = with_law(load_scenario("target-a", low), "radial")
    assert not [warning for warning in check_scenario(scenario).warnings if "apex" in warning]


# ---------------------------------------------------------------------------------------- is the step fine enough?


@pytest.mark.parametrize(("stepper", "limit"), [("semi-implicit-euler", 2.0), ("rk4", 2.8)])
@pytest.mark.parametrize("factor", [0.95, 1.08])
def test_the_limit_of_the_step_is_where_runs_begin_to_diverge(stepper: str, limit: float, factor: float) -> None:
    """Below h = limit / omega a small disturbance stays small, above it grows, and only then there is a warning."""
    simulation = build(load_scenario("target-a"))
    step = factor * limit / fastest_frequency(simulation.plant, simulation.state)
    changes = {"control_period": step, "duration": step, "stepper": {"name": stepper, "step": step}}
    scenario = load_scenario("target-a", changes)
    simulation = build(scenario)
    simulation.sample()
    torque = simulation.torque.copy()
    simulation.state.v[:] += 1e-6 * np.random.default_rng(0).normal(size=simulation.state.v.size)
    fastest = 0.0
    try:
        for _ in range(round(0.2 / step)):  # longer, and the grasp leaves its start whatever the step
            simulation.integration.advance(simulation.state, torque)
            fastest = max(fastest, float(np.max(np.abs(simulation.state.v))))
    except FloatingPointError:
        fastest = np.inf
    is_told = any("is too long for" in warning for warning in check_scenario(scenario).warnings)
    assert (not fastest < 5.0) == is_told == (factor > 1.0)


def test_the_frequency_grows_with_the_root_of_the_stiffness(tmp_path: Path) -> None:
    """Four times the stiffness at the same state: twice the frequency."""
    soft = build(load_scenario("target-a"))
    names = ("k_r", "k_phi", "k_theta", "k_psi")
    values = dict(load_scenario("target-a").fingertip.parameters)
    stiff = build(load_scenario("target-a", {f"fingertip.{name}": 4.0 * values[name] for name in names}))
    frequency = fastest_frequency(soft.plant, soft.state)
    assert fastest_frequency(stiff.plant, soft.state) == pytest.approx(2.0 * frequency, rel=1e-9)


def test_strong_damping_is_as_fast_as_stiffness() -> None:
    """An overdamped contact has an eigenvalue beyond the frequency without damping."""
    scenario = load_scenario("target-a", {"fingertip.damping": {"name": "kelvin-voigt", "radial": 1000.0}})
    damped, free = build(scenario), build(load_scenario("target-a"))
    assert isinstance(damped.plant.fingertips[0].damping, KelvinVoigt)
    assert fastest_frequency(damped.plant, free.state) > 5.0 * fastest_frequency(free.plant, free.state)


@pytest.mark.parametrize("layout", ["two fingers", "four fingers", "wrist", "continuous"])
def test_any_hand_has_a_frequency(layout: str, tmp_path: Path) -> None:
    """Other numbers of fingers and joints."""
    task = make_named_task(layout, tmp_path)
    assert 100.0 < fastest_frequency(task.plant(), task.grasp.state) < 1e4


# ---------------------------------------------------------------------------------------- the command


def test_check_of_a_urdf_tells_what_it_is() -> None:
    """Exit code 0, kind, joints, ends."""
    result = run(str(DATA / "good.urdf"))
    assert result.returncode == 0, result.stderr
    for words in ("hand", "5, root palm", "2 moving, 2 fixed", "0.1 kg", "left_tip, right_tip", "no errors"):
        assert words in result.stdout


def test_check_of_a_broken_urdf_fails() -> None:
    """Exit code 1, the message on stderr, no traceback."""
    result = run(str(DATA / "broken/decimal_comma.urdf"))
    assert result.returncode == 1 and result.stderr.startswith("error:") and "Traceback" not in result.stderr
    assert "decimal_comma.urdf, line 19, <mass> of link 'left_finger': value=\"0,05\"" in result.stderr


def test_check_of_a_doubtful_urdf_warns(tmp_path: Path) -> None:
    """Exit code 0 with warnings."""
    file = tmp_path / "long.urdf"
    file.write_text((DATA / "good.urdf").read_text().replace('xyz="0.06 0 0"', 'xyz="50 0 0"', 1))
    result = run(str(file))
    assert result.returncode == 0 and "warning:" in result.stdout and "is it in millimetres?" in result.stdout


def tent(pit: float) -> str:
    """A pyramid 50 mm high, as OBJ, with a hollow of that height under it."""
    corners = "v -0.02 -0.02 0\nv 0.02 -0.02 0\nv 0.02 0.02 0\nv -0.02 0.02 0\n"
    sides = [(1, 2), (2, 3), (3, 4), (4, 1)]
    faces = [f"f {a} {b} 5\nf {b} {a} 6\n" for a, b in sides]
    return f"{corners}v 0 0 0.05\nv 0 0 {pit}\n{''.join(faces)}"


INERTIAL = (
    '<inertial><mass value="0.05"/><inertia ixx="2e-5" iyy="2e-5" izz="1.5e-5" ixy="0" ixz="0" iyz="0"/></inertial>'
)


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        ('<mesh filename="tent.obj"/>', "is not convex: its surface at"),
        ("", "an object needs a collision shape, or several that are its parts, each a <box>, <sphere>, <cylinder>"),
    ],
)
def test_check_of_an_object_that_tips_cannot_touch_warns(shape: str, words: str, tmp_path: Path) -> None:
    """As every scenario refuses it as it is, with the remedy; the hull of the hollow one is taken when asked for."""
    (tmp_path / "tent.obj").write_text(tent(0.02))
    collision = f"<collision><geometry>{shape}</geometry></collision>" if shape else ""
    text = f'<robot name="t"><link name="t">{INERTIAL}{collision}</link></robot>'
    (tmp_path / "tent.urdf").write_text(text)
    result = run(str(tmp_path / "tent.urdf"))
    told = " ".join(result.stdout.split())
    assert result.returncode == 0 and f"warning: {tmp_path / 'tent.urdf'}: " in told and words in told
    assert run(str(tmp_path / "tent.urdf"), "-q").stdout == ""
    if shape:
        assert "set object.decompose = true" in told and "or object.hull = true" in told
        assert len(ObjectModel.read(tmp_path / "tent.urdf", hull=True).build()[1].faces()) == 5
    with pytest.raises(ModelError, match=words):
        ObjectModel.read(tmp_path / "tent.urdf").build()


def test_check_of_a_scenario_explains_it() -> None:
    """Values with units, the start, warnings; exit code 0. A wrong value: 1."""
    result = run(
        "target-a", "--set", "stepper.name=rk4", "--set", "control_period=0.005", "--set", "stepper.step=0.005"
    )
    assert result.returncode == 0, result.stderr
    for words in ("377000.0 N/m^2", "friction use", "Hz", "warning: stepper.step: 0.005 s is too long for rk4"):
        assert words in result.stdout
    result = run("target-a", "--set", "object.position=[0,0,1]")
    assert result.returncode == 1 and "out of reach" in result.stderr


# ---------------------------------------------------------------------------------------- schema


SCHEMA = scenario_schema()
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)


def problems(changes: dict[str, Any]) -> int:
    """How many errors the schema finds in target A with changed tables."""
    table = tomllib.loads(find_scenario("target-a").read_text())
    for section, values in changes.items():
        table[section] = {**table[section], **values} if isinstance(values, dict) else values
    return len(list(VALIDATOR.iter_errors(table)))


def test_the_schema_is_one() -> None:
    """A valid schema of its draft."""
    jsonschema.Draft202012Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("name", scenario_names())
def test_what_ships_fits_the_schema(name: str) -> None:
    """Every shipped scenario, as written and as resolved."""
    assert not list(VALIDATOR.iter_errors(tomllib.loads(find_scenario(name).read_text())))
    assert not list(VALIDATOR.iter_errors(tomllib.loads(build(load_scenario(name)).scenario)))


@pytest.mark.parametrize(
    "changes",
    [
        {"durration": 1.0},
        {"duration": 0},
        {"duration": "2 s"},
        {"hand": {"tips": ["one"]}},
        {"object": {"position": [0.0, 0.0]}},
        {"fingertip": {"kr": 1.0}},
        {"fingertip": {"law": "hertz"}},
        {"fingertip": {"damping": {"name": "kelvin-voigt", "rates": [1.0]}}},
        {"controller": {"K_O": 1.0}},
        {"controller": {"name": 3}},
        {"reference": {"frequency": 3.0}},
        {"stepper": {"step": -1.0}},
        {"stepper": {"rtol": 1e-6}},
    ],
    ids=str,
)
def test_what_softhand_refuses_the_schema_refuses(changes: dict[str, Any]) -> None:
    """A misspelt key, a wrong type, a value out of range, a key of another plugin."""
    assert problems(changes)


@pytest.mark.parametrize(
    "changes",
    [
        {"fingertip": {"law": "gel", "anything": 1.0}},
        {"controller": {"K_O_position": [1.0, 2.0, 3.0]}},
        {"fingertip": {"damping": {"name": "fung", "rates": [1.0], "shares": [0.1]}}},
        {"stepper": {"name": "adaptive", "rtol": 1e-6}},
        {"reference": {"kind": "sine", "frequency": 3.0}},
    ],
    ids=str,
)
def test_what_softhand_takes_the_schema_takes(changes: dict[str, Any]) -> None:
    """A law of another package with keys of its own; lists of gains; settings of plugins."""
    assert not problems(changes)


@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind in SHIPPED for name in SHIPPED[kind]])
def test_every_key_of_a_plugin_is_described(kind: str, name: str) -> None:
    """A docstring stands below each field of each plugin."""
    fields = find_plugin(kind, name, kind).model_fields
    assert [key for key, field in fields.items() if not field.description] == []


def described(schema: Any) -> Iterator[tuple[str, bool]]:
    """Key by key, at every depth, whether the schema describes it."""
    for part in schema.values() if isinstance(schema, dict) else schema if isinstance(schema, list) else ():
        yield from described(part)
    for key, value in schema.get("properties", {}).items() if isinstance(schema, dict) else ():
        yield key, bool(value.get("description"))


def test_every_key_of_a_scenario_is_described() -> None:
    """Also those of tables in tables: waypoints, tips placed on links, the balls of a palm."""
    tables = {name: table for name, table in SCHEMA["properties"].items() if "anyOf" not in table}
    found = list(described([{"properties": tables}, SCHEMA["properties"]["reference"]["anyOf"][0]]))
    assert {"carried", "frame", "face_friction", "radius", "height", "joint_guess"} <= {key for key, _ in found}
    assert [key for key, is_described in found if not is_described] == []
