"""Collisions along a recording, or at the start of a scenario."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.obstacles import read_obstacles
from softhand.assembly.parts import read_laws
from softhand.assembly.plant import read_coupling
from softhand.assembly.probe import recorded_scenario
from softhand.assembly.resolve import Setup, resolve
from softhand.collision.pairs import list_pairs
from softhand.collision.record import Collision, Collisions
from softhand.collision.search import Search
from softhand.collision.solids import Situation, read_cast
from softhand.contact.supports import table_plane
from softhand.errors import RecordingError, ScenarioError, SofthandError
from softhand.model.body import ObjectModel
from softhand.model.shapes.shape import Shape
from softhand.model.shapes.union import parts_of
from softhand.model.urdf.examination import Role
from softhand.model.urdf.geometry import Purpose
from softhand.model.urdf.urdf import Urdf
from softhand.model.world import joints_of
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of
from softhand.recording.events import Event
from softhand.recording.recording import Recording
from softhand.recording.sound import require_sound
from softhand.scenario.file import resolve_path
from softhand.scenario.scenario import Scenario, load_scenario

_HAND, _OBJECT = (Role(is_object, effort_counts=False, shape_counts=False) for is_object in (False, True))
_NEEDED = ("joint_position", "object_position", "object_rpy")


def collisions(
    source: str | Path | Scenario | Recording, every: float = 0.010, shapes: Purpose = "collision"
) -> Collisions:
    """Collisions that a run passed over: of the links of the hand with the object, the table, palms and each other.

    Links pass through everything in a run; only soft tips and supports touch. The shapes are those of the URDFs, a mesh
    is its convex hull, the table a half space. The depth of two of them is the shortest way that parts them, by coal.

    Left out are links that do not move against each other; neighbours, with no other shape between them on the way to
    the base; links that overlap with all joints at zero, or at the limit nearest to it. What lies inside the ball of a
    soft tip or of a palm, on the body that carries it, meets object and table in the contact model, and only the rest
    of that body counts there.

    Args:
        source: a recording, a run.nc; or a scenario, a .toml file, a name that ships, of which the start counts.
        every: time between the samples that are looked at [s]; begin, end and depth of what is found are then those of
            the recorded samples. What comes and goes in between is not seen.
        shapes: of the hand that count: `collision`, or `visual` for a hand that has no others.

    Raises:
        ModelError: no link of the hand has such a shape, or the object has no collision shape.
        RecordingError: the recording cannot be used.
        SofthandError: the scenario cannot be used, or `every` is not above zero.
    """
    if not every > 0.0:
        raise SofthandError(f"every = {every!r}: must be a time above zero, such as 0.01 s.", value=every)
    if shapes not in ("collision", "visual"):
        raise SofthandError(f"shapes = {shapes!r}: there are 'collision' and 'visual'.", value=shapes)
    if isinstance(source, str | Path):
        is_run = Path(source).suffix.lower() == ".nc"
        source = Recording.load(Path(source)) if is_run else load_scenario(str(source))
    if isinstance(source, Recording):
        return _of_recording(source, every, shapes)
    return collisions_at_start(resolve(source), shapes)


def collisions_at_start(setup: Setup, shapes: Purpose = "collision") -> Collisions:
    """Those of the start of a scenario that is resolved. Raises as `collisions`."""
    world, q = setup.world, setup.grasp.state.q
    situation = situation_of(setup, shapes)
    angles, position, rotation = joints_of(world, q), world.object_position(q), world.object_rotation(q)
    return _search(situation, np.zeros(1), angles[None], position[None], rotation[None], 1)


def situation_of(setup: Setup, shapes: Purpose = "collision") -> Situation:
    """Whose collisions are looked for, of a scenario that is resolved."""
    radii = [tip.law.radius for tip in setup.fingertips]
    return _situation(setup.asked, setup.world.hand, setup.world.object, radii, shapes)


def with_collisions(recording: Recording, events: Sequence[Event]) -> list[Event]:
    """The events of a run with its collisions among them; without, where these cannot be looked for."""
    try:
        found = collisions(recording).events()
    except SofthandError:
        found = []
    return sorted([*events, *found], key=lambda event: event.time)


def _of_recording(recording: Recording, every: float, shapes: Purpose) -> Collisions:
    require_sound(recording, "the recording")
    missing = [name for name in _NEEDED if name not in recording.variables]
    if missing:
        raise RecordingError(f"The recording lacks {', '.join(missing)}; collisions need them.", file=None)
    if not (recording.hand_urdf and recording.object_urdf):
        raise RecordingError(
            "The recording does not hold the URDFs of hand and object; compute the run anew.", file=None
        )
    scenario = recorded_scenario(recording)
    hand = Urdf.parse(recording.hand_urdf, Path(scenario.hand.urdf), _HAND, _folder(scenario.hand.urdf))
    held = Urdf.parse(recording.object_urdf, Path(scenario.object.urdf), _OBJECT, _folder(scenario.object.urdf))
    situation = _situation(scenario, hand, held, [law.radius for law in read_laws(scenario)], shapes)
    time = recording.time
    period = (time[-1] - time[0]) / max(len(time) - 1, 1)
    stride = max(int(every / period + 1e-6), 1) if period else 1
    rotation = np.moveaxis(rotation_of(recording.object_rpy.T), 2, 0)
    return _search(situation, time, recording.joint_position, recording.object_position, rotation, stride)


def _folder(urdf: str) -> Path | None:
    """Where a URDF lay, and its meshes."""
    try:
        return resolve_path(urdf).parent
    except ScenarioError:
        return None


def _situation(scenario: Scenario, hand: Urdf, held: Urdf, radii: Sequence[float], shapes: Purpose) -> Situation:
    table = scenario.table
    return Situation(
        hand,
        held,
        list(zip(scenario.hand.names, radii, strict=True)),
        [(f"palm {k}", palm.frame, palm.position, palm.radius) for k, palm in enumerate(scenario.palm, 1)],
        None if table is None else table_plane(table.height, table.normal),
        [(obstacle.name, obstacle.shape) for obstacle in read_obstacles(scenario.obstacle)],
        scenario.object.ellipsoid,
        read_coupling(scenario.hand.coupling),
        scenario.fingertip.tips_touch,
        shapes,
        _parts(scenario, held),
    )


def _parts(scenario: Scenario, held: Urdf) -> tuple[Shape, ...]:
    """The parts that a mesh of the object is cut into; none if it is taken as it is."""
    cut = scenario.object.cut
    return () if cut is None else parts_of(ObjectModel(held, cut=cut).build()[1])


def _search(
    situation: Situation, time: Array, angles: Array, position: Array, rotation: Array, stride: int
) -> Collisions:
    cast = read_cast(situation)
    pairs, disregarded = list_pairs(cast)

    def poses(samples: NDArray[np.int64]) -> tuple[Array, Array]:
        return cast.kinematics.poses(angles[samples], position[samples], rotation[samples])

    found = Search(pairs, poses, len(time)).run(stride)
    spells = sorted(found.spells, key=lambda spell: (spell.first, spell.names))
    return Collisions(
        [Collision(*s.names, *map(float, (time[s.first], time[s.last], s.depth, time[s.deepest]))) for s in spells],
        found.clearance,
        *found.names,
        float(time[found.sample]),
        len(time),
        disregarded,
        cast.unseen,
        cast.hulls,
    )
