"""Followers whose limits and multiplier are of opposite sign: told, and mended in the way that a scenario says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from commands import run_command

from softhand import build, load_scenario
from softhand.errors import ScenarioError, SofthandError
from softhand.model.body import ObjectModel
from softhand.model.hand import HandModel
from softhand.model.world import World, load_world
from softhand.scenario.blank import read_hand

BOX = Path(__file__).parents[1] / "urdf" / "box.urdf"
INERTIAL = (
    '<inertial><mass value="0.05"/><inertia ixx="2e-5" ixy="0" ixz="0" iyy="2e-5" iyz="0" izz="2e-5"/></inertial>'
)


def hand(folder: Path, multiplier: float = -1.0, offset: float = 0.0, limits: tuple[float, float] = (0.0, 0.9)) -> Path:
    """Two fingers of two links as a parallel gripper has them: the distal joint turns back by as much."""
    links = [f'<link name="{name}">{INERTIAL}</link>' for name in ("a", "a_tip", "b", "b_tip")]
    joints = []
    for name, parent, x, mimic in (
        ("a", "base", 0.03, ""),
        ("a_tip", "a", 0.05, f'<mimic joint="joint_a" multiplier="{multiplier}" offset="{offset}"/>'),
        ("b", "base", -0.03, '<mimic joint="joint_a" multiplier="1"/>'),
        ("b_tip", "b", 0.05, ""),
    ):
        kind, low, high = "revolute", *((0.0, 0.8) if not name.endswith("tip") else limits)
        joints.append(
            f'<joint name="joint_{name}" type="{kind}"><parent link="{parent}"/><child link="{name}"/>'
            f'<origin xyz="{x} 0 0.02"/><axis xyz="0 1 0"/>{mimic}\n'
            f'<limit lower="{low}"  upper="{high}" effort="3" velocity="2"/></joint>'
        )
    file = folder / "hand.urdf"
    file.write_text('<robot name="hand"><link name="base"/>\n' + "\n".join([*links, *joints]) + "\n</robot>")
    return file


def world_of(file: Path, *turned: tuple[str, str]) -> World:
    return load_world(HandModel.read(file, ["a_tip", "b_tip"], turned=turned), ObjectModel.read(BOX))


def test_a_clash_is_told_with_both_remedies(tmp_path: Path) -> None:
    """By a scenario as an error, by `softhand check` of the URDF as a warning; a hand that is in order says nothing."""
    with pytest.raises(ScenarioError) as told:
        world_of(hand(tmp_path))
    text = str(told.value)
    assert "leave the motor 'joint_a' no range: 'joint_a_tip' follows 'joint_a' by the multiplier -1" in text
    assert "from -0.8 to 0, and its limits are 0 and 0.9" in text
    assert 'hand.mimic_signs = { joint_a_tip = "limits" }, "multiplier" in place' in text
    done = run_command("check", str(hand(tmp_path)), folder=tmp_path)
    assert "hand.mimic_signs = { joint_a_tip" in " ".join(done.stdout.split())
    for limits, multiplier in (((-0.9, 0.0), -1.0), ((0.0, 0.9), 1.0)):
        done = run_command("check", str(hand(tmp_path, multiplier, limits=limits)), folder=tmp_path)
        assert "mimic_signs" not in done.stdout and "0 warnings" in done.stdout


@pytest.mark.parametrize("offset", [0.0, 0.1])
def test_what_is_turned_goes_where_it_is_said(offset: float, tmp_path: Path) -> None:
    """With its limits turned the tip turns back, with its multiplier turned it turns on; the motor keeps its range."""
    file = hand(tmp_path, -1.0, offset, (offset, 0.9 + offset))
    for what, sign in (("limits", -1.0), ("multiplier", 1.0)):
        world = world_of(file, ("joint_a_tip", what))
        coupling = world.coupling
        assert coupling is not None
        names, motor = list(coupling.joint_names), coupling.motors.index("joint_a")
        assert coupling.S[names.index("joint_a_tip"), motor] == sign
        assert coupling.offset[names.index("joint_a_tip")] == offset
        assert np.allclose(world.position_limits[0][motor], 0.0)
        assert np.allclose(world.position_limits[1][motor], 0.8)
        lower, upper = coupling.joint_limits[:, names.index("joint_a_tip")]
        assert (lower, upper) == pytest.approx((offset - 0.9, offset) if sign < 0 else (offset, offset + 0.9))
        (warning,) = [one for one in world.hand.warnings if "mimic_signs" in str(one)]
        assert f'mimic_signs = "{what}"' in str(warning)
        assert "joint_a_tip" in str(warning)


def test_a_wrong_name_or_word_is_refused(tmp_path: Path) -> None:
    file = hand(tmp_path)
    with pytest.raises(
        ScenarioError, match=r"hand\.mimic_signs: 'joint_b_tip' follows no other joint .* joint_a_tip, joint_b"
    ):
        world_of(file, ("joint_b_tip", "limits"))
    scenario = load_scenario("coupled-hand")
    with pytest.raises(SofthandError, match="mimic_signs"):
        scenario.with_values({"hand.mimic_signs": {"thumb": "sign"}})
    with pytest.raises(ScenarioError, match=r"hand\.mimic_signs: 'thumb' follows no other"):
        build(scenario.with_values({"hand.mimic_signs": {"thumb": "limits"}}))


@pytest.mark.parametrize("what", ["limits", "multiplier"])
def test_a_scenario_for_such_a_hand_says_it(tmp_path: Path, what: str) -> None:
    """The line of the scenario is the one that makes the hand read, and it reads as it was found."""
    found, lines = read_hand(hand(tmp_path), what)
    assert len(lines) == 1 and lines[0].startswith(f'mimic_signs = {{ "joint_a_tip" = "{what}" }}')
    joint = next(joint for joint in found.tree.joints if joint.name == "joint_a_tip")
    limit, mimic = joint.element.find("limit"), joint.element.find("mimic")
    assert limit is not None and mimic is not None
    expected = (-0.9, -1.0) if what == "limits" else (0.0, 1.0)
    assert (float(limit.attrib["lower"]), float(mimic.attrib["multiplier"])) == expected


def test_a_sign_that_is_not_wrong_is_no_remedy(tmp_path: Path) -> None:
    """A word that is none, and a hand that is in order."""
    with pytest.raises(ScenarioError, match='got \'axis\'; give "limits" or "multiplier"'):
        read_hand(hand(tmp_path), "axis")
    with pytest.raises(ScenarioError, match="no joint follows another one beyond its own limits"):
        read_hand(hand(tmp_path, multiplier=1.0), "limits")
