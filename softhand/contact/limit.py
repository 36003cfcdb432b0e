"""The limit surface of friction: how much force and torsion a contact holds together."""

from __future__ import annotations

import math

import numpy as np

from softhand.contact.records import COLUMNS, ELLIPSE
from softhand.numerics.branches import seldom, usually
from softhand.numerics.compiled import compiled

_SHORTEST = 1e-9  # [m] lever of a tip pressed flat, which has no disc left to hold a spin with
_SHALLOW = 0.005  # dr / r below which the closed form of `spin_length` would lose digits

_DEEPEST = 0.5  # dr / r, and
_KAPPA, _LEAST, _MOST = 0.6, 0.5, 2.0 / 3.0  # tau_max / (mu f_z a): where the fit below is centred, and its range
_CURVES = np.array(
    [
        [[0.4013, -0.2346, -0.1621], [0.1555, 0.186, -0.3751], [-0.3408, -0.5027, 1.5667], [0.8888, 0.4611, -2.9059],
         [-0.3974, -0.0552, 1.6335]],
        [[0.4491, 1.0007, -3.7226], [0.1277, -0.9298, 4.1974], [-0.2689, 2.48, -0.3972], [0.8579, -2.4913, -6.0967],
         [-0.4243, 0.56, 4.2473]],
    ]
)  # fmt: skip
"""Coefficients b_ij of the fit of `set_limit`, for the pressure of columns and for one with a kappa of its own."""


@compiled
def spin_length(pad, distance):
    """tau_max / (mu f_z) [m]: how far out the pressure acts against a spin of the contact about its normal.

    With c = R / r, s = a / r and the pressure of columns that are compressed one by one, the paper's Fig. 4,

        tau_max = pi mu k_r r^3 c {arccos c + c s - 2 c artanh s} = kappa mu f_z a,   f_z = pi k_r dr^2

    kappa goes to 8/15 as dr goes to 0. Elastic half-spaces touch over a^2 = r dr, where kappa is a constant of the law;
    and a length can be given outright.

    Args:
        pad: one row of `records.PAD`.
        distance: R [m].
    """
    if pad.torsion_length > 0.0:
        return pad.torsion_length
    r = pad.radius
    e = 1.0 - distance / r
    if not usually((e > 0.0) & (e < 1.0)):
        return 0.0
    c = 1.0 - e
    if pad.torsion_share > 0.0:
        return pad.torsion_share * math.sqrt(e) * r
    s = math.sqrt(e * (1.0 + c))
    if seldom(e < _SHALLOW):
        kappa = 8.0 / 15.0 - e * (8.0 / 35.0 + e * (0.1206349206 + e * (0.0669552673 + e * 0.0388)))
        return kappa * s * r
    return r * c * (math.acos(c) + c * s - 2.0 * c * math.atanh(s)) / (e * e)


@compiled
def set_limit(pad, contact):
    """The size and the shape of the limit surface of a contact: `lever` and `curve`.

    A contact that slips as a whole turns about a point of its plane, at a distance d from its middle, and each part of
    it drags against its own way (Goyal, Ruina, Papadopoulos 1991; Howe, Cutkosky 1996): with the pressure p(rho)

        f_t = mu int p (d - rho cos a) / s dA,   tau = mu int p rho (rho - d cos a) / s dA,
        s = |(d - rho cos a, rho sin a)|

    d runs along the curve, from pure spin at d = 0 to pure sliding. With F = f_t / (mu f_z), T = tau / tau_max and the
    share u = F^2 / (F^2 + T^2) this is, within 3e-4 of the radius and 0.2 deg of the normal,

        (F^2 + T^2) Q(u) = 1,   Q = 1 + u (1 - u) (c_0 + c_1 u + ... + c_4 u^4),   c_i = b_i0 + b_i1 x + b_i2 x^2

    for columns, which are compressed one by one, with x = dr / r up to 0.5, and for p = (1 - (rho / a)^k)^(1/k) from
    k = 1.5 over Hertz (2) to an even pressure, with x = kappa - 0.6. Q = 1 is the ellipse.

    Args:
        pad: one row of `records.PAD`.
        contact: one row of `records.CONTACT`, after `find_nearest`.
    """
    contact.lever = max(spin_length(pad, contact.distance), _SHORTEST)
    if pad.limit == ELLIPSE:
        return
    if pad.limit == COLUMNS:
        depth = 1.0 - contact.distance / pad.radius if usually(pad.radius > 0.0) else 0.0
        x, b = min(max(depth, 0.0), _DEEPEST), _CURVES[0]
    else:
        x, b = min(max(pad.kappa, _LEAST), _MOST) - _KAPPA, _CURVES[1]
    for i in range(5):
        contact.curve[i] = b[i, 0] + x * (b[i, 1] + x * b[i, 2])


