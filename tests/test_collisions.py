"""Collisions: against depths by hand, however the scene is turned, and none where tips press as they should."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
from commands import run_command
from hands import BOX_URDF

import softhand
from softhand.assembly.collisions import situation_of, with_collisions
from softhand.assembly.resolve import resolve
from softhand.collision.distances import distance
from softhand.collision.lookout import Lookout
from softhand.collision.pairs import list_pairs
from softhand.collision.search import Search
from softhand.collision.shapes import SoftBall, outside
from softhand.collision.solids import Solid, read_cast
from softhand.commands.simulate import _save
from softhand.model.urdf.geometry import Geometry
from softhand.recording.events import events_as_text, find_events
from softhand.recording.recording import Recording

Array = np.ndarray

LENGTH, EDGE = 0.100, 0.020  # [m] from a knuckle to the middle of the cube at the end of its finger, and that cube
RADIUS = 0.010  # [m] of the soft tips of the scenario below
APART = 0.300  # [m] between the two knuckles
TIME = np.arange(401) * 1e-3


def cube(edge: float = EDGE) -> str:
    return f'<box size="{edge} {edge} {edge}"/>'


def hand_text(shape: str = cube(), palm: str = "", turn: Array | None = None, tip: float = LENGTH + 0.1) -> str:
    """Two fingers along x, each turning about y; a positive angle lowers its end, which has a shape."""
    rpy = " ".join(map(repr, pin.rpy.matrixToRpy(np.eye(3) if turn is None else turn).tolist()))
    fingers = "".join(
        f"""<joint name="{name}" type="revolute"><parent link="palm"/><child link="{name}_finger"/>
        <origin xyz="0 {y} 0"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
        <link name="{name}_finger"><inertial><mass value="0.1"/>
        <inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial>
        <collision><origin xyz="{LENGTH} 0 0"/><geometry>{shape}</geometry></collision></link>
        <joint name="{name}_mount" type="fixed"><parent link="{name}_finger"/><child link="{name}_tip"/>
        <origin xyz="{tip} 0 0"/></joint><link name="{name}_tip"/>"""
        for name, y in (("left", 0.0), ("right", APART))
    )
    return (
        f'<robot name="hand"><link name="world_link"/><joint name="place" type="fixed"><parent link="world_link"/>'
        f'<child link="palm"/><origin xyz="0 0 0" rpy="{rpy}"/></joint><link name="palm">{palm}</link>{fingers}</robot>'
    )


def recorded(
    hand: str,
    left: Array,
    position: Any = (0.0, 0.0, 5.0),
    rotation: Array | None = None,
    right: Array | float = 0.0,
    **changes: Any,
) -> Recording:
    """A run of that hand beside the reference box: angle of the left finger in each sample, and what else there is."""
    values = {"hand.tips": ["left_tip", "right_tip"], "fingertip.radius": RADIUS, **changes}
    scenario = softhand.load_scenario("pinch", values)
    n = len(left)
    rpy = pin.rpy.matrixToRpy(np.eye(3) if rotation is None else rotation)
    arrays: dict[str, Any] = {
        "time": TIME[:n],
        "joint_position": np.stack([left, np.broadcast_to(right, (n,))], axis=1),
        "object_position": np.tile(position, (n, 1)),
        "object_rpy": np.tile(rpy, (n, 1)),
    }
    labels = {"joint": ("left", "right"), "contact": ("left_tip", "right_tip")}
    text = BOX_URDF.read_text()
    return Recording(arrays, labels, scenario.to_toml(), "0", True, "", float(TIME[n - 1]), {}, hand, text)


def table(height: float, normal: Any = (0.0, 0.0, 1.0)) -> dict[str, Any]:
    return {"table": {"height": float(height), "friction": 0.5, "normal": list(map(float, normal))}}


def depth_in_table(angle: Array, height: float) -> Array:
    """Of the cube at the end of a finger: h - (z of its lowest corner)."""
    return height + LENGTH * np.sin(angle) + 0.5 * EDGE * (np.abs(np.sin(angle)) + np.abs(np.cos(angle)))


SWING = 0.5 - 0.5 * np.cos(2.0 * np.pi * TIME / 0.4)  # [rad] down and up again
HEIGHT = -0.080  # [m]


def test_boxes_of_known_depth() -> None:
    """Along the face that is nearest, and apart likewise; turned about its axis by 45 deg a box is longer."""
    one = Solid("one", 0, coal.Box(0.1, 0.2, 0.3))
    other = Solid("other", 1, coal.Box(0.1, 0.1, 0.1))
    R, p = np.stack([np.eye(3)] * 2), np.array([[0.0, 0.0, 0.0], [0.093, 0.02, 0.03]])
    assert distance(one, other, R, p) == pytest.approx(-0.007, abs=1e-7)
    p[1, 0] = 0.113
    assert distance(one, other, R, p) == pytest.approx(0.013, abs=1e-7)
    R[1] = pin.rpy.rpyToMatrix(0.0, 0.0, np.pi / 4.0)
    assert distance(one, other, R, p) == pytest.approx(0.113 - 0.05 - 0.05 * np.sqrt(2.0), abs=1e-7)


def test_times_between_the_samples_that_are_looked_at() -> None:
    """A cube flies through another one: begin, end and depth are those of all samples, though every 10th is seen."""
    x = 0.30 - 2.0 * TIME * (1.0 - TIME)  # [m], ever slower; edges of 0.1 m meet at x = 0.1 and part at -0.1
    pair = Solid("one", 0, coal.Box(0.1, 1.0, 1.0)), Solid("other", 1, coal.Box(0.1, 1.0, 1.0))

    def poses(samples: Array) -> tuple[Array, Array]:
        R = np.tile(np.eye(3), (len(samples), 2, 1, 1))
        p = np.zeros((len(samples), 2, 3))
        p[:, 1, 0] = x[samples]
        return R, p

    found = Search([pair], poses, len(x)).run(10)
    (spell,) = found.spells
    hits = np.flatnonzero(np.abs(x) < 0.1 - 1e-5)
    assert (spell.first, spell.last, spell.deepest) == (hits[0], hits[-1], np.argmin(np.abs(x)))
    assert {spell.first % 10, spell.last % 10, spell.deepest % 10} != {0}
    assert spell.depth == pytest.approx(0.1 - np.min(np.abs(x)), abs=1e-7)
    assert found.clearance == -spell.depth


def test_finger_through_a_table() -> None:
    """Begin, end and depth as by hand; the finger beside it stays above, and its clearance would be told."""
    found = softhand.collisions(recorded(hand_text(), SWING, **table(HEIGHT)))
    depth = depth_in_table(SWING, HEIGHT)
    hits = np.flatnonzero(depth > 1e-5)
    (one,) = found.found
    assert (one.one, one.other) == ("left_finger", "table")
    assert one.begin == pytest.approx(TIME[hits[0]], abs=1e-9)
    assert one.end == pytest.approx(TIME[hits[-1]], abs=1e-9)
    assert one.depth == pytest.approx(depth.max(), abs=1e-7)
    assert one.deepest == TIME[np.argmax(depth)]
    assert found.clearance == -one.depth
    above = softhand.collisions(recorded(hand_text(), 0.2 * SWING, **table(HEIGHT)))
    assert not above.found
    assert above.clearance == pytest.approx(-depth_in_table(0.2 * SWING, HEIGHT).max(), abs=1e-7)
    assert above.clearance_time == pytest.approx(0.2)
    assert (above.clearance_one, above.clearance_other) == ("left_finger", "table")


def test_finger_into_the_object_and_twice() -> None:
    """Two spells are two collisions, by the recorded samples."""
    angle = 0.5 - 0.5 * np.cos(4.0 * np.pi * TIME / 0.4)
    below = -LENGTH * np.sin(1.0) - 0.030  # the top of the box, 60 mm high, is where the deepest middle of the cube is
    found = softhand.collisions(recorded(hand_text(), angle, (LENGTH * np.cos(1.0), 0.0, below)))
    assert [(one.one, one.other) for one in found.found] == [("left_finger", "object")] * 2
    assert found.found[0].end < 0.2 < found.found[1].begin
    expected = 0.5 * EDGE * (np.sin(1.0) + np.cos(1.0))
    assert [one.depth for one in found.found] == pytest.approx([expected] * 2, abs=1e-7)


@pytest.mark.parametrize("rpy", [(0.3, -0.2, 1.1), (np.pi / 2.0, 0.4, -2.0)])
def test_turned_scene_collides_alike(rpy: tuple[float, ...]) -> None:
    R = pin.rpy.rpyToMatrix(*rpy)
    place = np.array([LENGTH * np.cos(1.0), 0.0, -0.120])
    straight = softhand.collisions(recorded(hand_text(), SWING, place, **table(HEIGHT)))
    turned = softhand.collisions(recorded(hand_text(turn=R), SWING, R @ place, R, **table(HEIGHT, R[:, 2])))
    assert len(straight.found) == 2
    assert [(a.one, a.other, a.begin, a.end) for a in straight.found] == [
        (b.one, b.other, b.begin, b.end) for b in turned.found
    ]
    assert [a.depth for a in straight.found] == pytest.approx([b.depth for b in turned.found], abs=1e-7)


def test_mesh_is_as_its_box(tmp_path: Path) -> None:
    corners = 0.5 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"f {' '.join(str(i + 1) for i in face)}" for face in faces]
    (tmp_path / "cube.obj").write_text("\n".join(lines))
    mesh = f'<mesh filename="cube.obj" scale="{EDGE} {EDGE} {EDGE}"/>'
    where = {"hand.urdf": str(tmp_path / "hand.urdf"), **table(HEIGHT)}
    (one,) = softhand.collisions(recorded(hand_text(), SWING, **where)).found
    found = softhand.collisions(recorded(hand_text(mesh), SWING, **where))
    (other,) = found.found
    assert (other.begin, other.end) == (one.begin, one.end)
    assert other.depth == pytest.approx(one.depth, abs=1e-7)
    assert found.hulls == ["left_finger", "right_finger"]
    assert "convex hulls: left_finger, right_finger" in " ".join(found.notes())


def test_links_with_each_other() -> None:
    """Fingers side by side; with the palm they are neighbours, and what overlaps at zero does not count."""
    wide = f'<box size="{EDGE} {APART + 0.01} {EDGE}"/>'
    at_zero = softhand.collisions(recorded(hand_text(wide), 0.1 * SWING))
    assert not at_zero.found
    reasons = {(pair.one, pair.other): pair.reason for pair in at_zero.disregarded}
    assert reasons["left_finger", "right_finger"] == "overlap with all joints at zero"
    assert "left_finger - right_finger" in " ".join(at_zero.notes())
    palm = "<collision><geometry><box size='0.5 0.5 0.5'/></geometry></collision>"
    inside = softhand.collisions(recorded(hand_text(palm=palm), SWING))
    reasons = {(pair.one, pair.other): pair.reason for pair in inside.disregarded}
    assert not inside.found
    assert reasons["left_finger", "palm"] == "neighbours in the hand"
    across = hand_text().replace(
        f'<origin xyz="0 {APART} 0"/>', '<origin xyz="0.200 0 0.050" rpy="0 0 3.141592653589793"/>'
    )  # the right finger comes down on the left one
    (one,) = softhand.collisions(recorded(across, 0.0 * SWING, right=0.3 * SWING)).found
    assert (one.one, one.other) == ("left_finger", "right_finger")
    assert one.deepest == pytest.approx(0.2)
    assert not softhand.collisions(recorded(across, 0.0 * SWING, right=0.1 * SWING)).found


def test_what_is_left_outside_a_ball() -> None:
    """A rod with a ball at its end loses this end, exactly; a ball in a ball of its size is gone."""
    rod = Geometry("rod", "box", np.array([0.1, 0.01, 0.01]), np.eye(3), np.zeros(3), "", None, None)
    left = outside(rod, [SoftBall("tip", np.array([0.05, 0.0, 0.0]), 0.01)])
    left.computeLocalAABB()
    end = 0.05 - np.sqrt((1.001 * 0.01) ** 2 - 2.0 * 0.005**2)  # where the sphere cuts the long edges
    assert left.aabb_local.max_[0] == pytest.approx(end, abs=1e-12)
    assert left.aabb_local.min_[0] == pytest.approx(-0.05)
    tip = Geometry("tip", "sphere", np.array([0.01]), np.eye(3), np.array([0.05, 0.0, 0.0]), "", None, None)
    assert outside(tip, [SoftBall("tip", np.array([0.05, 0.0, 0.0]), 0.01)]) is None


def test_soft_tip_explains_its_rigid_core() -> None:
    """A rigid ball within the soft one presses with it, on object and table; a larger one is told by what juts out."""
    small, large = (f'<sphere radius="{radius}"/>' for radius in (RADIUS, 1.5 * RADIUS))
    place = LENGTH * np.cos(1.0), 0.0, -LENGTH * np.sin(1.0) - 0.035  # the ball goes 5 mm into the box
    core = softhand.collisions(recorded(hand_text(small, tip=LENGTH), SWING, place, **table(HEIGHT)))
    assert not core.found
    assert {(pair.one, pair.other) for pair in core.disregarded if "soft ball" in pair.reason} >= {
        ("left_finger", "object"),
        ("left_finger", "table"),
    }
    bare = softhand.collisions(recorded(hand_text(small), SWING, place))
    assert bare.found[0].depth == pytest.approx(0.005, abs=1e-6)
    juts = softhand.collisions(recorded(hand_text(large, tip=LENGTH), SWING, place))
    assert juts.found[0].depth == pytest.approx(0.010, abs=2e-4)  # of a polytope within the sphere


def test_palms_meet_links_but_not_the_object() -> None:
    """The ball of a palm carries the object in the contact model; a finger that goes through it is told."""
    palm = {"frame": "palm", "position": [LENGTH * np.cos(1.0), 0.0, -0.090], "radius": 0.02, "friction": 0.5}
    run = recorded(hand_text(), SWING, (LENGTH * np.cos(1.0), 0.0, -0.140), palm=[palm])
    assert {(one.one, one.other) for one in softhand.collisions(run).found} == {("left_finger", "palm 1")}


def test_links_without_shape_are_said_not_to_be_seen() -> None:
    text = hand_text().replace("<collision>", "<visual>", 1).replace("</collision>", "</visual>", 1)
    found = softhand.collisions(recorded(text, SWING, **table(HEIGHT)))
    assert not found.found
    assert found.unseen == ["left_finger"]
    assert "left_finger" in found.notes()[0]
    with_visuals = softhand.collisions(recorded(text, SWING, **table(HEIGHT)), shapes="visual")
    assert [one.one for one in with_visuals.found] == ["left_finger"]


def test_hand_without_shapes_says_so_in_one_line(tmp_path: Path) -> None:
    run = recorded(hand_text().replace("collision>", "visual>"), SWING, **table(HEIGHT))
    with pytest.raises(softhand.ModelError, match="no link of the hand has a <collision> shape") as error:
        softhand.collisions(run)
    assert "\n" not in str(error.value)
    assert with_collisions(run, []) == []
    run.save(tmp_path / "run.nc")
    said = run_command("check", "run.nc", folder=tmp_path)
    assert said.returncode == 0
    assert sum("no link of the hand has a <collision> shape" in line for line in said.stdout.splitlines()) == 1


def test_check_tells_of_a_run(tmp_path: Path) -> None:
    """In a warning, and all of it as JSON with units."""
    recorded(hand_text(), SWING, **table(HEIGHT)).save(tmp_path / "run.nc")
    said = run_command("check", "run.nc", folder=tmp_path)
    assert "collision: left_finger is in table from 0.129 to 0.271 s, at most 18 mm deep" in said.stdout
    told = json.loads(run_command("check", "run.nc", "--json", folder=tmp_path).stdout)["collisions"]
    assert told["found"][0]["one"] == "left_finger"
    assert told["found"][0]["units"]["depth"] == "m"
    assert told["units"]["clearance"] == "m"


def test_collisions_are_events() -> None:
    (event,) = with_collisions(recorded(hand_text(), SWING, **table(HEIGHT)), [])
    assert (event.kind, event.finger, event.time) == ("collision", "left_finger", pytest.approx(0.129))
    assert event.text == "with table, until 0.271 s, at most 18 mm deep at 0.2 s"


def test_what_simulate_writes_has_collisions_among_its_events(tmp_path: Path) -> None:
    """In the order of time, once, beside those that the arrays tell; without any the file stays as it is."""
    run = recorded(hand_text(), SWING, **table(HEIGHT))
    run.attributes["events"] = events_as_text(find_events(run))
    assert "collision" not in run.attributes["events"]
    _save(run, tmp_path, plot=False)
    events = json.loads(softhand.Recording.load(tmp_path / "run.nc").attributes["events"])
    assert [event["finger"] for event in events if event["kind"] == "collision"] == ["left_finger"]
    assert [event["time"] for event in events] == sorted(event["time"] for event in events)
    (tmp_path / "clear").mkdir()
    clear = recorded(hand_text(), 0.2 * SWING, **table(HEIGHT))
    _save(clear, tmp_path / "clear", plot=False)
    assert "collision" not in str(softhand.Recording.load(tmp_path / "clear" / "run.nc").attributes)


def test_wrong_questions() -> None:
    run = recorded(hand_text(), SWING)
    with pytest.raises(softhand.SofthandError, match=r"every = 0\.0: must be a time above zero"):
        softhand.collisions(run, every=0.0)
    with pytest.raises(softhand.SofthandError, match="there are 'collision' and 'visual'"):
        softhand.collisions(run, shapes="looks")  # type: ignore[arg-type]
    bare = Recording({"time": TIME}, {}, run.scenario, "0", True, "", 0.4, {}, run.hand_urdf, run.object_urdf)
    with pytest.raises(softhand.RecordingError, match="lacks joint_position, object_position, object_rpy"):
        softhand.collisions(bare)
    old = Recording(run.variables, run.labels, run.scenario, "0", True, "", 0.4)
    with pytest.raises(softhand.RecordingError, match="does not hold the URDFs"):
        softhand.collisions(old)


@pytest.mark.parametrize("name", softhand.scenario_names())
def test_no_shipped_scenario_starts_in_a_collision(name: str) -> None:
    """By what their hands look like where they have no collision shapes, which is stricter."""
    shapes = "collision" if "allegro" in name else "visual"
    found = softhand.collisions(name, shapes=shapes)  # type: ignore[arg-type]
    assert found.found == []
    assert 0.0 < found.clearance < 0.05


ENDING = {"duration": 0.7, "collision.ends_run": True}


def test_collision_ends_a_run_in_both_loops() -> None:
    """At the first look at which two are too deep in each other: that sample is kept, and no step follows."""
    scenario = softhand.load_scenario("allegro-box", ENDING)
    with pytest.raises(softhand.SimulationStopped, match=r"link_6\.0 is 0\.0192 mm deep in object") as stop:
        softhand.simulate(scenario)
    recording = stop.value.recording
    (one,) = softhand.collisions(recording).found
    assert (stop.value.reason, stop.value.time, recording.time[-1]) == ("collision", 0.64, 0.64)
    assert (one.begin, one.end) == (pytest.approx(0.639), pytest.approx(0.64))
    assert one.depth == pytest.approx(1.92e-5, abs=1e-7)
    assert not recording.complete
    runs = softhand.rollout(scenario, {"collision.depth": [1e-5, 1e-3]}, every=0.01)
    assert runs.compiled.all()
    assert [(end.reason, end.time) for end in runs.outcomes] == [("collision", 0.64), ("finished", 0.7)]
    np.testing.assert_allclose(runs.object_position[0, :65], recording.object_position[::10], rtol=0.0, atol=1e-12)
    assert np.isnan(runs.object_position[0, 65:]).all()


def test_lookout_sees_what_all_pairs_have(rng: np.random.Generator) -> None:
    """The deepest of all pairs, one by one, at angles within the limits and a hand in the table now and then."""
    setup = resolve(softhand.load_scenario("allegro-box", {"table": table(-0.08, (0.3, -0.2, 1.0))["table"]}))
    situation = situation_of(setup)
    lookout, cast = Lookout(situation, 2e-3), read_cast(situation)
    pairs, _ = list_pairs(cast)
    lower, upper = setup.world.position_limits
    seen = []
    for _ in range(20):
        angles = lower + (0.2 + 0.6 * rng.uniform(size=len(lower))) * (upper - lower)
        position, rotation = (
            np.array([0.0, 0.0, 0.15]) + rng.normal(0.0, 0.08, 3),
            pin.rpy.rpyToMatrix(*rng.normal(size=3)),
        )
        R, p = cast.kinematics.poses(angles[None], position[None], rotation[None])
        depths = {(a.name, b.name): -distance(a, b, R[0], p[0]) for a, b in pairs}
        worst = max(depths, key=depths.__getitem__)
        found = lookout.deepest(angles, position, rotation)
        seen.append(found and found.other)
        if depths[worst] > 2e-3:
            assert found is not None
            assert found.depth == pytest.approx(depths[worst], abs=1e-6)
        else:
            assert found is None
    assert len(set(seen)) >= 3, seen


def test_collision_at_the_start_ends_a_run_there() -> None:
    """Also one that is driven by hand: its first sample is there, its first step is refused, however often."""
    simulation = softhand.build("pinch", overrides={**table(0.0), "collision.shapes": "visual", "collision.depth": 0.0})
    for _ in range(2):
        simulation.reset()
        simulation.sample()
        with pytest.raises(softhand.SimulationStopped, match=r"deep in table.*t = 0 s"):
            simulation.step()
        assert simulation.time == 0.0
    bare = {"collision": {"ends_run": False}, "duration": 0.01}
    assert softhand.simulate("target-a", overrides=bare).complete  # no shapes are asked for


def test_ending_needs_shapes_and_sound_settings() -> None:
    with pytest.raises(softhand.ModelError, match="no link of the hand has a <collision> shape"):
        softhand.build("target-a", overrides={"collision.ends_run": True})
    assert softhand.build("target-a", overrides={"collision.ends_run": True, "collision.shapes": "visual"})
    for key, value in (("depth", -1e-3), ("every", 0.0), ("depth", float("nan")), ("shapes", "looks"), ("end_run", 1)):
        with pytest.raises(softhand.ScenarioError, match=f"collision.{key}"):
            softhand.load_scenario("target-a", {f"collision.{key}": value})


def test_command_tells_and_fails(tmp_path: Path) -> None:
    said = run_command("simulate", "allegro-box", "--set", "duration=0.7", "--set", "collision.ends_run=true",
                       "--no-plot", "--out", "out", folder=tmp_path)  # fmt: skip
    assert said.returncode == 1
    assert "collision.ends_run ends the run there" in said.stderr
    assert (tmp_path / "out" / "run.nc").exists()
