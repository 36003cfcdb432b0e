"""Where a fit begins: which coefficients the forces are linear in, and a net of values for the others."""

from __future__ import annotations

import math
from collections.abc import Hashable
from itertools import product

import numpy as np
from numpy.typing import NDArray

from softhand.identification.fitting.coefficients import OFFSET, Coefficient
from softhand.identification.fitting.model import Model
from softhand.numerics.arrays import Array

_MOST_STARTS = 512
_MOST_SETTINGS = 20  # at which linearity is looked for
_STRAIGHT = 1e-9  # second differences below this share of the forces are rounding
_KEPT = 64
_known: dict[Hashable, NDArray[np.bool_]] = {}  # answers of find_linear: cross-validation asks the same again and again


def find_linear(model: Model) -> NDArray[np.bool_]:
    """The coefficients in which the forces are affine, all together: second differences vanish wherever one looks."""
    count = len(model.settings)
    probe = model.settings[np.unique(np.linspace(0, count - 1, min(count, _MOST_SETTINGS)).astype(int))]
    components = np.unique(model.component)
    key = (model.law_class, model.radius, repr(model.fixed), probe.tobytes(), components.tobytes(), len(model.free))
    if key in _known:
        return _known[key].copy()
    bases = _bases(model)
    linear = np.zeros(len(model.free), dtype=bool)
    for k, coefficient in enumerate(model.free):
        linear[k] = coefficient.name != OFFSET and all(
            _is_straight(model, probe, components, base, k, linear) for base in bases
        )
    if len(_known) == _KEPT:
        _known.clear()
    _known[key] = linear
    return linear.copy()


def find_starts(model: Model, linear: NDArray[np.bool_]) -> list[Array]:
    """Values to begin from: defaults where there are some, else a net; linear coefficients are 1."""
    nets = [
        [1.0] if is_linear else _net(coefficient) for coefficient, is_linear in zip(model.free, linear, strict=True)
    ]
    points = [np.array(point) for point in product(*nets)]
    if len(points) > _MOST_STARTS:
        chosen = np.random.default_rng(0).choice(len(points), _MOST_STARTS, replace=False)
        points = [points[k] for k in chosen]
    return points


def _bases(model: Model) -> list[Array]:
    """Values near 1, and some from all over the limits."""
    rng = np.random.default_rng(0)
    nets = [_net(coefficient) for coefficient in model.free]
    middle = np.array([min(net, key=lambda value: abs(value - 1.0)) for net in nets])
    return [middle, 2.0 * middle, *(np.array([rng.choice(net) for net in nets]) for _ in range(4))]


def _is_straight(
    model: Model, probe: Array, components: NDArray[np.int64], base: Array, k: int, linear: NDArray[np.bool_]
) -> bool:
    def forces(values: Array) -> Array:
        return model.at(values, probe)[:, components]

    moves = np.diag(0.5 * np.abs(base))
    at_base, moved = forces(base), forces(base + moves[k])
    size = max(float(np.max(np.abs(values), initial=0.0)) for values in (at_base, moved))
    for other in [*moves[linear], moves[k]]:
        bend = forces(base + moves[k] + other) - moved - forces(base + other) + at_base
        if np.max(np.abs(bend), initial=0.0) > _STRAIGHT * size:
            return False
    return True


def _net(coefficient: Coefficient) -> list[float]:
    lower, upper, default = coefficient.lower, coefficient.upper, coefficient.default
    if coefficient.name == OFFSET:
        return [0.0]
    if default is not None and lower < default < upper and default != 0.0:
        return [default, *(value for share in (0.3, 3.0) if lower < (value := share * default) < upper)]
    if math.isfinite(lower) and math.isfinite(upper):
        return [lower + share * (upper - lower) for share in (0.1, 0.37, 0.63, 0.9)]
    powers = [10.0**power for power in range(-6, 10)]
    if math.isfinite(lower):
        return [lower + value for value in powers]
    if math.isfinite(upper):
        return [upper - value for value in powers]
    return [*powers, *(-value for value in powers)]
