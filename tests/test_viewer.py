"""The scene of a grasp, and the live page: what is drawn, who can see it, and that nobody waits for it."""

from __future__ import annotations

import asyncio
import dataclasses
import socket
import urllib.error
import urllib.request

import numpy as np
import pytest
from chromium import needs_chromium, open_coarse, wait_until
from hands import LAYOUTS, STEPPERS, run
from ports import port_of_this_worker
from tornado.websocket import websocket_connect
from typer.testing import CliRunner

from softhand import Recording, RecordingError, SofthandError, Viewer, build, load_scenario, simulate, view
from softhand.commands.main import app
from softhand.model.urdf import examination
from softhand.model.urdf.examination import HAND
from softhand.model.urdf.urdf import Urdf
from softhand.recording import recorded
from softhand.viewer import live
from softhand.viewer.live.pace import Pace
from softhand.viewer.live.readings import readings
from softhand.viewer.live.replay import Replay
from softhand.viewer.live.stream import encode
from softhand.viewer.scene.moment import Past
from softhand.viewer.scene.palette import SLIP, SLIPPING, use_colour
from softhand.viewer.scene.parts.forces import Supports
from softhand.viewer.scene.recorded import RecordedScene
from softhand.viewer.scene.samples import recorded_moment
from softhand.viewer.scene.visuals import read_visuals

PORT = port_of_this_worker(7600)
SIZE = 700, 500  # [px]


@pytest.fixture(scope="module")
def recording() -> Recording:
    return simulate(load_scenario("target-a", {"duration": 0.5}))


@pytest.fixture(scope="module")
def scene(recording) -> RecordedScene:
    return RecordedScene(recording)


def updates_of(scene, k):
    return {item.name: update for item, update in zip(scene.items, scene.frame(k), strict=True)}


# ----------------------------------------------------------------------------------------------------------- the scene


def test_every_item_has_its_layer_and_one_update_a_frame(scene):
    """Names are unique, layers known, frames of soft items keep their number of vertices."""
    names = [item.name for item in scene.items]
    assert len(set(names)) == len(names)
    assert {item.layer for item in scene.items} == set(scene.layers)
    for item, update in zip(scene.items, scene.frame(300), strict=True):
        assert item.faces.min() >= 0 and item.faces.max() < len(item.vertices)
        assert item.soft == (update.vertices is not None)
        if item.soft:
            assert update.vertices.shape == item.vertices.shape
            assert np.isfinite(update.vertices).all()


@pytest.mark.parametrize("k", [0, 250, 500])
def test_tips_sit_where_the_recording_has_them(scene, recording, k):
    """Forward kinematics from the URDF's text agree with what the simulation recorded."""
    updates = updates_of(scene, k)
    for i, name in enumerate(recording.labels["contact"]):
        np.testing.assert_allclose(updates[f"tips/{name}"].pose[:3, 3], recording.tip_position[k, i], atol=1e-12)


@pytest.mark.parametrize("k", [0, 250, 500])
def test_the_flat_part_of_a_tip_lies_on_the_object(scene, recording, k):
    """No vertex of a tip is inside the object, and the farthest ones are on the contact plane."""
    updates = updates_of(scene, k)
    for i, name in enumerate(recording.labels["contact"]):
        pose, vertices = updates[f"tips/{name}"].pose, updates[f"tips/{name}"].vertices
        in_world = vertices @ pose[:3, :3].T + pose[:3, 3]
        depth = (in_world - recording.contact_point[k, i]) @ recording.contact_rotation[k, i][:, 2]
        assert abs(depth.max()) < 1e-9


def test_the_disc_has_the_radius_of_the_contact(scene, recording):
    """sqrt(r^2 - R^2) with R = r - dr."""
    updates = updates_of(scene, 400)
    for i, name in enumerate(recording.labels["contact"]):
        dr = recording.deformation[400, i, 0]
        scale = np.linalg.norm(updates[f"tips/{name}_disc"].pose[:3, 0])
        assert scale == pytest.approx(np.sqrt(0.01**2 - (0.01 - dr) ** 2))


def test_arrows_point_along_the_force_on_the_object(scene, recording):
    """From the contact point, in proportion to the force, the same scale at all contacts."""
    updates = updates_of(scene, 400)
    scales = []
    for i, name in enumerate(recording.labels["contact"]):
        force = recording.contact_rotation[400, i] @ recording.contact_force[400, i, :3]
        head = updates[f"forces/{name}_head"].pose
        tip = head[:3, 3] + head[:3, 2]
        along = tip - recording.contact_point[400, i]
        np.testing.assert_allclose(np.cross(along, force), 0.0, atol=1e-12)
        scales.append(along @ force / (force @ force))
    assert min(scales) > 0.0
    assert max(scales) == pytest.approx(min(scales))


def test_colours_tell_the_friction_use():
    """Green without, red at the limit, dark beyond it and where a tip pulls."""
    red = [use_colour(use)[0] for use in (0.0, 0.25, 0.5)]
    green = [use_colour(use)[1] for use in (0.5, 0.75, 1.0)]
    assert red == sorted(red) and green == sorted(green, reverse=True)
    assert use_colour(1.01) == use_colour(np.inf) == use_colour(np.nan) == SLIPPING


