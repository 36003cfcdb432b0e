"""Growth rates over the stiffness of the tips and the gain K_O."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from softhand.assembly.parts import read_laws
from softhand.assembly.plant import read_world
from softhand.closed_loop.gain_loop import close_gain_loop
from softhand.closed_loop.start import held_start
from softhand.errors import GraspError, LawError
from softhand.laws.law import Law
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.scenario.scenario import Scenario


@dataclass(frozen=True, eq=False)
class Scan(Record):
    """Growth rates over the stiffness of the tips and the gain K_O.

    Attributes:
        stiffness: factors on the coefficients of the law, shape (s,).
        gain: factors on K_O, shape (g,).
        growth: rate of the fastest growing motion [1/s], NaN without a grasp, shape (g, s).
        held_growth: the same with the torque held for the control period, shape (g, s).
        use: largest eigenvalue of K_c^-1 K_O at the gain factor 1, shape (s,).
    """

    units: ClassVar = {"stiffness": "1", "gain": "1", "growth": "1/s", "held_growth": "1/s", "use": "1"}

    stiffness: Array
    gain: Array
    growth: Array
    held_growth: Array
    use: Array

    def largest_gain(self, column: int) -> float:
        """Factor on K_O at which a controller without sampling loses the object; NaN if not within the scan."""
        growth = self.growth[:, column]
        lost = np.flatnonzero(growth > 0.0)
        if not lost.size or lost[0] == 0:
            return float("nan")
        k = lost[0]
        share = -growth[k - 1] / (growth[k] - growth[k - 1])
        return float(self.gain[k - 1] * (self.gain[k] / self.gain[k - 1]) ** share)


def scan(
    scenario: Scenario,
    stiffness: Sequence[float],
    gain: Sequence[float],
    progress: Callable[[float], None] | None = None,
) -> Scan:
    """Where regulation is lost: K_O against the stiffness of the contacts.

    Args:
        scenario: whose start is held, with the controller `regulation`.
        stiffness: factors on the coefficients of the law.
        gain: factors on K_O.
        progress: called with the number of stiffnesses done.

    Raises:
        LawError: the law has no coefficients that scale its force.
    """
    world, laws = read_world(scenario), [(law, _scaling_fields(law)) for law in read_laws(scenario)]
    held, continuous = np.full((len(gain), len(stiffness)), np.nan), np.full((len(gain), len(stiffness)), np.nan)
    use = np.full(len(stiffness), np.nan)
    for s, factor in enumerate(stiffness):
        scaled = [law.model_copy(update={name: factor * getattr(law, name) for name in names}) for law, names in laws]
        try:
            start = held_start(scenario, scaled, world)
        except GraspError:  # so soft that the tips are pressed flat
            continue
        loop = close_gain_loop(start)
        use[s] = loop.use
        every = [share * loop.K_O for share in gain]
        continuous[:, s] = [loop.growth(gains) for gains in every]
        held[:, s] = loop.held_growth(every, start.period)
        if progress is not None:
            progress(s + 1.0)
    return Scan(np.asarray(stiffness, dtype=float), np.asarray(gain, dtype=float), continuous, held, use)


def _scaling_fields(law: Law) -> list[str]:
    """Fields that scale the force of a law together: twice their values, twice the force."""
    rng = np.random.default_rng(0)
    probes = [((*rng.uniform(0.05, 0.4, 1) * law.radius, *rng.uniform(-0.3, 0.3, 3)), phi) for phi in (0.7, 1.1, 1.5)]

    def forces(names: Sequence[str], factor: float) -> Array:
        changed = law.model_copy(update={name: factor * getattr(law, name) for name in names})
        return np.array([changed(np.array(deformation), phi) for deformation, phi in probes])

    names = [name for name, value in dict(law).items() if name != "radius" and type(value) is float]
    base = forces([], 1.0)
    straight = [
        name for name in names
        if np.allclose(forces([name], 3.0) - base, 2.0 * (forces([name], 2.0) - base), rtol=1e-9, atol=0.0)
        and not np.array_equal(forces([name], 2.0), base)
    ]  # fmt: skip
    if not straight or not np.allclose(forces(straight, 2.0), 2.0 * base, rtol=1e-9, atol=0.0):
        raise LawError(
            f"law '{type(law).__name__}' cannot be made stiffer as a whole: its force is not in proportion to its "
            "coefficients.",
            law=type(law).__name__,
        )
    return straight
