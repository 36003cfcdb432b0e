"""Pose of the object and torsion of the tips from joint angles and contact forces alone."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from softhand.contact.address import call
from softhand.contact.records import LAW_ARGUMENTS
from softhand.controllers.estimate import Estimate, room_for_estimate
from softhand.controllers.tips import moved, radii
from softhand.errors import ScenarioError
from softhand.laws.law import LEADING, Law, compile_law
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.compiled import compiled
from softhand.numerics.linear import least_norm, truncated_solution
from softhand.numerics.rotations import turn_rotation
from softhand.numerics.triples import solved
from softhand.sensing.fields import observed_by, pick
from softhand.sensing.observation import Observation

STEP = 1e-6  # of the radius, or rad: of the slope of a law
MOVING = 1e-3  # share of the largest singular value: motion that moves the contacts less is not observation
CERTAIN = 0.3  # the same of distances: two tips that face each other would turn their disagreement into a large turn
NEWTON = 3  # steps with one slope; the deformation moves little between two samples
FLAT = 1e-9  # determinant of a slope with columns of length one, below which it cannot be inverted


class Tips(NamedTuple):
    """What is known of the tips and their faces, and room to work in."""

    codes: AnyArray
    """Addresses of the laws, shape (nc,)."""
    arguments: Array
    """Of the laws: room for what is before their parameters, and these, shape (nc, numbers)."""
    is_surface: AnyArray
    """1 for laws in surface coordinates, shape (nc,)."""
    radii: Array
    """[m], shape (nc,)."""
    normals: Array
    """Of the faces, in the object, shape (nc, 3)."""
    tangents: Array
    """Likewise."""
    offsets: Array
    """Of the faces [m], shape (nc,)."""
    is_continuous: AnyArray
    """Which joints turn without end, shape (n,)."""
    dq_F: Array
    """Room, shape (n,)."""
    turned: Array
    """Room, shape (nc,)."""
    motion: Array
    """Room, shape (6,)."""
    slope: Array
    """Room, shape (3, 3)."""


_laws_in_use: dict[int, Any] = {}  # machine code must live as long as it may be called


def known_tips(observation: Observation) -> Tips:
    """What is known of the tips of a grasp.

    Raises:
        ScenarioError: a tip touches a curved surface.
    """
    tips, n = observation.fingertips, observation.joint_position.shape[0]
    if any(tip.face.is_curved for tip in tips):
        raise ScenarioError(
            "the pose of an object is computed from its plane faces alone, and this one is curved where it is "
            "touched; choose a controller that measures it, or a mesh.",
            key="controller.name", value="",
        )  # fmt: skip
    codes, arguments = np.zeros(len(tips), np.int64), np.zeros((len(tips), LAW_ARGUMENTS))
    for i, tip in enumerate(tips):
        codes[i], arguments[i] = _code_of(tip.law)
    return Tips(
        codes,
        arguments,
        np.array([tip.law.coordinates == "surface" for tip in tips], dtype=np.int64),
        radii(observation),
        np.array([tip.face.normal for tip in tips]),
        np.array([tip.face.tangent for tip in tips]),
        np.array([tip.face.offset for tip in tips]),
        observation.is_continuous.copy(),
        np.zeros(n),
        np.zeros(len(tips)),
        np.zeros(6),
        np.zeros((3, 3)),
    )


def _code_of(law: Law) -> tuple[int, Array]:
    code, row, first = compile_law(law), np.zeros(LAW_ARGUMENTS), len(LEADING[law.coordinates])
    _laws_in_use[code.force.address] = code.force
    row[first : first + len(code.parameters)] = code.parameters
    return code.force.address, row


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

    This is the Python side of `set_update`, which compiled laws call.

    Attributes:
        known: of the tips.
        reach: mean distance of the contacts from the object's origin at the start [m]; a turn counts as the way that it
            moves them.

    Args:
        observation: the grasp at the start: its pose, the laws of the tips and faces.

    Raises:
        ScenarioError: a tip touches a curved surface.
    """

    def __init__(self, observation: Observation) -> None:
        self.known = known_tips(observation)
        arms = observation.contact_point - observation.object_position
        self.reach = float(np.linalg.norm(arms, axis=1).mean())

    def start(self, observation: Observation) -> Estimate:
        """The estimate at the start, where the pose of the object and the deformation are known."""
        place = observation.object_position, observation.object_rotation
        return self.at(observation, *place, observation.deformation)

    def at(self, observation: Observation, position: Array, rotation: Array, deformation: Array) -> Estimate:
        """The estimate with the object at a place [m], shape (3,) and (3, 3), and deformations, shape (nc, 4)."""
        now = self._room()
        now.position[:], now.rotation[:], now.deformation[:] = position, rotation, deformation
        set_contacts(_seen(observation), self.known, now)
        return now

    def update(self, observation: Observation, before: Estimate) -> Estimate:
        """The estimate at a sample from that of the one before.

        Args:
            observation: of which q_F, what depends on it alone, and f_C are read.
            before: the estimate of the sample before.
        """
        now = self._room()
        for own, old in zip(now, before, strict=True):
            own[:] = old
        set_update(_seen(observation), self.known, self.reach, before, now)
        return now

    def _room(self) -> Estimate:
        return room_for_estimate(len(self.known.radii), len(self.known.dq_F))[1]


