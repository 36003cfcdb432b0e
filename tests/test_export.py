"""Logs that other programs open: what is in them, that nothing is lost, and what is said of mistakes."""

from __future__ import annotations

import dataclasses
import json
import os
import subprocess
import sys
from importlib.util import find_spec
from itertools import chain

import numpy as np
import pytest
from commands import run_command

from softhand import Recording, RecordingError, SofthandError, load_scenario, read_mcap, simulate, write_mcap
from softhand.export.frames import Frames
from softhand.recording.events import find_events
from softhand.viewer.scene.poses import pose_of
from softhand.viewer.scene.recorded import RecordedScene

needs_export = pytest.mark.skipif(
    find_spec("mcap") is None or find_spec("foxglove_schemas_protobuf") is None,
    reason="the extra is not installed: pip install 'softhand[export]'",
)
needs_rerun = pytest.mark.skipif(
    find_spec("rerun") is None, reason="the extra is not installed: pip install 'softhand[rerun]'"
)
RATE = 100.0


@pytest.fixture(scope="module")
def recording() -> Recording:
    """Two tips slip, a torque limit is met, a table carries."""
    return simulate(load_scenario("grasp-and-lift", {"duration": 0.06}))


@pytest.fixture(scope="module")
def slipping(recording) -> Recording:
    """With a slip, a number that is not finite and one that is minus zero."""
    slips, use, torque = recording.is_slipping.copy(), recording.friction_use.copy(), recording.joint_torque.copy()
    slips[20:23, 1], use[5, 0], torque[7, 2] = 1, np.inf, -0.0
    changed = {"is_slipping": slips, "friction_use": use, "joint_torque": torque}
    return dataclasses.replace(recording, variables={**recording.variables, **changed})


@pytest.fixture(scope="module")
def file(slipping, tmp_path_factory):
    """Its log."""
    file = tmp_path_factory.mktemp("log") / "run.mcap"
    write_mcap(slipping, file, RATE)
    return file


@pytest.fixture(scope="module")
def log(file):
    """Messages by topic, with their times [ns]."""
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    found = {}
    with file.open("rb") as content:
        for schema, channel, message, decoded in make_reader(
            content, decoder_factories=[DecoderFactory()]
        ).iter_decoded_messages():
            found.setdefault(channel.topic, []).append((message.log_time, schema.name, decoded))
    return found


# ----------------------------------------------------------------------------------------------------------- the frames


def test_what_a_frame_carries_is_where_the_scene_has_it(recording):
    """Vertices of each thing, moved by its frame, are those of the item, moved by its update."""
    frames, scene = Frames(recording, RATE), RecordedScene(recording)
    poses, things = frames.moment(40)
    updates = {item.name: update for item, update in zip(scene.items, scene.frame(40), strict=True)}
    checked = 0
    for thing in chain(frames.still(), things):
        update = updates[thing.item.name]
        if thing.visible and not thing.arrow:
            frame, own = poses.get(thing.frame, np.eye(4)), np.eye(4) if update.pose is None else update.pose
            vertices = thing.item.vertices if update.vertices is None else update.vertices
            np.testing.assert_allclose(moved(thing.vertices, frame), moved(vertices, own), atol=1e-8)
            checked += 1
    assert checked > 20


def test_arrows_reach_as_far_as_those_of_the_scene(recording):
    """Shaft and head of two items are one arrow."""
    frames = Frames(recording, RATE)
    _, things = frames.moment(40)
    arrows = {thing.item.name: thing.arrow for thing in things if thing.arrow}
    updates = {item.name: u for item, u in zip(frames.scene.items, frames.scene.frame(40), strict=True)}
    assert {name.split("/")[0] for name in arrows} >= {"supports"}
    for name, arrow in arrows.items():
        head = updates[name.removesuffix("shaft") + "head"].pose
        end = arrow.start + (arrow.shaft[0] + arrow.head[0]) * arrow.axes[:, 2]
        np.testing.assert_allclose(end, head[:3, 3] + head[:3, 2], atol=1e-12)


def moved(vertices, pose):
    return vertices @ pose[:3, :3].T + pose[:3, 3]


