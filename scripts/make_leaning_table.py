"""Write tests/data/leaning.csv: what a plane feels of a tip that leans on it, by finite elements; half an hour."""

from __future__ import annotations

import csv
import math
import sys
from collections.abc import Iterator
from pathlib import Path

from softhand.material.leaning import Leaning, LeaningTip

FILE = Path(__file__).parents[1] / "tests" / "data" / "leaning.csv"
COLUMNS = (
    "contact",
    "nu",
    "from [deg]",
    "lean [deg]",
    "d / r",
    "f_n / (G r^2)",
    "f_t / (G r^2)",
    "m / (G r^3)",
    "mesh",
)
DEPTHS = (0.1, 0.15, 0.2, 0.25, 0.3)
RATIOS = (0.5, 0.3, 0.1)
LEANS = (15, 30, 45)
ROLLED = ((0, 20), (30, 20), (30, 40))
FINER = ((0.5, 30), (0.5, 45), (0.1, 45))


def rows() -> Iterator[tuple[str, ...]]:
    """All of the table."""
    for nu in RATIOS:
        for lean in LEANS:
            for sticks in (True, False):
                yield from pressed(nu, lean, sticks, 0)
        for lean, end in ROLLED:
            tip = LeaningTip(nu, math.radians(lean), sticks=True)
            tip.press(0.2)
            yield row("rolled", nu, lean, list(tip.roll(math.radians(end)))[-1], 0)
    for nu, lean in FINER:
        yield from pressed(nu, lean, True, 1)


def pressed(nu: float, lean: int, sticks: bool, level: int) -> Iterator[tuple[str, ...]]:
    """One tip, deeper and deeper along the normal."""
    tip = LeaningTip(nu, math.radians(lean), sticks, level)
    for depth in DEPTHS:
        yield row("sticking" if sticks else "smooth", nu, lean, tip.press(depth), level)


def row(contact: str, nu: float, first: int, found: Leaning, level: int) -> tuple[str, ...]:
    """As text."""
    forces = (f"{value:.4f}" for value in (found.normal, found.along, found.moment))
    return contact, str(nu), str(first), f"{math.degrees(found.lean):.0f}", f"{found.depth:.2f}", *forces, str(level)


def main() -> None:
    """Row by row, so that one can look."""
    with FILE.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        for one in rows():
            table.writerow(one)
            file.flush()
            print(*one, file=sys.stderr)


if __name__ == "__main__":
    main()
