"""A tip with taxels against a face, a box or a ball, at any depth, shear and load: the kernels of `tactile` alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.contact.geometry import find_nearest, place_contact
from softhand.contact.records import CONTACT, PAD, PLANE, SOLID
from softhand.laws.law import Law
from softhand.model.shapes.box import Box
from softhand.numerics.arrays import Array
from softhand.tactile.field import Felt, feel
from softhand.tactile.pattern import taxel_pattern
from softhand.tactile.taxels import Taxels


class Rig:
    """One tip of a law over an object; the pose of the tip is free, the object may be turned.

    Args:
        law: of the tip.
        shape: the solid; an endless face z = 0 if None.
        places: of the taxels, unit vectors in F.
    """

    def __init__(self, law: Law, shape: Any = None, places: Array | None = None) -> None:
        self.law, self.places = law, taxel_pattern() if places is None else places
        self.shape = shape
        self.pads, self.contacts = np.zeros(1, PAD), np.zeros(1, CONTACT)
        pad = self.pad = self.pads[0]
        pad["joint"], pad["base"], pad["rotation"], pad["radius"] = 1, 0, np.eye(3), law.radius
        pad["face_normal"], pad["face_tangent"] = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
        pad["is_surface"], pad["shape"] = law.coordinates == "surface", PLANE if shape is None else SOLID
        if isinstance(shape, Box):
            pad["box_rotation"], pad["box_centre"], pad["box_half"] = shape.rotation, shape.centre, shape.half
        elif shape is not None:
            pad["nearest_function"], pad["shape_data"] = shape.nearest_function, shape.data.ctypes.data
        self.use(self.places)

    def use(self, places: Array) -> None:
        count = len(places)
        self.skin = Taxels(places, np.zeros((1, count), bool)).skin([self.law], self.shape)
        self.felt = Felt(np.zeros((1, count)), np.zeros((1, count, 2)), np.zeros((1, count)), np.zeros((1, count)))

    def feel(
        self,
        tip: Array,
        rotation: Array,
        shear: tuple[float, float, float] = (0.0, 0.0, 0.0),
        force: tuple[float, ...] | None = None,
        slip: tuple[float, float, float] = (0.0, 0.0, 0.0),
        base: tuple[Array, Array] = (np.eye(3), np.zeros(3)),
    ) -> Felt:
        """What is felt.

        Args:
            tip: centre of the flat face [m].
            rotation: axes of F as columns.
            shear: what the memory of the contact holds, in the coordinates of the law.
            force: in the contact frame; that of the law if None.
            slip: speeds in those coordinates.
            base: rotation and position of the object.
        """
        poses = np.zeros((2, 12))
        poses[0], poses[1] = np.concatenate([base[0].T.ravel(), base[1]]), np.concatenate([rotation.T.ravel(), tip])
        contact = self.contacts[0]
        find_nearest(self.pads[0], poses[1], poses[0], contact)
        place_contact(self.pads[0], poses[1], poses[0], contact)
        contact["deformation"] = (self.law.radius - contact["distance"], *shear)
        contact["slip_speed"] = slip
        if force is None:
            deformation = contact["deformation"]
            a, b, c, d = self.law(deformation, contact["angles"][1]) if deformation[0] > 0.0 else np.zeros(4)
            to_x, to_y, twist = contact["theta_per_x"], contact["phi_per_y"], contact["psi_per_x"]
            force = to_x * b + twist * d, to_y * c, a, d
        contact["force"] = force
        feel(self.skin, self.pads, self.contacts, poses, self.felt)
        return Felt(*(array[0].copy() for array in self.felt))

    def press(self, depth: float, rotation: Array, **given: Any) -> Felt:
        """On the endless face, or the top of the shape, so deep [m], with the tip's axes as they are."""
        return self.feel(np.array([0.0, 0.0, self.law.radius - depth]), rotation, **given)

    def torsion(self, felt: Felt) -> float:
        """Sum of moments of the shear about the contact point [N m]."""
        x, q = self.law.radius * self.skin.moved[:2].T, felt.tactile_shear_force
        return float(np.sum(x[:, 0] * q[:, 1] - x[:, 1] * q[:, 0]))


def pointing(direction: Array, roll: float = 0.3) -> Array:
    """Axes of a tip whose x_F points in a direction."""
    x = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    y = np.cross(x, (0.3, -0.5, 0.8))
    y /= np.linalg.norm(y)
    z = np.cross(x, y)
    return np.column_stack([x, np.cos(roll) * y + np.sin(roll) * z, np.cos(roll) * z - np.sin(roll) * y])