READS = ("joint_position", "tip_position", "tip_rotation", "tip_jacobian", "tip_angular_jacobian", "contact_force")


def _seen(observation: Observation) -> Any:
    return pick(observed_by(READS), observation._views)


@compiled
def set_update(observed, known, reach, before, now):
    """The estimate at a sample; `now` is that of the sample before on entry, as `before` stays."""
    dq_F, turned, motion = known.dq_F, known.turned, known.motion
    for j in range(dq_F.shape[0]):
        dq_F[j] = moved(observed.joint_position[j], before.q_F[j], known.is_continuous[j])
    turned[:] = 0.0
    for _ in range(2):  # the middle is known only after a first go
        for i in range(turned.shape[0]):
            _set_deformation(observed.contact_force[i], known, i, before, now)
        _set_motion(known, reach, before, now)
        _move(before, motion, now)
        set_contacts(observed, known, now)
        for i in range(turned.shape[0]):  # w_z dt, from the moment rows of (43)
            turned[i] = 0.0
            for j in range(dq_F.shape[0]):
                turned[i] += 0.5 * (now.J_CF_tau[i, j] + before.J_CF_tau[i, j]) * dq_F[j]
            for k in range(6):
                turned[i] -= 0.5 * (now.torsion_rows[i, k] + before.torsion_rows[i, k]) * motion[k]
            _set_torsion(turned[i], before, now, i)
    _correct(known, reach, now)
    set_contacts(observed, known, now)


@compiled
def set_contacts(observed, known, now):
    """Contact frames and Jacobians where the object is thought to be, (13), (14), (16) for plane faces."""
    for j in range(now.q_F.shape[0]):
        now.q_F[j] = observed.joint_position[j]
    for i in range(known.radii.shape[0]):
        _set_frame(observed.tip_position[i], observed.tip_rotation[i], known, i, now)
        _set_jacobians(observed.tip_position[i], observed.tip_jacobian[i], observed.tip_angular_jacobian[i], i, now)
        now.tau_C[i] = _force(known, i, now)[3]


@compiled
def _set_frame(tip, tip_axes, known, i, now):
    """Frame, angles and distance of a contact."""
    R, normal, axes = now.rotation, known.normals[i], now.axes[i]
    for k in range(3):  # z_C out of the tip, against the face
        axes[k, 2] = -(R[k, 0] * normal[0] + R[k, 1] * normal[1] + R[k, 2] * normal[2])
    distance = -known.offsets[i]
    sin_Phi = across = along = 0.0
    for k in range(3):
        distance -= axes[k, 2] * (tip[k] - now.position[k])
        sin_Phi += tip_axes[k, 0] * axes[k, 2]
        across += tip_axes[k, 1] * axes[k, 2]
        along += tip_axes[k, 2] * axes[k, 2]
    cos_Phi, Theta = math.hypot(across, along), math.atan2(along, across)
    now.distance[i], now.Phi[i] = distance, math.asin(min(max(sin_Phi, -1.0), 1.0))
    tangent = known.tangents[i]
    for k in range(3):
        now.point[i, k] = tip[k] + distance * axes[k, 2]
        axes[k, 0] = -math.sin(Theta) * tip_axes[k, 1] + math.cos(Theta) * tip_axes[k, 2]
        if known.is_surface[i]:
            axes[k, 0] = R[k, 0] * tangent[0] + R[k, 1] * tangent[1] + R[k, 2] * tangent[2]
    axes[0, 1] = axes[1, 2] * axes[2, 0] - axes[2, 2] * axes[1, 0]
    axes[1, 1] = axes[2, 2] * axes[0, 0] - axes[0, 2] * axes[2, 0]
    axes[2, 1] = axes[0, 2] * axes[1, 0] - axes[1, 2] * axes[0, 0]
    now.lean[i, 0] = now.lean[i, 1] = 0.0
    for k in range(3):
        now.lean[i, 0] += tip_axes[k, 0] * axes[k, 0]
        now.lean[i, 1] += tip_axes[k, 0] * axes[k, 1]
    levers = now.levers[i]
    levers[0], levers[1], levers[2] = distance * cos_Phi, distance, sin_Phi
    if known.is_surface[i]:
        levers[0], levers[1], levers[2] = 1.0, 1.0, 0.0


