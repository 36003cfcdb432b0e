"""The moment that a controller sees."""

from __future__ import annotations

from typing import Any

from softhand.plant.plant import Plant
from softhand.sensing.observation import Observation
from softhand.viewer.scene.moment import CONTACT_FIELDS, Moment, forces_in_world
from softhand.viewer.scene.poses import pose_of


def observed_moment(observation: Observation, plant: Plant) -> Moment:
    """What a controller sees and the supports of the plant at the same state, copied."""
    desired, supports = observation.desired.coordinates, plant.support_contacts
    contacts: dict[str, Any] = {name: getattr(observation, name).copy() for name in CONTACT_FIELDS}
    return Moment(
        observation.time,
        observation.joint_position.copy(),
        pose_of(observation.object_position, observation.object_rpy),
        pose_of(desired[:3], desired[3:]),
        **contacts,
        support_point=supports["point"].copy(),
        support_force=forces_in_world(supports["rotation"], supports["force"]),
        tactile_normal_force=observation.tactile_normal_force.copy(),
    )
