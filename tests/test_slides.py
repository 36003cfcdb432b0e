"""The effort of a joint that slides is a force in N, one that turns has a torque in N m: wherever it is told."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import xarray as xr

import softhand
from softhand.checks.check import check
from softhand.errors import GraspError, ModelError
from softhand.model.urdf.examination import HAND
from softhand.model.urdf.urdf import Urdf
from softhand.plots.run import draw_run
from softhand.recording.events import find_events
from softhand.studies.compare import compare, headings

SHORT = {"duration": 0.02, "reference.duration": 0.01}
WEAK = {**SHORT, "hand.effort_limit": 9.0}  # the start needs 8 N, the target 12 N


@pytest.fixture(scope="module")
def gripper() -> softhand.Recording:
    """Two fingers that slide, at their limit."""
    return softhand.simulate("gripper", overrides=WEAK)


@pytest.fixture(scope="module")
def fingers() -> softhand.Recording:
    """Three fingers that turn, at their limit."""
    return softhand.simulate("target-a", overrides={**SHORT, "hand.effort_limit": 0.43, "duration": 0.1})


def test_events(gripper: softhand.Recording, fingers: softhand.Recording) -> None:
    """What was cut by a limit."""
    for recording, unit in ((gripper, "N"), (fingers, "N m")):
        cut = [event for event in find_events(recording) if event.kind == "torque limit"]
        assert cut and all(f" {unit}, " in event.text for event in cut)


def test_figures(gripper: softhand.Recording, fingers: softhand.Recording) -> None:
    """Labels of the panels of the joints."""
    labels = [{axes.get_ylabel() for axes in draw_run(run).axes} for run in (gripper, fingers)]
    assert "force, joint 1 [N]" in labels[0] and "torque, joint 1 [N m]" in labels[1]
    assert not any("N m" in label and "joint" in label for label in labels[0])


def test_files(gripper: softhand.Recording, fingers: softhand.Recording, tmp_path: Path) -> None:
    """Units in NetCDF and in the columns of CSV."""
    for run, units in ((gripper, ("m", "m/s", "N")), (fingers, ("rad", "rad/s", "N m"))):
        run.save(tmp_path / "run.nc")
        with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as data:
            assert units == tuple(data[f"joint_{name}"].units for name in ("position", "velocity", "torque"))
        run.to_csv(tmp_path / "run.csv")
        columns = (tmp_path / "run.csv").read_text().splitlines()[0].split(",")
        joint = run.labels["joint"][0]
        assert f"joint_torque_{joint}_{units[2].replace(' ', '_')}" in columns


def test_check() -> None:
    """Values and the start."""
    found = check("gripper")
    units = {key: unit for key, _, unit in found.values}  # type: ignore[union-attr]
    assert units["controller.K_v"] == "N s/m" and units["controller.K_posture"] == "N/m"
    assert any(row[0] == "largest force" and " N at " in row[1] for row in found.start)  # type: ignore[union-attr]


def test_errors() -> None:
    """A start beyond the limit."""
    with pytest.raises(GraspError, match=r"would need -?8 N at the start; its effort limit is 7 N\."):
        softhand.build("gripper", overrides={"hand.effort_limit": 7.0})


def test_tables() -> None:
    """The heading of the effort in a comparison."""
    for name, unit in (("gripper", "N"), ("target-a", "N m")):
        rows = compare(softhand.load_scenario(name, SHORT), controllers=["regulation"])
        assert f"effort\n[{unit}]" in headings(rows)


@pytest.mark.parametrize(("hand", "words"), [("gripper", "force [N]"), ("two_finger_hand", "torque [N m]")])
def test_a_joint_without_effort(hand: str, words: str) -> None:
    """The message says what to write, in its unit."""
    file = Path(__file__).parents[1] / f"urdf/{hand}.urdf"
    text = re.sub(r'effort="[^"]*"', 'effort="0"', file.read_text(), count=1)
    with pytest.raises(ModelError, match=re.escape(f"write the largest {words}")):
        Urdf.parse(text, file, HAND)
