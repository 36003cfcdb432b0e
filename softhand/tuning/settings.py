"""The tables of a study that a tuning adds: what is turned, what it costs, in which worlds, and the search"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from softhand.settings.settings import NonNegative, Positive, Settings
from softhand.settings.wording import show

Seed = Annotated[int, Field(ge=0, le=10**9)]
Count = Annotated[int, Field(ge=2, le=1_000_000)]


def _ordered(ends: tuple[float, float] | None) -> tuple[float, float] | None:
    if ends is not None and not ends[0] < ends[1]:
        raise ValueError("there is nothing between these bounds; the first must be below the second.")
    return ends


class Turned(Settings):
    """Bounds of a key that is turned: one of `range` and `factor`."""

    range: tuple[float, float] | None = None
    """Smallest and largest value; of a list, of each of its numbers, which are turned one by one."""
    factor: tuple[float, float] | None = None
    """Smallest and largest factor on the value that the scenario has; of a list, one factor on all its numbers."""
    scale: Literal["linear", "log"] = "linear"
    """`log` takes the same ratio for the same way: for gains, of which only the order is known."""

    @field_validator("range", "factor")
    @classmethod
    def _begins_below(cls, ends: tuple[float, float] | None) -> tuple[float, float] | None:
        return _ordered(ends)

    @model_validator(mode="after")
    def _is_one(self) -> Turned:
        if (self.range is None) == (self.factor is None):
            raise ValueError("give its bounds, either range = [smallest, largest] or factor = [smallest, largest].")
        if self.scale == "log" and not self.ends[0] > 0.0:
            raise ValueError(f'scale = "log" needs bounds above 0; got {show(self.ends)}.')
        return self

    @property
    def ends(self) -> tuple[float, float]:
        """The bounds, of values or of the factor."""
        found = self.range or self.factor
        assert found is not None
        return found


class Spread(Settings):
    """What one key takes in the worlds: one of `range`, `factor`, `normal` and `choice`."""

    range: tuple[float, float] | None = None
    """Two numbers between which it lies."""
    factor: tuple[float, float] | None = None
    """Likewise, as factors on the number that the scenario has: `[0.8, 1.2]` is 20 % less to 20 % more."""
    normal: tuple[float, float] | None = None
    """Mean and standard deviation of a normal distribution."""
    choice: tuple[Any, ...] | None = None
    """Values that are all as likely."""
    scale: Literal["linear", "log"] = "linear"
    """Of a range or factor: `log` draws the logarithm evenly."""
    also: tuple[str, ...] = ()
    """Further keys that take the same value."""

    @field_validator("range", "factor")
    @classmethod
    def _begins_below(cls, ends: tuple[float, float] | None) -> tuple[float, float] | None:
        return _ordered(ends)

    @model_validator(mode="after")
    def _is_one(self) -> Spread:
        kinds = ("range", "factor", "normal", "choice")
        given = [name for name in kinds if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"give one of {', '.join(kinds)}; got {' and '.join(given) or 'none'}.")
        if self.normal is not None and not self.normal[1] > 0.0:
            raise ValueError("the second number of normal is the standard deviation, and must be above 0.")
        if self.choice is not None and not self.choice:
            raise ValueError("the choice is empty; give at least one value.")
        ends = self.range or self.factor
        if self.scale == "log" and not (ends and ends[0] > 0.0):
            raise ValueError('scale = "log" needs a range or factor above 0.')
        return self


class Term(Settings):
    """What a figure costs, and how large it may be."""

    weight: NonNegative = 0.0
    """Cost of the figure, as a multiple of what it was before."""
    at_most: Literal["before"] | NonNegative | None = None
    """Largest figure, a number in its unit or that of the scenario as it is; none if not given."""
    over: Literal["mean", "worst"] = "mean"
    """What becomes of the worlds, both for the weight and the limit."""

    @model_validator(mode="after")
    def _is_something(self) -> Term:
        if self.weight == 0.0 and self.at_most is None:
            raise ValueError("it costs nothing; give weight, at_most or both.")
        return self


class Worlds(Settings):
    """Worlds in which each candidate runs, and others in which the best one is judged."""

    count: Count = 8
    """Worlds of the search."""
    held_out: Count = 100
    """Further ones that the search never sees."""
    go_on: Annotated[float, Field(ge=1.0, le=1000.0)] = 5.0
    """So many times the duration some of them are run at the end: what is settled must stay so."""
    seed: Seed = 0
    """Of all worlds."""


class Method(Settings):
    """How the search goes."""

    name: Literal["auto", "gradient", "cma"] = "auto"
    """`auto` takes `gradient` where all costs have one, `cma` elsewhere."""
    runs: Annotated[int, Field(ge=1, le=10**9)] = 2000
    """Runs of the search at most, those of the gradient counted as four."""
    population: Annotated[int, Field(ge=4, le=10_000)] | None = None
    """Candidates of a generation of `cma`; 4 + 3 log(parameters) if not given."""
    step: Annotated[float, Field(gt=0.0, le=1.0)] = 0.2
    """Standard deviation of the first generation of `cma`, as a share of the bounds."""
    margin: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.01
    """By so much, as a share of it, the search stays below a limit, which has to hold in other worlds too."""
    lost: Positive = 10.0
    """Cost of a lost run, spread over the worlds, beside weights that are multiples of what was before; up to twice as
    much for one that is lost at its begin."""
    seed: Seed = 0
    """Of the search."""
