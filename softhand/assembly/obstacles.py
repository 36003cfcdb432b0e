"""The obstacles of a scenario."""

from __future__ import annotations

import numpy as np

from softhand.collision.distances import distance
from softhand.collision.solids import standing
from softhand.contact.obstacles import Obstacle
from softhand.errors import ModelError, ScenarioError
from softhand.model.shapes.box import Box
from softhand.model.shapes.cylinder import Cylinder
from softhand.model.shapes.mesh import as_polyhedron
from softhand.model.shapes.mesh_file import Mesh
from softhand.model.shapes.shape import Shape
from softhand.model.shapes.sphere import Sphere
from softhand.model.shapes.union import parts_of
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of
from softhand.scenario.obstacles import ObstacleSection, names_of

_DEEPEST = 5e-4  # [m]


def read_obstacles(sections: tuple[ObstacleSection, ...]) -> list[Obstacle]:
    """The obstacles, in the world.

    Raises:
        ScenarioError: two have one name, or the vertices of one have no volume.
    """
    names = names_of(sections)
    for name in names:
        if names.count(name) > 1:
            raise ScenarioError(f"obstacle.name: {name!r} is there twice; rename one.", key="obstacle.name", value=name)
    return [
        Obstacle(name, shape_of(section), section.friction, section.stiffness, section.damping)
        for name, section in zip(names, sections, strict=True)
    ]


def check_clear(sections: tuple[ObstacleSection, ...], world: World, q: Array) -> None:
    """Nothing if the object is clear of all obstacles, or at most half a millimetre deep in one.

    Raises:
        ScenarioError: it is deeper in one; says how deep.
    """
    if not sections:
        return
    R = np.stack([np.eye(3), world.object_rotation(q)])
    p = np.stack([np.zeros(3), world.object_position(q)])
    held = [standing("object", part, 1) for part in parts_of(world.shape)]
    for obstacle in read_obstacles(sections):
        depth = -min(distance(standing(obstacle.name, obstacle.shape), part, R, p) for part in held)
        if depth > _DEEPEST:
            raise ScenarioError(
                f"obstacle '{obstacle.name}': the object starts {1e3 * depth:.3g} mm deep in it; move object.position "
                "or the position of the obstacle.",
                key="obstacle.position", value=depth,
            )  # fmt: skip


def shape_of(section: ObstacleSection) -> Shape:
    """The shape of an obstacle, placed in the world."""
    rotation, centre = rotation_of(section.rpy), np.array(section.position)
    if section.vertices is not None:
        vertices = np.array(section.vertices)
        mesh = Mesh(vertices, np.zeros((0, 3), dtype=np.int64), "obstacle.vertices")
        try:
            return as_polyhedron(mesh, rotation, centre, take_hull=True)
        except ModelError as error:
            raise ScenarioError(str(error), key="obstacle.vertices", value=section.vertices) from error
    size = section.size or ()
    if section.shape == "box":
        return Box(rotation, centre, 0.5 * np.array(size))
    if section.shape == "cylinder":
        return Cylinder(rotation, centre, size[0], 0.5 * size[1])
    return Sphere(rotation, centre, size[0])
