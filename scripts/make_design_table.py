"""Target A with the paper's gains and with designed ones: the tables of docs/design.md.

Each is held at the start of target A, nudged by 1e-6 rad/s, for as long as is asked for. The second table is the growth
of the linear loop there, with more and less damping at the object.

Examples:
    python scripts/make_design_table.py                 # 600 s each, prints the tables
    python scripts/make_design_table.py --seconds 20
    python scripts/make_design_table.py --seconds 0     # the second alone, in seconds
"""

from __future__ import annotations

import argparse
import math
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import softhand
from softhand.controllers.object_impedance import ObjectImpedance
from softhand.design.effective import effective
from softhand.design.families import first_knobs, with_knobs
from softhand.margins.delay import delay_margin
from softhand.margins.loop import close_loop
from softhand.margins.place import find_place

NUDGE = 1e-6  # [rad/s] of the first joint
WAYS = (("regulation", 4.0, 0.2), ("object-impedance", 4.0, 0.2), ("computed-torque", 4.0, 0.2))
"""Controllers, bandwidth [Hz] and damping ratio."""
HELD = {"reference": {"kind": "hold"}}


class Row(NamedTuple):
    """A line of the table."""

    name: str
    growth: float
    """Of the linear loop about the start [1/s]."""
    delay: float
    """That it bears [s]."""
    held: float
    """Time for which the box was held [s]."""
    speed: float
    """Largest joint speed in the last second [rad/s]."""
    strayed: float
    """Of the box at the end [m]."""


def controllers(folder: Path) -> dict[str, dict[str, Any] | None]:
    """Sections `controller` by name; None for that of the paper."""
    found: dict[str, dict[str, Any] | None] = {"regulation, the paper's gains": None}
    for name, bandwidth, damping in WAYS:
        design = softhand.design_gains("target-a", bandwidth, damping, controller=name)
        found[f"{name}, {bandwidth:g} Hz, {damping:g}"] = {"name": name, **design.settings}
    softhand.design_lqr("target-a", overrides=HELD).save(folder / "gains.toml")
    found["state-feedback, by weights"] = {"name": "state-feedback", "gain_file": str(folder / "gains.toml")}
    return found


def row(name: str, controller: dict[str, Any] | None, seconds: float) -> Row:
    """One run, and the linear loop about its start."""
    changes: dict[str, Any] = {**HELD, "duration": seconds}
    if controller is not None:
        changes["controller"] = controller
    scenario = softhand.load_scenario("target-a", changes)
    found = softhand.stability(scenario, with_margins=False)
    simulation = softhand.build(scenario)
    simulation.state.v[0] = NUDGE
    start, count, speed, k = None, round(seconds / scenario.control_period), 0.0, 0
    try:
        for k in range(count):
            seen = simulation.sample()
            start = seen.object_position.copy() if start is None else start
            if k >= count - 1000:
                speed = max(speed, float(np.max(np.abs(seen.joint_velocity))))
            simulation.step()
        strayed = float(np.linalg.norm(simulation.sample().object_position - start))
    except softhand.SimulationStopped:
        speed = strayed = math.inf
    return Row(name, found.held_growth, delay_margin(found.loop, found.place),
               (k + 1) * scenario.control_period, speed, strayed)  # fmt: skip


def rows(seconds: float) -> list[Row]:
    """All lines."""
    with tempfile.TemporaryDirectory() as folder:
        return [row(name, controller, seconds) for name, controller in controllers(Path(folder)).items()]


def table(found: list[Row]) -> str:
    """As Markdown."""
    lines = ["| Controller, bandwidth, damping ratio | Growth [1/s] | Bears a delay of | Box held for | Strayed |",
             "|---|---|---|---|---|"]  # fmt: skip
    for one in found:
        delay = "-" if math.isnan(one.delay) else f"{1e3 * one.delay:.2g} ms"
        strayed = "lost" if math.isinf(one.strayed) else f"{one.strayed:.0e} m"
        lines.append(f"| {one.name} | {one.growth:+.2g} | {delay} | {one.held:.3g} s | {strayed} |")
    return "\n".join(lines)


SHARES = (1.0, 0.2, 0.05, 0.0)
DAMPED = tuple((4.0, zeta) for zeta in (0.2, 0.3, 0.5, 0.7))
"""Of 2 zeta omega M; bandwidth [Hz] and damping ratio."""


def growths(bandwidth: float, damping: float) -> list[float]:
    """Of object impedance at the start of target A with these shares of D = 2 zeta omega M [1/s]."""
    place, omega = find_place(softhand.load_scenario("target-a")), 2.0 * math.pi * bandwidth
    felt = effective(place)
    knobs, whole = first_knobs(ObjectImpedance(), felt, omega, damping), 2.0 * damping * omega * np.diag(felt.inertia)
    loops = [with_knobs(ObjectImpedance(), felt, knobs._replace(damping=share * whole)) for share in SHARES]
    return [close_loop(place.with_controller(controller)).growth for controller in loops]


def damping_table() -> str:
    """As Markdown."""
    lines = ["| Bandwidth, damping ratio | " + " | ".join(f"{share:g} D" for share in SHARES) + " |",
             "|---" * (1 + len(SHARES)) + "|"]  # fmt: skip
    for bandwidth, damping in DAMPED:
        cells = " | ".join(f"{growth:+.2g}" for growth in growths(bandwidth, damping))
        lines.append(f"| {bandwidth:g} Hz, {damping:g} | {cells} |")
    return "\n".join(lines)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=600.0, help="of each run [s]")
    seconds = parser.parse_args().seconds
    if seconds > 0.0:
        print(table(rows(seconds)), end="\n\n")
    print(damping_table())