def test_torsion_gauges_turn_with_the_sign_of_the_torsion(scene, recording):
    """The arc is right-handed about the normal into the object; its frame is the contact's."""
    k = 500
    updates = updates_of(scene, k)
    torsion = recording.contact_force[k, :, 3]
    assert torsion.min() < 0.0 < torsion.max()
    for i, name in enumerate(recording.labels["contact"]):
        rings = updates[f"torsion/{name}"].vertices.reshape(-1, 8, 3).mean(axis=1)
        turned = np.sum(np.cross(rings[:-1], rings[1:])[:, 2])
        assert np.sign(turned) == np.sign(torsion[i])
        np.testing.assert_array_equal(updates[f"torsion/{name}"].pose[:3, :3], recording.contact_rotation[k, i])


def test_trails_go_from_the_first_contact_to_the_last(scene, recording):
    """The rings at both ends of the tube are about the contact points of the start and of now, on the object."""
    updates = updates_of(scene, 500)
    for i, name in enumerate(recording.labels["contact"]):
        trail = updates[f"trails/{name}"]
        rings = trail.vertices.reshape(-1, 6, 3).mean(axis=1)
        now = rings[-1] @ trail.pose[:3, :3].T + trail.pose[:3, 3]
        np.testing.assert_allclose(now, recording.contact_point[500, i], atol=1e-9)
        start = updates_of(scene, 0)[f"trails/{name}"].vertices[0]
        np.testing.assert_allclose(rings[0], start, atol=1e-9)


def test_the_ghost_is_at_the_desired_pose(scene, recording):
    """Object and ghost have the same shape at two poses."""
    updates = updates_of(scene, 300)
    np.testing.assert_allclose(updates["desired/body_0"].pose[:3, 3], recording.object_position_desired[300])
    np.testing.assert_allclose(updates["object/body_0"].pose[:3, 3], recording.object_position[300])
    shapes = {item.name: item.vertices for item in scene.items}
    np.testing.assert_array_equal(shapes["desired/body_0"], shapes["object/body_0"])


def test_internal_forces_join_the_contacts_of_their_pair(scene, recording):
    """Line "23" goes from contact 2 to contact 3."""
    pose = updates_of(scene, 100)["internal/23"].pose
    np.testing.assert_allclose(pose[:3, 3], recording.contact_point[100, 1])
    np.testing.assert_allclose(pose[:3, 3] + pose[:3, 2], recording.contact_point[100, 2])


def test_the_bounds_hold_everything(scene):
    """Each vertex of hand and object lies in the sphere, which is not far too large."""
    farthest = 0.0
    for k in (0, 250, 500):
        for item, update in zip(scene.items, scene.frame(k), strict=True):
            if item.layer in ("links", "base", "object", "tips"):
                vertices = item.vertices if update.vertices is None else update.vertices
                place = vertices @ update.pose[:3, :3].T + update.pose[:3, 3]
                farthest = max(farthest, np.linalg.norm(place - scene.bounds.whole.centre, axis=1).max())
    grasp, whole = scene.bounds.grasp, scene.bounds.whole
    assert 0.05 < grasp.radius < 0.7 * whole.radius  # the box, its tips and its way
    assert 0.9 * scene.bounds.whole.radius < farthest < 1.01 * scene.bounds.whole.radius


@pytest.mark.parametrize("name", LAYOUTS)
def test_any_hand_is_drawn_from_its_recording(make_task, name):
    """Two or four fingers, a wrist, continuous joints, canted tips; without visuals bones stand for the links."""
    recording = run(make_task(name), STEPPERS["midpoint"](step=1e-3), 0.02)
    scene = RecordedScene(recording)
    updates = updates_of(scene, len(recording) - 1)
    assert any(item.layer == "links" for item in scene.items)
    assert any(item.layer == "object" for item in scene.items)
    for i, tip in enumerate(recording.labels["contact"]):
        np.testing.assert_allclose(updates[f"tips/{tip}"].pose[:3, 3], recording.tip_position[-1, i], atol=1e-12)


def test_a_tip_may_be_any_frame(scene):
    """Named by the fixed joint that carries its link: the link's rigid shape stays away, its colour is used."""
    mounts = [f"finger_{k}_tip_mount" for k in (1, 2, 3)]
    other = RecordedScene(simulate(load_scenario("target-a", {"duration": 0.01, "hand.tips": mounts})))
    assert len(other.items) == len(scene.items)
    colours = {item.colour for item in other.items if item.name.endswith("tip_mount") and item.layer == "tips"}
    assert colours == {item.colour for item in scene.items if item.name == "tips/finger_1_tip"}


MESH_URDF = """<robot name="m"><link name="a">
  <visual><geometry><mesh filename="{file}" scale="2 2 2"/></geometry></visual>
  <visual><geometry><mesh filename="package://none/there.stl"/></geometry></visual>
</link></robot>"""
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"


@pytest.mark.parametrize("file", ["meshes/t.obj", "package://robot/meshes/t.obj"])
def test_meshes_are_drawn_if_they_can_be_read(tmp_path, file):
    """Beside the URDF, or in the folder of its package; the others are named."""
    folder = tmp_path / "robot"
    (folder / "meshes").mkdir(parents=True)
    (folder / "meshes" / "t.obj").write_text(OBJ)
    visuals, unread = read_visuals(Urdf.parse(MESH_URDF.format(file=file), folder / "m.urdf", HAND, folder))
    assert unread == ["package://none/there.stl"]
    assert visuals[0].mesh.vertices.max() == pytest.approx(2.0)
    assert len(visuals[0].mesh.faces) == 4


