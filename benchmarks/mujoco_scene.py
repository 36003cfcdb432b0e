"""The grasp of a softhand scenario as a scene of MuJoCo, with the control law of the paper on MuJoCo's data.

Shared by the benchmarks. All numbers come from softhand's model of the URDFs and from its grasp at the start: joint
placements and axes, masses, inertias, tip frames, radius, friction, faces of the object, joint angles, object pose.

What cannot be the same is the contact: MuJoCo's has a normal force that grows with the depth, a damping, and friction
that creeps; it has no tangential and no torsional spring. Here

* normal: `solref` and `solimp` of each pair give, at the depth of the start, the force of the fingertip law and its
  derivative (F = pi k_r dr^2 and 2 pi k_r dr for the paper's law);
* friction: elliptic cone, condim 4, sliding coefficient mu, torsional coefficient tau_max / N of the pressure that
  belongs to the paper's law; `impratio` as high as careful users of grasps set it, so that the grasp creeps little;
* collisions of each tip with the object only, as explicit pairs.

MuJoCo keeps its default feature flags, as whoever loads a model gets them. `trimmed` switches off what the scene does
not use (islands, actuators, sensors, limits, springs, ...). In both cases torques go straight to `qfrc_applied`, and
the elliptic cone takes less time than the pyramidal one.
"""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from softhand.contact.pads import Fingertip
from softhand.contact.pairs import contact_pairs
from softhand.model.configuration import ADDITIVE
from softhand.model.world import World
from softhand.numerics.compiled import compiled
from softhand.numerics.linear import least_norm
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.references.reference import Desired

Array = NDArray[np.float64]

INTEGRATORS = {
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "Euler": mujoco.mjtIntegrator.mjINT_EULER,
    "RK4": mujoco.mjtIntegrator.mjINT_RK4,
}

IMPEDANCE = 0.9  # of the contacts at the depth of the start; MuJoCo's default goes from 0.9 to 0.95
IMPRATIO = 100.0  # how much harder friction is than the normal direction
DAMPING_RATIO = 1.0  # of the contacts, as MuJoCo's default

_OBJECT = "object"
_UNUSED = ("ISLAND", "SENSOR", "ACTUATION", "AUTORESET", "EQUALITY", "FRICTIONLOSS", "LIMIT", "SPRING", "DAMPER")
_BAD = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)
_DIFFERENCE = 1e-6  # [m]


class Void(RuntimeError):
    """The comparison is void: the two sides do not do the same."""


