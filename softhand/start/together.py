"""All fingers of a hand at their contacts at once: with coupled joints no finger can be solved by itself."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from softhand.contact.pads import Fingertip
from softhand.errors import GraspError
from softhand.laws.law import CompiledLaw, Law
from softhand.model.arm import REACHED, Arm
from softhand.model.shapes.face import Face
from softhand.numerics.arrays import Array
from softhand.start.finger import answer_tip
from softhand.start.reach import millimetres
from softhand.start.settle import SETTLED, Settled
from softhand.start.statics import contact_loads

FARTHEST = 1e-3
"""[m] by which a start moves a contact point along the face, or the object, to where the coupled joints reach it."""

_TURNS = 60
_ITERATIONS = 60
_LONGEST = 0.3  # of one step, over the range of a motor
_STARTS = 8
_HEAVY = 1e3  # how much rather a contact point moves than the object
_WISH = 1e-7  # [m] what all of its range counts to a motor that could be elsewhere
_SAME = 1e-9  # [m]
_OPEN = 0.5  # of the opening, by which a gap may be wider or narrower
_CLOSER = 10.0  # how much rather an open tip is beside its point than nearer to its face or farther


class Together(NamedTuple):
    """All fingers at rest on their contacts.

    Attributes:
        angles: of the motors [rad or m], shape (n,).
        points: of contact in the object frame [m], shape (nc, 3).
        forces: of `contact_loads`, shape (nc, 4).
        position: of the object frame in the world [m], shape (3,).
        rotation: its axes, shape (3, 3).
    """

    angles: Array
    points: Array
    forces: Array
    position: Array
    rotation: Array


def settle_together(
    arm: Arm,
    fingertips: Sequence[Fingertip],
    code: Mapping[Law, CompiledLaw],
    contact_points: Sequence[ArrayLike],
    internal_force: ArrayLike,
    position: Array,
    rotation: Array,
    angles: Array,
    settled: Sequence[Settled],
    moments: Array,
) -> Together:
    """Motor positions and deformations of all fingers that answer their contact forces.

    Every tip has to lie at its depth. Where the motors do not bring all of them to their points, the points move along
    their faces, as little as they can in all; the object moves only where the depths ask for it, as between two jaws
    with one motor.

    Args:
        arm: of the hand.
        fingertips: law, friction and face of each tip.
        code: machine code of the laws.
        contact_points: in the object frame [m], one a tip.
        internal_force: f_N [N], one a pair of contacts.
        position: of the object frame in the world [m], shape (3,).
        rotation: its axes, shape (3, 3).
        angles: of the motors to begin from, and to be near to [rad or m], shape (n,).
        settled: of each tip, set.
        moments: of all tips on the object, as in `contact_loads`.

    Raises:
        GraspError: the points are out of reach, or as `answer_tip` and `contact_loads`.
    """
    asked = np.array([np.asarray(point, dtype=float) for point in contact_points])
    faces, world = [fingertip.face for fingertip in fingertips], arm.world
    fit = _Fit(arm, angles.copy(), asked, faces, position, rotation)
    points = asked
    for one in settled:
        one.deformation[:] = 0.0
    for turn in range(_TURNS):
        before = np.array([one.deformation.copy() for one in settled])
        inward = np.array([tip.law.radius for tip in fingertips]) - before[:, 0]
        fit.solve(inward, first=turn == 0)
        points, faces = fit.contacts(inward)
        fit.follow(points, faces)
        inward_normals = np.array([-fit.rotation @ face.normal for face in faces])
        forces = contact_loads(
            world, list(fit.to_world(points)), fit.position, fit.rotation, internal_force, moments, inward_normals
        )
        for i, (fingertip, face) in enumerate(zip(fingertips, faces, strict=True)):
            frame = fit.rotation @ np.column_stack([face.tangent, -face.normal])
            answer_tip(world, i, fingertip, code.get(fingertip.law), arm.tip(i)[1], frame, forces[i], settled[i])
        if np.max(np.abs([one.deformation - old for one, old in zip(settled, before, strict=True)])) < 10.0 * SETTLED:
            break
    return Together(fit.angles, points, forces, fit.position, fit.rotation)


def open_together(
    arm: Arm,
    fingertips: Sequence[Fingertip],
    contact_points: Sequence[ArrayLike],
    opening: float,
    position: Array,
    rotation: Array,
    angles: Array,
) -> None:
    """Motor positions at which all tips stand off the object, about before their contact points.

    The motors of coupled joints seldom bring every tip to its place; each stands off by the opening, within half of it.

    Args:
        arm: of the hand.
        fingertips: law and face of each tip.
        contact_points: in the object frame [m], one a tip.
        opening: gap between tip and face [m], above 0.
        position: of the object frame in the world [m], shape (3,).
        rotation: its axes, shape (3, 3).
        angles: of the motors to begin from; set [rad or m], shape (n,).

    Raises:
        GraspError: some tip cannot stand so.
    """
    asked = np.array([np.asarray(point, dtype=float) for point in contact_points])
    faces = [fingertip.face for fingertip in fingertips]
    fit = _Fit(arm, angles.copy(), asked, faces, position, rotation)
    off = fit.stand_off(np.array([fingertip.law.radius + opening for fingertip in fingertips]))
    worst = int(np.argmax(np.abs(off)))
    if abs(off[worst]) > _OPEN * opening:
        name = arm.world.tips[worst].name
        raise GraspError(
            f"{name}: with all tips {1e3 * opening:.3g} mm before their faces this one is "
            f"{1e3 * (opening + off[worst]):.3g} mm before it, as its joints are coupled to those of others or at "
            "their limits. Move the object or the contact points, or give another grasp.opening.",
            finger=name, quantity="reach", value=float(off[worst]),
        )  # fmt: skip
    angles[:] = fit.angles


class _Fit:
    """Motors and object, with each tip at a distance from its face.

    Attributes:
        angles: of the motors, shape (n,).
        rotation: axes of the object in the world, shape (3, 3).
    """

    def __init__(
        self, arm: Arm, guess: Array, asked: Array, faces: Sequence[Face], position: Array, rotation: Array
    ) -> None:
        self._arm, self._guess, self._asked, self._faces = arm, guess, asked, list(faces)
        self._position, self.rotation = position, rotation
        self._feet = asked.copy()
        lower, upper = arm.limits
        self._size = np.where(np.isfinite(upper - lower), upper - lower, 2.0 * math.pi)
        self.angles, self._moved = guess.copy(), np.zeros(3)

    @property
    def position(self) -> Array:
        """Of the object frame in the world [m], shape (3,)."""
        return self._position + self._moved

    def to_world(self, points: Array) -> Array:
        return np.asarray(self.position + points @ self.rotation.T)

    def contacts(self, inward: Array) -> tuple[Array, list[Face]]:
        """Contact points in the object frame, and the faces there."""
        shape = self._arm.world.shape
        points, faces = self._asked.copy(), list(self._faces)
        for i, face in enumerate(self._faces):
            way = self.rotation.T @ (self._arm.tip(i)[0] - self.position) - inward[i] * face.normal - self._feet[i]
            way -= face.normal * (face.normal @ way)
            points[i] = self._feet[i] + way
            if face.is_curved:
                points[i] = shape.nearest(points[i])[0]
                faces[i] = shape.face_at(points[i])
            elif np.linalg.norm(points[i] - self._asked[i]) <= _SAME:
                points[i] = self._asked[i]
        return points, faces

    def follow(self, points: Array, faces: Sequence[Face]) -> None:
        """Go on from the tangent planes at these points, where the surface is curved."""
        for i, face in enumerate(faces):
            if face.is_curved:
                self._feet[i], self._faces[i] = points[i], face

    def solve(self, inward: Array, first: bool) -> None:
        """Put each tip at that distance from its face [m], as near to its point as can be.

        Raises:
            GraspError: that cannot be.
        """
        found = self._from(self.angles, self._moved, inward)
        if first and not (found[0] <= REACHED and found[1] <= _SAME):
            lower, upper = self._arm.limits
            within = np.maximum(lower, -math.pi), np.minimum(upper, math.pi)
            others = np.random.default_rng(0).uniform(*within, (_STARTS, len(lower)))
            tried = [found, *(self._from(start, np.zeros(3), inward) for start in others)]
            reached = [one for one in tried if one[0] <= REACHED]
            found = min(reached, key=lambda one: one[1]) if reached else min(tried, key=lambda one: one[0])
        gap, beside, self.angles, self._moved = found
        self._arm.move(self.angles)
        if gap > REACHED or beside > FARTHEST or np.linalg.norm(self._moved) > FARTHEST:
            self._refuse(inward, gap)

    def stand_off(self, outward: Array) -> Array:
        """Put the tips before their faces, as near to that distance and before their points as one gets.

        Returns:
            What each is off its distance [m], shape (nc,).
        """
        _, _, self.angles, _ = self._from(self.angles, np.zeros(3), outward, is_soft=True)
        return self._errors(self.angles, np.zeros(3), outward)[0]

    def _refuse(self, inward: Array, gap: float) -> None:
        world = self._arm.world
        how = f"with {world.n_joints} joints"
        if world.coupling is not None:
            coupled = ", ".join(world.coupling.joint_names[k] for k in world.coupling.coupled_joints)
            how = f"with {world.n_joints} motor{' that moves' if world.n_joints == 1 else 's that move'} {coupled} too"
        if gap > REACHED:
            depth, _, _, _ = self._errors(self.angles, self._moved, inward)
            i = int(np.argmax(np.abs(depth)))
            raise GraspError(
                f"{world.tips[i].name}: the contact points are out of reach at once {how}: at best this tip is off its "
                f"face by {1e3 * abs(depth[i]):.3g} mm within the joint limits. Move the object or the contact points, "
                "or give another grasp.joint_guess.",
                finger=world.tips[i].name, quantity="reach", value=gap,
            )  # fmt: skip
        points, _ = self.contacts(inward)
        moved = float(np.linalg.norm(self._moved))
        way = np.linalg.norm(points - self._asked, axis=1)
        i = int(np.argmax(way))
        nearest = "[" + ", ".join(f"[{x:.6g}, {y:.6g}, {z:.6g}]" for x, y, z in np.round(points, 6) + 0.0) + "]"
        place = "[" + ", ".join(f"{x:.6g}" for x in np.round(self.position, 6) + 0.0) + "]"
        told = (
            f"the nearest point of the face that it reaches is {millimetres(points[i])} mm, {1e3 * way[i]:.3g} mm "
            f"beside its own; take grasp.contact_points = {nearest}"
        )
        if moved > FARTHEST:
            told = f"the object would have to be {1e3 * moved:.3g} mm beside; take object.position = {place}"
        raise GraspError(
            f"{world.tips[i].name}: the contact points are out of reach at once {how}: {told}.",
            finger=world.tips[i].name, quantity="reach", value=max(float(way[i]), moved),
        )  # fmt: skip

    def _errors(self, angles: Array, moved: Array, inward: Array) -> tuple[Array, Array, Array, Array]:
        """Of depth and beside the points, shapes (nc,) and (2 nc,); their slopes by motors and by the object."""
        self._arm.move(angles)
        R, p = self.rotation, self._position + moved
        depth, beside, of_depth, of_beside = [], [], [], []
        for i, face in enumerate(self._faces):
            tip = self._arm.tip(i)[0]
            way, tangents = R.T @ (tip - p), _tangents(face)
            slope = R.T @ np.hstack([self._arm.point_jacobian(i, tip), -np.eye(3)])
            depth.append(face.normal @ (way - self._feet[i]) - inward[i])
            beside.extend(tangents.T @ (way - self._asked[i]))
            of_depth.append(face.normal @ slope)
            of_beside.extend(tangents.T @ slope)
        return np.array(depth), np.array(beside), np.array(of_depth), np.array(of_beside)

    def _from(
        self, angles: Array, moved: Array, inward: Array, is_soft: bool = False
    ) -> tuple[float, float, Array, Array]:
        """Largest error of depth and way beside a point [m], where the search from there ends, motors and object.

        Newton's method, Gauss's for what is beside, under the equations of the depths; these may be missed too, and
        the object stays, where the fit is soft.
        """
        n, lower, upper = len(angles), *self._arm.limits
        angles, moved = np.clip(angles, lower, upper), moved.copy()
        scale = np.concatenate([self._size, np.ones(3)])
        for _ in range(_ITERATIONS):
            depth, beside, of_depth, of_beside = self._errors(angles, moved, inward)
            goal = np.concatenate([beside, _WISH * (angles - self._guess) / self._size, _HEAVY * moved])
            slope = np.vstack([of_beside, np.diag(np.concatenate([_WISH / self._size, np.full(3, _HEAVY)]))])
            if is_soft:
                goal, slope = np.concatenate([_CLOSER * depth, goal]), np.vstack([_CLOSER * of_depth, slope])
                depth, of_depth = depth[:0], of_depth[:0]
            held = np.zeros(n + 3, bool)
            held[n:] = is_soft
            while True:
                step = np.zeros(n + 3)
                step[~held] = scale[~held] * _constrained(
                    slope[:, ~held] * scale[~held], goal, of_depth[:, ~held] * scale[~held], depth
                )
                step *= min(1.0, _LONGEST / max(float(np.max(np.abs(step[:n]) / self._size)), 1e-300))
                new = angles + step[:n]
                out = ((new < lower) | (new > upper)) & ~held[:n]
                stuck = out & ((angles <= lower) & (step[:n] < 0.0) | (angles >= upper) & (step[:n] > 0.0))
                if not stuck.any():
                    break
                held[:n] |= stuck
            angles, moved = np.clip(new, lower, upper), moved + step[n:]
            if np.max(np.abs(step) / scale) < 1e-14:
                break
        depth, beside, _, _ = self._errors(angles, moved, inward)
        return float(np.max(np.abs(depth))), float(np.max(np.hypot(*beside.reshape(-1, 2).T))), angles, moved


def _tangents(face: Face) -> Array:
    return np.column_stack([face.tangent, np.cross(face.normal, face.tangent)])


def _constrained(A: Array, b: Array, C: Array, d: Array) -> Array:
    """y that minimises |A y + b| where |C y + d| is least."""
    U, s, Vt = np.linalg.svd(C)
    rank = int(np.count_nonzero(s > 1e-10 * max(s.max(initial=0.0), 1e-300)))
    y = -Vt[:rank].T @ ((U[:, :rank].T @ d) / s[:rank])
    Z = Vt[rank:].T
    if Z.shape[1]:
        y = y + Z @ np.linalg.lstsq(A @ Z, -(A @ y + b), rcond=1e-13)[0]
    return np.asarray(y)