@compiled
def _set_jacobians(tip, velocity, spin, i, now):
    """Rows of a contact in the Jacobians of hand and object."""
    axes, point, p = now.axes[i], now.point[i], now.position
    for j in range(now.q_F.shape[0]):
        x, y, z = point[0] - tip[0], point[1] - tip[1], point[2] - tip[2]
        a = velocity[0, j] + spin[1, j] * z - spin[2, j] * y
        b = velocity[1, j] + spin[2, j] * x - spin[0, j] * z
        c = velocity[2, j] + spin[0, j] * y - spin[1, j] * x
        for k in range(3):
            now.J_CF_f[3 * i + k, j] = axes[0, k] * a + axes[1, k] * b + axes[2, k] * c
        now.J_CF_tau[i, j] = axes[0, 2] * spin[0, j] + axes[1, 2] * spin[1, j] + axes[2, 2] * spin[2, j]
    x, y, z = point[0] - p[0], point[1] - p[1], point[2] - p[2]
    for k in range(3):
        row = now.force_rows[3 * i + k]
        row[0], row[1], row[2] = axes[0, k], axes[1, k], axes[2, k]
        row[3], row[4], row[5] = y * row[2] - z * row[1], z * row[0] - x * row[2], x * row[1] - y * row[0]
        now.torsion_rows[i, k], now.torsion_rows[i, 3 + k] = 0.0, axes[k, 2]


@compiled
def _force(known, i, now):
    """f_x, f_y, f_z [N], tau [N m] on the object in C_F that the law of a tip answers with, (48)."""
    row, d, found = known.arguments[i], now.deformation[i], np.empty(4)
    for k in range(4):
        row[k] = d[k]
    if known.is_surface[i]:
        row[4], row[5] = now.lean[i, 0], now.lean[i, 1]
        call(known.codes[i], row, found)  # type: ignore[call-arg]
        return found[1], found[2], found[0], found[3]
    row[4] = now.Phi[i] + d[2]
    call(known.codes[i], row, found)  # type: ignore[call-arg]
    R, sin_Phi, cos_Phi = known.radii[i] - d[0], math.sin(now.Phi[i]), math.cos(now.Phi[i])
    return (found[1] - sin_Phi * found[3]) / (R * cos_Phi), found[2] / R, found[0], found[3]


@compiled
def _set_torsion(turned, before, now, i):
    """dpsi of a contact, from dpsi' = w_z - sinPhi dtheta'."""
    lever = 0.5 * (now.levers[i, 2] + before.levers[i, 2])
    bent = now.deformation[i, 1] - before.deformation[i, 1]
    now.deformation[i, 3] = before.deformation[i, 3] + turned - lever * bent


@compiled
def _set_deformation(f_C, known, i, before, now):
    """The deformation of a tip that its law answers to with f_C at the frame of `now`.

    Newton's method from the deformation of `now`, with one slope. The torsion follows the second deformation by
    `_set_torsion`: to take it from the pass before would swing up where Fpsi has much weight in f_x.
    """
    d, slope, turned = now.deformation[i], known.slope, known.turned[i]
    _set_torsion(turned, before, now, i)
    off = _force(known, i, now)
    for k in range(3):
        kept, step = d[k], STEP * (known.radii[i] if k == 0 or known.is_surface[i] else 1.0)
        d[k] += step
        _set_torsion(turned, before, now, i)
        there = _force(known, i, now)
        for row in range(3):
            slope[row, k] = (there[row] - off[row]) / step
        d[k] = kept
    for pass_ in range(NEWTON):
        if pass_:
            _set_torsion(turned, before, now, i)
            off = _force(known, i, now)
        back = _solved(slope, (off[0] - f_C[0], off[1] - f_C[1], off[2] - f_C[2]))
        for k in range(3):
            d[k] -= back[k]


