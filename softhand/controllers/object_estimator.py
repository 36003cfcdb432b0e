"""Pose of the object and torsion of the tips from joint angles and contact forces alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softhand.laws.law import Law
from softhand.model.configuration import rotation_of, turning_of
from softhand.observation import Observation, carried, contact_pairs

Array = NDArray[np.float64]

_STEP = 1e-6  # of the radius, or rad: of the slope of a law
_MOVING = 1e-3  # share of the largest singular value: motion that moves the contacts less is not seen
_CERTAIN = 0.3  # the same of distances: two tips that face each other would turn their disagreement into a large turn
_NEWTON = 3  # steps with one slope; the deformation moves little between two samples


@dataclass(frozen=True)
class Estimate:
    """The grasp as the joints and the contact forces tell it, at one sample.

    Attributes:
        q_O: position [m], roll, pitch, yaw [rad] of the object, shape (6,).
        q_F: joint angles [rad], shape (n,).
        deformation: dr [m], dtheta, dphi, dpsi [rad], shape (nc, 4).
        tau_C: torsion moments on the object [N m], shape (nc,).
        point: contact points [m], shape (nc, 3).
        axes: of the contact frames C_F in the world, shape (nc, 3, 3).
        angles: Theta, Phi [rad], shape (nc, 2).
        distance: R [m], shape (nc,).
        J_CF_f: as in `Observation`, shape (3 nc, n).
        J_CF_tau: as in `Observation`, shape (nc, n).
        J_O_f: as in `Observation`, shape (3 nc, 6).
        J_O_tau: as in `Observation`, shape (nc, 6).
    """

    q_O: Array
    q_F: Array
    deformation: Array
    tau_C: Array
    point: Array
    axes: Array
    angles: Array
    distance: Array
    J_CF_f: Array
    J_CF_tau: Array
    J_O_f: Array
    J_O_tau: Array

    def kernel(self) -> Array:
        """K of (58), shape (3 nc, np)."""
        pairs = contact_pairs(len(self.point))
        K = np.zeros((len(self.point), 3, len(pairs)))
        for k, (i, j) in enumerate(pairs):
            direction = (self.point[j] - self.point[i]) / np.linalg.norm(self.point[j] - self.point[i])
            K[i, :, k], K[j, :, k] = self.axes[i].T @ direction, -self.axes[j].T @ direction
        return K.reshape(-1, len(pairs))

    def deformation_rows(self) -> Array:
        """The rows of J_delta for v_x, v_y, v_z in the rates of dr, dtheta, dphi, (37), shape (3 nc, 3 nc)."""
        count = len(self.point)
        rows = np.zeros((3 * count, 3 * count))
        for i, (R, Phi) in enumerate(zip(self.distance, self.angles[:, 1], strict=True)):
            rows[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = [[0.0, R * np.cos(Phi), 0.0], [0.0, 0.0, R], [1.0, 0.0, 0.0]]
        return rows


class _Tip:
    """The law of a tip, known to the controller."""

    def __init__(self, law: Law) -> None:
        self.radius, self._force, self._parameters = law.radius, law.force, law.parameters().tolist()

    def force(self, deformation: Array, Phi: float) -> tuple[float, ...]:
        """Fr, Ftheta, Fphi, Fpsi; what `Law.__call__` gives, but the parameters are looked up once."""
        dr, dtheta, dphi, dpsi = deformation.tolist()
        return self._force(dr, dtheta, dphi, dpsi, Phi + dphi, *self._parameters)

    def answer(self, f: Array, Phi: float, deformation: Array) -> None:
        """Set dr, dtheta, dphi so that the contact force is f: (48) solved at a given dpsi.

            Fr = f_z,   Ftheta = f_x R cosPhi + sinPhi Fpsi,   Fphi = f_y R

        Args:
            f: f_x, f_y, f_z [N], shape (3,).
            Phi: of the deformed tip [rad].
            deformation: a close guess, with the dpsi to take; set, shape (4,).
        """
        sin_Phi, cos_Phi = math.sin(Phi), math.cos(Phi)

        def excess() -> Array:
            Fr, Ftheta, Fphi, Fpsi = self.force(deformation, Phi)
            R = self.radius - deformation[0]
            return np.array([Fr - f[2], Ftheta - sin_Phi * Fpsi - f[0] * R * cos_Phi, Fphi - f[1] * R])

        first = excess()
        slope = np.empty((3, 3))
        for k in range(3):
            kept, step = deformation[k], _STEP * (self.radius if k == 0 else 1.0)
            deformation[k] = kept + step
            slope[:, k] = (excess() - first) / step
            deformation[k] = kept
        inverse = np.linalg.pinv(slope, rcond=1e-12)  # of a tip that has let go, the best that there is
        for _ in range(_NEWTON):
            deformation[:3] -= inverse @ excess()


class _Hand:
    """Tips and their Jacobians: what q_F alone tells."""

    def __init__(self, seen: Observation) -> None:
        self.q_F = seen.joint_position.copy()
        self.tips, self.axes = seen.tip_position.copy(), seen.tip_rotation
        self.velocity, self.spin = seen.tip_jacobian, seen.tip_angular_jacobian


class ObjectEstimator:
    """Integrates the motion of the object that rolls between tips, and keeps it at the right distance from them.

    The force rows of (43) give the motion between two samples,

        J_O^f dq_O = J_CF^f dq_F - J_delta^f d(dr, dtheta, dphi),

    least squares, with Jacobians of the middle. The deformation is the one that the law answers with f_C: (48) solved
    with dpsi, which the fourth row of (43) gives. Then dr = dr(f_z) has to agree with n . (x_i - p_O) - d = r - dr at
    each tip: the shortest change of q_O that makes it so takes the drift of these distances away. What tips that face
    each other disagree on, as they do where the law is known badly, is left alone. Motion along the faces is integrated
    only.

    Args:
        seen: the grasp at the start: its pose, the laws of the tips, faces and weight.
    """

    def __init__(self, seen: Observation) -> None:
        self._tips = [_Tip(tip.law) for tip in seen.fingertips]
        self._normals = np.array([tip.face.normal for tip in seen.fingertips])
        self._offsets = np.array([tip.face.offset for tip in seen.fingertips])
        self._radii = np.array([tip.radius for tip in self._tips])
        self._weight = -seen.object_mass * seen.gravity
        self._lever = seen.object_lever.copy()
        # a turn counts as the way that it moves the contacts
        reach = np.linalg.norm(seen.contact_point - seen.object_position, axis=1).mean()
        self._size = np.repeat([1.0, 1.0 / reach], 3)

    def start(self, seen: Observation) -> Estimate:
        """The estimate at the start, where the pose of the object and the deformation are known."""
        return self._at(_Hand(seen), seen.q_O.copy(), seen.deformation.copy())

    def weight(self, q_O: Array) -> Array:
        """N_O, the gravity terms of the object in the coordinates q_O, shape (6,)."""
        moment = np.cross(rotation_of(q_O[3:]) @ self._lever, self._weight)
        return np.concatenate([self._weight, turning_of(q_O[3:]).T @ moment])

    def update(self, seen: Observation, before: Estimate) -> Estimate:
        """The estimate at a sample from that of the one before.

        Args:
            seen: of which q_F, what depends on it alone, and f_C are read.
            before: the estimate of the sample before.
        """
        now, hand = before, _Hand(seen)
        dq_F = hand.q_F - before.q_F
        for _ in range(2):  # the middle is known only after a first go
            deformation = self._deformation(seen.f_C, now)
            dq_O = self._motion(dq_F, deformation - before.deformation, now, before)
            now = self._at(hand, before.q_O + dq_O, deformation)
            deformation[:, 3] = before.deformation[:, 3] + self._torsion(dq_F, dq_O, deformation, now, before)
        return self._at(hand, self._corrected(now), deformation)

    def _at(self, hand: _Hand, q_O: Array, deformation: Array) -> Estimate:
        """Contact frames and Jacobians where the object is thought to be, (13), (14), (16) for plane faces."""
        rotation, turning = rotation_of(q_O[3:]), turning_of(q_O[3:])
        tips, tip_axes, spin = hand.tips, hand.axes, hand.spin
        normal = -self._normals @ rotation.T
        distance = -np.einsum("ib,ib->i", normal, tips - q_O[:3]) - self._offsets
        arm = distance[:, None] * normal
        in_tip = np.einsum("iba,ib->ia", tip_axes, normal)
        Theta, Phi = np.arctan2(in_tip[:, 2], in_tip[:, 1]), np.arcsin(np.clip(in_tip[:, 0], -1.0, 1.0))
        x_C = -np.sin(Theta)[:, None] * tip_axes[:, :, 1] + np.cos(Theta)[:, None] * tip_axes[:, :, 2]
        axes = np.stack([x_C, np.cross(normal, x_C), normal], axis=2)
        velocity = carried(hand.velocity, spin, arm)
        lever = tips + arm - q_O[:3]
        unit = np.tile(np.hstack([np.eye(3), np.zeros((3, 3))]), (len(tips), 1, 1))
        moved = carried(unit, np.tile(np.hstack([np.zeros((3, 3)), turning]), (len(tips), 1, 1)), lever)
        count, n = len(tips), velocity.shape[2]
        forces = [tip.force(delta, phi) for tip, delta, phi in zip(self._tips, deformation, Phi.tolist(), strict=True)]
        return Estimate(
            q_O=q_O,
            q_F=hand.q_F,
            deformation=deformation,
            tau_C=np.array(forces)[:, 3],
            point=tips + arm,
            axes=axes,
            angles=np.column_stack([Theta, Phi]),
            distance=distance,
            J_CF_f=np.einsum("iba,ibk->iak", axes, velocity).reshape(3 * count, n),
            J_CF_tau=np.einsum("ib,ibk->ik", normal, spin),
            J_O_f=np.einsum("iba,ibk->iak", axes, moved).reshape(3 * count, 6),
            J_O_tau=np.hstack([np.zeros((count, 3)), normal @ turning]),
        )

    def _deformation(self, f_C: Array, now: Estimate) -> Array:
        """(dr, dtheta, dphi, dpsi) that the laws answer with f_C at the angles of `now`, shape (nc, 4)."""
        found = now.deformation.copy()
        for i, (tip, f) in enumerate(zip(self._tips, f_C.reshape(-1, 3), strict=True)):
            tip.answer(f, float(now.angles[i, 1]), found[i])
        return found

    def _motion(self, dq_F: Array, change: Array, now: Estimate, before: Estimate) -> Array:
        """dq_O from the force rows of (43), Jacobians of the middle, shape (6,)."""
        J_O, J_CF = 0.5 * (now.J_O_f + before.J_O_f), 0.5 * (now.J_CF_f + before.J_CF_f)
        J_delta = 0.5 * (now.deformation_rows() + before.deformation_rows())
        moved = J_CF @ dq_F - J_delta @ change[:, :3].ravel()
        scaled: Array = np.linalg.lstsq(J_O * self._size, moved, rcond=_MOVING)[0]
        return scaled * self._size

    def _torsion(self, dq_F: Array, dq_O: Array, deformation: Array, now: Estimate, before: Estimate) -> Array:
        """Change of dpsi from the moment rows of (43), shape (nc,)."""
        J_CF, J_O = 0.5 * (now.J_CF_tau + before.J_CF_tau), 0.5 * (now.J_O_tau + before.J_O_tau)
        sin_Phi = 0.5 * (np.sin(now.angles[:, 1]) + np.sin(before.angles[:, 1]))
        turned: Array = J_CF @ dq_F - J_O @ dq_O - sin_Phi * (deformation[:, 1] - before.deformation[:, 1])
        return turned

    def _corrected(self, now: Estimate) -> Array:
        """q_O changed as little as makes the distances of the tips those of the forces, r - dr(f_z), shape (6,)."""
        gap = now.distance - (self._radii - now.deformation[:, 0])
        along_normal = now.J_O_f[2::3] * self._size
        scaled: Array = np.linalg.lstsq(along_normal, gap, rcond=_CERTAIN)[0]
        return now.q_O - scaled * self._size