@compiled
def limit_of(curve, s):
    """The limit surface as a function of the force s = (f_x, f_y, tau / l), l the lever of the spin.

        H(s) = |s|^2 Q(u),   u = (f_x^2 + f_y^2) / |s|^2,   sqrt(H) = mu f_z on the limit

    Args:
        curve: c_i of `set_limit`, shape (5,).
        s: three numbers, not all zero.

    Returns:
        H; its outward normal e, half the gradient, (alpha f_x, alpha f_y, beta tau / l) with alpha = Q + (1 - u) Q' and
        beta = Q - u Q', so that e = s for the ellipse; the derivative of e by s.
    """
    c0, c1, c2, c3, c4 = curve[0], curve[1], curve[2], curve[3], curve[4]
    x, y, w = s[0], s[1], s[2]
    square = x * x + y * y + w * w
    u = (x * x + y * y) / square
    P = c0 + u * (c1 + u * (c2 + u * (c3 + u * c4)))
    P_rate = c1 + u * (2.0 * c2 + u * (3.0 * c3 + u * 4.0 * c4))
    P_bend = 2.0 * c2 + u * (6.0 * c3 + u * 12.0 * c4)
    Q = 1.0 + u * (1.0 - u) * P
    Q_rate = (1.0 - 2.0 * u) * P + u * (1.0 - u) * P_rate
    Q_bend = 2.0 * (1.0 - 2.0 * u) * P_rate - 2.0 * P + u * (1.0 - u) * P_bend
    alpha, beta = Q + (1.0 - u) * Q_rate, Q - u * Q_rate
    bend = 2.0 * Q_bend / square  # alpha' = (1 - u) Q'', beta' = -u Q'', du/ds = 2 ((1 - u) x, (1 - u) y, -u w) / |s|^2
    flat, steep, mixed = (1.0 - u) * (1.0 - u) * bend, u * u * bend, -u * (1.0 - u) * bend
    by_s = (
        alpha + flat * x * x, flat * x * y, mixed * x * w,
        flat * x * y, alpha + flat * y * y, mixed * y * w,
        mixed * x * w, mixed * y * w, beta + steep * w * w,
    )  # fmt: skip
    return square * Q, (alpha * x, alpha * y, beta * w), by_s


@compiled
def limit_use(contact, s, room):
    """sqrt(H(s)) / (mu f_z): 1 on the limit surface, 0 without load, infinite where only the load is.

    Args:
        contact: one row of `records.CONTACT`, after `set_limit`.
        s: (f_x, f_y, tau / lever) [N].
        room: mu f_z [N].
    """
    c, square = contact.curve, s[0] * s[0] + s[1] * s[1] + s[2] * s[2]
    if seldom(square == 0.0):
        return 0.0
    u = (s[0] * s[0] + s[1] * s[1]) / square
    Q = 1.0 + u * (1.0 - u) * (c[0] + u * (c[1] + u * (c[2] + u * (c[3] + u * c[4]))))
    return math.inf if seldom(room <= 0.0) else math.sqrt(square * Q) / room
