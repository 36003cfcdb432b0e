"""Holding: nothing creeps, the limit is kept, and what does not slip is untouched by it."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from softhand.assembly.build import simulate
from softhand.contact.limit import limit_of, limit_use
from softhand.dampings.kelvin_voigt import KelvinVoigt
from softhand.laws.law import Law
from softhand.laws.parallel_distributed import ParallelDistributed
from softhand.laws.radial import Radial
from softhand.numerics.spatial import rotation_of
from softhand.scenario.scenario import load_scenario
from softhand.steppers.midpoint import Midpoint
from softhand.validation.check import Check
from softhand.validation.every_law import LAWS, name_of
from softhand.validation.rigs import BOTTOM, MU, RADIUS, Body, Carriage, Rig, make_rig, make_world, pinch, tip

LEAN = 0.5  # [rad]


def creep() -> Iterable[Check]:
    """A box pinched with 6 N a side, mu 0.5, let go askew of its rest: how far it moves from 10 s to 60 s."""
    rig = pinch(6.0, damping=KelvinVoigt())
    rig.run(Midpoint(step=1e-3), 10.0)
    start = rig.position.copy()
    farthest = 0.0

    def watch(time: float) -> None:
        nonlocal farthest
        farthest = max(farthest, float(np.linalg.norm(rig.position - start)))

    rig.run(Midpoint(step=1e-3), 50.0, watch)
    yield Check("creep of a pinched box, 10 s to 60 s", 1e9 * farthest, 0.0, 1.0, "nm")
    weight = 0.5 * 0.2 * 9.81
    sag = weight / Radial(radius=RADIUS).k_tangential
    yield Check("sag of a pinched box", -1e3 * float(rig.position[2]), 1e3 * sag, 1e-6, "mm")


def slip_to_limit() -> Iterable[Check]:
    """Whatever is stored: what slips ends on the limit, and has slipped along its normal."""
    rng = np.random.default_rng(3)
    for law in LAWS:
        yield from _slipped(name_of(law), law, rng)
    leaning = ParallelDistributed(radius=RADIUS)  # pulls sideways without any shear
    yield from _slipped("ParallelDistributed at 45 deg, mu 0.3", leaning, rng, 0.3, math.radians(45.0))


def _slipped(name: str, law: Law, rng: np.random.Generator, mu: float = MU, lean: float = LEAN) -> Iterable[Check]:
    """How far off the limit, and the slip off its normal, after 150 random displacements; ellipse and exact limit."""
    off = angle = 0.0
    for limit in ("ellipse", "exact"):
        rig = _leaning(law, 0.0, lean, friction=mu, limit=limit)
        position, turn = rig.position.copy(), rotation_of((0.0, lean, 0.0))
        for _ in range(150):
            rig.position[:] = position - 10 ** rng.uniform(-5.0, -2.5) * turn[:, 2]
            unit = RADIUS if law.coordinates == "surface" else 1.0
            rig.state.z[0, :3] = 10 ** rng.uniform(-3.0, 0.5) * rng.normal(size=3) * (unit, unit, 1.0)
            rig.update()
            force, slip, lever = rig.contact["force"], _slip_of(rig.contact), rig.contact["lever"]
            s = float(force[0]), float(force[1]), float(force[3] / lever)
            use = limit_use(rig.contact, s, mu * force[2])
            off = max(off, abs(use - 1.0) if np.any(slip) else use - 1.0)
            normal = np.array(limit_of(rig.contact["curve"], s)[1])
            angle = max(angle, math.atan2(float(np.linalg.norm(np.cross(slip, normal))), float(slip @ normal)))
    yield Check(f"after slip, use of the limit off 1, {name}", off, 0.0, 1e-12)
    yield Check(f"after slip, off the normal of the limit, {name}", math.degrees(angle), 0.0, 1e-6, "deg")


def _slip_of(contact: np.void) -> np.ndarray:
    """Along x, along y, and about z times the lever, in C_F."""
    along_x = contact["slip"][0] / contact["theta_per_x"]
    twist = contact["slip"][2] - contact["psi_per_x"] * along_x
    return np.array([along_x, contact["slip"][1] / contact["phi_per_y"], contact["lever"] * twist])


def stick() -> Iterable[Check]:
    """Below the limit a tip is a spring: what is stored and released leaves no slip and the same force, to the bit."""
    rng = np.random.default_rng(5)
    differ = slid = 0.0
    for law in LAWS:
        rolling, limited = (_leaning(law, 1e-3, can_slip=can_slip) for can_slip in (False, True))
        for share in rng.uniform(-1.0, 1.0, size=(50, 3)):
            for rig in (rolling, limited):
                rig.state.z[0, :3] = share * _small(law)
                rig.update()
                rig.plant.note_slip(rig.state.z)
            differ += float(np.sum(rolling.contact["force"] != limited.contact["force"]))
            differ += float(np.sum(limited.state.z[0, :3] != share * _small(law)))
        slid += float(limited.contact["slip_travel"] + limited.contact["slip_twist"])
    yield Check("stick: numbers that the limit changes", differ, 0.0, 0.0)
    yield Check("stick: slip travel and twist", slid, 0.0, 0.0)


def touch_again() -> Iterable[Check]:
    """Lifted off with shear and torsion stored, a tip neither pulls nor remembers."""
    worst = stored = 0.0
    for law in LAWS:
        rig = _leaning(law, 1e-3)
        rig.state.z[0, :3] = _small(law)
        rig.run(Midpoint(step=1e-3), 1e-3)
        rig.position[:] += 2e-3 * rotation_of((0.0, 0.5, 0.0))[:, 2]
        rig.velocity[:2] = 0.1, 0.2
        rig.run(Midpoint(step=1e-3), 0.02)
        worst = max(worst, float(np.max(np.abs(rig.velocity[:2] - (0.1, 0.2)))))
        stored = max(stored, float(np.max(np.abs(rig.state.z))))
    yield Check("lift-off: what holds in the air, change of speed", worst, 0.0, 1e-15, "m/s")
    yield Check("lift-off: what stays stored", stored, 0.0, 0.0)


def _small(law: Law) -> np.ndarray:
    """Within the limit in any combination, at 1 mm."""
    return np.array([2e-5, 2e-5, 3e-3]) if law.coordinates == "surface" else np.array([2e-3, 2e-3, 3e-3])


def target_a() -> Iterable[Check]:
    """The paper's target A at mu 0.6 stays inside the limit: with it and without the run is the same."""
    runs = []
    for contact in ("rolling", "coulomb"):
        runs.append(simulate(load_scenario("target-a", {"fingertip.friction": 0.6, "fingertip.contact": contact})))
    rolling, limited = runs
    off = max(
        float(np.max(np.abs(getattr(limited, name) - getattr(rolling, name))))
        for name in ("joint_position", "object_position", "deformation")
    )
    yield Check("target A, mu 0.6: what the limit changes", off, 0.0, 1e-12)


def _leaning(law: Law, depth: float, lean: float = LEAN, **options: object) -> Rig:
    """A box on a fixed tip that leans, as laws in polar coordinates have a pole at the apex."""
    turn = rotation_of((0.0, lean, 0.0))
    world = make_world([Carriage("Z")], Body(), np.zeros(3))
    return make_rig(world, [tip(world, BOTTOM, law, **options)], turn @ (0.0, 0.0, RADIUS - depth + 0.030), turn)  # type: ignore[arg-type]


EXPERIMENTS = (creep, slip_to_limit, stick, touch_again, target_a)
