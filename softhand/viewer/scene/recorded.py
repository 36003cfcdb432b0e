"""The scene of a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from softhand.errors import ScenarioError
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of
from softhand.recording.recording import Recording
from softhand.scenario.file import resolve_path
from softhand.settings.toml import tomllib
from softhand.viewer.scene.bodies import Plane
from softhand.viewer.scene.item import Update
from softhand.viewer.scene.moment import Past, recorded_moment
from softhand.viewer.scene.scales import Scales, radii_of, shared_scales
from softhand.viewer.scene.scene import Cast, Scene

SLIP_HOLD = 0.1  # [s] that the mark of a slip stays: most slips are too short to be seen


class RecordedScene(Scene):
    """The scene of a recording.

    Attributes:
        times: of the samples [s], shape (samples,).
        bounds: spheres around what is seen over the whole run.
        slip_begins: samples at which a mark of slip appears.

    Args:
        recording: what is shown.
        scales: of several recordings that are compared, see `shared_scales`; by default those of this one.
        slip_hold: how long the mark of a slip stays [s].

    Raises:
        RecordingError: the recording lacks what a picture needs.
    """

    def __init__(self, recording: Recording, scales: Scales | None = None, slip_hold: float = SLIP_HOLD) -> None:
        scales = scales or shared_scales([recording])
        super().__init__(_cast_of(recording, slip_hold), scales)
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
    return Cast(
        recording.hand_urdf,
        recording.object_urdf,
        recording.labels["contact"],
        radii_of(recording),
        tuple(_of_scenario(recording, "gravity") or (0.0, 0.0, -9.81)),
        _folder_of(recording, "hand"),
        _folder_of(recording, "object"),
        _table_of(recording),
        _object_section(recording).get("ellipsoid"),
        recording.labels.get("support", ()),
        slip_hold if _can_slip(recording) else None,
    )


def _can_slip(recording: Recording) -> bool:
    """Whether tips have a limit of friction, by the recorded scenario, or slipped."""
    if "is_slipping" not in recording.variables:
        return False
    fingertip = _of_scenario(recording, "fingertip")
    return (isinstance(fingertip, dict) and fingertip.get("contact") == "coulomb") or bool(recording.is_slipping.any())


def _since_slip(recording: Recording) -> Array:
    """Time since each tip slipped, infinite if it did not [s], shape (samples, nc)."""
    now = recording.time[:, None]
    slips = recording.variables.get("is_slipping", np.zeros((len(recording), len(recording.labels["contact"]))))
    since: Array = now - np.maximum.accumulate(np.where(slips != 0, now, -np.inf), axis=0)
    return since


def _table_of(recording: Recording) -> tuple[Plane, Array] | None:
    """The table of the recorded scenario, if it can be read and has one."""
    try:
        table = tomllib.loads(recording.scenario)["table"]
        normal = np.array(table.get("normal", (0.0, 0.0, 1.0)), dtype=float)
        return Plane(float(table["height"]), normal / np.linalg.norm(normal)), recording.object_position[0]
    except (tomllib.TOMLDecodeError, KeyError, TypeError, AttributeError, ValueError):
        return None


def _object_section(recording: Recording) -> dict[str, Any]:
    try:
        section: dict[str, Any] = tomllib.loads(recording.scenario)["object"]
        return section
    except (tomllib.TOMLDecodeError, KeyError, TypeError):
        return {}


def _folder_of(recording: Recording, section: str) -> Path | None:
    """Where the URDF of a section of the recorded scenario lay, if that can be told."""
    try:
        return resolve_path(_of_scenario(recording, section)["urdf"]).parent
    except (KeyError, TypeError, AttributeError, ScenarioError):
        return None


def _of_scenario(recording: Recording, key: str) -> Any:
    """A value at the top of the recorded scenario; None if that cannot be told."""
    try:
        return tomllib.loads(recording.scenario).get(key)
    except tomllib.TOMLDecodeError:
        return None


def _path_of(recording: Recording) -> Array:
    """Contact points in the object frame over the run [m], shape (samples, nc, 3)."""
    rotation = rotation_of(recording.object_rpy.T)  # shape (3, 3, samples)
    reach = recording.contact_point - recording.object_position[:, None]
    path: Array = np.einsum("kis,snk->sni", rotation, reach)
    return path