# ------------------------------------------------------------------------------------------------------------- the log


@needs_export
def test_a_log_gives_the_recording_back_to_the_last_bit(slipping, file):
    """Arrays with their types and order, infinities and minus zeros, labels, texts, attributes."""
    back = read_mcap(file)
    assert list(back.variables) == list(slipping.variables)
    for name, array in slipping.variables.items():
        assert (back[name].dtype, back[name].shape) == (array.dtype, array.shape), name
        assert back[name].tobytes() == array.tobytes(), name
    for field in dataclasses.fields(Recording):
        if field.name != "variables":
            assert getattr(back, field.name) == getattr(slipping, field.name), field.name


@needs_export
def test_an_incomplete_run_is_one_in_the_log(slipping, tmp_path):
    """With its reason."""
    part = dataclasses.replace(slipping, complete=False, reason="given up", stop_time=0.03)
    part.to_mcap(tmp_path / "part.mcap", picture=False)
    back = read_mcap(tmp_path / "part.mcap")
    assert (back.complete, back.reason, back.stop_time) == (False, "given up", 0.03)


@needs_export
def test_every_sample_has_its_numbers_and_joint_states(slipping, log):
    """Under names that a plot can ask for, at the time of the sample."""
    ticks = [round(1e9 * time) for time in slipping.time]
    for topic in ("/joint_states", "/run/deformation", "/run/support_force"):
        assert [time for time, _, _ in log[topic]] == ticks
    message = log["/run/deformation"][30][2]
    assert message.finger_2_tip.dr == slipping.deformation[30, 1, 0]
    assert log["/run/support_force"][30][2].table_corner_2.f_z == slipping.support_force[30, 1, 2]
    assert log["/run/contact_rotation"][30][2].finger_1_tip.x.y == slipping.contact_rotation[30, 0, 0, 1]
    assert log["/run/internal_force"][30][2].pair_23 == slipping.internal_force[30, 0]
    joint = log["/joint_states"][30][2].joints[4]
    names = slipping.labels["joint"]
    assert (joint.name, joint.position, joint.velocity, joint.effort) == (
        names[4], slipping.joint_position[30, 4], slipping.joint_velocity[30, 4], slipping.joint_torque[30, 4],
    )  # fmt: skip


@needs_export
def test_frames_of_a_log_are_where_the_recording_has_them(slipping, log):
    """Tips, contacts, the object and where it is wanted, at each picture."""
    time, schema, message = log["/tf"][3]
    assert schema == "foxglove.FrameTransforms"
    k = int(np.searchsorted(slipping.time, 1e-9 * time - 1e-6))
    poses = {t.child_frame_id: matrix(t.translation, t.rotation) for t in message.transforms}
    assert {t.parent_frame_id for t in message.transforms} == {"world"}
    wanted = pose_of(slipping.object_position_desired[k], slipping.object_rpy_desired[k])
    np.testing.assert_allclose(poses["object"], pose_of(slipping.object_position[k], slipping.object_rpy[k]), atol=1e-9)
    np.testing.assert_allclose(poses["object_desired"], wanted, atol=1e-9)
    contacts = log["/contacts"][3][2].poses
    for i, tip in enumerate(slipping.labels["contact"]):
        np.testing.assert_allclose(poses[tip][:3, 3], slipping.tip_position[k, i], atol=1e-9)
        np.testing.assert_allclose(poses[f"{tip}/contact"][:3, :3], slipping.contact_rotation[k, i], atol=1e-9)
        point = contacts[i].position
        np.testing.assert_allclose([point.x, point.y, point.z], slipping.contact_point[k, i])


def matrix(position, turn):
    x, y, z, w = turn.x, turn.y, turn.z, turn.w
    pose = np.eye(4)
    pose[:3, 3] = position.x, position.y, position.z
    pose[:3, :3] = np.eye(3) + 2.0 * np.array([
        [-y * y - z * z, x * y - z * w, x * z + y * w],
        [x * y + z * w, -x * x - z * z, y * z - x * w],
        [x * z - y * w, y * z + x * w, -x * x - y * y],
    ])  # fmt: skip
    return pose


