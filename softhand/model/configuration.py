"""Moving a configuration along a velocity: the joints that a URDF can have, compiled.

Pinocchio's conventions: a free-flyer is (x, y, z, quaternion x, y, z, w) with its velocity (linear, angular) in the
moving frame; a continuous joint is (cos, sin).
"""

from __future__ import annotations

import math

from softhand.numerics.branches import seldom
from softhand.numerics.compiled import compiled

ADDITIVE, CONTINUOUS, FREE_FLYER = 0, 1, 2


@compiled
def integrate(joints, q, v, time, out):
    """out = q moved for `time` [s] with the constant velocity v (the exponential map of each joint).

    Args:
        joints: kind, index in q, index in v of each joint, shape (joints, 3).
        q: configuration, shape (nq,).
        v: velocity, shape (nv,).
        time: [s].
        out: the new configuration, shape (nq,); may be q itself.
    """
    for k in range(joints.shape[0]):
        kind, i, j = joints[k, 0], joints[k, 1], joints[k, 2]
        if kind == ADDITIVE:
            out[i] = q[i] + time * v[j]
        elif kind == CONTINUOUS:
            c, s = math.cos(time * v[j]), math.sin(time * v[j])
            out[i], out[i + 1] = q[i] * c - q[i + 1] * s, q[i] * s + q[i + 1] * c
        else:
            _integrate_free_flyer(q[i : i + 7], v[j : j + 6], time, out[i : i + 7])


@compiled
def _integrate_free_flyer(pose, twist, time, out):
    """Exponential map of SE(3): p + R V(w) v, quaternion times exp(w / 2)."""
    x, y, z, w = pose[3], pose[4], pose[5], pose[6]
    vx, vy, vz = time * twist[0], time * twist[1], time * twist[2]
    wx, wy, wz = time * twist[3], time * twist[4], time * twist[5]
    square = wx * wx + wy * wy + wz * wz
    if seldom(square > 0.01):
        angle = math.sqrt(square)
        half = math.sin(0.5 * angle) / angle
        cosine = math.cos(0.5 * angle)
        first = (1.0 - math.cos(angle)) / square
        second = (angle - math.sin(angle)) / (square * angle)
    else:
        half = 0.5 - square * (1 / 48 - square * (1 / 3840 - square * (1 / 645120 - square / 185794560)))
        cosine = 1.0 - square * (1 / 8 - square * (1 / 384 - square * (1 / 46080 - square / 10321920)))
        first = 0.5 - square * (1 / 24 - square * (1 / 720 - square * (1 / 40320 - square / 3628800)))
        second = 1 / 6 - square * (1 / 120 - square * (1 / 5040 - square * (1 / 362880 - square / 39916800)))
    # V(w) v = v + first w x v + second w x (w x v)
    cx, cy, cz = wy * vz - wz * vy, wz * vx - wx * vz, wx * vy - wy * vx
    ux = vx + first * cx + second * (wy * cz - wz * cy)
    uy = vy + first * cy + second * (wz * cx - wx * cz)
    uz = vz + first * cz + second * (wx * cy - wy * cx)
    # rotate by the quaternion: u + 2 w (r x u) + 2 r x (r x u)
    tx, ty, tz = 2.0 * (y * uz - z * uy), 2.0 * (z * ux - x * uz), 2.0 * (x * uy - y * ux)
    out[0] = pose[0] + ux + w * tx + y * tz - z * ty
    out[1] = pose[1] + uy + w * ty + z * tx - x * tz
    out[2] = pose[2] + uz + w * tz + x * ty - y * tx
    hx, hy, hz = half * wx, half * wy, half * wz
    nx = w * hx + x * cosine + y * hz - z * hy
    ny = w * hy + y * cosine + z * hx - x * hz
    nz = w * hz + z * cosine + x * hy - y * hx
    nw = w * cosine - x * hx - y * hy - z * hz
    scale = 1.0 / math.sqrt(nx * nx + ny * ny + nz * nz + nw * nw)
    out[3], out[4], out[5], out[6] = scale * nx, scale * ny, scale * nz, scale * nw


@compiled
def coordinate_rate(joints, q, v, out):
    """out = dq/dt of the stored coordinates (quaternion and all), for steppers that treat q as a plain vector.

    Args:
        joints: as in `integrate`.
        q: configuration, shape (nq,).
        v: velocity, shape (nv,).
        out: rate of q, shape (nq,).
    """
    for k in range(joints.shape[0]):
        kind, i, j = joints[k, 0], joints[k, 1], joints[k, 2]
        if kind == ADDITIVE:
            out[i] = v[j]
        elif kind == CONTINUOUS:
            out[i], out[i + 1] = -q[i + 1] * v[j], q[i] * v[j]
        else:
            x, y, z, w = q[i + 3], q[i + 4], q[i + 5], q[i + 6]
            ux, uy, uz, wx, wy, wz = v[j], v[j + 1], v[j + 2], v[j + 3], v[j + 4], v[j + 5]
            tx, ty, tz = 2.0 * (y * uz - z * uy), 2.0 * (z * ux - x * uz), 2.0 * (x * uy - y * ux)
            out[i] = ux + w * tx + y * tz - z * ty
            out[i + 1] = uy + w * ty + z * tx - x * tz
            out[i + 2] = uz + w * tz + x * ty - y * tx
            out[i + 3] = 0.5 * (w * wx + y * wz - z * wy)
            out[i + 4] = 0.5 * (w * wy + z * wx - x * wz)
            out[i + 5] = 0.5 * (w * wz + x * wy - y * wx)
            out[i + 6] = -0.5 * (x * wx + y * wy + z * wz)


@compiled
def normalize(joints, q):
    """Bring the quaternions and (cos, sin) pairs of q back to length one, in place."""
    for k in range(joints.shape[0]):
        kind, i = joints[k, 0], joints[k, 1]
        if kind == CONTINUOUS:
            start, stop = i, i + 2
        elif kind == FREE_FLYER:
            start, stop = i + 3, i + 7
        else:
            continue
        square = 0.0
        for n in range(start, stop):
            square += q[n] * q[n]
        for n in range(start, stop):
            q[n] /= math.sqrt(square)