class Scene:
    """Hand, object and contacts in MuJoCo, at the start of the grasp.

    Args:
        plant: softhand's hand, object and contacts.
        start: the grasp at rest.
        internal_force: f_N at the start [N], shape (pairs,).
        step: time step [s].
        integrator: a name of `INTEGRATORS`.
        trimmed: switch off the features that the scene does not use.

    Attributes:
        model: MuJoCo's model; velocity k of the hand is velocity k of softhand's.
        data: its data.
        torque: joint torques, a view into `qfrc_applied`, shape (n,).
        seen: what `sense` found, named as in softhand's `Observation`; live views.
        pairs: contacts of each internal force, shape (pairs, 2).
    """

    def __init__(
        self,
        plant: Plant,
        start: State,
        internal_force: ArrayLike,
        step: float,
        integrator: str = "implicitfast",
        trimmed: bool = False,
    ) -> None:
        world = plant.world
        plant.update(start.q, start.v, start.z)
        contacts = plant.contacts.copy()
        self.model = _describe(world, plant.fingertips, contacts["distance"], step, integrator).compile()
        if trimmed:
            self.model.opt.disableflags = sum(_flag(name) for name in _UNUSED)
        self.data = mujoco.MjData(self.model)
        self._n, self._tips = world.n_joints, world.n_tips
        self.pairs = np.array(contact_pairs(self._tips), dtype=np.int64)
        self._start = _start_position(world, start)
        self._set_start(np.zeros(self._n))
        _check_order(self, world)
        for name, pad, contact in zip((tip.name for tip in world.tips), plant.fingertips, contacts, strict=True):
            _match_law(self.model, self.data, name, pad, contact)
        self._set_start(np.zeros(self._n))
        self.torque = self.data.qfrc_applied[: self._n]
        self._take_views(world)
        self._holding = self._find_holding(np.asarray(internal_force, dtype=float))
        self.reset()

    @property
    def holds(self) -> bool:
        """Whether every tip touches the object."""
        return self.data.ncon == self._tips

    def reset(self) -> None:
        """Back to the start, at rest, under the torques that hold it, contact forces solved."""
        self._set_start(self._holding)

    def object_pose(self) -> Array:
        """Position [m] and quaternion (w, x, y, z) of the object, shape (7,). A copy."""
        return self.data.qpos[-7:].copy()

    def check(self) -> None:
        """Raise Void if a contact is lost, or if MuJoCo has started anew after numbers beyond reason."""
        if any(self.data.warning[int(kind)].number for kind in _BAD):
            raise Void(f"diverges before {1e3 * self.data.time:.3g} ms")
        if not self.holds:
            raise Void(f"a contact is lost at {1e3 * self.data.time:.3g} ms, {self.data.ncon} of {self._tips} remain")

    def check_views(self) -> None:
        """Raise Void if MuJoCo has moved the arrays that `sense` and `control` read."""
        live = (self.data.contact.pos, self.data.contact.frame, self.data.efc_force)
        if any(a.ctypes.data != b.ctypes.data for a, b in zip(live, self._views[:3], strict=True)):
            raise Void("MuJoCo has moved its contact arrays")

    def sense(self) -> SimpleNamespace:
        """Bring `seen` up to date from the last forward pass of MuJoCo. One compiled call."""
        _sense(*self._views, self._record)
        return self.seen

    def control(self, desired: Desired, gains: NDArray[np.void]) -> None:
        """`sense` and the law (59), its torque put in place. One compiled call.

        Args:
            desired: what the reference asks for.
            gains: from `gains_of`, shape (1,).
        """
        _control(*self._views, self._record, desired.coordinates, desired.internal_force, gains, self.torque)

    def apply(self, torque: Array, gains: NDArray[np.void]) -> None:
        """Put a torque in place, cut to the effort limits. One compiled call."""
        _apply(torque, gains, self.torque)

    def _set_start(self, torque: Array) -> None:
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:] = self._start
        self.data.qfrc_applied[: self._n] = torque
        mujoco.mj_forward(self.model, self.data)

    def _take_views(self, world: World) -> None:
        """Arrays that the kernels read. Contacts lie at the start of MuJoCo's arena, so their views stay good."""
        data, body = self.data, self.model.body(_OBJECT).id
        self._views = (
            data.contact.pos, data.contact.frame, data.efc_force, data.xanchor, data.xaxis, data.xpos[body],
            data.xmat[body], data.qvel, data.qfrc_bias, _chains(world), self.pairs,
        )  # fmt: skip
        self._record = np.zeros(1, _seen_type(self._tips, self._n, len(self.pairs)))
        self.seen = SimpleNamespace(**{name: self._record[name][0] for name in self._record.dtype.names})

    def _find_holding(self, internal_force: Array) -> Array:
        """Torques of (59) at rest: the internal force of the start and the least-norm share of the object's weight."""
        seen = self.sense()
        f_C = np.linalg.pinv(seen.J_O_f.T) @ seen.N_O + seen.K @ internal_force
        return seen.J_CF_f.T @ f_C + seen.N_F


def gains_of(
    K_O: ArrayLike, K_v: ArrayLike, K_N: ArrayLike, effort_limit: ArrayLike, compensate: bool
) -> NDArray[np.void]:
    """Gains of (59), one row, for `Scene.control`."""
    values = {"K_O": K_O, "K_v": K_v, "K_N": K_N, "effort_limit": effort_limit, "compensate": float(compensate)}
    arrays = {name: np.asarray(value, dtype=float) for name, value in values.items()}
    gains = np.zeros(1, [(name, np.float64, value.shape) for name, value in arrays.items()])
    for name, value in arrays.items():
        gains[name][0] = value
    return gains


