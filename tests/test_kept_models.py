"""What is kept of files that were read: never stale, never shared where it is written to."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hands import BOX_URDF, HAND_URDF, REPOSITORY

from softhand.assembly.build import build
from softhand.errors import ModelError
from softhand.model.body import ObjectModel
from softhand.model.hand import HandModel
from softhand.model.urdf.examination import OBJECT
from softhand.model.urdf.mounting import TipPlace
from softhand.model.urdf.urdf import Urdf
from softhand.model.world import World, load_world

TIPS = [f"finger_{k}_tip" for k in (1, 2, 3)]


def world_of(hand: Path, body: Path, mass: float | None = None) -> World:
    """Hand and object read from files."""
    return load_world(HandModel.read(hand, TIPS), ObjectModel.read(body, mass))


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """Copies of the reference hand and box."""
    hand, box = tmp_path / "hand.urdf", tmp_path / "box.urdf"
    shutil.copy(HAND_URDF, hand)
    shutil.copy(BOX_URDF, box)
    return hand, box


def prism(folder: Path) -> tuple[Path, Path]:
    """A copy of the prism, and its mesh."""
    shutil.copytree(REPOSITORY / "urdf/meshes", folder / "meshes")
    shutil.copy(REPOSITORY / "urdf/prism.urdf", folder)
    return folder / "prism.urdf", folder / "meshes/prism.obj"


def rewrite(file: Path, old: str, new: str) -> None:
    """Change a file and nothing that a folder tells of it: neither its length nor its times."""
    text, status = file.read_text(), file.stat()
    assert old in text
    assert len(old) == len(new)
    file.write_text(text.replace(old, new))
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))


def test_a_changed_object_is_read_anew(files: tuple[Path, Path]) -> None:
    """Mass and size are those in the file now, though it has the length and the time that it had."""
    before = world_of(*files)
    rewrite(files[1], 'value="0.200"', 'value="0.300"')
    rewrite(files[1], "0.056", "0.066")
    after = world_of(*files)
    assert (before.object_mass, after.object_mass) == (0.2, 0.3)
    assert after.shape.half[0] == pytest.approx(0.033)


def test_a_changed_hand_is_read_anew(files: tuple[Path, Path]) -> None:
    """And refused, if it has become wrong."""
    before = world_of(*files).effort_limit
    text = files[0].read_text()
    files[0].write_text(text.replace('effort="', 'effort="1'))
    assert np.all(world_of(*files).effort_limit > before)
    files[0].write_text(text.replace("</robot>", ""))
    with pytest.raises(ModelError, match="not XML"):
        world_of(*files)
    files[0].write_text(text)
    np.testing.assert_array_equal(world_of(*files).effort_limit, before)


def test_a_mesh_that_is_gone_is_missed(tmp_path: Path) -> None:
    """The text of the URDF is what it was, but a mesh that it names is not there any more; or it is back."""
    body, mesh = prism(tmp_path)
    assert len(ObjectModel.read(body).build()[1].faces()) == 14
    kept = mesh.read_bytes()
    mesh.unlink()
    with pytest.raises(ModelError, match="there is no such file"):
        ObjectModel.read(body)
    mesh.write_bytes(kept)
    assert len(ObjectModel.read(body).build()[1].faces()) == 14


def test_a_changed_mesh_is_read_anew(tmp_path: Path) -> None:
    """With the same name, length and time."""
    body, mesh = prism(tmp_path)
    before = ObjectModel.read(body).build()[1].surface_points(50)[0]
    rewrite(mesh, "0.045", "0.075")
    after = ObjectModel.read(body).build()[1].surface_points(50)[0]
    assert np.max(np.abs(before[:, 2])) == pytest.approx(0.045)
    assert np.max(np.abs(after[:, 2])) == pytest.approx(0.075)


def test_same_files_are_checked_once() -> None:
    """A second reading gives the same document, a role of another kind one of its own."""
    assert Urdf.read(BOX_URDF, OBJECT) is Urdf.read(BOX_URDF, OBJECT)
    assert Urdf.read(BOX_URDF, OBJECT) is not Urdf.read(BOX_URDF)


def test_worlds_share_no_model(files: tuple[Path, Path]) -> None:
    """Masses, limits and gravity of one are not those of another."""
    heavy, light = world_of(*files, mass=0.5), world_of(*files)
    strong = load_world(HandModel.read(files[0], TIPS, effort_limit=9.0), ObjectModel.read(files[1]), (0.0, 0.0, 0.0))
    light.model.inertias[1] = pin.Inertia.Random()
    fresh = world_of(*files)
    assert (heavy.object_mass, light.object_mass, fresh.object_mass) == (0.5, 0.2, 0.2)
    assert set(strong.effort_limit) == {9.0}
    assert not np.any(fresh.effort_limit == 9.0)
    np.testing.assert_array_equal(fresh.gravity, (0.0, 0.0, -9.81))
    assert fresh.model.inertias[1] != light.model.inertias[1]
    assert heavy.model.inertias[1] == fresh.model.inertias[1]


def test_a_placed_hand_is_not_the_bare_one(files: tuple[Path, Path]) -> None:
    """Each place of the hand and of its tips has a model of its own."""
    bare = world_of(*files)
    place = TipPlace("soft", "finger_1_tip", position=[0.0, 0.0, 0.002])  # type: ignore[arg-type]
    body = ObjectModel.read(files[1])
    moved = load_world(HandModel.read(files[0], [place, *TIPS[1:]], (0.0, 0.0, 0.1)), body)
    assert moved.tips[0].position[2] - bare.tips[0].position[2] == pytest.approx(0.002)
    lifted = moved.model.jointPlacements[1].translation - bare.model.jointPlacements[1].translation
    np.testing.assert_allclose(lifted, (0.0, 0.0, 0.1), atol=1e-15)


def test_a_second_simulation_runs_as_the_first_alone() -> None:
    """One that is built and run between changes nothing."""
    alone = build("target-a", duration=0.02).run().joint_torque
    first = build("target-a", duration=0.02)
    build("target-a", duration=0.02, mass=0.4, gravity=(0.0, 0.0, -1.0)).run()
    np.testing.assert_array_equal(first.run().joint_torque, alone)
