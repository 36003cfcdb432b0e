"""The section of a scenario on the skin of the tips."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from softhand.settings.settings import NonNegative, Positive, Settings

FEWEST, MOST = 12, 2000
"""Taxels of a tip, as `tactile.pattern` has them."""

Share = Annotated[float, Field(ge=0, le=1)]
Numbers = tuple[int, ...]


class TactileSection(Settings):
    """A skin of taxels on every tip; all that is not given is ideal."""

    count: Annotated[int, Field(ge=FEWEST, le=MOST)] = 100
    """Taxels of each tip, 12 to 2000."""
    pattern: Literal["fibonacci", "rings"] = "fibonacci"
    """Where they sit: on a spiral, or on rings about the apex; of equal areas."""
    hysteresis: Share = 0.0
    """Share by which a taxel that is let go may read too much, 0 to 1."""
    noise: NonNegative = 0.0
    """Standard deviation of the normal force of each taxel [N]."""
    shear_noise: NonNegative = 0.0
    """Standard deviation of each of its two shear forces [N]."""
    dead: Numbers | dict[str, Numbers] = ()
    """Numbers of taxels that read nothing, counted from 1: of all tips, or by the name of a tip."""
    dead_share: Share = 0.0
    """Share of the taxels that are dead beside these, drawn by the seed."""
    delay: NonNegative = 0.0
    """Time until a sample arrives, a whole number of control periods [s]."""
    rate: Positive | None = None
    """Samples a second, held in between; each control period if not given [Hz]."""
    seed: Annotated[int, Field(ge=0, le=10**9)] = 0
    """Of the noise and of the dead taxels."""

    @model_validator(mode="after")
    def _has_its_dead(self) -> TactileSection:
        every = self.dead.values() if isinstance(self.dead, dict) else [self.dead]
        for number in (number for numbers in every for number in numbers):
            if not 1 <= number <= self.count:
                raise ValueError(
                    f"dead: got {number}, but a tip has {self.count} taxels, counted from 1; give 1 to {self.count}."
                )
        return self