def describe_settings(model: mujoco.MjModel) -> dict[str, Any]:
    """What was chosen for MuJoCo, as plain data."""
    return {
        "cone": "elliptic", "condim": 4, "impratio": float(model.opt.impratio), "solver": "Newton",
        "tolerance": float(model.opt.tolerance), "friction": model.pair_friction[:, :3].tolist(),
        "solref": model.pair_solref.tolist(), "solimp": model.pair_solimp.tolist(),
        "disabled": [name for name in _UNUSED if model.opt.disableflags & _flag(name)],
    }  # fmt: skip


def _flag(name: str) -> int:
    """The bit that switches a feature off."""
    return int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}"))


# The scene -----------------------------------------------------------------------------------------------------------


def _describe(
    world: World, fingertips: tuple[Fingertip, ...], distances: Array, step: float, integrator: str
) -> mujoco.MjSpec:
    """The scene as MuJoCo's editable description."""
    spec = mujoco.MjSpec()
    option = spec.option
    option.timestep, option.integrator, option.gravity = step, INTEGRATORS[integrator], world.model.gravity.linear
    option.cone, option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, IMPRATIO
    bodies = _add_bodies(spec, world)
    _add_object(bodies[world.object_joint], world)
    for tip, fingertip, distance in zip(world.tips, fingertips, distances, strict=True):
        bodies[tip.joint].add_geom(
            name=tip.name, type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[fingertip.law.radius, 0.0, 0.0], pos=tip.position,
            mass=0.0, contype=0, conaffinity=0,
        )  # fmt: skip
        sliding, torsional = fingertip.friction, _torsional_friction(fingertip, float(distance))
        spec.add_pair(
            name=tip.name, geomname1=tip.name, geomname2=_OBJECT, condim=4,
            friction=[sliding, sliding, torsional, 0.0, 0.0],
        )  # fmt: skip
    return spec


def _add_bodies(spec: mujoco.MjSpec, world: World) -> list[mujoco.MjsBody]:
    """One body a joint, from Pinocchio's placements, axes and inertias."""
    model = world.model
    data = model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    bodies = [spec.worldbody]
    for joint in range(1, model.njoints):
        placement, inertia = model.jointPlacements[joint], model.inertias[joint]
        is_object = joint == world.object_joint
        body = bodies[model.parents[joint]].add_body(
            name=_OBJECT if is_object else model.names[joint], pos=placement.translation, quat=_wxyz(placement.rotation)
        )
        I = inertia.inertia  # noqa: E741  about the centre of mass
        body.explicitinertial, body.mass, body.ipos = True, inertia.mass, inertia.lever
        body.fullinertia = [I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]]
        if is_object:
            body.add_freejoint()
        else:
            twist = pin.getJointJacobian(model, data, joint, pin.LOCAL)[:, model.joints[joint].idx_v]
            if not np.any(twist[3:]):
                raise NotImplementedError(f"joint '{model.names[joint]}' slides; the benchmark knows hinges only.")
            body.add_joint(name=model.names[joint], type=mujoco.mjtJoint.mjJNT_HINGE, axis=twist[3:])
        bodies.append(body)
    return bodies


def _add_object(body: mujoco.MjsBody, world: World) -> None:
    """The box of the object from its faces, which come as opposite pairs along three axes."""
    up, down = world.faces[0::2], world.faces[1::2]
    axes = np.column_stack([face.normal for face in up])
    half = [0.5 * (a.offset + b.offset) for a, b in zip(up, down, strict=True)]
    centre = axes @ [0.5 * (a.offset - b.offset) for a, b in zip(up, down, strict=True)]
    if np.linalg.det(axes) < 0.0:
        raise NotImplementedError("faces of the object in an order that makes no right-handed frame")
    body.add_geom(
        name=_OBJECT, type=mujoco.mjtGeom.mjGEOM_BOX, size=half, pos=centre, quat=_wxyz(axes), mass=0.0,
        contype=0, conaffinity=0,
    )  # fmt: skip


