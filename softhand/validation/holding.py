"""Holding: nothing creeps, the limit is kept, and what does not slip is untouched by it."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from softhand.assembly import simulate
from softhand.dampings.kelvin_voigt import KelvinVoigt
from softhand.laws.conservative import Conservative
from softhand.laws.hertz import Hertz
from softhand.laws.law import Law
from softhand.laws.nakashima import Nakashima
from softhand.laws.parallel_distributed import ParallelDistributed
from softhand.laws.power import Power
from softhand.laws.radial import Radial
from softhand.scenario import load_scenario
from softhand.steppers.midpoint import Midpoint
from softhand.validation.check import Check
from softhand.validation.rigs import MU, RADIUS, Body, Carriage, make_rig, make_world, pinch, tip

LAWS: tuple[Law, ...] = (
    Radial(radius=RADIUS),
    Power(radius=RADIUS),
    Hertz(radius=RADIUS),
    ParallelDistributed(radius=RADIUS),
    Nakashima(radius=RADIUS),
    Conservative(radius=RADIUS),
)


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


def cut_back() -> Iterable[Check]:
    """Whatever is stored: after the return the use of the limit surface is at most 1, on the ray of what was stored."""
    rng = np.random.default_rng(3)
    for law in LAWS:
        world = make_world([Carriage("Z")], Body(), np.zeros(3))
        # leaning, as a law in polar coordinates has a pole at the apex
        turn = np.array([[math.cos(0.5), 0.0, math.sin(0.5)], [0.0, 1.0, 0.0], [-math.sin(0.5), 0.0, math.cos(0.5)]])
        worst, count = 0.0, 0
        for _ in range(300):
            depth = 10 ** rng.uniform(-5.0, -2.5)
            rig = make_rig(world, [tip(world, 5, law)], turn @ (0.0, 0.0, RADIUS - depth + 0.030), turn)
            size = 10 ** rng.uniform(-3.0, 0.5)
            unit = RADIUS if law.coordinates == "surface" else 1.0
            rig.state.z[0, :3] = size * rng.normal(size=3) * (unit, unit, 1.0)
            rig.update()
            force, contact = rig.contact["force"], rig.contact
            if force[2] <= 0.0:
                use = 0.0 if np.all(force == 0.0) else math.inf
            else:
                use = math.hypot(
                    math.hypot(force[0], force[1]) / (MU * force[2]),
                    force[3] / (MU * force[2] * _spin_length(rig.plant.pads[0], contact["distance"])),
                )
            worst = max(worst, use)
            count += bool(np.any(contact["slip"]))
        yield Check(f"use of the limit after the return, {type(law).__name__}", worst, 1.0, 1e-12)


def _spin_length(pad: np.void, distance: float) -> float:
    from softhand.contact.friction import spin_length

    return float(spin_length(pad, distance))


EXPERIMENTS = (creep, cut_back)