# ---------------------------------------------------------------------------------------------------- slip and supports


def slipping(recording, samples=slice(100, 103), tip=1) -> Recording:
    """The recording with a slip of one tip at some samples."""
    slips = np.zeros_like(recording.is_slipping)
    slips[samples, tip] = 1
    return dataclasses.replace(recording, variables={**recording.variables, "is_slipping": slips})


def test_a_slip_is_marked_while_it_lasts_and_a_tenth_of_a_second_longer(recording):
    """At its tip alone, around the contact; then it pales."""
    scene = RecordedScene(slipping(recording))
    looked = [0, 50, *range(98, 104), 150, *range(199, 206), 300, 500]
    shown = {k: updates_of(scene, k)["slip/finger_2_tip"] for k in looked if k != 202}  # 0.1 s later but for rounding
    assert [k for k, mark in shown.items() if mark.visible] == [100, 101, 102, 103, 150, 199, 200, 201]
    np.testing.assert_array_equal(shown[101].pose[:3, 3], recording.contact_point[101, 1])
    np.testing.assert_array_equal(shown[101].pose[:3, :3], recording.contact_rotation[101, 1])
    assert shown[101].colour == SLIP and shown[150].colour > SLIP and shown[200].colour > shown[150].colour
    for other in ("slip/finger_1_tip", "slip/finger_3_tip"):
        assert not any(updates_of(scene, k)[other].visible for k in (100, 102, 150))
    assert [entry.text for entry in scene.legend if entry.ring] == ["Slipping, now or in the last 0.1\u00a0s"]


def test_the_ring_of_slip_is_broken_and_outside_of_the_tip(recording):
    """No colour is needed to tell it from the track of the torsion; it lies between the tip and that track."""
    ring = next(item for item in RecordedScene(slipping(recording)).items if item.name == "slip/finger_1_tip")
    around = np.hypot(ring.vertices[:, 0], ring.vertices[:, 1])
    assert 0.010 < around.min() < around.max() < 0.0155
    angles = np.sort(np.arctan2(ring.vertices[:, 1], ring.vertices[:, 0]))
    assert np.count_nonzero(np.diff(angles) > 0.2) >= 7  # gaps [rad]


def test_tips_that_cannot_slip_have_no_mark(scene):
    """Rolling: neither layer nor legend; Coulomb: both, though nothing slips."""
    assert "slip" not in scene.layers and not any(entry.layer == "slip" for entry in scene.legend)
    assert any("a real tip would slip" in entry.text for entry in scene.legend)
    coulomb = RecordedScene(simulate(load_scenario("target-a", {"duration": 0.002, "fingertip.contact": "coulomb"})))
    assert coulomb.layers["slip"] == "Slip" and sum(entry.ring for entry in coulomb.legend) == 1
    assert not any("a real tip would slip" in entry.text for entry in coulomb.legend)


def test_a_live_page_marks_slips_between_two_pictures():
    """A slip that no picture shows is noted, and on the next one for a tenth of a second."""
    simulation = build(load_scenario("target-a", {"fingertip.contact": "coulomb"}))
    observation = simulation.sample().copy()
    with Viewer(simulation, port=PORT) as viewer:
        marks = [k for k, item in enumerate(viewer._scene.items) if item.layer == "slip"]

        def visible():
            rows = np.frombuffer(viewer._render()[1], "<f4")[1:]
            return [rows[16 * k + 15] for k in marks]

        assert visible() == [0.0, 0.0, 0.0]
        observation.is_slipping[2], observation.time, viewer._newest._due = 1, 0.01, np.inf
        viewer.show(observation)
        for now, seen in ((0.05, 1.0), (0.109, 1.0), (0.2, 0.0)):
            observation.is_slipping[2], observation.time, viewer._newest._due = 0, now, 0.0
            viewer.show(observation)
            assert visible() == [0.0, 0.0, seen]


@pytest.fixture(scope="module")
def lift() -> Recording:
    return simulate(load_scenario("grasp-and-lift", {"duration": 0.01}))


def arrow_of(updates, name, part="shaft"):
    head = updates[f"{name}head"].pose
    return head[:3, 3] + head[:3, 2] - updates[f"{name}{part}"].pose[:3, 3]


def test_arrows_of_the_table_carry_the_object(lift):
    """From the four corners that stand, against gravity, of equal length; none where nothing touches."""
    scene = RecordedScene(lift)
    updates = updates_of(scene, 10)
    seen = [name for name in lift.labels["support"] if updates[f"supports/{name} shaft"].visible]
    assert seen == [f"table corner {k}" for k in (2, 4, 6, 8)]
    arrows = np.array([arrow_of(updates, f"supports/{name} ") for name in seen])
    np.testing.assert_allclose(arrows[:, :2], 0.0, atol=1e-6)
    np.testing.assert_allclose(arrows[:, 2], arrows[0, 2], rtol=1e-3)
    assert arrows[0, 2] < -0.01  # gravity is along +z here
    for name in seen:
        k = lift.labels["support"].index(name)
        np.testing.assert_array_equal(updates[f"supports/{name} shaft"].pose[:3, 3], lift.support_point[10, k])


