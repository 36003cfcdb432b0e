"""Kernel: what taxels read of what they feel: hysteresis, noise, dead ones."""

from __future__ import annotations

from typing import NamedTuple

from numpy.typing import NDArray

from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.philox import normal
from softhand.tactile.field import feel

_STREAM = 1000  # of the random numbers; instruments have the first ones


class Reading(NamedTuple):
    """What taxels do to what they feel."""

    errs: NDArray
    """0 if all that is felt is read as it is, shape (1,)."""
    hysteresis: Array
    """Shape (1,)."""
    noise: Array
    """Standard deviation of normal and shear forces [N], shape (2,)."""
    seed: NDArray
    """Shape (1,)."""
    dead: NDArray
    """1 where a taxel is dead, shape (nc, taxels)."""
    memory: Array
    """Normal force that each read last [N], shape (nc, taxels)."""


@compiled
def read_taxels(reading, felt, period):
    """Change what is felt into what is read in a control period; twice in the same gives the same.

    A taxel that is let go holds on: it reads y, clipped from what it read before to x <= y <= (1 + hysteresis) x, x its
    normal force; so it is exact as long as the load grows, and never more than that share too high. Its shear is higher
    by as much. Noise is white and normal, a number of it a function of seed, taxel and control period alone. A dead
    taxel reads zeros.

    Args:
        reading: `Reading`.
        felt: `field.Felt`, changed.
        period: its first number is that of the control period.
    """
    if not reading.errs[0]:
        return
    force, shear = felt.tactile_normal_force, felt.tactile_shear_force
    tips, count = force.shape
    share, seed, index = reading.hysteresis[0], reading.seed[0], period[0]
    for i in range(tips):
        for t in range(count):
            x = force[i, t]
            if share > 0.0 and x > 0.0:
                y = min(max(reading.memory[i, t], x), (1.0 + share) * x)
                force[i, t], shear[i, t, 0], shear[i, t, 1] = y, shear[i, t, 0] * (y / x), shear[i, t, 1] * (y / x)
            reading.memory[i, t] = force[i, t]
            place = i * count + t
            if reading.noise[0] > 0.0:
                force[i, t] += reading.noise[0] * normal(seed, _STREAM, place, index)
            if reading.noise[1] > 0.0:
                shear[i, t, 0] += reading.noise[1] * normal(seed, _STREAM + 1, place, index)
                shear[i, t, 1] += reading.noise[1] * normal(seed, _STREAM + 2, place, index)
            if reading.dead[i, t]:
                force[i, t], shear[i, t, 0], shear[i, t, 1] = 0.0, 0.0, 0.0
                felt.tactile_slip[i, t], felt.penetration_depth[i, t] = 0.0, 0.0


@compiled
def feel_and_read(skin, reading, pads, contacts, poses, felt, seen, period):
    """`field.feel` and `read_taxels`, and a copy for what a controller sees.

    Args:
        skin: as in `feel`, like the next four.
        reading: as in `read_taxels`.
        pads: as in `feel`.
        contacts: likewise.
        poses: likewise.
        felt: set.
        seen: `field.Felt`, set; of no tips where the controller sees what is felt itself.
        period: its first number is that of the control period.
    """
    feel(skin, pads, contacts, poses, felt)
    read_taxels(reading, felt, period)
    for i in range(seen.tactile_slip.shape[0]):
        for t in range(seen.tactile_slip.shape[1]):
            seen.tactile_normal_force[i, t] = felt.tactile_normal_force[i, t]
            for k in range(2):
                seen.tactile_shear_force[i, t, k] = felt.tactile_shear_force[i, t, k]
            seen.tactile_slip[i, t] = felt.tactile_slip[i, t]
            seen.penetration_depth[i, t] = felt.penetration_depth[i, t]
