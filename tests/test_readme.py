"""The README tells the truth: its examples run and its links lead somewhere."""

import re
from pathlib import Path

import numpy as np
import pytest
from test_attitude import TURNS, load, turned

import softhand

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
EXAMPLES = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)


@pytest.mark.parametrize("example", EXAMPLES, ids=["controller"])
def test_the_examples_run(example, tmp_path, monkeypatch):
    """Each Python block of the README runs as it stands, and its run is complete."""
    monkeypatch.chdir(tmp_path)
    namespace = {"__name__": "readme"}
    exec(compile(example, "README.md", "exec"), namespace)
    assert namespace["recording"].complete


def test_the_controller_example_regulates(tmp_path, monkeypatch):
    """The README's controller brings the box to within 2 mm of the target and writes its two files."""
    monkeypatch.chdir(tmp_path)
    namespace = {"__name__": "readme"}
    exec(compile(EXAMPLES[0], "README.md", "exec"), namespace)
    assert softhand.summarize(namespace["recording"]).position_error < 2.0
    assert (tmp_path / "run.nc").is_file() and (tmp_path / "figure.png").is_file()


@pytest.mark.parametrize("turn", ["pitch 90", "seam"])
def test_the_controller_example_knows_no_seam(turn, tmp_path, monkeypatch):
    """Turned as a whole, onto pitch 90 deg or to the ends of roll and yaw, it does the same."""
    monkeypatch.chdir(tmp_path)
    namespace = {"__name__": "readme"}
    exec(compile(EXAMPLES[0].partition("\ncontroller =")[0], "README.md", "exec"), namespace)
    controller, scenario, Q = namespace["PoseSpring"](), load("regulation"), TURNS[turn]
    here, there = (softhand.simulate(task, controller) for task in (scenario, turned(scenario, Q)))
    assert np.ptp(here.joint_torque, axis=0).max() > 1e-3
    assert there.joint_torque == pytest.approx(here.joint_torque, rel=0.0, abs=1e-9)
    assert there.object_position == pytest.approx(here.object_position @ Q.T, rel=0.0, abs=1e-10)


def test_the_pictures_and_pages_are_there():
    """Every relative link of the README leads to a file."""
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        if not target.startswith("http"):
            assert (ROOT / target).exists(), target
