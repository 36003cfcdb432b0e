"""Kernel: what taxels read of what they feel: hysteresis, noise, dead ones, a rate and a delay."""

from __future__ import annotations

from typing import NamedTuple

from numpy.typing import NDArray

from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.philox import fill_blocks
from softhand.numerics.ziggurat import three_normals
from softhand.tactile.field import Felt, feel

_STREAM = 1000  # of the random numbers; instruments have the first ones


class Reading(NamedTuple):
    """What taxels do to what they feel, and what they remember."""

    errs: NDArray
    """Whether any taxel errs, and whether any is dead, shape (2,)."""
    hysteresis: Array
    """Shape (1,)."""
    noise: Array
    """Standard deviation of normal and shear forces [N], shape (2,)."""
    seed: NDArray
    """Shape (1,)."""
    dead: NDArray
    """1 where a taxel is dead, shape (nc, taxels)."""
    memory: Array
    """Normal force that each read last, of hysteresis [N], shape (nc, taxels)."""
    bits: NDArray
    """Scratch: random bits, uint32, shape (4, taxels)."""
    timing: NDArray
    """Control periods between two samples, and until one arrives, shape (2,)."""
    begun: NDArray
    """1 once there are samples, shape (1,)."""
    line: Array
    """Samples on their way, number j in row j mod rows, the arrays of a `Felt` one behind the other; no rows where each
    control period has its own at once, shape (samples, numbers)."""


@compiled
def read_taxels(reading, felt, period):
    """Change what is felt into what is read in a control period; twice in the same gives the same.

    A taxel that is let go holds on: it reads y, clipped from what it read before to x <= y <= (1 + hysteresis) x, x its
    normal force; so it is exact as long as the load grows, and never more than that share too high. Its shear is higher
    by as much. Noise is white and normal, a number of it a function of seed, taxel and control period alone. A dead
    taxel reads zeros.

    With a rate or a delay a sample is taken every so many control periods, as all this says, and read from when it
    arrives until the next one does. Before the run all stood as at its first sample, with noise of its own.

    Args:
        reading: `Reading`.
        felt: `field.Felt`, changed.
        period: its first number is that of the control period.
    """
    k, rows, stride = period[0], reading.line.shape[0], reading.timing[0]
    if reading.hysteresis[0] > 0.0:
        for i in range(felt.tactile_slip.shape[0]):
            _hold_on(reading, i, felt)
    if rows == 0:
        _err(reading, felt, k)
        return
    last, arrived = k // stride, (k - reading.timing[1]) // stride
    if reading.begun[0] == 0 or k % stride == 0:
        for j in range(arrived if reading.begun[0] == 0 else last, last + 1):
            sample = _row(reading, j % rows, felt)
            _copy(felt, sample)
            _err(reading, sample, j * stride)
        reading.begun[0] = 1
    _copy(_row(reading, arrived % rows, felt), felt)


@compiled
def _row(reading, j, felt):
    """A row of the line as a `Felt`."""
    row, shape, n = reading.line[j], felt.tactile_slip.shape, felt.tactile_slip.size
    return Felt(
        row[:n].reshape(shape),
        row[n : 3 * n].reshape((shape[0], shape[1], 2)),
        row[3 * n : 4 * n].reshape(shape),
        row[4 * n :].reshape(shape),
    )


@compiled
def _copy(source, target):
    for i in range(target.tactile_slip.shape[0]):
        for t in range(target.tactile_slip.shape[1]):
            target.tactile_normal_force[i, t] = source.tactile_normal_force[i, t]
            target.tactile_shear_force[i, t, 0] = source.tactile_shear_force[i, t, 0]
            target.tactile_shear_force[i, t, 1] = source.tactile_shear_force[i, t, 1]
            target.tactile_slip[i, t] = source.tactile_slip[i, t]
            target.penetration_depth[i, t] = source.penetration_depth[i, t]


@compiled
def _err(reading, felt, index):
    """Noise of the sample with that index, and zeros of dead taxels."""
    for i in range(felt.tactile_slip.shape[0]):
        if reading.noise[0] > 0.0 or reading.noise[1] > 0.0:
            _add_noise(reading, i, felt, index)
        if reading.errs[1]:
            _let_die(reading, i, felt)


@compiled
def _hold_on(reading, i, felt):
    """Hysteresis of one tip."""
    force, shear, memory = felt.tactile_normal_force[i], felt.tactile_shear_force[i], reading.memory[i]
    share = reading.hysteresis[0]
    for t in range(force.shape[0]):
        x = force[t]
        if x > 0.0:
            y = min(max(memory[t], x), (1.0 + share) * x)
            force[t], shear[t, 0], shear[t, 1] = y, shear[t, 0] * (y / x), shear[t, 1] * (y / x)
        memory[t] = force[t]


@compiled
def _add_noise(reading, i, felt, index):
    """Noise of one tip: of each taxel three numbers, of one block of random bits."""
    force, shear, seed, words = felt.tactile_normal_force[i], felt.tactile_shear_force[i], reading.seed[0], reading.bits
    first, normal, tangential = i * force.shape[0], reading.noise[0], reading.noise[1]
    fill_blocks(words, seed, _STREAM, first, index)
    for t in range(force.shape[0]):
        a, b, c = three_normals(words, t, seed, _STREAM, first + t, index)
        force[t] += normal * a
        shear[t, 0] += tangential * b
        shear[t, 1] += tangential * c


@compiled
def _let_die(reading, i, felt):
    """Zeros of the dead taxels of one tip."""
    for t in range(felt.tactile_slip.shape[1]):
        if reading.dead[i, t]:
            felt.tactile_normal_force[i, t], felt.tactile_slip[i, t], felt.penetration_depth[i, t] = 0.0, 0.0, 0.0
            felt.tactile_shear_force[i, t, 0], felt.tactile_shear_force[i, t, 1] = 0.0, 0.0


@compiled
def feel_and_read(skin, reading, pads, contacts, poses, felt, seen, period):
    """`field.feel`, where a sample is taken, and `read_taxels`, and a copy for what a controller sees.

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
    if period[0] % reading.timing[0] == 0 or reading.begun[0] == 0 or reading.hysteresis[0] > 0.0:
        feel(skin, pads, contacts, poses, felt)
    read_taxels(reading, felt, period)
    _copy(felt, seen)
