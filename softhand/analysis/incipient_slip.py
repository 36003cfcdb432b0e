"""Which share of each contact slipped already in a run whose tips held as a whole, or before they let go."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from softhand.assembly.plant import read_plant
from softhand.assembly.probe import check_states, recorded_scenario
from softhand.contact.friction import face_of
from softhand.contact.pads import Fingertip
from softhand.errors import RecordingError
from softhand.model.shapes.shape import Shape
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of
from softhand.patch.patch import Patch
from softhand.patch.tip import contact_radius, material_of_law, ring_shares
from softhand.recording.events import events_as_text, find_events
from softhand.recording.recording import Recording
from softhand.recording.sound import require_sound

_NEEDED = ("contact_force", "contact_rotation", "object_rpy", "deformation", "is_slipping")


def incipient_slip(recording: Recording, rings: int = 12, sectors: int = 12) -> Recording:
    """The recording with `slipped_share` and `microslip_loss` of each contact, and the events that they tell.

    A contact that holds as a whole slips at its rim already. Each contact of the recording becomes a `Patch` that
    transmits the recorded force and torsion, sample by sample, under the pressure that the limit surface of its law
    comes from. Quasi-static and one way: what is found does not act back on the run. The share depends on the history
    of the load, on mu, the pressure and Poisson's ratio, and not on the stiffness of the tip; the loss is inverse to
    the shear modulus, see `patch.tip.material_of_law`. Rolling is taken to carry nothing out of the contact.

    mu is that until slip begins, of the face that is touched. A tip that slips as a whole, or carries more than
    friction would hold, as one that may not slip can, has the share 1. About 1 ms a sample and contact.

    Args:
        recording: a run, of either loop.
        rings: of the grid over the largest contact of each tip.
        sectors: columns of a ring.

    Raises:
        RecordingError: it lacks arrays, or its scenario cannot be used.
        SofthandError: there are too few or too many rings or sectors.
    """
    require_sound(recording, "The recording")
    plant = read_plant(recorded_scenario(recording))
    check_states(plant, recording, *_NEEDED)
    if not len(recording):
        raise RecordingError("The recording has no samples; compute the run anew.", file=None)
    share, loss = np.zeros((2, len(recording), len(plant.fingertips)))
    to_object = np.moveaxis(rotation_of(recording.object_rpy.T), -1, 0).transpose(0, 2, 1)
    for i, tip in enumerate(plant.fingertips):
        axes = to_object @ recording.contact_rotation[:, i]
        loads = _in_face(axes, recording.contact_force[:, i])
        slips = recording.is_slipping[:, i] != 0
        normals = -axes[:, :, 2]
        for k, (held, lost) in enumerate(
            _followed(tip, plant.world.shape, recording.deformation[:, i, 0], loads, normals, rings, sectors)
        ):
            share[k, i] = 1.0 if slips[k] and loads[k, 2] > 0.0 else held
            loss[k, i] = lost
    found = replace(
        recording,
        variables={**recording.variables, "slipped_share": share, "microslip_loss": loss},
        attributes=dict(recording.attributes),
    )
    found.attributes["events"] = events_as_text(find_events(found))
    return found


def _followed(
    tip: Fingertip, shape: Shape, depths: Array, loads: Array, normals: Array, rings: int, sectors: int
) -> Iterator[tuple[float, float]]:
    """Slipped share and loss so far [J] of one contact, sample by sample."""
    law = tip.law
    G, nu = material_of_law(law)
    radii = [contact_radius(law, depth) for depth in depths]
    patch = Patch(max(*radii, 1e-6), G, nu, 1.0, rings, sectors)
    for depth, radius, load, normal in zip(depths, radii, loads, normals, strict=True):
        mu = _friction(tip, shape, normal)
        touches = load[2] > 0.0 and radius > 0.0
        patch.press(mu * load[2] if touches else 0.0, radius, ring_shares(law, depth, patch.edges) if touches else 1.0)
        state = patch.load(*(load[[0, 1, 3]] if touches else np.zeros(3)))
        yield state.slipped, state.lost


def _friction(tip: Fingertip, shape: Shape, normal: Array) -> float:
    """mu until slip begins, at a normal of the object in its frame; as `contact.friction.set_friction`."""
    until = tip.static_friction or tip.friction
    own = tip.face_friction[face_of(shape.rotation, normal)] if tip.face_friction else 0.0
    return own * until / tip.friction if own else until


def _in_face(axes: Array, forces: Array) -> Array:
    """The forces with their tangential part along axes that do not turn about the normal of the object.

    The axes of a contact turn about it where the law is in the paper's coordinates; a patch has to see its load in axes
    that stay with the object. They are carried from normal to normal by the least rotation.

    Args:
        axes: of the contact frames, in the object frame, shape (samples, 3, 3).
        forces: in the contact frames, shape (samples, 4).
    """
    found, x = forces.copy(), axes[0, :, 0]
    for k, (frame, force) in enumerate(zip(axes, forces, strict=True)):
        normal = frame[:, 2]
        x = x - (x @ normal) * normal
        x /= np.linalg.norm(x)
        y = np.cross(normal, x)
        across = force[0] * frame[:, 0] + force[1] * frame[:, 1]
        found[k, 0], found[k, 1] = across @ x, across @ y
    return found