def _torsional_friction(fingertip: Fingertip, distance: float) -> float:
    """tau_max / N [m] of the pressure of the paper's law, for pure spin, at R = `distance`."""
    r = fingertip.law.radius
    c = distance / r
    s = math.sqrt(1.0 - c * c)
    moment = math.pi * fingertip.friction * r**3 * c * (math.acos(c) + c * s - 2.0 * c * math.atanh(s))
    return moment / (math.pi * (r - distance) ** 2)


def _match_law(model: mujoco.MjModel, data: mujoco.MjData, name: str, fingertip: Fingertip, contact: np.void) -> None:
    """Set a pair so that its normal force and stiffness at the depth of the start are those of the law.

    At rest MuJoCo's normal force is F = K d dr / R, R = (1 - d) A / d, with d growing linearly with dr. So

        d log F / d log dr = 1 + (2 - d) / (1 - d) d log d / d log dr

    gives the slope of d, and F gives K. A comes from a forward pass with any settings.
    """
    pair, row = model.pair(name).id, data.contact.efc_address[_contact_of(model, data, name)]
    dr, force, stiffness = float(contact["deformation"][0]), *_normal_law(fingertip, contact)
    slope = (stiffness * dr / force - 1.0) * (1.0 - IMPEDANCE) / (2.0 - IMPEDANCE)
    lowest, highest = IMPEDANCE * (1.0 - slope), IMPEDANCE * (1.0 + slope)
    d = data.efc_KBIP[row, 2]
    A = data.efc_R[row] * d / (1.0 - d)
    K = force / dr * A * (1.0 - IMPEDANCE) / IMPEDANCE**2
    model.pair_solimp[pair] = lowest, highest, 2.0 * dr, 0.5, 1.0
    model.pair_solref[pair] = -K * highest**2, -2.0 * DAMPING_RATIO * math.sqrt(K) * highest


def _normal_law(fingertip: Fingertip, contact: np.void) -> tuple[float, float]:
    """Fr [N] of the law at a contact, and its derivative by dr [N/m]."""
    deformation, Phi = contact["deformation"].copy(), float(contact["angles"][1])
    force = fingertip.law(deformation, Phi)[0]
    shift = np.array([_DIFFERENCE, 0.0, 0.0, 0.0])
    upper, lower = (fingertip.law(deformation + sign * shift, Phi)[0] for sign in (1.0, -1.0))
    return float(force), float(upper - lower) / (2.0 * _DIFFERENCE)


def _start_position(world: World, start: State) -> Array:
    """Configuration in MuJoCo's coordinates: one number a joint, then position and quaternion (w, x, y, z)."""
    hand = [
        start.q[i] if kind == ADDITIVE else math.atan2(start.q[i + 1], start.q[i]) for kind, i, _ in world.joints[:-1]
    ]
    return np.concatenate([hand, start.q[-7:-4], start.q[[-1, -4, -3, -2]]])


def _check_order(scene: Scene, world: World) -> None:
    """Joints, contacts and rows of the contact forces are in softhand's order."""
    model, data = scene.model, scene.data
    joints = [model.joint(k).name for k in range(world.n_joints)]
    scene_holds = scene.holds and [model.geom(k).name for k in data.contact.geom[:, 0]] == [t.name for t in world.tips]
    if joints != list(world.joint_names) or not scene_holds:
        raise Void("MuJoCo has other joints or contacts at the start than softhand.")
    if list(data.contact.efc_address) != list(range(0, 4 * world.n_tips, 4)):
        raise Void("MuJoCo lays out its contact forces differently.")


def _chains(world: World) -> NDArray[np.int64]:
    """Joints that move each tip, padded with -1, shape (nc, longest chain)."""
    chains = np.full((world.n_tips, max(len(tip.columns) for tip in world.tips)), -1, dtype=np.int64)
    for chain, tip in zip(chains, world.tips, strict=True):
        chain[: len(tip.columns)] = tip.columns
    return chains


