"""The scene of a plant that runs now."""

from __future__ import annotations

import numpy as np

from softhand.model.shapes.ellipsoid import Ellipsoid
from softhand.model.shapes.face import Face
from softhand.model.shapes.shape import Shape
from softhand.plant.plant import Plant
from softhand.viewer.scene.moment import Moment
from softhand.viewer.scene.parts.table import Plane
from softhand.viewer.scene.recorded import SLIP_HOLD
from softhand.viewer.scene.scales import fit_scales
from softhand.viewer.scene.scene import Cast, Scene

_HEADROOM = 1.5  # of a live scene, over the forces at its start

_SHARE = 0.04  # of a force, of the strongest taxel, where nothing is pressed yet


def live_scene(plant: Plant, first: Moment) -> Scene:
    """The scene of a plant that runs now; its first moment sets the scales.

    Raises:
        ModelError: a URDF cannot be read.
    """
    world = plant.world
    table = _table_of(plant)
    cast = Cast(
        world.hand,
        world.object,
        tuple(tip.name for tip in world.tips),
        tuple(map(float, plant.pads["radius"][: world.n_tips])),
        tuple(map(float, world.gravity)),
        None if table is None else (table, first.object_pose[:3, 3]),
        world.shape.semi_axes if isinstance(world.shape, Ellipsoid) else None,
        tuple(support.name for support in plant.supports),
        SLIP_HOLD if any(tip.can_slip for tip in plant.fingertips) else None,
        world.coupling.table if world.coupling is not None else None,
        obstacles=_obstacles_of(plant),
        taxels=None if plant.taxels is None else plant.taxels.places,
    )
    weight = float(world.model.inertias[world.object_joint].mass * np.linalg.norm(world.gravity))
    tips, internal, supports = first.contact_force, first.internal_force, first.support_force
    scales = fit_scales(_HEADROOM * tips, _HEADROOM * internal, _HEADROOM * supports, cast.radii, weight)
    if plant.n_taxels:
        felt = float(first.tactile_normal_force.max(initial=0.0))
        scales = scales._replace(taxel=max(_HEADROOM * felt, _SHARE * scales.force))
    return Scene(cast, scales)


def _obstacles_of(plant: Plant) -> tuple[tuple[str, Shape], ...]:
    found: dict[int, tuple[str, Shape]] = {}
    for support in plant.supports:
        if support.obstacle is not None:
            found.setdefault(id(support.obstacle), (support.of, support.obstacle))
    return tuple(found.values())


def _table_of(plant: Plant) -> Plane | None:
    shapes = (support.shape for support in plant.supports)
    return next((Plane(shape.offset, shape.normal) for shape in shapes if isinstance(shape, Face)), None)
