"""Quasi-linear viscoelasticity: the force relaxes."""

from __future__ import annotations

from pydantic import field_validator, model_validator

from softhand.dampings.damping import Damping
from softhand.settings.settings import Vector
from softhand.settings.wording import show

_MOST = 4


class Fung(Damping):
    """Quasi-linear viscoelastic (Fung; Tiezzi, Kao): a held tip relaxes to a share c_0 of its force [F].

        F = c_0 F_e + sum q_k,   q_k' = -nu_k q_k + c_k F_e',   c_0 + sum c_k = 1

    F_e is the force of the law in its own coordinates. In place of q_k its complement is integrated, which needs no
    rate of F_e: q_k = c_k (F_e - w_k), w_k' = nu_k (F_e - w_k). A fast motion meets F_e, a slow one c_0 F_e. At the
    start all is relaxed.
    """

    shares: Vector = (0.2, 0.1)
    """Shares c_k of the force that relax [1], one to four with a sum below 1."""
    rates: Vector = (50.0, 5.0)
    """Rates nu_k at which they relax [1/s], as many."""

    @field_validator("shares")
    @classmethod
    def _leave_something(cls, shares: tuple[float, ...]) -> tuple[float, ...]:
        if min(shares) <= 0.0 or sum(shares) >= 1.0 or len(shares) > _MOST:
            raise ValueError(
                f"it must be one to {_MOST} numbers > 0 with a sum < 1, since c_0 = 1 - sum is what is left."
            )
        return shares

    @field_validator("rates")
    @classmethod
    def _relax(cls, rates: tuple[float, ...]) -> tuple[float, ...]:
        if min(rates) <= 0.0:
            raise ValueError("every rate must be > 0.")
        return rates

    @model_validator(mode="after")
    def _come_in_pairs(self) -> Fung:
        if len(self.shares) != len(self.rates):
            raise ValueError(
                f"damping fung: shares = {show(self.shares)} and rates = {show(self.rates)} must have one length."
            )
        return self

    def relaxation(self) -> tuple[tuple[float, float], ...]:
        """The pairs."""
        return tuple(zip(self.shares, self.rates, strict=True))