def _contact_of(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> int:
    return list(data.contact.geom[:, 0]).index(model.geom(name).id)


def _wxyz(rotation: Array) -> Array:
    return pin.Quaternion(np.asarray(rotation)).coeffs()[[3, 0, 1, 2]]


# The law on MuJoCo's data --------------------------------------------------------------------------------------------


def _seen_type(nc: int, n: int, pairs: int) -> np.dtype[np.void]:
    """One row with all that the law needs; one argument of a kernel instead of eleven."""
    shapes = {
        "J_CF_f": (3 * nc, n), "J_CF_tau": (nc, n), "J_O_f": (3 * nc, 6), "J_O_tau": (nc, 6), "K": (3 * nc, pairs),
        "contact_force": (nc, 4), "internal_force": (pairs,), "q_O": (6,), "N_F": (n,), "N_O": (6,),
        "joint_velocity": (n,),
    }  # fmt: skip
    return np.dtype([(name, np.float64, shape) for name, shape in shapes.items()])


@compiled
def _control(
    point, frame, force, anchor, axis, origin, xmat, qvel, bias, chains, pairs, record, q_Od, f_Nd, gains, torque
):  # fmt: skip
    _sense(point, frame, force, anchor, axis, origin, xmat, qvel, bias, chains, pairs, record)
    _regulate(record[0], q_Od, f_Nd, gains[0], torque)


@compiled
def _sense(point, frame, force, anchor, axis, origin, xmat, qvel, bias, chains, pairs, record):
    """What the law needs, in frames as softhand's: x and y of a contact are MuJoCo's tangents, z is its normal.

    Args:
        point: contact points, shape (nc, 3).
        frame: normal from tip to object, first and second tangent, shape (nc, 9).
        force: on the object along them, then the torsion moment, shape (4 nc,).
        anchor: a point of each joint axis, shape (joints, 3).
        axis: its direction, shape (joints, 3).
        origin: of the object frame, shape (3,).
        xmat: axes of the object frame by rows, shape (9,).
        qvel: velocity, shape (nv,).
        bias: Coriolis, centrifugal and gravity terms, shape (nv,).
        chains: joints that move each tip, padded with -1, shape (nc, longest chain).
        pairs: contacts of each internal force, shape (pairs, 2).
        record: set, shape (1,).
    """
    seen = record[0]
    n = seen.N_F.shape[0]
    for k in range(n):
        seen.N_F[k], seen.joint_velocity[k] = bias[k], qvel[k]
    roll, pitch, yaw = math.atan2(xmat[7], xmat[8]), math.asin(-xmat[6]), math.atan2(xmat[3], xmat[0])
    for k in range(3):
        seen.q_O[k] = origin[k]
    seen.q_O[3], seen.q_O[4], seen.q_O[5] = roll, pitch, yaw
    # angular velocity = T (roll', pitch', yaw')
    T = np.zeros((3, 3))
    T[0, 0], T[1, 0], T[2, 0] = math.cos(yaw) * math.cos(pitch), math.sin(yaw) * math.cos(pitch), -math.sin(pitch)
    T[0, 1], T[1, 1], T[2, 2] = -math.sin(yaw), math.cos(yaw), 1.0
    for k in range(3):
        seen.N_O[k], seen.N_O[3 + k] = bias[n + k], 0.0
        for row in range(3):
            moment = 0.0
            for c in range(3):
                moment += xmat[3 * row + c] * bias[n + 3 + c]
            seen.N_O[3 + k] += T[row, k] * moment
    for i in range(point.shape[0]):
        _sense_contact(i, point[i], frame[i], force, anchor, axis, origin, T, chains[i], seen)
    _sense_internal_forces(point, frame, pairs, seen)


@compiled
def _sense_contact(i, point, frame, force, anchor, axis, origin, T, chain, seen):
    """Force and Jacobian rows of contact i."""
    for row in range(3):
        seen.contact_force[i, row] = force[4 * i + (row + 1) % 3]
    seen.contact_force[i, 3] = force[4 * i + 3]
    for k in range(chain.shape[0]):
        joint = chain[k]
        if joint < 0:
            break
        wx, wy, wz = axis[joint, 0], axis[joint, 1], axis[joint, 2]
        ax, ay, az = point[0] - anchor[joint, 0], point[1] - anchor[joint, 1], point[2] - anchor[joint, 2]
        vx, vy, vz = wy * az - wz * ay, wz * ax - wx * az, wx * ay - wy * ax
        for row in range(3):
            c = 3 * ((row + 1) % 3)
            seen.J_CF_f[3 * i + row, joint] = frame[c] * vx + frame[c + 1] * vy + frame[c + 2] * vz
        seen.J_CF_tau[i, joint] = frame[0] * wx + frame[1] * wy + frame[2] * wz
    ax, ay, az = point[0] - origin[0], point[1] - origin[1], point[2] - origin[2]
    for k in range(3):
        wx, wy, wz = T[0, k], T[1, k], T[2, k]
        vx, vy, vz = wy * az - wz * ay, wz * ax - wx * az, wx * ay - wy * ax
        for row in range(3):
            c = 3 * ((row + 1) % 3)
            seen.J_O_f[3 * i + row, k] = frame[c + k]
            seen.J_O_f[3 * i + row, 3 + k] = frame[c] * vx + frame[c + 1] * vy + frame[c + 2] * vz
        seen.J_O_tau[i, 3 + k] = frame[0] * wx + frame[1] * wy + frame[2] * wz


@compiled
def _sense_internal_forces(point, frame, pairs, seen):
    """K of (58) and f_N = K^+ f_C."""
    for k in range(pairs.shape[0]):
        i, j = pairs[k, 0], pairs[k, 1]
        x, y, z = point[j, 0] - point[i, 0], point[j, 1] - point[i, 1], point[j, 2] - point[i, 2]
        scale = 1.0 / math.sqrt(x * x + y * y + z * z)
        for row in range(3):
            c = 3 * ((row + 1) % 3)
            seen.K[3 * i + row, k] = scale * (frame[i, c] * x + frame[i, c + 1] * y + frame[i, c + 2] * z)
            seen.K[3 * j + row, k] = -scale * (frame[j, c] * x + frame[j, c + 1] * y + frame[j, c + 2] * z)
    f_C = np.empty(3 * point.shape[0])
    for i in range(point.shape[0]):
        for row in range(3):
            f_C[3 * i + row] = seen.contact_force[i, row]
    least_norm(seen.K, False, f_C, seen.internal_force)


@compiled
def _regulate(seen, q_Od, f_Nd, gains, torque):
    """The law (59), cut to the effort limits."""
    nc, rows = seen.J_CF_tau.shape[0], seen.J_CF_f.shape[0]
    wrench, f_C = np.empty(6), np.empty(rows)
    for k in range(6):
        wrench[k] = seen.N_O[k] - gains.K_O[k] * (seen.q_O[k] - q_Od[k])
        for i in range(nc):
            wrench[k] -= gains.compensate * seen.J_O_tau[i, k] * seen.contact_force[i, 3]
    least_norm(seen.J_O_f, True, wrench, f_C)
    for k in range(seen.K.shape[1]):
        internal = seen.internal_force[k] - gains.K_N[k] * (seen.internal_force[k] - f_Nd[k])
        for row in range(rows):
            f_C[row] += seen.K[row, k] * internal
    for j in range(torque.shape[0]):
        value = seen.N_F[j] - gains.K_v[j] * seen.joint_velocity[j]
        for row in range(rows):
            value += seen.J_CF_f[row, j] * f_C[row]
        for i in range(nc):
            value += gains.compensate * seen.J_CF_tau[i, j] * seen.contact_force[i, 3]
        torque[j] = value
    _limit(torque, gains.effort_limit)


@compiled
def _apply(torque, gains, out):
    for k in range(out.shape[0]):
        out[k] = torque[k]
    _limit(out, gains[0].effort_limit)


@compiled
def _limit(torque, effort_limit):
    """Cut to the effort limits."""
    for k in range(torque.shape[0]):
        torque[k] = min(max(torque[k], -effort_limit[k]), effort_limit[k])
