"""A study: one scenario, what varies in it, how it is sampled, and what is asked of each run."""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

import tomli_w
from pydantic import Field, field_validator, model_validator

from softhand.settings.settings import Positive, Settings
from softhand.settings.wording import show
from softhand.studies.outcome_settings import Condition, Outcome

Count = Annotated[int, Field(ge=1, le=100_000_000)]

Method = Literal["grid", "random", "latin-hypercube", "sobol", "saltelli"]


class Varied(Settings):
    """What one key of the scenario takes: one of `grid`, `choice`, `range` and `normal`."""

    grid: tuple[Any, ...] | None = None
    """Values that are all taken, with all others of other keys and with all samples."""
    choice: tuple[Any, ...] | None = None
    """Values of which each sample takes one, all as likely."""
    range: tuple[float, float] | None = None
    """Two numbers between which samples are drawn."""
    normal: tuple[float, float] | None = None
    """Mean and standard deviation of samples with a normal distribution."""
    scale: Literal["linear", "log"] = "linear"
    """Of a range: `log` draws the logarithm evenly."""
    points: Annotated[int, Field(ge=2, le=1_000_000)] | None = None
    """Makes of a range a grid of so many values, both ends among them."""
    also: tuple[str, ...] = ()
    """Further keys of the scenario that take the same value."""

    @field_validator("grid", "choice")
    @classmethod
    def _some(cls, values: Any) -> Any:
        if values is not None and not values:
            raise ValueError("it is empty; give at least one value.")
        return values

    @field_validator("range")
    @classmethod
    def _begins_below(cls, ends: Any) -> Any:
        if ends is not None and not ends[0] < ends[1]:
            raise ValueError("the range is empty; its first number must be below its second.")
        return ends

    @field_validator("normal")
    @classmethod
    def _is_spread(cls, normal: Any) -> Any:
        if normal is not None and not normal[1] > 0.0:
            raise ValueError("the second number is the standard deviation, and must be above 0.")
        return normal

    @model_validator(mode="after")
    def _is_one(self) -> Varied:
        given = [name for name in _KINDS if getattr(self, name) is not None]
        if len(given) != 1:
            got = " and ".join(given) if given else "none"
            raise ValueError(f"give one of {', '.join(_KINDS)}; got {got}.")
        if self.range is None and self.scale != "linear":
            raise ValueError(f'scale = "log" belongs to a range, and not to a {given[0]}.')
        if self.range is None and self.points is not None:
            raise ValueError(f"points belong to a range, and not to a {given[0]}.")
        if self.range is not None and self.scale == "log" and not self.range[0] > 0.0:
            raise ValueError(f'scale = "log" needs a range above 0; got {show(self.range)}.')
        return self

    @property
    def is_grid(self) -> bool:
        """Whether all values are taken with all others, rather than one by each sample."""
        return self.grid is not None or self.points is not None

    @property
    def ends(self) -> list[Any]:
        """Values that tell whether the key takes what it is given."""
        if self.normal is not None:
            return [self.normal[0]]
        return list(self.grid or self.choice or self.range or ())


_KINDS = ("grid", "choice", "range", "normal")


class Sample(Settings):
    """How samples are drawn."""

    method: Method = "grid"
    """`grid` takes all values, `saltelli` is the design of Sobol indices: count (keys + 2) runs."""
    count: Count = 1
    """Samples; of `saltelli`, base samples. Powers of two for `sobol` and `saltelli`."""
    seed: Annotated[int, Field(ge=0, le=10**9)] = 0
    """Of the samples."""
    repeats: Count = 1
    """Runs of each sample, with other noise in `[sensing]` and `[actuation]`."""

    @model_validator(mode="after")
    def _is_balanced(self) -> Sample:
        count = self.count
        if self.method in ("sobol", "saltelli") and count & (count - 1):
            below = 1 << (count.bit_length() - 1)
            raise ValueError(
                f"{self.method} needs a count that is a power of two; {below} or {2 * below}, not {count}."
            )
        if self.method == "grid" and count != 1:
            raise ValueError(
                f"a grid has as many runs as its values make; leave out count, or choose another "
                f"method: {', '.join(get_args(Method)[1:])}."
            )
        return self


class Keep(Settings):
    """What is kept of each run beside its outcomes."""

    variables: tuple[str, ...] = ()
    """Arrays of a recording that are kept in the store."""
    every: Positive = 0.01
    """Time between two samples, of these and of what outcomes are computed from [s]."""


class Study(Settings):
    """One scenario, what varies in it, how it is sampled, and what is asked of each run.

    Make one with `load_study` or `as_study` of `loading`, which check it against the scenario.
    """

    scenario: str
    """The scenario that ships, by its name, or a path, relative to the file of the study."""
    description: str = ""
    """One line, the title of figures."""
    set: dict[str, Any] = Field(default_factory=dict)
    """Values put over the scenario, of all runs."""
    vary: dict[str, Varied] = Field(default_factory=dict)
    """What varies, by dotted key; `object.position[0]` is one number of a list."""
    sample: Sample = Sample()
    """How samples are drawn."""
    outcomes: dict[str, Outcome] = Field(default_factory=dict)
    """Numbers of a run, by names of one's own."""
    success: dict[str, Condition] = Field(default_factory=dict)
    """Limits of outcomes, within which a finished run is a success."""
    keep: Keep = Keep()
    """What else is kept."""

    def to_toml(self) -> str:
        """The study as TOML text; reading it gives an equal one."""
        return tomli_w.dumps(self.model_dump(exclude_none=True, exclude_defaults=True))
