"""Kernels: from the state of a contact to what each taxel of its tip feels."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.contact.axes import finger_axes
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.rotations import turn_rotation
from softhand.tactile.overlap import weigh
from softhand.tactile.solid import Solid

TOUCH, BELOW, WEIGHT = range(3)
"""Rows of `Skin.work`."""


class Felt(NamedTuple):
    """What taxels tell, by the names that an observation has for it."""

    tactile_normal_force: Array
    """[N] along z_C, positive where it presses, shape (nc, taxels)."""
    tactile_shear_force: Array
    """[N] on the object along x_C and y_C, shape (nc, taxels, 2)."""
    tactile_slip: Array
    """Speed over the object [m/s], shape (nc, taxels)."""
    penetration_depth: Array
    """[m], shape (nc, taxels)."""


class Skin(NamedTuple):
    """The taxels of all tips, for kernels."""

    places: Array
    """Unit vectors in F, shape (3, taxels)."""
    reach: Array
    """h, how far the force of a place spreads over the skin [m], shape (nc,)."""
    exponent: Array
    """m of `growth.pressure_exponent`, shape (nc,)."""
    narrow: Array
    """eta: 1 where the contact has a^2 = r dr, as on a half-space, 0 where the surface cuts the sphere, shape (nc,)."""
    axes: Array
    """Scratch, shape (3, 3)."""
    turned: Array
    """Scratch, shape (3, 3)."""
    moved: Array
    """Scratch: taxels in the contact frame, over r, shape (3, taxels)."""
    work: Array
    """Scratch: how much a taxel touches, depth below the surface, weight, shape (3, taxels)."""
    taking: NDArray[np.int64]
    """Scratch: numbers of the taxels that have a part in the contact, first, shape (taxels,)."""
    solid: Solid
    """The object."""


@compiled
def feel(skin, pads, contacts, poses, felt):
    """The fields of all tips, see `feel_tip`.

    Args:
        skin: `Skin`.
        pads: table `records.PAD`, fingertips first.
        contacts: table `records.CONTACT`, evaluated.
        poses: of the joints, as `Snapshot.poses`.
        felt: `Felt`, set.
    """
    for i in range(felt.tactile_slip.shape[0]):
        pad = pads[i]
        feel_tip(skin, i, pad, contacts[i], poses[pad.joint], poses[pad.base], felt)


@compiled
def feel_tip(skin, i, pad, contact, pose, base_pose, felt):
    """Share out the force and the torsion of one contact over its taxels.

    With the shares n of `overlap.weigh`, x the place of a taxel in the plane of the contact, x_m = sum n x, and E the
    turn by 90 deg about z_C:

        f_n = n f_z,   f_t = n {(f_x, f_y) + w E (x - x_m)},   w = {tau - (x_m cross f_t)_z} / sum n |x - x_m|^2

    Their sums are the contact force and, about the contact point, its torsion, to rounding, whatever the shares are. Of
    all fields of shear with these sums it is the one with the least sum of f_t^2 / n. No pressure is negative as
    long as the contact presses. The speed of a taxel over the object is that of a rigid turn about z_C, of the slip
    that the contact had in the last step, and fades out where the taxel touches no more.

    Args:
        skin: `Skin`.
        i: which tip.
        pad: its row of `records.PAD`.
        contact: its row of `records.CONTACT`.
        pose: of the joint that carries it, shape (12,).
        base_pose: of the object, shape (12,).
        felt: `Felt`, row i is set.
    """
    normal, shear = felt.tactile_normal_force[i], felt.tactile_shear_force[i]
    slip, depth, f = felt.tactile_slip[i], felt.penetration_depth[i], contact.force
    normal[:], shear[:, :], slip[:], depth[:] = 0.0, 0.0, 0.0, 0.0
    if contact.deformation[0] <= 0.0 and f[0] == 0.0 and f[1] == 0.0 and f[2] == 0.0 and f[3] == 0.0:
        return
    _move(skin, pad, contact, pose)
    total, taking = weigh(skin, i, pad, contact, base_pose)
    v, w, r, weight = skin.moved[0], skin.moved[1], pad.radius, skin.work[WEIGHT]
    # middle and spread of the shares, over r
    mx, my, spread = 0.0, 0.0, 0.0
    for k in range(taking):
        t = skin.taking[k]
        weight[t] /= total
        mx, my = mx + weight[t] * v[t], my + weight[t] * w[t]
    for k in range(taking):
        t = skin.taking[k]
        x, y = v[t] - mx, w[t] - my
        spread += weight[t] * (x * x + y * y)
    turn = (f[3] / r - mx * f[1] + my * f[0]) / spread if spread > 1e-9 else 0.0
    # velocity of slip of the contact in C_F
    vx = contact.slip_speed[0] / contact.theta_per_x
    vy, spin = contact.slip_speed[1] / contact.phi_per_y, r * (contact.slip_speed[2] - contact.psi_per_x * vx)
    for k in range(taking):
        t = skin.taking[k]
        n = weight[t]
        normal[t] = n * f[2]
        shear[t, 0], shear[t, 1] = n * (f[0] - turn * (w[t] - my)), n * (f[1] + turn * (v[t] - mx))
        depth[t] = max(skin.work[BELOW, t], 0.0)
        if vx != 0.0 or vy != 0.0 or spin != 0.0:
            slip[t] = skin.work[TOUCH, t] * math.hypot(vx - spin * w[t], vy + spin * v[t])


@compiled
def _move(skin, pad, contact, pose):
    """`moved`: where the material of each taxel is now, in the contact frame, over r.

    The place (theta, phi) of the undeformed tip is now at (Theta, Phi), turned by -dpsi, [Nakashima] Eq. (15), so that
    v = R_Z(-dpsi) R(theta, phi)^T u. In surface coordinates the tip is turned in the contact frame by the vector
    (s2 / R, -s1 / R, -psi), which brings there what belongs into the middle. So taxels that stick stay in their places
    on the object while they are sheared.
    """
    R, d, a = contact.rotation, contact.deformation, skin.axes
    if pad.is_surface:
        for k in range(3):
            a[k, 0], a[k, 1], a[k, 2] = 0.0, 0.0, 0.0
        for row in range(3):
            fx, fy, fz = finger_axes(pad, pose, row)
            for k in range(3):
                a[k, 0], a[k, 1], a[k, 2] = a[k, 0] + R[row, k] * fx, a[k, 1] + R[row, k] * fy, a[k, 2] + R[row, k] * fz
        turn_rotation(d[2] / contact.distance, -d[1] / contact.distance, -d[3], a, skin.turned)
        a = skin.turned
    else:
        theta, phi = contact.angles[0] + d[1], contact.angles[1] + d[2]
        c, s, C, S = math.cos(theta), math.sin(theta), math.cos(phi), math.sin(phi)
        p, q = math.cos(d[3]), math.sin(d[3])
        a[0, 0], a[0, 1], a[0, 2] = q * C, -p * s - q * c * S, p * c - q * s * S
        a[1, 0], a[1, 1], a[1, 2] = p * C, q * s - p * c * S, -q * c - p * s * S
        a[2, 0], a[2, 1], a[2, 2] = S, c * C, s * C
    u, v, w = skin.places[0], skin.places[1], skin.places[2]
    for k in range(3):
        moved, x, y, z = skin.moved[k], a[k, 0], a[k, 1], a[k, 2]
        for t in range(u.shape[0]):
            moved[t] = x * u[t] + y * v[t] + z * w[t]
