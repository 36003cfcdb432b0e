"""How much squeeze holds a set of loads, by the margin that is left."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from softhand.holding.held import Held
from softhand.holding.loads import Loads
from softhand.holding.program import Found, Program, Terms
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record

_MARGINS = tuple(np.linspace(0.0, 0.9, 10).round(2).tolist())


@dataclass(frozen=True, eq=False)
class SqueezeCurve(Record):
    """Least and largest squeeze that hold a set of loads, by the margin.

    Attributes:
        margin: share of the limit surface that is left free, shape (margins,).
        least: sum of the normal forces, the mean over the loads [N]; NaN where no squeeze holds, shape (margins,).
        largest: likewise, infinite where nothing limits it, shape (margins,).
        present: of the scenario or of the sample [N].
        chosen: margin that was asked for.
    """

    units: ClassVar = {"margin": "1", "least": "N", "largest": "N", "present": "N", "chosen": "1"}

    margin: Array
    least: Array
    largest: Array
    present: float
    chosen: float


def curve_of(held: Held, loads: Loads, terms: Terms) -> SqueezeCurve:
    """Least and largest squeeze at margins from 0 to 0.9.

    Args:
        held: contacts, whose levers of torsion stay.
        loads: all of them are held.
        terms: with the margin that was asked for.
    """
    rows = []
    for share in _MARGINS:
        program = Program(held, loads, replace(terms, use=1.0 - share))
        least = program.least()
        largest = None if least is None else program.largest()
        ends = [least, largest if largest is not None or least is None else np.inf]
        rows.append([end if isinstance(end, float) else _normal(end) for end in ends])
    least_of, largest_of = np.array(rows).T
    present = float(np.sum(held.force[2::3]))
    return SqueezeCurve(np.array(_MARGINS), least_of, largest_of, present, 1.0 - terms.use)


def _normal(found: Found | None) -> float:
    """Sum of the normal forces, the mean over the loads [N]."""
    return float("nan") if found is None else float(np.mean(np.sum(found.force[:, 2::3], axis=1)))