@needs_export
def test_each_layer_has_a_topic_that_tells_all_of_it(slipping, log):
    """Bodies once, in frames that move them; the rest at each picture; what is not seen is taken away."""
    layers = {topic.removeprefix("/scene/"): messages for topic, messages in log.items() if topic.startswith("/scene/")}
    assert layers.keys() == RecordedScene(slipping).layers.keys()
    frames = {t.child_frame_id for t in log["/tf"][0][2].transforms} | {"world"}
    pictures = len(log["/tf"])
    assert pictures >= 7
    for layer, messages in layers.items():
        still = layer in ("links", "base", "object", "desired", "table")
        assert len(messages) == (1 if still else pictures), layer
        told = {(*[e.id for e in m.entities], *[d.id for d in m.deletions]) for _, _, m in messages}
        assert len({tuple(sorted(ids)) for ids in told}) == 1
        for _, schema, message in messages:
            assert schema == "foxglove.SceneUpdate"
            for entity in message.entities:
                assert entity.frame_id in frames and entity.frame_locked
                assert len(entity.triangles) + len(entity.lines) + len(entity.arrows) == 1
    marks = [[entity.id for entity in message.entities] for _, _, message in layers["slip"]]
    assert ["slip/finger_2_tip"] in marks and [] in marks


@needs_export
def test_arrows_of_a_log_point_along_x(slipping, log):
    """As Foxglove draws them: along the force of the table on a corner."""
    arrow = next(e.arrows[0] for e in log["/scene/supports"][0][2].entities if "corner 2" in e.id)
    along = matrix(arrow.pose.position, arrow.pose.orientation)[:3, 0]
    force = slipping.support_rotation[0, 1] @ slipping.support_force[0, 1, :3]
    np.testing.assert_allclose(along, -force / np.linalg.norm(force), atol=1e-6)
    assert arrow.shaft_length > 0.0 and arrow.head_diameter > arrow.shaft_diameter > 0.0


