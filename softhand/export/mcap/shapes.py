"""Things of a scene as entities of Foxglove's scene."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.ArrowPrimitive_pb2 import ArrowPrimitive
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneEntityDeletion_pb2 import SceneEntityDeletion
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.TriangleListPrimitive_pb2 import TriangleListPrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3

from softhand.export.frames import Arrow, Thing
from softhand.numerics.arrays import AnyArray, Array
from softhand.viewer.scene.palette import Colour
from softhand.viewer.scene.poses import quaternion_of

_LINE = 1.0  # [px]


def scene_update(things: Iterable[Thing], stamp: Any) -> Any:
    """Things as they are now; those that are not seen are taken away."""
    update = SceneUpdate()
    for thing in things:
        if thing.visible:
            update.entities.append(_entity(thing, stamp))
        else:
            matching = SceneEntityDeletion.Type.MATCHING_ID
            update.deletions.append(SceneEntityDeletion(timestamp=stamp, type=matching, id=thing.item.name))
    return update


def pose_message(matrix: Array) -> Any:
    """A pose, shape (4, 4)."""
    x, y, z = matrix[:3, 3].tolist()
    return Pose(position=Vector3(x=x, y=y, z=z), orientation=_rotation(matrix[:3, :3]))


def transform_parts(matrix: Array) -> dict[str, Any]:
    """A pose, shape (4, 4), as the fields of a transform."""
    x, y, z = matrix[:3, 3].tolist()
    return {"translation": Vector3(x=x, y=y, z=z), "rotation": _rotation(matrix[:3, :3])}


def point_cloud(thing: Thing, stamp: Any) -> Any:
    """Vertices of a soft thing, with how far each has moved from where it is at rest [m]."""
    rest = thing.item.vertices
    table = np.column_stack([thing.vertices, np.linalg.norm(thing.vertices - rest, axis=1)]).astype("<f4")
    number = PackedElementField.NumericType.FLOAT32
    fields = [
        PackedElementField(name=name, offset=4 * k, type=number)
        for k, name in enumerate(("x", "y", "z", "displacement"))
    ]
    data = table.tobytes()
    return PointCloud(
        timestamp=stamp, frame_id=thing.frame, pose=pose_message(np.eye(4)), point_stride=16, fields=fields, data=data
    )


def _entity(thing: Thing, stamp: Any) -> Any:
    item = thing.item
    entity = SceneEntity(timestamp=stamp, frame_id=thing.frame, id=item.name, frame_locked=True)
    colour = _colour(thing.colour, item.opacity)
    indices = item.faces.ravel().tolist()
    if thing.arrow:
        entity.arrows.append(_arrow(thing.arrow, colour))
    elif item.kind == "lines":
        entity.lines.append(
            LinePrimitive(
                type=LinePrimitive.Type.LINE_LIST,
                pose=pose_message(np.eye(4)),
                thickness=_LINE,
                scale_invariant=True,
                points=_points(thing.vertices),
                color=colour,
                indices=indices,
            )
        )
    else:
        entity.triangles.append(
            TriangleListPrimitive(
                pose=pose_message(np.eye(4)), points=_points(thing.vertices), color=colour, indices=indices
            )
        )
    return entity


def _arrow(arrow: Arrow, colour: Any) -> Any:
    """Arrows of Foxglove point along x."""
    axes = arrow.axes[:, [2, 0, 1]]
    start = np.eye(4)
    start[:3, :3], start[:3, 3] = axes, arrow.start
    return ArrowPrimitive(
        pose=pose_message(start),
        shaft_length=arrow.shaft[0],
        shaft_diameter=2.0 * arrow.shaft[1],
        head_length=arrow.head[0],
        head_diameter=2.0 * arrow.head[1],
        color=colour,
    )


def _points(vertices: AnyArray) -> list[Any]:
    single = vertices.astype(np.float32)  # what an eye can tell; the file is half as large
    return [Point3(x=x, y=y, z=z) for x, y, z in single.tolist()]


def _colour(colour: Colour, opacity: float) -> Any:
    red, green, blue = colour
    return Color(r=red, g=green, b=blue, a=opacity)


def _rotation(rotation: Array) -> Any:
    x, y, z, w = quaternion_of(rotation)
    return Quaternion(x=x, y=y, z=z, w=w)
