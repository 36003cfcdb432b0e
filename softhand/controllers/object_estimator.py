"""Pose of the object and torsion of the tips from joint angles and contact forces alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from softhand.contact.pairs import contact_pairs
from softhand.errors import ScenarioError
from softhand.laws.law import Law
from softhand.numerics.arrays import Array
from softhand.numerics.rotations import set_rpy, turn_rotation
from softhand.numerics.spatial import carried, cross_matrix
from softhand.sensing.observation import Observation

_STEP = 1e-6  # of the radius, or rad: of the slope of a law
_MOVING = 1e-3  # share of the largest singular value: motion that moves the contacts less is not observation
_CERTAIN = 0.3  # the same of distances: two tips that face each other would turn their disagreement into a large turn
_NEWTON = 3  # steps with one slope; the deformation moves little between two samples


@dataclass(frozen=True)
class Estimate:
    """The grasp as the joints and the contact forces tell it, at one sample.

    Attributes:
        position: of the origin of the object frame [m], shape (3,).
        rotation: axes of the object frame as columns, shape (3, 3).
        q_F: joint angles [rad], shape (n,).
        deformation: dr [m], dtheta, dphi, dpsi [rad] or dr, s1, s2 [m], psi [rad], by the law, shape (nc, 4).
        tau_C: torsion moments on the object [N m], shape (nc,).
        point: contact points [m], shape (nc, 3).
        axes: of the contact frames C_F in the world, shape (nc, 3, 3).
        Phi: [rad], shape (nc,).
        lean: components of x_F along x_C and y_C, shape (nc, 2).
        distance: R [m], shape (nc,).
        levers: what J_delta has beside ones: R cosPhi, R, sinPhi by (37), or 1, 1, 0 in surface coordinates, (nc, 3).
        J_CF_f: as in `Observation`, shape (3 nc, n).
        J_CF_tau: as in `Observation`, shape (nc, n).
        force_rows: `object_force_jacobian` of an observation, shape (3 nc, 6).
        torsion_rows: `object_torsion_jacobian`, shape (nc, 6).
    """

    position: Array
    rotation: Array
    q_F: Array
    deformation: Array
    tau_C: Array
    point: Array
    axes: Array
    Phi: Array
    lean: Array
    distance: Array
    levers: Array
    J_CF_f: Array
    J_CF_tau: Array
    force_rows: Array
    torsion_rows: Array

    @property
    def q_O(self) -> Array:
        """Position [m], roll, pitch, yaw [rad] of the object, shape (6,)."""
        coordinates = np.concatenate([self.position, np.zeros(3)])
        set_rpy(self.rotation, coordinates[3:])
        return coordinates

    def moved(self, motion: Array) -> tuple[Array, Array]:
        """Position and rotation after a small displacement and rotation vector, world axes, shape (6,)."""
        rotation = np.empty((3, 3))
        turn_rotation(motion[3], motion[4], motion[5], self.rotation, rotation)
        return self.position + motion[:3], rotation

    def kernel(self) -> Array:
        """K of (58), shape (3 nc, np)."""
        pairs = contact_pairs(len(self.point))
        K = np.zeros((len(self.point), 3, len(pairs)))
        for k, (i, j) in enumerate(pairs):
            direction = (self.point[j] - self.point[i]) / np.linalg.norm(self.point[j] - self.point[i])
            K[i, :, k], K[j, :, k] = self.axes[i].T @ direction, -self.axes[j].T @ direction
        return K.reshape(-1, len(pairs))

    def deformation_rows(self) -> Array:
        """The rows of J_delta for v_x, v_y, v_z in the rates of the first three deformations, shape (3 nc, 3 nc)."""
        count = len(self.point)
        rows, k = np.zeros((count, 3, count, 3)), np.arange(count)
        rows[k, 0, k, 1], rows[k, 1, k, 2], rows[k, 2, k, 0] = self.levers[:, 0], self.levers[:, 1], 1.0
        return rows.reshape(3 * count, 3 * count)


class _Tip:
    """The law of a tip, known to the controller."""

    def __init__(self, law: Law) -> None:
        self.radius, self.is_surface = law.radius, law.coordinates == "surface"
        self._force, self._parameters = law.force, law.parameters().tolist()

    def force(self, deformation: list[float], Phi: float, lean: list[float]) -> tuple[float, float, float, float]:
        """f_x, f_y, f_z [N], tau [N m] on the object in C_F, (48)."""
        if self.is_surface:
            f_z, f_x, f_y, tau = self._force(*deformation, *lean, *self._parameters)
            return f_x, f_y, f_z, tau
        Fr, Ftheta, Fphi, Fpsi = self._force(*deformation, Phi + deformation[2], *self._parameters)
        R = self.radius - deformation[0]
        return (Ftheta - math.sin(Phi) * Fpsi) / (R * math.cos(Phi)), Fphi / R, Fr, Fpsi


class _Hand:
    """Tips and their Jacobians: what q_F alone tells."""

    def __init__(self, observation: Observation) -> None:
        self.q_F = observation.joint_position.copy()
        self.tips, self.axes = observation.tip_position.copy(), observation.tip_rotation
        self.velocity, self.spin = observation.tip_jacobian, observation.tip_angular_jacobian


class ObjectEstimator:
    """Integrates the motion of the object that rolls between tips, and keeps it at the right distance from them.

    The force rows of (43) give the motion between two samples,

        G^fT dx_O = J_CF^f dq_F - J_delta^f d(dr, dtheta, dphi),        (dr, s1, s2) in surface coordinates

    dx_O the displacement and the rotation vector of the object, by
    least squares, with Jacobians of the middle. The deformation is the one that the law answers with f_C: (48) solved
    with dpsi, which the fourth row of (43) gives. Then dr = dr(f_z) has to agree with n . (x_i - p_O) - d = r - dr at
    each tip: the shortest motion that makes it so takes the drift of these distances away. What tips that face
    each other disagree on, as they do where the law is known badly, is left alone. Motion along the faces is integrated
    only.

    Args:
        observation: the grasp at the start: its pose, the laws of the tips, faces and weight.

    Raises:
        ScenarioError: a tip touches a curved surface.
    """

    def __init__(self, observation: Observation) -> None:
        if any(tip.face.is_curved for tip in observation.fingertips):
            raise ScenarioError(
                "the pose of an object is computed from its plane faces alone, and this one is curved where it is "
                "touched; choose a controller that measures it, or a mesh.",
                key="controller.name", value="",
            )  # fmt: skip
        self._tips = [_Tip(tip.law) for tip in observation.fingertips]
        self._normals = np.array([tip.face.normal for tip in observation.fingertips])
        self._offsets = np.array([tip.face.offset for tip in observation.fingertips])
        self._tangents = np.array([tip.face.tangent for tip in observation.fingertips])
        self._radii = np.array([tip.radius for tip in self._tips])
        self._is_surface = np.array([[tip.is_surface] for tip in self._tips])
        lengths = np.where(self._is_surface, self._radii[:, None], 1.0)
        self._steps = _STEP * np.column_stack([self._radii, lengths, lengths])
        self._weight = -observation.object_mass * observation.gravity
        self._lever = observation.object_lever.copy()
        # a turn counts as the way that it moves the contacts
        reach = np.linalg.norm(observation.contact_point - observation.object_position, axis=1).mean()
        self._size = np.repeat([1.0, 1.0 / reach], 3)

    def start(self, observation: Observation) -> Estimate:
        """The estimate at the start, where the pose of the object and the deformation are known."""
        place = observation.object_position.copy(), observation.object_rotation.copy()
        return self._at(_Hand(observation), place, observation.deformation.copy())

    def weight(self, rotation: Array) -> Array:
        """The wrench about the origin that holds the object, world axes [N, N m], shape (6,)."""
        return np.concatenate([self._weight, cross_matrix(rotation @ self._lever) @ self._weight])

    def update(self, observation: Observation, before: Estimate) -> Estimate:
        """The estimate at a sample from that of the one before.

        Args:
            observation: of which q_F, what depends on it alone, and f_C are read.
            before: the estimate of the sample before.
        """
        now, hand = before, _Hand(observation)
        dq_F, turned = observation.joints_from(before.q_F), np.zeros(len(self._tips))
        for _ in range(2):  # the middle is known only after a first go
            deformation = self._deformation(observation.f_C, turned, now, before)
            motion = self._motion(dq_F, deformation - before.deformation, now, before)
            now = self._at(hand, before.moved(motion), deformation)
            turned = self._turned(dq_F, motion, now, before)
            deformation[:, 3] = _torsion(deformation, turned, now, before)
        return self._at(hand, self._corrected(now), deformation)

    def _at(self, hand: _Hand, place: tuple[Array, Array], deformation: Array) -> Estimate:
        """Contact frames and Jacobians where the object is thought to be, (13), (14), (16) for plane faces."""
        position, rotation = place
        tips, tip_axes, spin = hand.tips, hand.axes, hand.spin
        normal = -self._normals @ rotation.T
        distance = -np.einsum("ib,ib->i", normal, tips - position) - self._offsets
        arm = distance[:, None] * normal
        sin_Phi, across, along = np.einsum("iba,ib->ai", tip_axes, normal)  # z_C in F
        cos_Phi, Phi, Theta = np.hypot(across, along), np.arcsin(np.clip(sin_Phi, -1.0, 1.0)), np.arctan2(along, across)
        x_polar = -np.sin(Theta)[:, None] * tip_axes[:, :, 1] + np.cos(Theta)[:, None] * tip_axes[:, :, 2]
        x_C = np.where(self._is_surface, self._tangents @ rotation.T, x_polar)
        axes = np.stack([x_C, np.einsum("iab,ib->ia", cross_matrix(normal), x_C), normal], axis=2)
        lean = np.einsum("ib,iba->ia", tip_axes[:, :, 0], axes)[:, :2]
        levers = np.where(self._is_surface, (1.0, 1.0, 0.0), np.column_stack([distance * cos_Phi, distance, sin_Phi]))
        into_contact = axes.transpose(0, 2, 1)
        moved = into_contact @ cross_matrix(tips + arm - position)
        count, n = len(tips), spin.shape[2]
        return Estimate(
            position=position,
            rotation=rotation,
            q_F=hand.q_F,
            deformation=deformation,
            tau_C=self._forces(deformation, Phi, lean)[:, 3],
            point=tips + arm,
            axes=axes,
            Phi=Phi,
            lean=lean,
            distance=distance,
            levers=levers,
            J_CF_f=(into_contact @ carried(hand.velocity, spin, arm)).reshape(3 * count, n),
            J_CF_tau=np.einsum("ib,ibk->ik", normal, spin),
            force_rows=np.concatenate([into_contact, -moved], axis=2).reshape(3 * count, 6),
            torsion_rows=np.hstack([np.zeros((count, 3)), normal]),
        )

    def _forces(self, deformation: Array, Phi: Array, lean: Array) -> Array:
        """f_x, f_y, f_z [N], tau [N m] that the laws answer with, shape (nc, 4)."""
        cases = zip(self._tips, deformation.tolist(), Phi.tolist(), lean.tolist(), strict=True)
        return np.array([tip.force(*case) for tip, *case in cases])

    def _deformation(self, f_C: Array, turned: Array, now: Estimate, before: Estimate) -> Array:
        """The deformation that the laws answer to with f_C at the frames of `now`, shape (nc, 4).

        Newton's method from the deformation of `now`, with one slope. The torsion follows the second deformation by
        `_torsion`: to take it from the pass before would swing up where Fpsi has much weight in f_x.
        """
        found = now.deformation.copy()

        def excess() -> Array:
            found[:, 3] = _torsion(found, turned, now, before)
            return self._forces(found, now.Phi, now.lean)[:, :3] - f_C.reshape(-1, 3)

        off, slope = excess(), np.empty((len(found), 3, 3))
        for k in range(3):
            kept = found[:, k].copy()
            found[:, k] += self._steps[:, k]
            slope[:, :, k] = (excess() - off) / self._steps[:, k, None]
            found[:, k] = kept
        inverse = np.linalg.pinv(slope, rcond=1e-12)  # of a tip that has let go, the best that there is
        for k in range(_NEWTON):
            found[:, :3] -= np.einsum("iab,ib->ia", inverse, excess() if k else off)
        return found

    def _motion(self, dq_F: Array, change: Array, now: Estimate, before: Estimate) -> Array:
        """dx_O from the force rows of (43), Jacobians of the middle, shape (6,)."""
        J_O, J_CF = 0.5 * (now.force_rows + before.force_rows), 0.5 * (now.J_CF_f + before.J_CF_f)
        J_delta = 0.5 * (now.deformation_rows() + before.deformation_rows())
        moved = J_CF @ dq_F - J_delta @ change[:, :3].ravel()
        scaled: Array = np.linalg.lstsq(J_O * self._size, moved, rcond=_MOVING)[0]
        return scaled * self._size

    def _turned(self, dq_F: Array, motion: Array, now: Estimate, before: Estimate) -> Array:
        """Angle w_z dt by which each tip has turned on the object, from the moment rows of (43) [rad], shape (nc,)."""
        J_CF, J_O = 0.5 * (now.J_CF_tau + before.J_CF_tau), 0.5 * (now.torsion_rows + before.torsion_rows)
        turned: Array = J_CF @ dq_F - J_O @ motion
        return turned

    def _corrected(self, now: Estimate) -> tuple[Array, Array]:
        """The pose changed as little as makes the distances of the tips those of the forces, r - dr(f_z)."""
        gap = now.distance - (self._radii - now.deformation[:, 0])
        along_normal = now.force_rows[2::3] * self._size
        scaled: Array = np.linalg.lstsq(along_normal, gap, rcond=_CERTAIN)[0]
        return now.moved(-scaled * self._size)


def _torsion(deformation: Array, turned: Array, now: Estimate, before: Estimate) -> Array:
    """dpsi of each contact, from dpsi' = w_z - sinPhi dtheta', shape (nc,)."""
    lever = 0.5 * (now.levers[:, 2] + before.levers[:, 2])
    torsion: Array = before.deformation[:, 3] + turned - lever * (deformation[:, 1] - before.deformation[:, 1])
    return torsion
