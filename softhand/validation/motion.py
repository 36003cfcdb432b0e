"""The box in free flight and under contacts without outer forces: what is conserved, and how the error shrinks."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from softhand.laws.radial import Radial
from softhand.numerics.spatial import rotation_of
from softhand.plugins import SHIPPED, find_plugin
from softhand.steppers.midpoint import Midpoint
from softhand.steppers.rk4 import RungeKutta4
from softhand.steppers.semi_implicit_euler import SemiImplicitEuler
from softhand.steppers.stepper import Stepper
from softhand.validation.check import Check
from softhand.validation.rigs import MASS, RADIUS, Body, Carriage, G, Rig, block, make_rig, make_world, pinch, tip

LAW = Radial(radius=RADIUS)


def free_fall() -> Iterable[Check]:
    """Away from the tips the box falls: exact for every second-order stepper."""
    rig = block(-1.0, LAW)
    start = rig.position.copy()
    rig.run(Midpoint(step=1e-3), 0.3)
    yield Check("free fall, 0.3 s", 1e3 * float(rig.position[2] - start[2]), -1e3 * 0.5 * G * 0.3**2, 1e-10, "mm")
    rig = block(-1.0, LAW)
    rig.velocity[:3] = 0.4, -0.2, 1.0
    rig.run(Midpoint(step=1e-3), 0.3)
    exact = np.array([0.4 * 0.3, -0.2 * 0.3, 0.3 - 0.5 * G * 0.3**2])
    off = float(np.linalg.norm(rig.position - start - exact))
    yield Check("projectile, 0.3 s: distance from the parabola", 1e3 * off, 0.0, 1e-10, "mm")


def precession() -> Iterable[Check]:
    """A free symmetric top: w about its axis stays, w across it turns at (I_3 - I_1) / I_1 w_3 in the body."""
    across, along = 8e-5, 12e-5
    rig = block(-1.0, LAW, body=Body(inertia=(across, across, along)), gravity=np.zeros(3))
    rig.velocity[3:] = 2.0, 0.0, 15.0
    rig.run(RungeKutta4(step=1e-3), 1.0)
    turned = (along - across) / across * 15.0 * 1.0
    found = math.atan2(rig.velocity[4], rig.velocity[3])
    off = math.remainder(found - turned, 2.0 * math.pi)
    yield Check("torque-free precession, angle after 1 s", turned + off, turned, 1e-7, "rad")
    yield Check("torque-free precession, spin about the axis", float(rig.velocity[5]), 15.0, 1e-9, "rad/s")


def momentum() -> Iterable[Check]:
    """A tip on a free slide strikes the box: their momentum along the slide stays, and their energy."""
    rig = _struck()
    mass, speed = 0.05, float(rig.state.v[0])
    energy = rig.energy()
    rig.run(RungeKutta4(step=2e-5), 0.03)
    total = mass * rig.state.v[0] + MASS * rig.velocity[0]
    yield Check("momentum after an impact", 1e3 * float(total), 1e3 * mass * speed, 1e-12, "N ms")
    yield Check("energy after an impact", 1e3 * rig.energy(), 1e3 * energy, 1e-6, "mJ")
    exact = 2.0 * mass * speed / (mass + MASS)
    yield Check("speed of the box after an impact", float(rig.velocity[0]), exact, 1e-6, "m/s")


def _struck() -> Rig:
    world = make_world([Carriage("x", (-0.039, 0.0, 0.0), (0.0, 0.0, 0.0), 0.05, 1e-5)], Body(), np.zeros(3))
    rig = make_rig(world, [tip(world, 1, LAW)], np.zeros(3))
    rig.state.v[0] = 0.4
    return rig


def action_and_reaction() -> Iterable[Check]:
    """What the contacts do to a tip on three slides and to the box, turned and slipping, adds up to nothing."""
    rng = np.random.default_rng(7)
    worst = 0.0
    for _ in range(20):
        world = make_world([Carriage("xyz", mass=0.05, inertia=1e-5)], Body(), np.zeros(3))
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        turn *= np.linalg.det(turn)
        rig = make_rig(world, [tip(world, 5, LAW)], turn @ (0.0, 0.0, RADIUS - 2e-3 + 0.030), turn)
        rig.state.z[0, :3] = rng.normal(size=3) * (1e-3, 1e-3, 0.1)
        rig.state.v[:] = rng.normal(size=9)
        rig.update()
        forces = rig.contact_forces()
        on_box = turn @ forces[3:6]
        worst = max(worst, float(np.linalg.norm(forces[:3] + on_box) / np.linalg.norm(on_box)))
    yield Check("action and reaction, largest relative sum", worst, 0.0, 1e-12)


def passivity() -> Iterable[Check]:
    """Without outer forces the energy of a box thrown askew at a tip, with slip, never grows."""
    rises, losses = 0.0, 0.0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        rig = block(0.0, LAW, body=Body(inertia=(81.93e-6, 112.78e-6, 74.70e-6)), gravity=np.zeros(3))
        rig.velocity[:] = rng.normal(size=6) * (0.5, 0.5, 0.0, 5.0, 5.0, 20.0)
        rig.velocity[2] = -0.5
        energies = [rig.energy()]
        rig.run(RungeKutta4(step=2e-5), 0.03, lambda time, rig=rig, energies=energies: energies.append(rig.energy()))  # type: ignore[misc]
        rises = max(rises, float(np.max(np.diff(energies))) / energies[0])
        losses = max(losses, 1.0 - energies[-1] / energies[0])
    yield Check("passivity: largest rise of the energy in a step, share", rises, 0.0, 1e-9)


def order() -> Iterable[Check]:
    """Error of a ringing grasp that does not slip, at a step and at half of it."""
    truth = _rung(RungeKutta4(step=5e-5))
    for name, stepper, step, exact in (
        ("semi-implicit Euler", SemiImplicitEuler, 5e-5, 1.0),
        ("midpoint", Midpoint, 2e-4, 2.0),
        ("Runge-Kutta", RungeKutta4, 5e-4, 4.0),
    ):
        coarse, fine = (np.linalg.norm(_rung(stepper(step=h)) - truth) for h in (step, step / 2.0))
        yield Check(f"order of {name}", math.log2(coarse / fine), exact, 0.1, "", True)


def _rung(stepper: Stepper) -> np.ndarray:
    rig = pinch(friction=2.0)
    rig.velocity[:] = 0.005, 0.005, -0.003, 0.02, 0.05, 0.05
    rig.run(stepper, 0.05)
    return np.concatenate([rig.position, 0.05 * rig.state.q[-4:-1], 0.01 * rig.velocity])


def invariance() -> Iterable[Check]:
    """A pinch that slips, in a world turned and moved as a whole, under the same forces of the joints."""
    turn, shift = rotation_of((-2.0, 0.7, 1.3)), np.array([0.3, -0.2, 0.5])
    plain, other = pinch(1.6), pinch(1.6, turn=turn, shift=shift)
    for rig in (plain, other):
        rig.velocity[:] = 0.0, 0.05, 0.0, 2.0, 0.3, 0.5
        rig.run(Midpoint(step=1e-3), 0.1)
    off = float(np.linalg.norm(turn @ plain.position + shift - other.position))
    yield Check("rigid motion of the world: what differs after 0.1 s", 1e3 * off, 0.0, 1e-8, "mm")
    slipped = [float(np.sum(rig.plant.contacts["slip_travel"])) for rig in (plain, other)]
    yield Check("rigid motion of the world: slip travel", 1e3 * slipped[1], 1e3 * slipped[0], 1e-8, "mm")


def repeats() -> Iterable[Check]:
    """Every stepper gives the same bits twice, slip included."""
    for name in SHIPPED["steppers"]:
        stepper = find_plugin("steppers", name, "stepper.name")(step=2e-4)
        states = []
        for _ in range(2):
            rig = pinch(1.6)
            rig.velocity[1] = 0.05
            rig.run(stepper, 0.02)
            states.append(np.concatenate([rig.state.q, rig.state.v, rig.state.z.ravel()]))
        yield Check(f"repeated run, numbers that differ, {name}", float(np.sum(states[0] != states[1])), 0.0, 0.0)


EXPERIMENTS = (
    free_fall,
    precession,
    momentum,
    action_and_reaction,
    passivity,
    order,
    invariance,
    repeats,
)
