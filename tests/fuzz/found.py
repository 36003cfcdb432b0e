"""URDFs as they are found, changed: hands with meshes, packages, coupled joints, wrong and missing inertias."""

from __future__ import annotations

import random
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio as pin
import trimesh

from fuzz.mutation import mutated_bytes, mutated_text
from fuzz.watch import Fault, command
from softhand.model.shapes.mesh_file import read_mesh
from softhand.model.urdf.examination import HAND
from softhand.model.urdf.pinocchio_model import build_model
from softhand.model.urdf.urdf import Urdf
from softhand.viewer.scene.visuals import read_visuals

_FORMATS = ("a.stl", "a.obj", "a.dae", "a.ply", "text.ply", "a.glb", "a.gltf")
_INERTIAS = (
    'ixx="2e-6" ixy="0" ixz="0" iyy="2e-5" iyz="0" izz="2e-5"',
    'ixx="8e-5" ixy="0" ixz="-5.6e-5" iyy="2.5e-5" iyz="0" izz="8e-5"',
    'ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"',
    'ixx="-1e-6" ixy="1e-6" ixz="0" iyy="1e-6" iyz="0" izz="3e-6" iyx="1e-6" izx="0" izy="0"',
    'ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"',
)


def try_found(rng: random.Random, folder: Path) -> str:
    """A hand as it is found, changed: checked, begun with, or mended and moved; or a mesh alone."""
    name = rng.choice(_FORMATS)
    data = _mesh(name)
    if rng.random() < 0.5:
        is_text = name in ("a.obj", "a.dae", "text.ply", "a.gltf")
        data = mutated_text(rng, data.decode(), 4).encode("utf-8", "replace") if is_text else mutated_bytes(rng, data)
    (folder / "meshes").mkdir(exist_ok=True)
    mesh = folder / "meshes" / name
    mesh.write_bytes(data)
    if rng.random() < 0.3:
        found = read_mesh(mesh, np.ones(3))
        if not np.isfinite(found.vertices).all() or found.triangles.max() >= len(found.vertices):
            raise Fault("a mesh of no numbers")
        return "taken"
    text = found_urdf(rng, name)
    file = folder / "fuzz.urdf"
    file.write_bytes((mutated_text(rng, text, 2) if rng.random() < 0.6 else text).encode("utf-8", "replace"))
    match rng.randrange(4):
        case 0:
            return command(folder, "check", "fuzz.urdf", echoes=True)
        case 1:
            (folder / "fuzz.toml").unlink(missing_ok=True)
            return command(folder, "new", "fuzz.toml", "--hand", "fuzz.urdf", echoes=True)
        case _:
            return _moved(rng, file)


def found_urdf(rng: random.Random, mesh: str) -> str:
    """The text of a hand of a few fingers, of the kinds that files of others are."""
    name = rng.choice((f"meshes/{mesh}", f"package://{rng.choice(('a_hand', 'meshes/..'))}/meshes/{mesh}", "gone.stl"))
    shape = (
        f'<geometry><mesh filename="{name}" scale="{rng.choice(("1 1 1", "0.001 0.001 0.001", "1 -1 1"))}"/></geometry>'
    )
    shapes = ("", f"<visual>{shape}</visual>", f"<collision>{shape}</collision><visual>{shape}</visual>",
              '<collision><geometry><capsule radius="0.01" length="0.03"/></geometry></collision>')  # fmt: skip
    parts = ['<?xml version="1.0"?>', '<robot name="found">', f'<link name="palm">{rng.choice(shapes)}</link>']
    for finger in range(rng.randint(2, 4)):
        parent = "palm"
        for k in range(rng.randint(1, 4)):
            link = f"finger_{finger}_{k}"
            inertia = rng.choice(_INERTIAS) if rng.random() < 0.5 else _INERTIAS[0]
            mass = rng.choice(("0.03", "0.03", "0.03", "0.03", "5") if rng.random() < 0.98 else ("0",))
            inertial = f'<inertial><origin xyz="0.01 0 0"/><mass value="{mass}"/><inertia {inertia}/></inertial>'
            parts.append(
                f'<link name="{link}">\n{rng.choice((inertial, inertial, inertial, ""))}{rng.choice(shapes)}</link>'
            )
            mimic = f'<mimic joint="finger_{finger}_{k - 1}_j" multiplier="{rng.choice(("1", "-0.5", "0"))}"/>'
            effort = rng.choice(("1", "1", "1", "0"))
            parts.append(
                f'<joint name="{link}_j" type="{rng.choice(("revolute", "revolute", "continuous", "prismatic"))}">\n'
                f'<parent link="{parent}"/><child link="{link}"/><origin xyz="0.03 0 0" rpy="0 0.1 0"/>'
                f'<axis xyz="{rng.choice(("0 0 1", "0 1 0", "1 0 0"))}"/>\n'
                f'<limit lower="-0.5" upper="1.2" effort="{effort}" velocity="1"/>'
                f"{mimic if k and rng.random() < 0.03 else ''}</joint>"
            )
            parent = link
        parts.append(
            f'<link name="tip_{finger}"/><joint name="tip_{finger}_j" type="fixed"><parent link="{parent}"/>'
            f'<child link="tip_{finger}"/><origin xyz="0.03 0 0"/></joint>'
        )
    return "\n".join([*parts, "</robot>"])


def _moved(rng: random.Random, file: Path) -> str:
    """With everything mended that can be: accelerations at random configurations are numbers, and it is drawn."""
    hand = Urdf.read(
        file, replace(HAND, effort_counts=False, repair="balance", density=rng.choice((1200.0, 1e-3, 1e6)))
    )
    again = Urdf.parse(hand.text, file, replace(HAND, effort_counts=False), hand.folder)
    model = build_model(again)
    data, numbers = model.createData(), np.random.default_rng(rng.randrange(1 << 30))
    lower, upper = np.maximum(model.lowerPositionLimit, -3.0), np.minimum(model.upperPositionLimit, 3.0)
    for _ in range(5 if model.nv else 0):
        q = pin.normalize(model, np.where(lower < upper, numbers.uniform(lower, np.maximum(lower, upper)), 0.5))
        M = np.triu(pin.crba(model, data, q))
        terms = pin.nonLinearEffects(model, data, q, numbers.normal(size=model.nv))
        acceleration = np.linalg.solve(M + np.triu(M, 1).T, -terms)
        if not np.isfinite(acceleration).all():
            raise Fault("an acceleration that is no number")
    read_visuals(again)
    return "taken"


@cache
def _mesh(name: str) -> bytes:
    """A convex body in a format."""
    body = trimesh.creation.icosphere(1, 0.02)
    if name == "text.ply":
        return bytes(body.export(file_type="ply", encoding="ascii"))
    if name == "a.gltf":
        return bytes(trimesh.exchange.gltf.export_gltf(body, embed_buffers=True)["model.gltf"])
    data = body.export(file_type=name[2:])
    return data.encode() if isinstance(data, str) else bytes(data)
