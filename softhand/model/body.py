"""The object that is held: one rigid body and its shape."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pinocchio as pin

from softhand.model.shapes.reading import read_shape
from softhand.model.shapes.shape import Shape
from softhand.model.urdf.examination import OBJECT
from softhand.model.urdf.pinocchio_model import build_model
from softhand.model.urdf.urdf import Urdf, Vector3


@dataclass(frozen=True, eq=False)
class ObjectModel:
    """One rigid body that can be held.

    Attributes:
        urdf: its links, and its collision shapes, the parts of one solid.
        mass: in place of that of the URDF, whose inertia is scaled alike [kg].
        inertia: moments about the axes of the object frame through the centre of mass, which are then its principal
            ones, in place of those of the URDF [kg m^2].
        ellipsoid: semi-axes of an ellipsoid in the place of the collision shape [m].
        hull: take the convex hull of a mesh.
        cut: threshold by which meshes are cut into convex parts; None: those that are not convex are refused.
    """

    urdf: Urdf
    mass: float | None = None
    ellipsoid: Vector3 | None = None
    hull: bool = False
    cut: float | None = None
    inertia: Vector3 | None = None

    @classmethod
    def read(
        cls,
        file: str | Path,
        mass: float | None = None,
        ellipsoid: Vector3 | None = None,
        hull: bool = False,
        repair: str = "",
        density: float | None = None,
        cut: float | None = None,
        inertia: Vector3 | None = None,
    ) -> ObjectModel:
        """Read an object; see the class, and `repair` and `density` of `HandModel.read`.

        Raises:
            ModelError: the file cannot be used.
        """
        role = replace(OBJECT, shape_counts=ellipsoid is None, repair=repair, density=density)
        return cls(Urdf.read(file, role), mass, ellipsoid, hull, cut, inertia)

    def build(self) -> tuple[pin.Model, Shape]:
        """Its Pinocchio model, one free-flyer joint, and its shape in the frame of that joint.

        Raises:
            ModelError: it has no shape that can be held.
        """
        model = build_model(self.urdf)
        self.weigh(model)
        return model, self.shape(model)

    def weigh(self, model: pin.Model) -> None:
        """Put mass and inertia, if there are any, on the last joint of a model that has them as in the URDF."""
        if self.mass is not None:
            set_mass(model, self.mass)
        if self.inertia is not None:
            held = model.inertias[model.njoints - 1]
            model.inertias[model.njoints - 1] = pin.Inertia(held.mass, held.lever, np.diag(self.inertia))

    def shape(self, model: pin.Model) -> Shape:
        """Its shape in the frame of the free-flyer; the model is that of its URDF alone.

        Raises:
            ModelError: it has none that can be held.
        """
        return read_shape(self.urdf, model, self.ellipsoid, self.hull, self.cut)


def set_mass(model: pin.Model, mass: float) -> None:
    """Set the mass of the body on the last joint [kg], and scale its inertia alike."""
    joint = model.njoints - 1
    inertia = model.inertias[joint]
    model.inertias[joint] = pin.Inertia(mass, inertia.lever, mass / inertia.mass * inertia.inertia)
