"""Rotations in kernels: matrices, rotation vectors, roll-pitch-yaw and the rates between them."""

from __future__ import annotations

import math

import numpy as np

from softhand.numerics.arrays import Array
from softhand.numerics.branches import usually
from softhand.numerics.compiled import compiled

_SMALL = 1e-8  # [rad^2] below which series are exact to rounding


@compiled
def set_rotation(rpy, R):
    """R = R_z(yaw) R_y(pitch) R_x(roll).

    Args:
        rpy: roll, pitch, yaw [rad], shape (3,).
        R: set, shape (3, 3).
    """
    a, b, c = math.cos(rpy[0]), math.cos(rpy[1]), math.cos(rpy[2])
    i, j, k = math.sin(rpy[0]), math.sin(rpy[1]), math.sin(rpy[2])
    R[0, 0], R[0, 1], R[0, 2] = c * b, c * j * i - k * a, c * j * a + k * i
    R[1, 0], R[1, 1], R[1, 2] = k * b, k * j * i + c * a, k * j * a - c * i
    R[2, 0], R[2, 1], R[2, 2] = -j, b * i, b * a


@compiled
def set_rpy(R, rpy):
    """Roll and yaw in (-pi, pi], pitch in [-pi/2, pi/2] of a rotation, shape (3,).

    Pitch and roll are those that remain after the yaw. Near pitch 90 deg, where the yaw is rounding, the three together
    are the rotation all the same.
    """
    rpy[2] = math.atan2(R[1, 0], R[0, 0])
    c, k = math.cos(rpy[2]), math.sin(rpy[2])
    rpy[1] = math.atan2(-R[2, 0], c * R[0, 0] + k * R[1, 0])
    rpy[0] = math.atan2(k * R[0, 2] - c * R[1, 2], c * R[1, 1] - k * R[0, 1])


@compiled
def log_of_turn(start, end, w):
    """w = log(start^T end): the rotation vector of the turn from one rotation to another, in axes of either.

    By the quaternion, so that it is exact to rounding at any angle up to half a turn, where the sign is free.

    Args:
        start: shape (3, 3).
        end: shape (3, 3).
        w: set [rad], shape (3,); at most pi long.
    """
    t00, t11, t22 = _entry(start, end, 0, 0), _entry(start, end, 1, 1), _entry(start, end, 2, 2)
    x = _entry(start, end, 2, 1) - _entry(start, end, 1, 2)
    y = _entry(start, end, 0, 2) - _entry(start, end, 2, 0)
    z = _entry(start, end, 1, 0) - _entry(start, end, 0, 1)
    trace = t00 + t11 + t22
    if usually(trace > 0.0):  # four times the squares of the quaternion's parts are 1 + trace, 1 + 2 t00 - trace, ...
        q, scale = 1.0 + trace, 1.0
    elif t00 >= t11 and t00 >= t22:
        q, x, scale = x, 1.0 + t00 - t11 - t22, math.copysign(1.0, x)
        y, z = _entry(start, end, 0, 1) + _entry(start, end, 1, 0), _entry(start, end, 0, 2) + _entry(start, end, 2, 0)
    elif t11 >= t22:
        q, y, scale = y, 1.0 + t11 - t00 - t22, math.copysign(1.0, y)
        x, z = _entry(start, end, 0, 1) + _entry(start, end, 1, 0), _entry(start, end, 1, 2) + _entry(start, end, 2, 1)
    else:
        q, z, scale = z, 1.0 + t22 - t00 - t11, math.copysign(1.0, z)
        x, y = _entry(start, end, 0, 2) + _entry(start, end, 2, 0), _entry(start, end, 1, 2) + _entry(start, end, 2, 1)
    length = math.sqrt(x * x + y * y + z * z)
    if usually(length > 0.0):
        scale *= 2.0 * math.atan2(length, abs(q)) / length
    w[0], w[1], w[2] = scale * x, scale * y, scale * z


@compiled
def _entry(start, end, row, column):
    """Of start^T end."""
    return start[0, row] * end[0, column] + start[1, row] * end[1, column] + start[2, row] * end[2, column]


@compiled
def turn_rotation(a, b, c, R, out):
    """out = exp([w]x) R: turned by a rotation vector w = (a, b, c) in world axes [rad]; `out` is not R itself.

    Args:
        a: first part of w.
        b: second.
        c: third.
        R: shape (3, 3).
        out: set, shape (3, 3).
    """
    first, second = _turning(a * a + b * b + c * c)
    for k in range(3):  # r + first w x r + second w x (w x r), column by column
        x, y, z = R[0, k], R[1, k], R[2, k]
        cx, cy, cz = b * z - c * y, c * x - a * z, a * y - b * x
        out[0, k] = x + first * cx + second * (b * cz - c * cy)
        out[1, k] = y + first * cy + second * (c * cx - a * cz)
        out[2, k] = z + first * cz + second * (a * cy - b * cx)