def test_arrows_of_other_supports_are_the_force_on_their_base(lift):
    """Of a palm that on the object, of two tips that on the second one: as recorded; table and walls the other way."""
    moment = dataclasses.replace(
        recorded_moment(lift, 10), support_point=np.zeros((4, 3)), support_force=np.tile([0.0, 3.0, 4.0], (4, 1))
    )
    names = ["palm 1", "table finger_1_tip", "wall corner 3", "wall's corner 3"]
    arrows = Supports(names, ["wall"], 0.01, 0.001).update(moment, Past.none(3))[::2]
    palm, table, ours, theirs = arrows
    np.testing.assert_allclose(palm.pose[:3, 2] / np.linalg.norm(palm.pose[:3, 2]), [0.0, 0.6, 0.8])
    np.testing.assert_allclose(table.pose[:3, 2] / np.linalg.norm(table.pose[:3, 2]), [0.0, -0.6, -0.8])
    np.testing.assert_allclose(ours.pose[:3, 2], table.pose[:3, 2])
    np.testing.assert_allclose(theirs.pose[:3, 2], palm.pose[:3, 2])


def test_supports_are_a_layer_only_where_there_are_some(scene, lift):
    """With a legend that says how large the longest is, a quarter of 0.2 kg."""
    assert "supports" not in scene.layers and not any(entry.layer == "supports" for entry in scene.legend)
    lifted = RecordedScene(lift)
    assert lifted.layers["supports"] == "Support forces"
    assert [entry.text for entry in lifted.legend if entry.layer == "supports"] == [
        "Force of a support, own scale, longest 0.49\u00a0N"
    ]


def test_a_live_page_shows_supports_and_leaves_room_for_forces_to_come(lift):
    """At a start with open fingers the longest arrow stands for two weights, not for next to nothing."""
    simulation = build(load_scenario("grasp-and-lift"))
    with Viewer(simulation, port=PORT) as viewer:
        texts = [entry.text for entry in viewer._scene.legend]
        viewer.show(simulation.sample())
        rows = np.frombuffer(viewer._render()[1], "<f4")[1:]
        seen = {item.name: rows[16 * k + 15] for k, item in enumerate(viewer._scene.items)}
    assert "longest 3.9\u00a0N" in texts[0] and "Force of a support, own scale, longest 2\u00a0N" in texts
    assert [seen[f"supports/table corner {k} head"] for k in range(1, 9)] == [0.0, 1.0] * 4


def test_a_tip_in_the_air_has_no_track_of_torsion(lift, scene):
    """Open fingers have none, tips that press have one each."""
    in_air, pressing = updates_of(RecordedScene(lift), 5), updates_of(scene, 5)
    for tip in lift.labels["contact"]:
        assert pressing[f"torsion/{tip}_track"].visible and not in_air[f"torsion/{tip}_track"].visible


# -------------------------------------------------------------------------------------------------------- the recording


def test_recordings_carry_the_urdfs(recording, tmp_path):
    """The texts that were loaded, bit for bit through a file; a long one too."""
    recording = dataclasses.replace(recording, object_urdf=recording.object_urdf + f"<!--{'ä' * 100_000}-->")
    recording.save(tmp_path / "run.nc")
    loaded = Recording.load(tmp_path / "run.nc")
    assert "finger_1_abduction" in loaded.hand_urdf
    assert (loaded.hand_urdf, loaded.object_urdf) == (recording.hand_urdf, recording.object_urdf)


@pytest.mark.parametrize(
    ("changes", "said"),
    [({"hand_urdf": ""}, "URDFs"), ({"variables": {"time": np.zeros(0)}}, "no samples"),
     ({"variables": {"time": np.zeros(1)}}, "lacks joint_position")],
)  # fmt: skip
def test_what_cannot_be_drawn_is_refused_with_its_reason(recording, changes, said):
    """An old file, an empty run, missing arrays."""
    with pytest.raises(RecordingError, match=said):
        RecordedScene(dataclasses.replace(recording, **changes))


def test_a_recorded_scene_reads_each_text_once(recording, monkeypatch):
    """The scenario as TOML, the URDFs of hand and object as XML."""
    parsed, read = [], []
    parse, read_document = recorded.parse_toml, examination.read_document
    monkeypatch.setattr(recorded, "parse_toml", lambda text, *rest: parsed.append(text) or parse(text, *rest))
    monkeypatch.setattr(examination, "read_document", lambda text, file: read.append(text) or read_document(text, file))
    text = recording.scenario + "\n# another text than before"
    RecordedScene(dataclasses.replace(recording, scenario=text))
    assert parsed == [text]
    assert sorted(read) == sorted([recording.hand_urdf, recording.object_urdf])


