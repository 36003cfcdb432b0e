"""Taxels, markers and depth pictures of the tips, in a run or at one instant of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from softhand.assembly.probe import Probe, recorded_scenario, recorded_state
from softhand.errors import RecordingError, ScenarioError
from softhand.numerics.arrays import Array
from softhand.recording.recording import Recording
from softhand.sensing.observation import Observation
from softhand.tactile.camera import indentation_of, seen_depth, seen_markers
from softhand.tactile.pattern import taxel_pattern
from softhand.tactile.taxels import taxel_area
from softhand.tactile.tip_shape import Indentation, deformed

_MOST_PIXELS = 2048


class Markers(NamedTuple):
    """Markers in the picture of a camera, along y and z of the tips' frames [m]."""

    positions: Array
    """On tips that touch nothing, shape (nc, markers, 2)."""
    displacements: Array
    """How far each has moved, shape (nc, markers, 2)."""


def tactile_pressure(recording: Recording) -> Array:
    """Pressure on each taxel [Pa], shape (samples, nc, taxels): its normal force over its area 2 pi r^2 / taxels.

    Raises:
        RecordingError: the run has no taxels.
    """
    if "tactile_normal_force" not in recording.variables:
        raise RecordingError(
            "The recording has no taxels; give its scenario the section [tactile], such as tactile.count = 100.",
            file=None,
        )
    force = recording.tactile_normal_force
    probe = Probe.of_scenario(recorded_scenario(recording))
    area = np.array([taxel_area(law.radius, force.shape[2]) for law in probe.laws])
    return np.asarray(force / area[:, None])


def taxel_points(source: Observation | Recording, at: float | None = None) -> Array:
    """Where the taxels are, on the deformed tips, in the world [m], shape (nc, taxels, 3).

    Args:
        source: an observation, or a recording.
        at: time in a recording [s]; its end if None.

    Raises:
        RecordingError: there are no taxels, or the recording does not reach to that time.
    """
    observation = _observed(source, at)
    taxels = observation.known.taxels
    if taxels is None:
        raise RecordingError("There are no taxels; give the scenario the section [tactile].", file=None)
    shapes = zip(_indentations(observation), observation.tip_position, observation.tip_rotation, strict=True)
    return np.array([place + deformed(shape, taxels) @ axes.T for shape, place, axes in shapes])


def marker_displacements(
    source: Observation | Recording, at: float | None = None, count: int = 127, pattern: str = "rings"
) -> Markers:
    """How markers on the inside of the skin move in the picture of a camera that looks out of the flat face.

    As in a TacTip: the material at the contact has moved with it and is pressed flat, the rim is bonded, what lies
    between follows smoothly, and what the object takes of the volume bulges out beside it. The picture is a parallel
    projection along x of the tip. The shape is the one of the film: it agrees with the deformation that the law has,
    and is no solution of an elastic body.

    Args:
        source: an observation, or a recording.
        at: time in a recording [s]; its end if None.
        count: markers on each tip.
        pattern: `rings` or `fibonacci`.

    Raises:
        ScenarioError: there is no such pattern, or no such number of markers.
        RecordingError: the recording does not reach to that time.
    """
    places, observation = taxel_pattern(count, pattern), _observed(source, at)
    shapes = _indentations(observation)
    rest = np.array([shape.radius * places[:, 1:] for shape in shapes])
    return Markers(rest, np.array([seen_markers(shape, places) for shape in shapes]))


def depth_image(source: Observation | Recording, at: float | None = None, pixels: int = 64) -> Array:
    """How far the skin of each tip is pushed in, as a camera in its flat face measures it, along x of the tip [m].

    The object is its tangent plane; the skin beside the contact stays where it was.

    Args:
        source: an observation, or a recording.
        at: time in a recording [s]; its end if None.
        pixels: rows and columns; columns go along y of the tip from -r to r, rows along z.

    Returns:
        Shape (nc, pixels, pixels), 0 where nothing is pushed in.

    Raises:
        ScenarioError: there is no such picture.
        RecordingError: the recording does not reach to that time.
    """
    if isinstance(pixels, bool) or not isinstance(pixels, int) or not 1 <= pixels <= _MOST_PIXELS:
        raise ScenarioError(
            f"pixels: got {pixels!r}; give a whole number from 1 to {_MOST_PIXELS}.", key="pixels", value=pixels
        )
    return np.array([seen_depth(shape, pixels) for shape in _indentations(_observed(source, at))])


def _observed(source: Observation | Recording, at: float | None) -> Observation:
    """The observation there; of a recording from its scenario."""
    if isinstance(source, Observation):
        return source
    if not isinstance(source, Recording):
        raise ScenarioError(
            f"source: got {type(source).__name__}; give an observation or a recording.", key="source", value=source
        )
    times = source.time
    when = float(times[-1]) if at is None else float(at)
    if not times[0] - 1e-9 <= when <= times[-1] + 1e-9:
        raise RecordingError(
            f"at: got {when:g} s, but the recording goes from {times[0]:g} to {times[-1]:g} s.", file=None
        )
    k = int(np.argmin(np.abs(times - when)))
    probe = Probe.of_scenario(recorded_scenario(source))
    return probe.at(recorded_state(probe.plant, source, k), float(times[k]))


def _indentations(observation: Observation) -> list[Indentation]:
    return [
        indentation_of(tip.law.radius, deformation, tip.law.coordinates == "surface", contact, axes)
        for tip, deformation, contact, axes in zip(
            observation.fingertips, observation.deformation, observation.contact_rotation, observation.tip_rotation,
            strict=True,
        )
    ]  # fmt: skip
