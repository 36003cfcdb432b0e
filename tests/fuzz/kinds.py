"""The kinds of inputs: from a seed an input of each, and what is done with it."""

from __future__ import annotations

import random
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import h5py
import numpy as np

from fuzz.code import short_run, try_controller, try_law
from fuzz.found import try_found
from fuzz.mutation import NUMBERS, mutated_bytes, mutated_text
from fuzz.pages import try_page
from fuzz.watch import Fault, command
from softhand.identification.record import EXAMPLE
from softhand.model.shapes.mesh import as_polyhedron
from softhand.model.shapes.mesh_file import read_mesh
from softhand.scenario.file import find_scenario, scenario_names

ROOT = Path(__file__).parents[2]
SHORT = ("--set", "duration=0.01", "--set", "reference.duration=0.01")


def try_scenario(rng: random.Random, folder: Path) -> str:
    """A scenario that ships, changed: checked, now and then run."""
    name = rng.choice([name for name in scenario_names() if "allegro" not in name])
    file = folder / "fuzz.toml"
    file.write_bytes(mutated_text(rng, find_scenario(name).read_text()).encode("utf-8", "replace"))
    if rng.random() < 0.03:
        return command(folder, "simulate", str(file), *SHORT, "--out", "out", "--no-plot", echoes=True)
    return command(folder, "check", str(file), echoes=True)


def try_override(rng: random.Random, folder: Path) -> str:
    """A scenario with values put over it on the command line."""
    keys = ("object.mass", "fingertip.friction", "hand.tips", "grasp.contact_points", "controller.K_v", "gravity",
            "object.rpy", "stepper.step", "duration", "table.height", "reference.object_position")  # fmt: skip
    changes = [f"{rng.choice(keys)}={mutated_text(rng, rng.choice(NUMBERS), 2)}"[:5000].replace("\0", "") for _ in "ab"]
    return command(folder, "check", "target-a", "--set", changes[0], "--set", changes[1], echoes=True)


def try_urdf(rng: random.Random, folder: Path) -> str:
    """A URDF that ships, changed: checked, or as the hand or object of a scenario."""
    source = rng.choice(sorted((ROOT / "urdf").glob("*.urdf")))
    file = folder / "fuzz.urdf"
    file.write_bytes(mutated_text(rng, source.read_text()).encode("utf-8", "replace"))
    if rng.random() < 0.7:
        return command(folder, "check", str(file), echoes=True)
    key = "hand.urdf" if "hand" in source.stem else "object.urdf"
    return command(folder, "check", "target-a", "--set", f"{key}={file}", echoes=True)


def try_recording(rng: random.Random, folder: Path) -> str:
    """A recording, changed in its bytes, its arrays or its attributes: checked, drawn or summed."""
    file = folder / "fuzz.nc"
    if rng.random() < 0.4:
        file.write_bytes(mutated_bytes(rng, _recording()))
    else:
        file.write_bytes(_recording())
        _change_arrays(rng, file)
    draw = rng.choice(["check"] * 6 + ["plot", "energy", "lyapunov", "report"])
    out = {"check": (), "report": ("--out", "a.html")}.get(draw, ("--out", "a.png"))
    return command(folder, draw, str(file), *out, echoes=draw == "check")


@cache
def _recording() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        short_run().save(Path(folder, "run.nc"))
        return Path(folder, "run.nc").read_bytes()