@compiled
def turn_vector(a, b, c, u):
    """u <- exp([w]x) u: a vector of shape (3,), turned in place; args as `turn_rotation`."""
    first, second = _turning(a * a + b * b + c * c)
    x, y, z = b * u[2] - c * u[1], c * u[0] - a * u[2], a * u[1] - b * u[0]
    u[0] += first * x + second * (b * z - c * y)
    u[1] += first * y + second * (c * x - a * z)
    u[2] += first * z + second * (a * y - b * x)


@compiled
def _turning(square):
    """sin(t) / t and (1 - cos(t)) / t^2 of the square of an angle t [Rodrigues]."""
    angle = math.sqrt(square)
    first = math.sin(angle) / angle if square > _SMALL else 1.0 - square / 6.0
    second = (1.0 - math.cos(angle)) / square if square > _SMALL else 0.5 - square / 24.0
    return first, second


@compiled
def rates_to_turning(rpy, rate, bend, velocity, acceleration):
    """Angular velocity and acceleration, world axes, from rpy' and rpy'': w = T rpy', w' = T rpy'' + T' rpy'.

    Args:
        rpy: [rad], shape (3,).
        rate: rpy' [rad/s], shape (3,).
        bend: rpy'' [rad/s^2], shape (3,).
        velocity: set [rad/s], shape (3,).
        acceleration: set [rad/s^2], shape (3,).
    """
    b, j, c, k = math.cos(rpy[1]), math.sin(rpy[1]), math.cos(rpy[2]), math.sin(rpy[2])
    velocity[0] = c * b * rate[0] - k * rate[1]
    velocity[1] = k * b * rate[0] + c * rate[1]
    velocity[2] = -j * rate[0] + rate[2]
    x = -k * b * rate[2] - c * j * rate[1]  # rate of the first column of T
    y = c * b * rate[2] - k * j * rate[1]
    acceleration[0] = c * b * bend[0] - k * bend[1] + x * rate[0] - c * rate[2] * rate[1]
    acceleration[1] = k * b * bend[0] + c * bend[1] + y * rate[0] - k * rate[2] * rate[1]
    acceleration[2] = -j * bend[0] + bend[2] - b * rate[1] * rate[0]


@compiled
def turning_to_rates(rpy, velocity, acceleration, rate, bend):
    """The reverse of `rates_to_turning`; zero where it is singular, at pitch 90 deg."""
    b, j, c, k = math.cos(rpy[1]), math.sin(rpy[1]), math.cos(rpy[2]), math.sin(rpy[2])
    if abs(b) < _SMALL:
        for i in range(3):
            rate[i], bend[i] = 0.0, 0.0
        return
    rate[0] = (c * velocity[0] + k * velocity[1]) / b
    rate[1] = c * velocity[1] - k * velocity[0]
    rate[2] = velocity[2] + j * rate[0]
    x = acceleration[0] + (k * b * rate[2] + c * j * rate[1]) * rate[0] + c * rate[2] * rate[1]
    y = acceleration[1] - (c * b * rate[2] - k * j * rate[1]) * rate[0] + k * rate[2] * rate[1]
    z = acceleration[2] + b * rate[1] * rate[0]
    bend[0] = (c * x + k * y) / b
    bend[1] = c * y - k * x
    bend[2] = z + j * bend[0]


def rotation_vector(start: Array, end: Array) -> Array:
    """The turn from one rotation to another as a rotation vector in world axes, log(end start^T) [rad], shape (3,).

    Args:
        start: shape (3, 3).
        end: shape (3, 3).
    """
    w = np.empty(3)
    log_of_turn(np.ascontiguousarray(start, dtype=float), np.ascontiguousarray(end, dtype=float), w)
    turn: Array = end @ w
    return turn


def turns_between(starts: Array, ends: Array) -> Array:
    """Rotation vectors from orientations to others, sample by sample, in axes of either [rad], shape (samples, 3).

    Args:
        starts: roll, pitch, yaw [rad], shape (samples, 3), or (1, 3) for all.
        ends: likewise, shape (samples, 3).
    """
    starts = np.broadcast_to(starts, ends.shape)
    turns = np.empty(ends.shape)
    _set_turns(np.ascontiguousarray(starts, dtype=float), np.ascontiguousarray(ends, dtype=float), turns)
    return turns


@compiled
def _set_turns(starts, ends, turns):
    start, end = np.empty((3, 3)), np.empty((3, 3))
    for k in range(turns.shape[0]):
        set_rotation(starts[k], start)
        set_rotation(ends[k], end)
        log_of_turn(start, end, turns[k])
