"""The scene of a recording."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from softhand.assembly.obstacles import read_obstacles
from softhand.assembly.plant import read_coupling
from softhand.errors import ScenarioError
from softhand.model.coupling import CouplingTable
from softhand.model.shapes.shape import Shape
from softhand.model.urdf.examination import Role
from softhand.model.urdf.urdf import Urdf
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of
from softhand.recording.recorded import RecordedScenario, scenario_of
from softhand.recording.recording import Recording
from softhand.scenario.bodies import CouplingSection
from softhand.scenario.file import resolve_path
from softhand.scenario.obstacles import ObstacleSection
from softhand.settings.settings import read_settings
from softhand.tactile.pattern import taxel_pattern
from softhand.viewer.scene.ellipsoids import Ellipsoids
from softhand.viewer.scene.item import Update
from softhand.viewer.scene.moment import Past
from softhand.viewer.scene.parts.table import Plane
from softhand.viewer.scene.samples import FELT, recorded_moment
from softhand.viewer.scene.scales import Scales, radii_of, shared_scales
from softhand.viewer.scene.scene import Cast, Scene

_HAND, _OBJECT = (Role(is_object, effort_counts=False, shape_counts=False) for is_object in (False, True))  # to look at
SLIP_HOLD = 0.1  # [s] that the mark of a slip stays: most slips are too short to be seen


class RecordedScene(Scene):
    """The scene of a recording.

    Attributes:
        times: of the samples [s], shape (samples,).
        bounds: spheres around what is there to see over the whole run.
        slip_begins: samples at which a mark of slip appears.

    Args:
        recording: what is shown.
        scales: of several recordings that are compared, see `shared_scales`; by default those of this one.
        slip_hold: how long the mark of a slip stays [s].
        stiffness: how the object gives way, see `ellipsoids_of`; not drawn without.

    Raises:
        RecordingError: the recording lacks what a picture needs.
        ScenarioError: the coupling of the joints in its scenario cannot be read.
    """

    def __init__(
        self,
        recording: Recording,
        scales: Scales | None = None,
        slip_hold: float = SLIP_HOLD,
        stiffness: tuple[Ellipsoids, ...] = (),
    ) -> None:
        scales = scales or shared_scales([recording])
        super().__init__(replace(_cast_of(recording, slip_hold), stiffness=stiffness), scales)
        self.times = recording.time
        self._recording = recording
        self._path, self._since_slip = _path_of(recording), _since_slip(recording)
        marked = self._since_slip <= slip_hold
        self.slip_begins = np.flatnonzero(np.any(marked & ~np.roll(marked, 1, axis=0), axis=1))
        some = range(0, len(recording), max(len(recording) // 25, 1))
        self.bounds = self.extent([recorded_moment(recording, k) for k in some])

    def frame(self, k: int) -> list[Update]:
        """Sample k: one update an item, in the order of `items`."""
        k = range(len(self.times))[k]
        return self.draw(recorded_moment(self._recording, k), Past(self._path[: k + 1], self._since_slip[k]))


def _cast_of(recording: Recording, slip_hold: float) -> Cast:
    scenario = scenario_of(recording)
    table = _table_of(scenario)
    return Cast(
        Urdf.parse(recording.hand_urdf, Path("the hand's URDF"), _HAND, _folder_of(scenario, "hand")),
        Urdf.parse(recording.object_urdf, Path("the object's URDF"), _OBJECT, _folder_of(scenario, "object")),
        recording.labels["contact"],
        radii_of(recording),
        scenario.vector("gravity") or Cast.gravity,
        None if table is None else (table, recording.object_position),
        scenario.vector("object", "ellipsoid"),
        recording.labels.get("support", ()),
        slip_hold if _can_slip(recording, scenario) else None,
        _coupling_of(scenario),
        obstacles=_obstacles_of(scenario),
        taxels=recorded_taxels(recording),
    )


def recorded_taxels(recording: Recording) -> Array | None:
    """Places of the taxels of a recording, unit vectors in the frame of a tip, shape (taxels, 3); None if none."""
    if FELT not in recording.variables:
        return None
    kind = scenario_of(recording).at("tactile", "pattern")
    return taxel_pattern(len(recording.labels["taxel"]), "fibonacci" if kind is None else str(kind))


def _coupling_of(scenario: RecordedScenario) -> CouplingTable | None:
    """The motors of coupled joints, as far as the scenario and not the URDF of the hand has them."""
    table = scenario.at("hand", "coupling")
    return None if table is None else read_coupling(read_settings(CouplingSection, table, "hand.coupling"))


def _can_slip(recording: Recording, scenario: RecordedScenario) -> bool:
    """Whether tips have a limit of friction, by the recorded scenario, or slipped."""
    slips = recording.variables.get("is_slipping")
    return slips is not None and (scenario.is_coulomb or bool(slips.any()))


def _table_of(scenario: RecordedScenario) -> Plane | None:
    """The table of the scenario, if it can be read and has one."""
    height = scenario.number("table", "height")
    normal = np.array(scenario.vector("table", "normal") or (0.0, 0.0, 1.0))
    length = float(np.linalg.norm(normal))
    return None if height is None or length == 0.0 else Plane(height, normal / length)


def _obstacles_of(scenario: RecordedScenario) -> tuple[tuple[str, Shape], ...]:
    """Name and shape of each obstacle of the scenario."""
    tables = scenario.at("obstacle")
    sections = [read_settings(ObstacleSection, table, "obstacle") for table in tables or ()]
    return tuple((obstacle.name, obstacle.shape) for obstacle in read_obstacles(tuple(sections)))


def _folder_of(scenario: RecordedScenario, section: str) -> Path | None:
    """Where the URDF of a section lay, if that can be told."""
    urdf = scenario.at(section, "urdf")
    try:
        return resolve_path(urdf).parent if isinstance(urdf, str) else None
    except ScenarioError:
        return None


def _path_of(recording: Recording) -> Array:
    """Contact points in the object frame over the run [m], shape (samples, nc, 3)."""
    rotation = rotation_of(recording.object_rpy.T)  # shape (3, 3, samples)
    reach = recording.contact_point - recording.object_position[:, None]
    path: Array = np.einsum("kis,snk->sni", rotation, reach)
    return path


def _since_slip(recording: Recording) -> Array:
    """Time since each tip slipped, infinite if it did not [s], shape (samples, nc)."""
    now = recording.time[:, None]
    slips = recording.variables.get("is_slipping", np.zeros((len(recording), len(recording.labels["contact"]))))
    since: Array = now - np.maximum.accumulate(np.where(slips != 0, now, -np.inf), axis=0)
    return since