@pytest.mark.parametrize(
    "scenario",
    ["= no TOML", "gravity = 'down'\nhand = 3\nobject = []\ntable = 'none'\nfingertip = 1", "gravity = [0, nan, 1]",
     "[table]\nheight = 'high'", "[table]\nheight = 0.1\nnormal = [0, 0, 0]", "[object]\nellipsoid = [0.1, true, 0.1]",
     "[hand]\nurdf = 'package://none/of_this_name.urdf'"],
)  # fmt: skip
def test_a_scenario_that_cannot_be_used_is_no_obstacle(recording, scene, scenario):
    """What it does not tell is as usual: gravity, no table, the object of the URDF, no slip."""
    other = RecordedScene(dataclasses.replace(recording, scenario=scenario))
    assert [item.name for item in other.items] == [item.name for item in scene.items]
    np.testing.assert_array_equal(other.bounds.upright, np.eye(3))


# ----------------------------------------------------------------------------------------------------------- the server


def read(address: str) -> str:
    with urllib.request.urlopen(address, timeout=10) as answer:
        return answer.read().decode()


@pytest.fixture(scope="module")
def replay(recording):
    """A page for all tests; it stands still at its start unless a test lets it go."""
    with view(recording, port=PORT) as replay:
        replay._obey({"playing": False, "time": 0.0})
        yield replay


class Clock:
    """Stands for the module `time`: it goes on while somebody sleeps, and when told to."""

    def __init__(self) -> None:
        self.now = 100.0
        self.slept: list[float] = []

    def perf_counter(self) -> float:
        return self.now

    def sleep(self, duration: float) -> None:
        self.slept.append(duration)
        self.now += duration


@pytest.fixture
def clock(monkeypatch) -> Clock:
    clock = Clock()
    for module in (live.pace, live.replay, live.newest):
        monkeypatch.setattr(module, "clock", clock)
    return clock


def test_the_page_is_seen_from_this_machine_alone(replay):
    """The port of another address of the same machine is closed."""
    assert "<canvas" in read(replay.address)
    with pytest.raises(OSError):
        socket.create_connection(("127.0.0.2", replay._server.port), timeout=2).close()


def test_a_busy_port_gives_the_next_and_says_so(recording, replay):
    """Two viewers at once."""
    with view(recording, port=replay._server.port) as second:
        assert second._server.port > replay._server.port
        assert f"port {replay._server.port} is busy" in second.notice
        assert "busy" not in replay.notice or replay._server.asked_port != replay._server.port


@pytest.mark.parametrize("host", ["203.0.113.7", "no host of this name"])
def test_a_host_that_cannot_be_listened_on_is_named(recording, host):
    """Another machine's address; no address."""
    with pytest.raises(SofthandError, match=f"{host}.*--host"):
        view(recording, host=host, port=PORT)


def test_a_closed_viewer_frees_its_port(recording):
    """And closing twice is no error."""
    first = view(recording, port=PORT)
    first.close()
    first.close()
    with pytest.raises(urllib.error.URLError):
        read(first.address)
    with view(recording, port=first._server.port) as second:
        assert second.address == first.address


def test_the_page_has_no_address_of_another_machine(replay):
    """Page, style and scripts of ours name none, and the policy would stop it."""
    for name in ("", "chart.css", "live.css", "live.js", "stage.js", "chart.js"):
        assert "http" not in read(replay.address + name).replace("http://www.w3.org/2000/svg", "").replace("https:", "")
    with urllib.request.urlopen(replay.address) as answer:
        assert "default-src 'self'" in answer.headers["Content-Security-Policy"]


def test_a_frame_is_all_numbers_of_its_updates(scene, recording):
    """Time, 16 numbers an item, vertices of the soft items, readings."""
    updates = scene.frame(7)
    read = readings(recorded_moment(recording, 7))
    numbers = np.frombuffer(encode(scene, 0.007, updates, read), "<f4")
    assert read[:3] == pytest.approx(recording.contact_force[7, :, 2])
    assert read[3:6] == pytest.approx(recording.friction_use[7])
    off = recording.object_position[7] - recording.object_position_desired[7]
    assert read[6] == pytest.approx(1e3 * np.linalg.norm(off)) and len(read) == 8
    np.testing.assert_array_equal(numbers[-8:], read.astype("<f4"))
    numbers = numbers[:-8]
    rows = numbers[1 : 1 + 16 * len(updates)].reshape(-1, 16)
    assert numbers[0] == np.float32(0.007)
    soft = [update.vertices for item, update in zip(scene.items, updates, strict=True) if item.soft]
    np.testing.assert_array_equal(numbers[1 + rows.size :], np.concatenate(soft).astype("<f4").reshape(-1))
    for row, update in zip(rows, updates, strict=True):
        np.testing.assert_array_equal(row[:12].reshape(3, 4), update.pose[:3].astype("<f4"))
        assert bool(row[15]) == update.visible


def stream(address: str, frames: int, during=lambda: None) -> list[bytes]:
    """Frames that a page gets which asks for so many, then for no more while something runs."""

    async def talk():
        socket = await websocket_connect(address.replace("http", "ws") + "stream")
        got = []
        for _ in range(frames):
            await socket.write_message("next")
            got.append(await asyncio.wait_for(socket.read_message(), 10))
        await asyncio.get_running_loop().run_in_executor(None, during)
        socket.close()
        return got

    return asyncio.run(talk())


