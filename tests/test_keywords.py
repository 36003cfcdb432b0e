"""Values of a scenario by keyword: the last part of a key, where only one key ends so."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import softhand
from softhand import ScenarioError, load_scenario
from softhand.scenario.file import scenario_names
from softhand.scenario.scenario import as_scenario

TARGET_A = load_scenario("target-a")


@pytest.mark.parametrize(
    ("values", "key"),
    [
        ({"mass": 0.3}, "object.mass"),
        ({"duration": 0.5}, "duration"),  # not reference.duration: what stands at the top is meant
        ({"gravity": (0.0, 0.0, -1.0)}, "gravity"),
        ({"friction": 0.4}, "fingertip.friction"),  # there is no table
        ({"k_r": 4e5}, "fingertip.k_r"),
        ({"effort_limit": 1.5}, "hand.effort_limit"),
        ({"K_posture": 0.5}, "controller.K_posture"),  # of the controller, not in the file
        ({"step": 0.0005}, "stepper.step"),
        ({"kind": "step"}, "reference.kind"),
        ({"object_position": (0.0, 0.01, 0.145)}, "reference.object_position"),
        ({"opening": None}, "grasp.opening"),
        ({"reference": {"kind": "side-step", "width": 0.1}}, "reference"),
    ],
    ids=str,
)
def test_a_keyword_is_the_key_that_ends_so(values: dict[str, Any], key: str) -> None:
    """The same scenario as with the whole key."""
    (value,) = values.values()
    assert load_scenario("target-a", **values) == load_scenario("target-a", {key: value})


def test_a_default_section_and_its_plugin_have_keys_too() -> None:
    """Of a stepper that the file does not name, and of a damping that it does."""
    plain = {"stepper": None, "fingertip.damping": {"name": "kelvin-voigt", "radial": 1.0}}
    assert load_scenario("target-a", plain, step=0.0005).stepper.step == 0.0005
    changed = load_scenario("target-a", plain, radial=2.0)
    assert changed.fingertip.damping is not None and changed.fingertip.damping.parameters["radial"] == 2.0


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (
            {"position": (0, 0, 0)},
            r"position: several keys .* end so: hand\.position, object\.position; give .*overrides=",
        ),
        ({"name": "blind"}, r"name: several keys .*: controller\.name, stepper\.name"),
        ({"masss": 0.3}, r"masss: no key of the scenario ends so\. Did you mean mass, for object\.mass\?"),
        ({"height": 0.1}, r"height: no key of the scenario ends so\."),  # target-a has no table
        ({"qwertz": 1}, r"qwertz: no key of the scenario ends so\.$"),
    ],
    ids=str,
)
def test_a_keyword_that_is_none_or_two_is_told(values: dict[str, Any], words: str) -> None:
    """With all that it could be, or the nearest; by every way in."""
    for call in (load_scenario, softhand.build, softhand.simulate):
        with pytest.raises(ScenarioError, match=words) as caught:
            call("target-a", **values)
        assert caught.value.key == next(iter(values))  # type: ignore[attr-defined]


def test_what_is_there_decides() -> None:
    """Friction of the tips and of a table are two keys, and so are those of a tip and of all tips."""
    table = {"table": {"height": 0.0, "friction": 0.3}}
    with pytest.raises(ScenarioError, match=r"fingertip\.friction, table\.friction"):
        load_scenario("target-a", table, friction=0.4)
    assert load_scenario("target-a", table, height=0.1).table.height == 0.1  # type: ignore[union-attr]
    own = {"fingertip.tips": {"finger_1_tip": {"friction": 0.6}}}
    with pytest.raises(ScenarioError, match=r"fingertip\.friction, fingertip\.tips\.finger_1_tip\.friction"):
        load_scenario("target-a", own, friction=0.4)


@pytest.mark.parametrize("name", scenario_names())
def test_every_key_at_the_top_is_itself(name: str) -> None:
    """Of each scenario that ships, given with its own value."""
    scenario = load_scenario(name)
    for key in ("description", "duration", "control_period", "gravity"):
        assert load_scenario(name, **{key: getattr(scenario, key)}) == scenario


def test_a_run_takes_a_name_a_path_or_a_scenario(tmp_path: Path) -> None:
    """With keywords and dotted keys, and the recording has them all."""
    (tmp_path / "mine.toml").write_text(TARGET_A.to_toml())
    changes: dict[str, Any] = {"overrides": {"reference.duration": 0.5, "object.mass": 0.25}, "duration": 0.01}
    runs = [softhand.simulate(source, **changes) for source in ("target-a", tmp_path / "mine.toml", TARGET_A)]
    assert {run.scenario for run in runs} == {runs[0].scenario}
    assert (runs[0].time[-1], len(runs[0])) == (0.01, 11)
    assert "mass = 0.25" in runs[0].scenario and "duration = 0.5" in runs[0].scenario
    light, heavy = (softhand.build("target-a", mass=mass) for mass in (0.1, 0.4))
    assert (light.plant.world.object_mass, heavy.plant.world.object_mass) == (0.1, 0.4)


def test_a_scenario_without_changes_stays_the_same_object() -> None:
    """Nothing is checked twice."""
    assert as_scenario(TARGET_A) is TARGET_A