@needs_export
def test_tips_are_point_clouds_with_their_displacement(slipping, log):
    """x, y, z in the frame of the tip, and how far each point of the material has moved."""
    _, schema, cloud = log["/tips/finger_1_tip"][0]
    assert schema == "foxglove.PointCloud" and cloud.frame_id == "finger_1_tip"
    table = np.frombuffer(cloud.data, "<f4").reshape(-1, cloud.point_stride // 4)
    assert [field.name for field in cloud.fields] == ["x", "y", "z", "displacement"]
    item = next(item for item in RecordedScene(slipping).items if item.name == "tips/finger_1_tip")
    away = np.linalg.norm(table[:, :3] - item.vertices, axis=1)
    np.testing.assert_allclose(table[:, 3], away, atol=1e-7)


@needs_export
def test_events_are_messages_of_a_log(slipping, log):
    """Each at its time, with the finger as its name; what went wrong is a warning."""
    events = find_events(slipping)
    assert [(1e-9 * time, m.name, m.message.partition(":")[0]) for time, _, m in log["/events"]] == [
        (pytest.approx(event.time), event.finger, event.kind) for event in events
    ]
    levels = {message.message.partition(":")[0]: message.level for _, _, message in log["/events"]}
    assert levels["slip"] == 3 and levels["slip ends"] == 2


@needs_export
def test_units_and_texts_go_along(file, slipping):
    """As metadata and attachments."""
    from mcap.reader import make_reader

    with file.open("rb") as content:
        reader = make_reader(content)
        about = next(iter(reader.iter_metadata())).metadata
        texts = {attachment.name: attachment.data.decode() for attachment in reader.iter_attachments()}
    assert json.loads(about["units"])["object_position"] == "m"
    assert texts["hand.urdf"] == slipping.hand_urdf and texts["scenario.toml"] == slipping.scenario


# ------------------------------------------------------------------------------------------------------------- mistakes


@needs_export
def test_missing_arrays_are_named_and_numbers_go_without_a_picture(recording, tmp_path):
    """A run of which a part was recorded."""
    some = {name: recording[name] for name in ("time", "joint_position", "object_position")}
    part = dataclasses.replace(recording, variables=some)
    with pytest.raises(RecordingError, match="lacks object_rpy"):
        write_mcap(part, tmp_path / "part.mcap")
    assert list(tmp_path.iterdir()) == []
    write_mcap(part, tmp_path / "part.mcap", picture=False)
    assert read_mcap(tmp_path / "part.mcap").variables.keys() == some.keys()


@needs_export
def test_an_interrupted_export_leaves_no_half_file(recording, tmp_path):
    """Nor does it touch an older one."""
    (tmp_path / "run.mcap").write_text("older")

    def interrupt(done: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_mcap(recording, tmp_path / "run.mcap", progress=interrupt)
    assert [file.name for file in tmp_path.iterdir()] == ["run.mcap"]
    assert (tmp_path / "run.mcap").read_text() == "older"


@needs_export
def test_a_file_that_is_no_log_is_named(tmp_path):
    """Not MCAP at all, or not there."""
    (tmp_path / "x.mcap").write_text("no log")
    for name in ("x.mcap", "y.mcap"):
        with pytest.raises(RecordingError, match=name):
            read_mcap(tmp_path / name)


@needs_export
@pytest.mark.parametrize("rate", [0.0, -1.0, np.nan, np.inf])
def test_a_rate_that_is_none_is_refused(recording, tmp_path, rate):
    """Before the work."""
    with pytest.raises(SofthandError, match="rate"):
        write_mcap(recording, tmp_path / "run.mcap", rate)


def test_a_missing_package_is_named_with_its_extra(recording, tmp_path, monkeypatch):
    """And what to type."""
    for name in ("foxglove_schemas_protobuf", "foxglove_schemas_protobuf.JointState_pb2"):
        monkeypatch.setitem(sys.modules, name, None)
    for name in [name for name in sys.modules if name.startswith("softhand.export.mcap")]:
        monkeypatch.delitem(sys.modules, name)
    with pytest.raises(SofthandError, match=r"pip install 'softhand\[export\]'"):
        recording.to_mcap(tmp_path / "run.mcap")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "none is given"),
        (("--out", "run.xyz"), "unknown ending '.xyz'"),
        (("--csv", "--mcap"), "take one of them"),
        (("--csv", "--out", "nowhere/run.csv"), "nowhere/run.csv: cannot be written"),
    ],
)
def test_the_command_names_what_it_cannot_do(recording, tmp_path, options, words):
    """In one message, with nothing written."""
    recording.save(tmp_path / "run.nc")
    outcome = run_command("export", "run.nc", *options, folder=tmp_path)
    assert outcome.returncode == 1 and words in outcome.stderr
    assert [file.name for file in tmp_path.iterdir()] == ["run.nc"]


@needs_export
def test_the_command_takes_a_folder_and_writes_beside_it(recording, tmp_path):
    """The ending of --out may say the format."""
    (tmp_path / "run").mkdir()
    recording.save(tmp_path / "run" / "run.nc")
    assert run_command("export", "run", "--mcap", "--rate", "20", folder=tmp_path).returncode == 0
    assert run_command("export", "run", "--out", "a.csv", folder=tmp_path).returncode == 0
    assert len(read_mcap(tmp_path / "run" / "run.mcap")) == len(recording)
    assert len((tmp_path / "a.csv").read_text().splitlines()) == len(recording) + 1


@needs_rerun
def test_rerun_reads_what_was_written(slipping, tmp_path):
    """Curves at every sample, the scene below its frames."""
    slipping.to_rrd(tmp_path / "run.rrd", rate=RATE)
    printed = subprocess.run(
        [sys.executable, "-m", "rerun", "rrd", "print", "run.rrd"],
        cwd=tmp_path, env={**os.environ, "RERUN_ANALYTICS": "0"}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    chunks = [line for line in printed.stdout.splitlines() if line.startswith("Chunk")]
    rows = {chunk.split(" - ")[1]: 0 for chunk in chunks}
    for chunk in chunks:
        rows[chunk.split(" - ")[1]] += int(chunk.split(" with ")[1].split()[0])
    assert rows["/run/deformation"] == len(slipping) + 1  # and the names of the curves
    assert {"/world/object", "/world/finger_1_tip", "/events", "/world/object/object/body_0"} <= rows.keys()