def test_a_page_that_never_asks_again_is_sent_nothing_and_stops_nobody(recording):
    """The simulation goes on at its speed; one frame was drawn, all others were dropped."""
    simulation = build(load_scenario("target-a"))
    drawn = []
    with Viewer(simulation, port=PORT) as viewer:
        draw = viewer._scene.draw
        viewer._scene.draw = lambda *args: drawn.append(1) or draw(*args)

        assert len(stream(viewer.address, 1, lambda: simulation.run(watch=viewer.show))) == 1
        assert len(drawn) == 1
        assert simulation.time == 2.0
        assert viewer._newest.count > 1


def test_showing_costs_next_to_nothing(clock, monkeypatch):
    """Sixty moments a second are copied, all others are passed over; nothing is drawn where no page asks."""
    copied, drawn = [], []
    simulation = build(load_scenario("target-a", {"duration": 0.5}))
    with Viewer(simulation, port=PORT) as viewer:
        monkeypatch.setattr(viewer._scene, "draw", lambda *_: drawn.append(1))
        copy = live.newest.observed_moment
        monkeypatch.setattr(live.newest, "observed_moment", lambda *args: copied.append(1) or copy(*args))
        for _ in range(1000):
            viewer.show(simulation.observation)
            clock.now += 1e-3
    assert 59 <= len(copied) <= 60 and drawn == []


def test_watching_changes_nothing(recording):
    """A run with a viewer is bit-equal to one without."""
    simulation = build(load_scenario("target-a", {"duration": 0.1}))
    alone = simulation.run()
    with Viewer(simulation, port=PORT) as viewer:
        watched = simulation.run(watch=viewer.show)
    for name, array in alone.variables.items():
        np.testing.assert_array_equal(watched[name], array)


def test_pace_holds_a_run_back_to_the_clock(clock):
    """0.2 s of simulated time at twice real time take 0.1 s; a run that is late is not held back."""
    pace = Pace(2.0)
    for k in range(21):
        pace.wait(0.01 * k)
    assert clock.now == pytest.approx(100.1) and sum(clock.slept) == pytest.approx(0.1)
    clock.now += 1.0
    pace.wait(0.21)
    assert sum(clock.slept) == pytest.approx(0.1)


@pytest.mark.parametrize("speed", [0.0, -1.0, np.nan, np.inf])
def test_a_speed_must_be_above_zero(recording, speed):
    """Named with its value."""
    with pytest.raises(SofthandError, match="speed: got"):
        Replay(recording, speed=speed, port=PORT)


def test_a_replay_plays_stops_and_is_wound(recording, clock):
    """By the clock, and by what the page asks for."""
    with view(recording, port=PORT) as replay:
        replay._obey({"playing": False, "time": 0.3})
        clock.now += 0.05
        assert replay.time == 0.3
        first = np.frombuffer(replay._render()[1], "<f4")[0]
        assert first == pytest.approx(0.3)
        replay._obey({"playing": True})
        clock.now += 0.05
        assert replay.time == pytest.approx(0.35)
        replay._obey({"speed": 0.5})
        clock.now += 0.05
        assert replay.time == pytest.approx(0.375)


def test_a_replay_that_plays_once_ends(recording, clock):
    """wait returns when the end is reached."""
    with view(recording, speed=10.0, once=True, port=PORT) as replay:
        replay.wait()
        assert replay.ended and replay.time == 0.5 and clock.now >= 100.05


def test_a_replay_begins_again(recording, clock):
    """After a rest at the end."""
    with view(recording, port=PORT) as replay:
        replay.play()
        shown = []
        for _ in range(13):
            shown.append(replay.time)
            clock.now += 0.125
    assert shown == [0.0, 0.125, 0.25, 0.375, *[0.5] * 7, 0.0, 0.125]
    assert not replay.ended


def test_notebooks_show_the_page_in_a_frame(replay):
    """_repr_html_ is what Jupyter asks for."""
    assert f'<iframe src="{replay.address}"' in replay._repr_html_()


# --------------------------------------------------------------------------------------------------------- the commands


