"""What a tuning found: numbers before and after, what they cost in other worlds, and the scenario with them."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass
from typing import Any, ClassVar

from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.scenario.scenario import Scenario
from softhand.tuning.figures import FIGURES
from softhand.tuning.judged import Judged


@dataclass(frozen=True)
class Turn(Record):
    """One number that was turned.

    Attributes:
        name: key of the scenario, with its place in a list; behind a factor stands "(factor)".
        unit: of it.
        low: smallest that was allowed.
        high: largest.
        before: in the scenario.
        after: found.
    """

    name: str
    unit: str
    low: float
    high: float
    is_log: bool
    before: float
    after: float

    @property
    def is_at_bound(self) -> bool:
        """Whether it ends at one of its bounds, within a hundredth of them."""
        near = 0.01 * (math.log(self.high / self.low) if self.is_log else self.high - self.low)
        ends = (math.log(self.after / self.low), math.log(self.high / self.after)) if self.is_log else (
            self.after - self.low, self.high - self.after)  # fmt: skip
        return min(ends) <= near


@dataclass(frozen=True, eq=False, repr=False)
class Tuning(Record):
    """Numbers of a scenario that were turned, and what that did.

    Attributes:
        turned: a line for each number.
        figures: a line for each figure, in the held-out worlds.
        lost: share of runs that are lost there, before and after.
        astray: share of runs that are lost or not settled if they go on, before and after.
        go_on: how much longer these are than the others.
        gain: mean of the cost before less after there, in multiples of the figures before, and half the width of its
            interval, 95 %.
        is_better: whether it is better there, as `judged.judge` has it.
        reasons: why it is not.
        worlds: how many of the search and held out.
        runs: of the search, and of the judgement.
        method: of the search.
        history: runs of the search, and the least cost after them, shape (generations, 2).
        each: figures in each held-out world before and after, shape (2, worlds, figures); NaN of lost runs.
        scenario: with the numbers that were found.
        before: as it was.
    """

    units: ClassVar = {"lost": "1", "astray": "1", "gain": "1"}
    unreported: ClassVar = frozenset({"scenario", "before", "each"})

    turned: tuple[Turn, ...]
    figures: tuple[Judged, ...]
    lost: tuple[float, float]
    astray: tuple[float, float]
    go_on: float
    gain: tuple[float, float]
    is_better: bool
    reasons: tuple[str, ...]
    worlds: tuple[int, int]
    runs: tuple[int, int]
    method: str
    history: Array
    each: Array
    scenario: Scenario
    before: Scenario

    def rows(self) -> list[tuple[str, str, str, str, str]]:
        """Label, before, after, change with its interval, and limit, of the held-out worlds."""
        rows = []
        for one in self.figures:
            unit = "" if one.unit == "1" else f" [{one.unit}]"
            worst = ", worst" if one.over == "worst" else ""
            wide = "" if math.isnan(one.half_width) else f" +- {one.half_width:.2g}"
            limit = "" if math.isinf(one.limit) else f"{one.limit:.4g}, {'kept' if one.is_kept else 'not kept'}"
            rows.append((
                f"{FIGURES[one.name].words}{worst}{unit}", f"{one.before:.4g}", f"{one.after:.4g}",
                f"{one.change:+.3g}{wide} ({one.percent:+.1f} %)", limit,
            ))  # fmt: skip
        for name, shares in (
            ("lost runs [%]", self.lost), (f"astray in {self.go_on:g} times the time [%]", self.astray)
        ):  # fmt: skip
            first, second = (100.0 * share for share in shares)
            rows.append((name, f"{first:.3g}", f"{second:.3g}", f"{second - first:+.3g}", ""))
        return rows

    def number_rows(self) -> list[tuple[str, str, str, str, str]]:
        """Key, unit, before, after and bounds of each number."""
        return [
            (one.name, one.unit, f"{one.before:.5g}", f"{one.after:.5g}{' (bound)' if one.is_at_bound else ''}",
             f"{one.low:.4g} to {one.high:.4g}{', log' if one.is_log else ''}")
            for one in self.turned
        ]  # fmt: skip

    def to_toml(self) -> str:
        """The scenario that was found, with what it is better in above it."""
        lines = [f"# Turned by softhand tune: {', '.join(one.name for one in self.turned)}."]
        lines += [f"# {' | '.join(filter(None, row))}" for row in self.rows()]
        lines.append(f"# Before, after and change over {self.worlds[1]} worlds that the search has not seen.")
        return "\n".join([*lines, "", self.scenario.to_toml()])

    def to_csv(self) -> str:
        """The figures in each held-out world before and after, a row a world."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        names = [f"{one.name} [{one.unit}]" for one in self.figures]
        writer.writerow(["world", *(f"{name} {when}" for when in ("before", "after") for name in names)])
        for k in range(self.each.shape[1]):
            writer.writerow([k, *self.each[0, k].tolist(), *self.each[1, k].tolist()])
        return text.getvalue()

    def __repr__(self) -> str:
        told = ", ".join(f"{one.name} {one.percent:+.1f} %" for one in self.figures)
        how = "better" if self.is_better else "not better"
        return f"<Tuning: {len(self.turned)} numbers, {how} in {self.worlds[1]} held-out worlds: {told}>"

    def to_dict(self) -> dict[str, Any]:
        """Numbers that were turned, by name."""
        return {one.name: one.after for one in self.turned}