def _change_arrays(rng: random.Random, file: Path) -> None:
    values = [np.nan, np.inf, -np.inf, 1e308, -1e308, 1e15, 1e-300, 0.0, -1.0, 1e5]
    with h5py.File(file, "r+") as hdf:
        for _ in range(rng.randint(1, 3)):
            name = rng.choice([name for name in hdf if hdf[name].dtype.kind in "fi" and hdf[name].size])
            item = hdf[name]
            k = rng.randrange(len(item))
            value = rng.choice(values)
            value = value if item.dtype.kind == "f" else rng.randrange(-128, 128)
            match rng.randrange(7):
                case 0:
                    item[k] = value
                case 1:
                    item[k:] = value
                case 2:
                    item[...] = value
                case 3:
                    item[...] = np.array(item[...] * rng.choice([-1, 2, 1e200]), item.dtype)
                case 4:
                    shape = [rng.choice([0, 1, n, n + 1]) for n in item.shape]
                    del hdf[name]
                    hdf.create_dataset(name, shape, rng.choice(["f8", "f4", "i1", "S5", "c16", "O8"][:5]))
                case 5:
                    del hdf[name]
                case _:
                    attribute = rng.choice(sorted(hdf.attrs))
                    old = hdf.attrs[attribute]
                    text = mutated_text(rng, old) if isinstance(old, str) else rng.choice(NUMBERS)
                    hdf.attrs[attribute] = rng.choice([text.replace("\0", ""), value, [1, 2], np.array(["a"], "S")])


def try_csv(rng: random.Random, folder: Path) -> str:
    """Measurements, changed: fitted by a law that ships."""
    lines = EXAMPLE.read_text().splitlines()
    kept = [line for line in lines if line.startswith("#")], [line for line in lines if not line.startswith("#")]
    text = "\n".join([*kept[0], kept[1][0], *rng.sample(kept[1][1:], min(60, len(kept[1]) - 1))])
    file = folder / "fuzz.csv"
    changed = mutated_text(rng, text)
    file.write_bytes(mutated_bytes(rng, changed.encode()) if rng.random() < 0.1 else changed.encode("utf-8", "replace"))
    law = rng.choice(["nakashima", "radial", "hertz", "power", "planar"])
    options = rng.choice([(), ("--friction", rng.choice(NUMBERS)), ("--radius", rng.choice(NUMBERS) + "mm"),
                          ("--level", rng.choice(NUMBERS)), ("--fix", f"k_r={rng.choice(NUMBERS)}")])  # fmt: skip
    return command(folder, "identify", str(file), "--law", law, "--no-compare", "--out", "fit", *options)


def try_mesh(rng: random.Random, folder: Path) -> str:
    """The mesh that ships, or an STL of it, changed."""
    source = ROOT / "urdf" / "meshes" / "prism.obj"
    match rng.randrange(3):
        case 0:
            file = folder / "fuzz.obj"
            file.write_bytes(mutated_text(rng, source.read_text(), 4).encode("utf-8", "replace"))
        case 1:
            file = folder / "fuzz.stl"
            file.write_bytes(mutated_bytes(rng, _stl(source)))
        case _:
            file = folder / "fuzz.stl"
            file.write_bytes(mutated_text(rng, _text_stl(source), 4).encode("utf-8", "replace"))
    shape = as_polyhedron(read_mesh(file, np.ones(3)), np.eye(3), np.zeros(3), rng.random() < 0.5)
    if not np.isfinite(shape.vertices).all() or not np.isfinite(shape.normals).all():
        raise Fault("a polyhedron of no numbers")
    return "taken"


def _corners(source: Path) -> np.ndarray:
    mesh = read_mesh(source, np.ones(3))
    return mesh.vertices[mesh.triangles]


def _stl(source: Path) -> bytes:
    corners = _corners(source)
    table = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    table["corners"] = corners
    return bytes(80) + len(corners).to_bytes(4, "little") + table.tobytes()


def _text_stl(source: Path) -> str:
    facets = ("\n".join("vertex " + " ".join(map(str, corner)) for corner in three) for three in _corners(source))
    return "solid a\n" + "\n".join(f"facet normal 0 0 0\nouter loop\n{facet}\nendloop\nendfacet" for facet in facets)


KINDS: dict[str, Callable[[random.Random, Path], str]] = {
    "scenario": try_scenario,
    "override": try_override,
    "urdf": try_urdf,
    "found": try_found,
    "recording": try_recording,
    "csv": try_csv,
    "mesh": try_mesh,
    "law": try_law,
    "controller": try_controller,
    "page": try_page,
}