def test_simulate_view_writes_the_same_results(tmp_path):
    """And prints where the page is."""
    command = ["simulate", "--view", "--no-open", "--no-plot", "--duration", "0.05", "--port", str(PORT)]
    result = CliRunner().invoke(app, [*command, "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert "viewer at http://127.0.0.1:" in result.output
    assert Recording.load(tmp_path / "run.nc").complete


def test_a_viewer_that_cannot_start_leaves_no_folder(tmp_path):
    """The mistake is told before anything is written."""
    command = ["simulate", "--view", "--no-open", "--speed", "0", "--duration", "0.01", "--out", str(tmp_path / "new")]
    assert CliRunner().invoke(app, command).exit_code == 1
    assert not (tmp_path / "new").exists()


def test_view_plays_an_incomplete_recording_as_far_as_it_goes(recording, tmp_path):
    """And says why it ends."""
    part = dataclasses.replace(recording, complete=False, reason="interrupted at t = 0.5 s", stop_time=0.5)
    part.save(tmp_path / "run.nc")
    result = CliRunner().invoke(app, ["view", str(tmp_path / "run.nc"), "--once", "--no-open", "--speed", "20"])
    assert result.exit_code == 0, result.output
    assert "goes to 0.5 s: interrupted" in result.output


def test_view_names_a_file_that_is_no_recording(tmp_path):
    """One error of ours, with the file."""
    (tmp_path / "x.nc").write_text("no recording")
    result = CliRunner().invoke(app, ["view", str(tmp_path / "x.nc"), "--no-open"])
    assert isinstance(result.exception, RecordingError)
    assert "x.nc" in str(result.exception)


# -------------------------------------------------------------------------------------------------- in a real Chromium


@pytest.fixture(scope="module")
def shared_page(browser, replay):
    page = open_coarse(browser, *SIZE)
    page.open(replay.address)
    yield page
    page.close()


@pytest.fixture
def page(shared_page, replay):
    """The page of the replay, all layers on, from the usual side."""
    picture(shared_page, replay, 0.05)
    shared_page.evaluate(
        "document.querySelectorAll('[data-layer]').forEach((box) => box.checked || box.click());"
        "document.querySelector('#views button').click()"
    )
    return shared_page


CANVAS = "document.getElementById('stage').toDataURL()"


def picture(page, replay, moment: float) -> str:
    """The canvas at a time of the replay."""
    replay._obey({"playing": False, "time": moment})
    near = f"Math.abs(document.body.dataset.time - {moment}) < 1e-3"
    assert wait_until(lambda: page.evaluate(near))
    return page.evaluate(CANVAS)


@needs_chromium
def test_the_page_asks_nobody_else(page, replay):
    """No error, no request to another machine."""
    assert page.console_errors == []
    assert {address.split("/")[2] for address in page.requests} == {f"127.0.0.1:{replay._server.port}"}


@needs_chromium
def test_the_page_shows_a_picture_that_changes_with_time(page, replay):
    """Not blank, another one later, the same one again."""
    first, later, again = (picture(page, replay, moment) for moment in (0.05, 0.5, 0.05))
    assert first != later and first == again
    colours = page.evaluate(
        """(() => {
          const canvas = document.getElementById('stage'), copy = document.createElement('canvas');
          [copy.width, copy.height] = [canvas.width, canvas.height];
          const context = copy.getContext('2d');
          context.drawImage(canvas, 0, 0);
          const data = context.getImageData(0, 0, copy.width, copy.height).data, seen = new Set();
          for (let k = 0; k < data.length; k += 4) seen.add(data[k] << 16 | data[k + 1] << 8 | data[k + 2]);
          return seen.size;
        })()"""
    )
    assert colours > 500


@needs_chromium
def test_each_layer_has_a_switch_that_works(page, replay, scene):
    """Switching a layer off changes the picture, switching it on brings it back."""
    before = picture(page, replay, 0.5)
    keys = page.evaluate("[...document.querySelectorAll('[data-layer]')].map((box) => box.dataset.layer)")
    assert keys == list(scene.layers)
    for key in keys:
        page.evaluate(f"document.querySelector('[data-layer={key}]').click()")
        assert page.evaluate(CANVAS) != before, key
        page.evaluate(f"document.querySelector('[data-layer={key}]').click()")
    assert page.evaluate(CANVAS) == before


@needs_chromium
def test_a_slip_is_in_the_picture_and_in_words(coarse_page, recording):
    """The finger is named while it is marked; without the layer neither is there."""
    page = coarse_page(*SIZE)
    words = "document.getElementById('slip').textContent"
    with view(slipping(recording), port=PORT) as replay:
        page.open(replay.address)
        for moment, said in ((0.09, ""), (0.15, "slipping: finger 2"), (0.3, "")):
            picture(page, replay, moment)
            assert page.evaluate(words) == said
        before = picture(page, replay, 0.15)
        page.evaluate("document.querySelector('[data-layer=slip]').click()")
        assert page.evaluate(CANVAS) != before
        assert page.evaluate(words) == "" and page.console_errors == []


@needs_chromium
@pytest.mark.parametrize("size", [(1440, 900), (1024, 768), (620, 600), (480, 700)])
def test_nothing_of_the_panel_is_cut_off(page, size):
    """All buttons of the panel lie within it, and the panel beside the picture, on a narrow window too."""
    page.resize(*size)
    places = page.evaluate(
        "['#panel', '#stage', '#player', ...[1, 2, 3, 4, 5].map((k) => `#views button:nth-child(${k})`)].map("
        "(name) => { const box = document.querySelector(name).getBoundingClientRect();"
        "return [box.left, box.right, box.top, box.bottom] })"
    )
    page.resize(*SIZE)
    panel, stage, player, *buttons = places
    assert panel[1] < stage[0] + 1.0 and stage[1] <= size[0] and player[1] <= size[0]
    assert panel[3] <= player[2] or panel[1] <= player[0]
    assert all(panel[0] < left and right < panel[1] for left, right, _, _ in buttons)


@needs_chromium
def test_trails_are_seen_below_their_arrows(page, replay):
    """With all layers on, hiding the trails changes the picture from the default side."""
    before = picture(page, replay, 0.5)
    page.evaluate("document.querySelector('[data-layer=trails]').click()")
    assert page.evaluate(CANVAS) != before


@needs_chromium
def test_the_grasp_can_be_seen_from_nearby(page, replay, scene):
    """The button `grasp` brings the camera to the object and the tips, `3-D` back to the whole hand."""
    whole = picture(page, replay, 0.5)
    press = "[...document.querySelectorAll('#views button')].find((b) => b.textContent === '{}').click()"
    page.evaluate(press.format("grasp"))
    assert page.evaluate("softhand.stage.orbit.target.toArray()") == pytest.approx(list(scene.bounds.grasp.centre))
    assert page.evaluate("softhand.stage.orbit.distance") < 0.7
    page.evaluate(press.format("3-D"))
    assert page.evaluate(CANVAS) == whole


@needs_chromium
def test_the_page_winds_the_replay(page, replay):
    """The slider stops it there, the button plays on."""
    page.evaluate("(() => { const w = document.getElementById('wind'); w.value = 0.2; w.oninput(); })()")
    assert wait_until(lambda: replay.time == pytest.approx(0.2))
    page.evaluate("document.getElementById('play').click()")
    assert wait_until(lambda: replay.time > 0.25)
    page.evaluate("document.getElementById('play').click()")


KEY = "document.body.dispatchEvent(new KeyboardEvent('keydown', {{key: '{}', bubbles: true}}))"


@needs_chromium
def test_keys_and_speed_are_those_of_a_report(page, replay):
    """Arrows step by a sixtieth, Home and End go to the ends, space plays and stops, the list sets the speed."""
    picture(page, replay, 0.2)
    page.evaluate("softhand.wind(0.2)")
    for key, time in (("ArrowRight", 0.2 + 1 / 60), ("ArrowLeft", 0.2), ("End", replay._times[-1]), ("Home", 0.0)):
        page.evaluate(KEY.format(key))
        assert wait_until(lambda time=time: replay.time == pytest.approx(time)), key
    page.evaluate(KEY.format(" "))
    assert wait_until(lambda: replay._playing)
    page.evaluate(KEY.format(" "))
    assert wait_until(lambda: not replay._playing)
    page.evaluate("(() => { const s = document.getElementById('speed'); s.value = '0.25'; s.onchange({target: s}) })()")
    assert wait_until(lambda: replay._speed == 0.25)
    page.evaluate("document.getElementById('speed').onchange({target: {value: 1}})")


@needs_chromium
def test_the_page_says_what_it_shows(page, replay, recording):
    """Title, names of the fingers at their tips, axes and gravity in a corner, curves with their units and values."""
    page.resize(1024, 768)
    picture(page, replay, 0.5)
    text = page.evaluate("document.body.innerText")
    assert "Box lowered, tilted about all three axes" in text and "controller regulation" in text
    names = page.evaluate("[...document.querySelectorAll('.finger')].map((n) => [n.textContent, n.hidden])")
    assert names == [[f"finger {k}", False] for k in (1, 2, 3)]
    assert page.evaluate("document.querySelector('.triad').getAttribute('aria-label')") == (
        "axes of the world, and gravity g"
    )
    panels = page.evaluate(
        "[...document.querySelectorAll('#curves .chart')].map((c) => [c.querySelector('b').textContent,"
        "c.querySelector('.unit').textContent, [...c.querySelectorAll('.values span')].map((s) => s.textContent),"
        "c.querySelector('.area').clientHeight])"
    )
    page.resize(*SIZE)
    assert [panel[1] for panel in panels] == ["[N]", "[-]", "[mm]", "[deg]"]
    k = np.searchsorted(recording.time, 0.5)
    assert np.allclose(list(map(float, panels[0][2])), recording.contact_force[k, :, 2], rtol=2e-2)
    assert min(panel[3] for panel in panels) > 60


@needs_chromium
def test_the_page_begins_at_the_grasp(coarse_page, replay, scene):
    """Not with the links of the hand."""
    page = coarse_page(*SIZE)
    page.open(replay.address)
    assert wait_until(lambda: page.evaluate("document.body.dataset.time"))
    share = scene.bounds.grasp.radius / scene.bounds.whole.radius
    assert page.evaluate("softhand.stage.orbit.distance") == pytest.approx(share)


def test_no_two_colours_of_the_legend_are_alike(scene):
    """Patches of one colour differ by more than shades of black."""
    single = [np.array(entry.colours[0]) for entry in scene.legend if len(entry.colours) == 1]
    apart = [np.abs(one - other).max() for k, one in enumerate(single) for other in single[:k]]
    assert min(apart) > 0.15


@needs_chromium
def test_a_running_simulation_is_shown_until_its_end(coarse_page):
    """The page has the last state shown when the viewer closes, and says that the run has ended."""
    simulation = build(load_scenario("target-a", {"duration": 0.2}))
    page = coarse_page(*SIZE)
    with Viewer(simulation, port=PORT) as viewer:
        page.open(viewer.address)
        assert viewer._server.opened.wait(10)
        pace = Pace()
        simulation.run(watch=lambda observation: (viewer.show(observation), pace.wait(observation.time)))
    assert wait_until(lambda: page.evaluate("document.getElementById('message').textContent") == "The run has ended.")
    assert page.evaluate("Number(document.body.dataset.time)") > 0.17
    samples, force = page.evaluate("[softhand.curves.times.length, softhand.curves.rows[0].values.at(-1)]")
    assert samples >= 2 and force == pytest.approx(simulation.sample().contact_force[0, 2], rel=0.05)
    assert page.console_errors == []