@compiled
def _solved(A, b):
    """A^-1 b; of a tip that has let go, whose slope has no inverse, the best that there is."""
    scaled, rest, x = np.empty((3, 3)), np.empty(3), np.empty(3)
    size = (
        math.sqrt(A[0, 0] ** 2 + A[1, 0] ** 2 + A[2, 0] ** 2),
        math.sqrt(A[0, 1] ** 2 + A[1, 1] ** 2 + A[2, 1] ** 2),
        math.sqrt(A[0, 2] ** 2 + A[1, 2] ** 2 + A[2, 2] ** 2),
    )
    for k in range(3):
        rest[k] = b[k]
        for row in range(3):
            scaled[row, k] = A[row, k] / size[k] if size[k] > 0.0 else 0.0
    minor = (
        scaled[1, 1] * scaled[2, 2] - scaled[1, 2] * scaled[2, 1],
        scaled[1, 2] * scaled[2, 0] - scaled[1, 0] * scaled[2, 2],
        scaled[1, 0] * scaled[2, 1] - scaled[1, 1] * scaled[2, 0],
    )
    if abs(scaled[0, 0] * minor[0] + scaled[0, 1] * minor[1] + scaled[0, 2] * minor[2]) > FLAT:
        return solved(
            (A[0, 0], A[0, 1], A[0, 2], A[1, 0], A[1, 1], A[1, 2], A[2, 0], A[2, 1], A[2, 2]), (b[0], b[1], b[2])
        )
    least_norm(scaled, False, rest, x)
    for k in range(3):
        x[k] = x[k] / size[k] if size[k] > 0.0 else 0.0
    return x[0], x[1], x[2]


@compiled
def _set_motion(known, reach, before, now):
    """dx_O from the force rows of (43), Jacobians of the middle, into the motion of `known`."""
    rows = now.force_rows.shape[0]
    J_O, gone = np.empty((rows, 6)), np.empty(rows)
    for row in range(rows):
        i, k = row // 3, row % 3
        change = (k + 1) % 3  # v_x goes with the second deformation, v_y with the third, v_z with the first
        lever = 1.0 if k == 2 else 0.5 * (now.levers[i, k] + before.levers[i, k])
        gone[row] = -lever * (now.deformation[i, change] - before.deformation[i, change])
        for j in range(known.dq_F.shape[0]):
            gone[row] += 0.5 * (now.J_CF_f[row, j] + before.J_CF_f[row, j]) * known.dq_F[j]
        for k in range(6):
            size = 1.0 if k < 3 else 1.0 / reach
            J_O[row, k] = 0.5 * (now.force_rows[row, k] + before.force_rows[row, k]) * size
    truncated_solution(J_O, gone, MOVING, known.motion)
    for k in range(3, 6):
        known.motion[k] /= reach


@compiled
def _correct(known, reach, now):
    """The pose changed as little as makes the distances of the tips those of the forces, r - dr(f_z)."""
    nc, motion = known.radii.shape[0], known.motion
    along, gap, before = np.empty((nc, 6)), np.empty(nc), np.empty((3, 3))
    for i in range(nc):
        gap[i] = now.distance[i] - (known.radii[i] - now.deformation[i, 0])
        for k in range(6):
            along[i, k] = now.force_rows[3 * i + 2, k] * (1.0 if k < 3 else 1.0 / reach)
    truncated_solution(along, gap, CERTAIN, motion)
    for k in range(3):
        now.position[k] -= motion[k]
        for i in range(3):
            before[k, i] = now.rotation[k, i]
    turn_rotation(-motion[3] / reach, -motion[4] / reach, -motion[5] / reach, before, now.rotation)


@compiled
def _move(before, motion, now):
    """The pose of `before` after a small displacement and rotation vector, world axes."""
    for k in range(3):
        now.position[k] = before.position[k] + motion[k]
    turn_rotation(motion[3], motion[4], motion[5], before.rotation, now.rotation)
