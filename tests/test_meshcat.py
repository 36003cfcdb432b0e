"""softhand in meshcat: what its page shows, beside what others put there, and that its server ends."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from urllib.parse import urlsplit

import meshcat
import numpy as np
import pytest
from chromium import needs_chromium, open_coarse, wait_until
from commands import run_command
from meshcat.path import Path
from ports import port_of_this_worker

from softhand import MeshcatViewer, Recording, SofthandError, build, load_scenario, simulate
from softhand.viewer.meshcat import wire
from softhand.viewer.meshcat.drawing import Drawing
from softhand.viewer.meshcat.server import MeshcatServer
from softhand.viewer.scene.item import Update
from softhand.viewer.scene.recorded import RecordedScene

PORT = port_of_this_worker(7900)
BASE = Path(("meshcat", "softhand"))


@pytest.fixture(scope="module")
def recording() -> Recording:
    return simulate(load_scenario("target-a", {"duration": 0.2}))


@pytest.fixture(scope="module")
def scene(recording) -> RecordedScene:
    return RecordedScene(recording)


@pytest.fixture(scope="module")
def server():
    server = MeshcatServer(PORT)
    yield server
    server.close()


@pytest.fixture
def vis(server):
    """A Visualizer as others have it, with a box of theirs."""
    vis = meshcat.Visualizer(server.zmq_url)
    vis.delete()
    vis["mine"].set_object(meshcat.geometry.Box([0.1, 0.1, 0.1]))
    return vis


# -------------------------------------------------------------------------------------------------------- the commands


def test_the_first_moment_is_drawn_whole_and_the_same_one_again_not_at_all(scene):
    """An object and a pose for all that is seen; nothing is sent twice."""
    drawing = Drawing(scene, BASE)
    commands = list(drawing.draw(scene.frame(100)))
    seen = {
        f"/meshcat/softhand/{item.name}" for item, u in zip(scene.items, scene.frame(100), strict=True) if u.visible
    }
    for kind in ("set_object", "set_transform"):
        assert {command["path"] for command in commands if command["type"] == kind} == seen
    assert list(drawing.draw(scene.frame(100))) == []


def test_what_goes_and_comes_back_is_told_with_its_object(scene):
    """A server keeps all properties since the object, so that comings and goings do not pile up there."""
    drawing, shown = Drawing(scene, BASE), scene.frame(100)
    list(drawing.draw(shown))
    gone = [*shown[:-1], Update(visible=False)]
    assert [(c["type"], c["value"]) for c in drawing.draw(gone)] == [("set_property", False)]
    assert list(drawing.draw(gone)) == []
    assert [c["type"] for c in drawing.draw(shown)] == ["set_object", "set_property"]


def test_a_pose_keeps_its_scale(scene):
    """meshcat takes matrices column by column."""
    shaft = "forces/finger_2_tip_shaft"
    commands = Drawing(scene, BASE).draw(scene.frame(100))
    sent = next(c["matrix"] for c in commands if c["path"].endswith(shaft) and c["type"] == "set_transform")
    np.testing.assert_array_equal(np.reshape(sent, (4, 4)).T, poses_of(scene, 100)[shaft])


# ---------------------------------------------------------------------------------------------------------- the server


def is_open(host: str, port: int) -> bool:
    with socket.socket() as caller:
        caller.settimeout(2.0)
        return caller.connect_ex((host, port)) == 0


def test_nothing_listens_beyond_this_machine(server):
    """Page and commands: at 127.0.0.1, and not at another address of the same machine."""
    for url in (server.web_url, server.zmq_url):
        port = urlsplit(url).port
        assert is_open("127.0.0.1", port)
        assert not is_open("127.0.0.2", port)


def test_a_server_of_our_own_ends_with_the_viewer(recording):
    """And passes over a busy port, which it says."""
    with socket.create_server(("127.0.0.1", PORT + 50)), MeshcatViewer(port=PORT + 50) as viewer:
        port = urlsplit(viewer.address).port
        assert port > PORT + 50 and f"port {PORT + 50} is busy" in viewer.notice
        process = viewer._target._server._process
    assert process.returncode == 0 and not is_open("127.0.0.1", port)


def test_a_server_ends_where_its_owner_is_killed():
    """Without a word to it."""
    program = (
        "import time; from softhand.viewer.meshcat.server import MeshcatServer; "
        f"print(MeshcatServer({PORT + 60}).web_url, flush=True); time.sleep(60)"
    )
    owner = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    port = urlsplit(owner.stdout.readline().strip()).port
    assert is_open("127.0.0.1", port)
    os.kill(owner.pid, signal.SIGKILL)
    owner.communicate()
    assert wait_until(lambda: not is_open("127.0.0.1", port))


def test_a_server_that_is_gone_is_an_error_and_no_hang(monkeypatch):
    """While drawing, by name."""
    monkeypatch.setattr(wire, "_PATIENCE", 0.3)
    server = MeshcatServer(PORT + 70)
    viewer = MeshcatViewer(vis=meshcat.Visualizer(server.zmq_url))
    server.close()
    with pytest.raises(SofthandError, match="does not answer"):
        viewer.clear()
    viewer.close()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"vis": "tcp://127.0.0.1:6000"}, "a str is no meshcat.Visualizer"),
        ({"simulation": "target-a"}, "takes a simulation first"),
        ({"prefix": ""}, "is no path below vis"),
    ],
)
def test_a_wrong_argument_is_named(arguments, words):
    """Before any server starts."""
    with pytest.raises(SofthandError, match=words):
        MeshcatViewer(**arguments)


def test_a_viewer_without_a_simulation_cannot_show_one(vis, recording):
    """And one that shows a simulation plays no recording."""
    simulation = build(load_scenario("target-a"))
    with MeshcatViewer(vis=vis) as viewer, pytest.raises(SofthandError, match="MeshcatViewer"):
        viewer.show(simulation.observation)
    with MeshcatViewer(simulation, vis) as viewer, pytest.raises(SofthandError, match="make another"):
        viewer.animate(recording)


def test_watching_changes_nothing(recording, vis):
    """A run that is shown is bit-equal to one that is not."""
    simulation = build(load_scenario("target-a", {"duration": 0.2}))
    with MeshcatViewer(simulation, vis) as viewer:
        watched = simulation.run(watch=viewer.show)
    for name, array in recording.variables.items():
        np.testing.assert_array_equal(array, watched[name])


# -------------------------------------------------------------------------------------------------- in a real Chromium


@pytest.fixture(scope="module")
def page(browser, server):
    page = open_coarse(browser, 500, 400)
    page.open(server.web_url)
    yield page
    page.close()


def node(*path: str) -> str:
    return f"viewer.scene_tree.find({['meshcat', *path]!r})"


def paths(page) -> list[str]:
    """What meshcat has directly below the root of a Visualizer."""
    return page.evaluate(f"Object.keys({node()}.children)")


def matrix(page, *path: str) -> np.ndarray:
    page.evaluate(f"{node(*path)}.object.updateMatrix()")
    return np.reshape(page.evaluate(f"{node(*path)}.object.matrix.toArray()"), (4, 4)).T


def near(page, item: str, pose: np.ndarray) -> bool:
    return "<object>" in page.evaluate(f"Object.keys({node('softhand', *item.split('/'))}.children)") and np.allclose(
        matrix(page, "softhand", *item.split("/")), pose, atol=1e-5
    )


def poses_of(scene, k):
    return {item.name: update.pose for item, update in zip(scene.items, scene.frame(k), strict=True) if update.visible}


def wind(page, time: float) -> str:
    """The picture at a time of the animation."""
    page.evaluate(f"(viewer.animator.pause(), viewer.animator.seek({time}), viewer.render())")
    return page.evaluate("(viewer.render(), viewer.renderer.domElement.toDataURL())")


@needs_chromium
def test_an_animation_moves_as_recorded_beside_what_is_there(page, vis, scene, recording):
    """Poses at a key, deformed tips, another picture at another time; a page that opens later shows the same."""
    with MeshcatViewer(vis=vis) as viewer:
        assert viewer.animate(recording) == pytest.approx(0.2)
        assert wait_until(lambda: page.evaluate("viewer.animator.duration") > 0.0)
        first, later = wind(page, 0.0), wind(page, 0.2)
        assert first != later
        for name, pose in poses_of(scene, -1).items():
            assert near(page, name, pose), name
        shares = page.evaluate(f"{node('softhand', 'tips', 'finger_1_tip', '<object>')}.object.morphTargetInfluences")
        assert shares == pytest.approx([0.0] * 5 + [1.0], abs=1e-6)
        assert sorted(paths(page)) == ["mine", "softhand"]
        page.open(viewer.address)
        assert wait_until(lambda: page.evaluate("viewer.animator.duration") > 0.0)
        assert wind(page, 0.2) == later
        vis["softhand"].set_transform(meshcat.transformations.translation_matrix([0.0, 0.0, 2.0]))
        viewer.clear()
        assert wait_until(lambda: page.evaluate(f"Object.keys({node('softhand')}.children)") == [])
        assert matrix(page, "softhand")[2, 3] == 2.0 and sorted(paths(page)) == ["mine", "softhand"]
    assert [error for error in page.console_errors if "404" not in error] == []  # meshcat has no favicon


@needs_chromium
def test_a_running_simulation_is_shown_to_its_end_where_the_user_puts_it(page, vis):
    """Below another path, whose transform stays that of the user."""
    simulation = build(load_scenario("target-a", {"duration": 0.1}))
    mount = meshcat.transformations.translation_matrix([0.0, 0.0, 1.0])
    with MeshcatViewer(simulation, vis, prefix="robot/hand") as viewer:
        vis["robot"].set_transform(mount)
        run = simulation.run(watch=viewer.show)
        viewer._newest._due = 0.0
        viewer.show(simulation.observation)
    last = poses_of(RecordedScene(run), -1)["tips/finger_2_tip"]
    assert wait_until(lambda: np.allclose(matrix(page, "robot", "hand", "tips", "finger_2_tip"), last, atol=1e-6))
    np.testing.assert_allclose(matrix(page, "robot"), mount)
    assert sorted(paths(page)) == ["mine", "robot"]


@needs_chromium
def test_a_replay_ends_at_the_last_sample(page, vis, scene, recording):
    """Fast, but to the end."""
    with MeshcatViewer(vis=vis) as viewer:
        viewer.replay(recording, speed=4.0)
    for name, pose in poses_of(scene, -1).items():
        assert wait_until(lambda name=name, pose=pose: near(page, name, pose)), name


# --------------------------------------------------------------------------------------------------------- the commands


def test_commands_show_and_play_in_meshcat(tmp_path):
    """Both say where, and end; a folder will do in place of its run.nc."""
    options = "--meshcat", "--no-open", "--port", str(PORT + 80)
    shown = run_command("simulate", "--duration", "0.02", "--no-plot", "--out", "run", *options, folder=tmp_path)
    assert shown.returncode == 0, shown.stderr
    played = run_command("view", "run", "--once", *options, folder=tmp_path)
    assert played.returncode == 0, played.stderr
    for outcome in (shown, played):
        assert "meshcat at http://127.0.0.1:" in outcome.stdout


@pytest.mark.parametrize("command", [("simulate", "--duration", "0.01"), ("view", "run.nc")])
def test_meshcat_is_for_this_machine_alone(command, recording, tmp_path):
    """Another host is refused, before any work."""
    recording.save(tmp_path / "run.nc")
    outcome = run_command(*command, "--meshcat", "--host", "0.0.0.0", folder=tmp_path)
    assert outcome.returncode == 1 and "this machine alone" in outcome.stderr
