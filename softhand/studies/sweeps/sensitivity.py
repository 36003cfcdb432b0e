"""What the outcomes depend on: Sobol indices of a design for them, rank correlations of any other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import spearmanr

from softhand.numerics.arrays import AnyArray, Array

_RESAMPLES = 200
_LEAST = 8


class Sensitivity(NamedTuple):
    """How much of one outcome is due to each key.

    Attributes:
        outcome: which.
        kind: `sobol`: shares of the variance; `rank`: Spearman's correlation.
        keys: what varies.
        first: of `sobol`, what a key does alone, S_i; of `rank`, the correlation; shape (keys,).
        total: of `sobol`, what it does together with others as well, S_Ti; NaN of `rank`; shape (keys,).
        first_low: lower ends of 95 % intervals by bootstrap; shape (keys,).
        first_high: upper ends.
        total_low: lower ends of those of `total`.
        total_high: upper ends.
        used: base samples, or runs, that have a number.
        left_out: those that have none, as a run was lost.
    """

    outcome: str
    kind: str
    keys: tuple[str, ...]
    first: Array
    total: Array
    first_low: Array
    first_high: Array
    total_low: Array
    total_high: Array
    used: int
    left_out: int


def sobol(outcome: str, keys: tuple[str, ...], values: Array) -> Sensitivity | None:
    """Sobol indices of first order and total.

        S_i = Var(E(Y|X_i)) / Var(Y),  S_Ti = E(Var(Y|X_~i)) / Var(Y)

    by the estimators that Saltelli et al. 2010, Comput. Phys. Commun. 181, 259-270, find best (table 2, b and f).
    Those of `scipy.stats.sobol_indices` are the same, and refuse a number of base samples that is no power of two, as
    it seldom is once those with a lost run are left out. Intervals are percentiles of a bootstrap, always the same.

    Args:
        outcome: name.
        keys: what varies, in the order of the design.
        values: of the outcome over the design of `samples.unit_points`, shape (points (keys + 2),).

    Returns:
        None where there are fewer than `_LEAST` base samples with numbers, or they are all the same.
    """
    blocks = values.reshape(-1, len(keys) + 2)
    whole = blocks[np.isfinite(blocks).all(axis=1)]
    if len(whole) < _LEAST or np.ptp(whole[:, :2]) == 0.0:
        return None
    first, total = _indices(whole)
    rng = np.random.default_rng(0)
    drawn = [_indices(whole[rng.integers(len(whole), size=len(whole))]) for _ in range(_RESAMPLES)]
    low, high = np.nanpercentile(np.array(drawn), (2.5, 97.5), axis=0)
    return Sensitivity(
        outcome, "sobol", keys, first, total, low[0], high[0], low[1], high[1], len(whole), len(blocks) - len(whole)
    )  # fmt: skip


def _indices(blocks: Array) -> tuple[Array, Array]:
    """First order and total of rows of f(A), f(B), f(A with a coordinate of B), shape (samples, keys + 2)."""
    centred = blocks - blocks[:, :2].mean()  # the estimate of S_i is not free of the mean
    f_A, f_B, f_AB = centred[:, :1], centred[:, 1:2], centred[:, 2:]
    variance = np.var(centred[:, :2])
    if variance == 0.0:
        return np.full(f_AB.shape[1], np.nan), np.full(f_AB.shape[1], np.nan)
    return np.mean(f_B * (f_AB - f_A), axis=0) / variance, 0.5 * np.mean((f_A - f_AB) ** 2, axis=0) / variance


def rank(outcome: str, columns: dict[str, AnyArray], values: Array) -> Sensitivity | None:
    """Spearman's rank correlation of an outcome with each key that has numbers; its interval by Fisher's transform.

    Returns:
        None where there are fewer than `_LEAST` runs with numbers, or they are all the same.
    """
    there = np.isfinite(values)
    keys = tuple(key for key, column in columns.items() if np.ptp(column[there]) > 0.0) if there.any() else ()
    if there.sum() < _LEAST or np.ptp(values[there]) == 0.0 or not keys:
        return None
    rho = np.array([spearmanr(columns[key][there], values[there]).statistic for key in keys])
    width = 1.96 * np.sqrt(1.06 / (there.sum() - 3))  # [Fieller, Hartley, Pearson 1957]
    z = np.arctanh(np.clip(rho, -1.0 + 1e-12, 1.0 - 1e-12))
    none = np.full(len(keys), np.nan)
    return Sensitivity(
        outcome, "rank", keys, rho, none, np.tanh(z - width), np.tanh(z + width), none, none, int(there.sum()),
        int(np.sum(~there)),
    )  # fmt: skip
