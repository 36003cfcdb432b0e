"""What a recording shows of the numbers that a run leaves behind: angles for displacements, and no jumps of a turn."""

from __future__ import annotations

import numpy as np

from softhand.model.configuration import CONTINUOUS
from softhand.numerics.arrays import AnyArray, Array
from softhand.plant.plant import Plant
from softhand.recording.variables import MEASURED_PREFIX


def finished(found: dict[str, AnyArray], plant: Plant, turns: dict[str, Array]) -> dict[str, AnyArray]:
    """Observed fields over time as the variables of a recording.

    Displacements of a law in surface coordinates are the angles s / R, angles go on beyond a turn, and
    `joint_limited` is told from the joint positions.

    Args:
        found: fields of observations, shape (samples, ...) each; those that are there are turned into variables.
        plant: which gave them.
        turns: whole turns that angles had made at the first sample, by the name of their array; set to those at the
            last.
    """
    found = dict(found)
    if "deformation" in found:
        found["deformation"], of_elements = _as_angles(found["deformation"], plant, found.get("element_deformation"))
        if of_elements is not None:
            found["element_deformation"] = of_elements
    is_curved = bool(plant.pads[0]["chart_function"])
    turning = {
        "joint_position": np.flatnonzero(plant.joints[:-1, 0] == CONTINUOUS).tolist(),
        "contact_angles": [0],
        "contact_coordinates": [0, 2, 4] if is_curved else [0, 4],  # theta, the angle about the object's axis, psi
    }
    for name, places in turning.items():
        if name in found:
            found[name], turns[name] = _without_jumps(found[name], places, turns.get(name))
    if "joint_position" in found:
        lower, upper = plant.world.position_limits
        position, coupling = found["joint_position"], plant.world.coupling
        found["joint_limited"] = np.subtract(position > upper, position < lower, dtype=np.int8)
        if coupling is not None:
            joints = coupling.joint_positions(position)
            found["coupled_position"] = joints[:, coupling.coupled_joints]
            lower, upper = coupling.joint_limits
            beyond = np.subtract(joints > upper, joints < lower, dtype=np.int8) * coupling.is_shared
            pushed = np.sign(beyond @ np.sign(coupling.S)).astype(np.int8)
            found["joint_limited"] = np.where(found["joint_limited"] == 0, pushed, found["joint_limited"])
    return found


def measured_in(found: dict[str, AnyArray], plant: Plant, turns: dict[str, Array]) -> dict[str, AnyArray]:
    """The same for what a controller saw, by its own names; args as `finished`."""
    size = len(MEASURED_PREFIX)
    own = {name[size:]: count for name, count in turns.items() if name.startswith(MEASURED_PREFIX)}
    done = finished(found, plant, own)
    turns |= {MEASURED_PREFIX + name: count for name, count in own.items()}
    return {MEASURED_PREFIX + name: done[name] for name in found}


def _as_angles(deformation: Array, plant: Plant, elements: Array | None) -> tuple[Array, Array | None]:
    """The displacements of a law in surface coordinates as the angles s / R, as recordings have them."""
    pads = plant.pads[: plant.world.n_tips]
    surface = np.flatnonzero(pads["is_surface"])
    if surface.size:
        deformation = deformation.copy()
        distance = pads["radius"][surface] - deformation[:, surface, 0]
        deformation[:, surface, 1:3] /= distance[:, :, None]
        if elements is not None:
            elements = elements.copy()
            elements[:, surface, :, :2] /= distance[:, :, None, None]
    return deformation, elements


def _without_jumps(values: Array, turning: list[int], before: Array | None) -> tuple[Array, Array]:
    """Values over time whose angles [rad], at these places of the last dimension, go on beyond one turn.

    Args:
        values: shape (samples, ..., numbers).
        turning: places of the angles.
        before: whole turns of each angle before the first sample, shape (..., angles); None for none.

    Returns:
        The values, and the whole turns of each angle before the last sample.
    """
    goes_on, angles = values.copy(), values[..., turning]
    turns = np.zeros(angles.shape)
    turns[:1] = 0.0 if before is None else before
    turns[1:] = -np.nan_to_num(np.round(np.diff(angles, axis=0) / (2.0 * np.pi)))
    turns = np.cumsum(turns, axis=0)
    goes_on[..., turning] += 2.0 * np.pi * turns
    return goes_on, turns[-1] if len(turns) else np.zeros(angles.shape[1:])
