"""What a controller sees: everything about the grasp at one instant, as plain numbers by name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softhand.contact.pads import Fingertip
from softhand.numerics.arrays import Array
from softhand.numerics.rotations import rates_to_turning
from softhand.numerics.spatial import cross_matrix
from softhand.references.reference import Desired
from softhand.sensing.fields import ALIASES, FIELDS, SPANS, fields
from softhand.sensing.known import Known
from softhand.settings.guesses import did_you_mean


class Observation:
    """The grasp at one instant. SI units; world axes unless said otherwise.

    What a controller is handed is the measurement of now: its arrays can be read, not written, and the next control
    period overwrites them. `copy` gives one of one's own, to keep, delay or disturb: its fields can be written, or
    set, `mine.object_position = ...`, and a controller answers to what is in it.

    n joints, nc contacts of fingertips, ns supports, np = nc (nc - 1) / 2 pairs of contacts. Recordings call the same
    things by the same names. The letters of the paper are there as second names: q_O, T_O, eta, K, f_N, N_F, J_CF_f ...
    """

    time: float
    """Time since the start of the run [s]."""
    clock: Array
    """The time since the start of the run, as compiled laws read it [s], shape (1,)."""
    configuration: Array
    """q of the rigid-body model, as in `State`, shape (nq,)."""
    joint_position: Array
    """q_F, joint angles [rad], travel of slides [m], shape (n,)."""
    joint_velocity: Array
    """q_F', velocity of the joints [rad/s, m/s of a slide], shape (n,)."""
    gravity_torque: Array
    """N_F, what holds the hand against gravity [N m, N], shape (n,)."""
    object_position: Array
    """Origin of the object frame, in the world [m], shape (3,)."""
    object_rpy: Array
    """Roll, pitch, yaw of the object [rad], R = R_z(yaw) R_y(pitch) R_x(roll), shape (3,)."""
    object_coordinates: Array
    """q_O, position and roll, pitch, yaw together, shape (6,)."""
    object_rotation: Array
    """Axes of the object frame as columns, in the world, shape (3, 3)."""
    object_twist: Array
    """Velocity of the origin of the object frame [m/s], then angular velocity [rad/s], world axes, shape (6,)."""
    object_gravity: Array
    """Force [N], and moment about the origin of the object frame [N m], that hold the object, shape (6,)."""
    coordinate_map: Array
    """T_O, object_twist = T_O q_O', shape (6, 6); singular at pitch 90 deg."""
    N_O: Array
    """T_O^T object_gravity: gravity terms of the object in the coordinates q_O, shape (6,)."""
    tip_position: Array
    """Centres of the hemispheres' flat faces, in the world [m], shape (nc, 3)."""
    tip_rotation: Array
    """Axes of the finger frames F as columns, in the world, shape (nc, 3, 3)."""
    tip_jacobian: Array
    """J_i, from q_F' to the velocity of `tip_position`, world axes, shape (nc, 3, n)."""
    tip_angular_jacobian: Array
    """From q_F' to the angular velocity of the tips, world axes, shape (nc, 3, n)."""
    contact_point: Array
    """Contact points, in the world [m], shape (nc, 3)."""
    contact_rotation: Array
    """Axes of the contact frames C_F (x_C, y_C, outward normal of the tip) in the world, shape (nc, 3, 3)."""
    contact_force: Array
    """f_x, f_y, f_z [N] and tau [N m] on the object, in C_F, shape (nc, 4)."""
    contact_moment: Array
    """Moments about x_C, y_C, z_C on the object beside `contact_force` [N m], shape (nc, 3) or (0, 3).
    Of laws that have a `moment`, none if no law of a tip has one; NaN under [sensing], as nothing measures them."""
    contact_angles: Array
    """Of the contact on the tip, in F: Theta in (-pi, pi], Phi in [-pi/2, pi/2] [rad], shape (nc, 2)."""
    contact_coordinates: Array
    """eta: theta, phi [rad], alpha_o [m or rad] (two), psi [rad] of each contact, shape (nc, 5).
    theta - dtheta and psi + dpsi are in (-pi, pi]; so are angles about the axis of a curved object. In a recording they
    go on beyond that, without jumps."""
    contact_coordinates_rate: Array
    """eta' by (38)-(41), with the sign of (39) mended, in slip at the mean slip of the last step, shape (nc, 5)."""
    contact_feature: Array
    """1 over a face of the object or a curved surface, 2 over an edge, 3 over a vertex, shape (nc,)."""
    deformation: Array
    """dr [m], dtheta, dphi, dpsi [rad], or dr, s1, s2 [m], psi [rad] under a law in surface coordinates, (nc, 4).
    A recording has the angles s / R in place of s."""
    deformation_rate: Array
    """Rate of `deformation`, in slip at the mean slip of the last step, shape (nc, 4)."""
    friction_use: Array
    """|f_t| / (mu f_z), 1 at the edge of the friction cone, shape (nc,)."""
    limit_surface_use: Array
    """`friction_use` with torsion, sqrt{(|f_t| / (mu f_z))^2 + (tau / tau_max)^2}, shape (nc,)."""
    is_slipping: Array
    """1 where the last step slipped, shape (nc,)."""
    slip_travel: Array
    """Way that each tip has slipped since the start [m], shape (nc,)."""
    slip_twist: Array
    """Angle that each tip has slipped about its normal [rad], shape (nc,)."""
    slip_loss: Array
    """Work that the slip of each tip has lost [J], shape (nc,)."""
    slipped_share: Array
    """Share of the area of each contact that is at its limit, shape (nc,), or (0,) where all slip as a whole.
    See `contact.elements`; 0 or 1 of a contact that slips as a whole."""
    element_deformation: Array
    """`deformation` of each element without dr, zeros behind the last one of a contact, shape (nc, elements, 3);
    (nc, 0, 3) where all slip as a whole."""
    element_force: Array
    """`contact_force` if all of the contact were like an element; that is their mean, shape (nc, elements, 4)."""
    support_force: Array
    """As `contact_force`, of the supports, shape (ns, 4)."""
    support_moment: Array
    """As `contact_moment`, of the supports, shape (ns, 3) or (0, 3)."""
    support_deformation: Array
    """Depth, shear [m] and torsion [rad] of each support, shape (ns, 4)."""
    support_point: Array
    """Where each support touches, or touched last, in the world [m], shape (ns, 3)."""
    support_rotation: Array
    """As `contact_rotation`, of the supports, shape (ns, 3, 3)."""
    support_is_slipping: Array
    """1 where the last step slipped, shape (ns,)."""
    support_slip_loss: Array
    """Work that the slip of each has lost [J], shape (ns,)."""
    tactile_normal_force: Array
    """Normal force of each taxel [N], along z_C, shape (nc, taxels); no taxels without the section [tactile]."""
    tactile_shear_force: Array
    """Shear force of each taxel on the object [N], along x_C and y_C, shape (nc, taxels, 2)."""
    tactile_slip: Array
    """Speed of each taxel over the object, of the slip of the last step [m/s], shape (nc, taxels)."""
    penetration_depth: Array
    """How deep each taxel of the undeformed tip lies below the surface of the object [m], shape (nc, taxels)."""
    internal_force: Array
    """f_N = K^+ f_C, between each pair of contacts [N], shape (np,)."""
    internal_force_basis: Array
    """K of (58): contact forces that add up to nothing, a column for each pair; f_N > 0 squeezes, shape (3 nc, np)."""
    hand_force_jacobian: Array
    """J_CF^f, from q_F' to the velocity of the tips at the contacts in C_F, shape (3 nc, n)."""
    hand_torsion_jacobian: Array
    """J_CF^tau, from q_F' to the spin of the tips about the contact normals, shape (nc, n)."""
    object_force_jacobian: Array
    """From `object_twist` to the velocity of the object at the contacts in C_F, shape (3 nc, 6)."""
    object_torsion_jacobian: Array
    """From `object_twist` to the spin of the object about the contact normals, shape (nc, 6)."""
    J_O_f: Array
    """From q_O', as the paper has it: object_force_jacobian T_O, shape (3 nc, 6)."""
    J_O_tau: Array
    """From q_O': object_torsion_jacobian T_O, shape (nc, 6)."""
    object_position_desired: Array
    """First half of q_Od: the origin of the object frame that is asked for, in the world [m], shape (3,)."""
    object_rpy_desired: Array
    """Second half of q_Od: roll, pitch, yaw that are asked for [rad], shape (3,)."""
    object_coordinates_desired: Array
    """q_Od, position [m] and roll, pitch, yaw [rad] that are asked for, shape (6,)."""
    object_coordinates_rate_desired: Array
    """q_Od' [m/s, rad/s], shape (6,)."""
    object_coordinates_acceleration_desired: Array
    """q_Od'' [m/s^2, rad/s^2], shape (6,)."""
    object_twist_desired: Array
    """Desired `object_twist` [m/s, rad/s], world axes, shape (6,)."""
    object_twist_rate_desired: Array
    """Rate of `object_twist_desired` [m/s^2, rad/s^2], shape (6,)."""
    internal_force_desired: Array
    """f_Nd [N], shape (np,)."""
    opening_desired: Array
    """How far the tips shall stand off [m], shape (1,)."""
    carried_desired: Array
    """Share of the object's weight that the fingers shall carry, shape (1,)."""
    standoff_desired: Array
    """Where the palm shall be, from its place at the object, world axes [m], shape (3,)."""
    standoff_rate_desired: Array
    """Its rate [m/s], shape (3,)."""
    standoff_acceleration_desired: Array
    """Its second derivative [m/s^2], shape (3,)."""

    def __init__(self, known: Known, block: Array, time: float = 0.0, is_live: bool = False) -> None:
        views = fields(block, known.sizes)
        views.clock[0] = time
        self.__dict__.update(_views=views, time=time, known=known)
        if is_live:
            block = _read_only(block)
            views = fields(block, known.sizes)
        self.__dict__.update(views._asdict(), block=block)
        self.__dict__["desired"] = Desired(
            self.object_coordinates_desired,
            self.object_coordinates_rate_desired,
            self.object_coordinates_acceleration_desired,
            self.internal_force_desired,
            self.object_twist_desired,
            self.object_twist_rate_desired,
            self.opening_desired,
            self.carried_desired,
            self.standoff_desired,
            self.standoff_rate_desired,
            self.standoff_acceleration_desired,
        )

    block: Array
    """All fields one behind the other, see `sensing.fields`."""
    _views: Any
    """The same by name, for kernels, which take other machine code for arrays that can only be read."""
    known: Known
    """What is the same at all observations."""
    desired: Desired
    """What the reference asks for now: the fields named `..._desired` as one record."""

    def copy(self) -> Observation:
        """One of one's own, which can be changed."""
        return Observation(self.known, self.block.copy(), self.time)

    def __copy__(self) -> Observation:
        return self.copy()

    def __deepcopy__(self, memo: Any) -> Observation:
        return self.copy()

    def __reduce__(self) -> Any:
        return Observation, (self.known, self.block.copy(), self.time)

    def __setattr__(self, name: str, value: Any) -> None:
        name = ALIASES.get(name, name)
        if name == "time":
            self._must_be_own(name)
            self.__dict__["time"] = self._views.clock[0] = float(value)
        elif name == "desired":
            self._set_desired(value)
        elif name in FIELDS or name in SPANS:
            self._must_be_own(name)
            self.__dict__[name][...] = value
        else:
            hint = did_you_mean(name, [*FIELDS, *SPANS, *ALIASES])
            raise AttributeError(f"an observation has no field {name!r} that can be set{hint}")

    def _must_be_own(self, name: str) -> None:
        if not self.block.flags.writeable:
            raise AttributeError(f"what is observed now can only be read; set {name!r} of observation.copy()")

    def _set_desired(self, desired: Desired) -> None:
        self.object_coordinates_desired = desired.coordinates
        self.object_coordinates_rate_desired = desired.coordinates_rate
        self.object_coordinates_acceleration_desired = desired.coordinates_acceleration
        self.internal_force_desired = desired.internal_force
        self.object_twist_desired, self.object_twist_rate_desired = desired.twist, desired.twist_rate
        self.opening_desired, self.carried_desired = desired.opening, desired.carried
        self.standoff_desired, self.standoff_rate_desired = desired.standoff, desired.standoff_rate
        self.standoff_acceleration_desired = desired.standoff_acceleration

    if TYPE_CHECKING:
        # the letters of the paper; `__getattr__` is not told to editors, or they take any name for a field
        q_F: Array
        """`joint_position`"""
        q_O: Array
        """`object_coordinates`"""
        q_O_rate: Array
        """`object_coordinates_rate`"""
        T_O: Array
        """`coordinate_map`"""
        eta: Array
        """`contact_coordinates`"""
        eta_rate: Array
        """`contact_coordinates_rate`"""
        f_N: Array
        """`internal_force`"""
        K: Array
        """`internal_force_basis`"""
        N_F: Array
        """`gravity_torque`"""
        J_CF: Array
        """`hand_jacobian`"""
        J_CF_f: Array
        """`hand_force_jacobian`"""
        J_CF_tau: Array
        """`hand_torsion_jacobian`"""
        M_F: Array
        """`hand_mass_matrix`"""
        velocity_terms_F: Array
        """`hand_velocity_terms`"""
    else:

        def __getattr__(self, name: str) -> Any:
            if name in ALIASES:
                return getattr(self, ALIASES[name])
            raise AttributeError(f"an observation has no {name!r}{did_you_mean(name, _names())}")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *ALIASES]

    def __repr__(self) -> str:
        return f"<Observation at t = {self.time:g} s: {', '.join(FIELDS)}>"

    @property
    def fingertips(self) -> tuple[Fingertip, ...]:
        """Law, friction and face (in the object frame) of each tip; constants."""
        return self.known.fingertips

    @property
    def tip_names(self) -> tuple[str, ...]:
        """Of the fingertips, in their order; constants."""
        return self.known.tip_names

    @property
    def effort_limit(self) -> Array:
        """Largest torque of each joint [N m, N], shape (n,); a constant."""
        return self.known.effort_limit

    @property
    def is_continuous(self) -> NDArray[np.bool_]:
        """Which joints turn without end, so that their position is known but for whole turns, shape (n,); constants."""
        return self.known.is_continuous

    def joints_from(self, start: Array) -> Array:
        """joint_position - start, of joints that turn without end the shorter way [rad, m], shape (n,).

        Args:
            start: joint positions [rad, m], shape (n,).
        """
        moved = self.joint_position - start
        return np.where(self.is_continuous, np.remainder(moved + np.pi, 2.0 * np.pi) - np.pi, moved)

    @property
    def object_mass(self) -> float:
        """[kg]; a constant."""
        return self.known.object_mass

    @property
    def object_lever(self) -> Array:
        """From the origin of the object frame to the centre of mass, in that frame [m], shape (3,); a constant."""
        return self.known.object_lever

    @property
    def gravity(self) -> Array:
        """[m/s^2], shape (3,); a constant."""
        return self.known.gravity

    @property
    def hand_jacobian(self) -> Array:
        """J_CF, from q_F' to the velocities of the tips at the contacts, four rows a contact, (43), shape (4 nc, n)."""
        return _interleave(self.hand_force_jacobian, self.hand_torsion_jacobian)

    @property
    def grasp_matrix(self) -> Array:
        """G, wrench on the object about its origin = G contact_force.ravel(), shape (6, 4 nc). J_O = G^T T_O.

        Without what laws with a `moment` transmit beside it.
        """
        return _interleave(self.object_force_jacobian, self.object_torsion_jacobian).T

    @property
    def J_O(self) -> Array:
        """From q_O' to the velocities of the object at the contacts, four rows a contact, (43), shape (4 nc, 6)."""
        return _interleave(self.J_O_f, self.J_O_tau)

    @property
    def f_C(self) -> Array:
        """Contact forces without the torsion moments, (49) [N], shape (3 nc,)."""
        return self.contact_force[:, :3].ravel()

    @property
    def tau_C(self) -> Array:
        """Torsion moments, (49) [N m], shape (nc,)."""
        return self.contact_force[:, 3]

    @property
    def object_coordinates_rate(self) -> Array:
        """q_O' [m/s, rad/s], shape (6,)."""
        return np.asarray(np.linalg.solve(self.coordinate_map, self.object_twist))

    @property
    def hand_mass_matrix(self) -> Array:
        """M_F, mass matrix of the hand at `configuration`, shape (n, n)."""
        n = self.known.sizes.n
        return self.known.rigid.mass_matrix(self.configuration)[:n, :n]

    @property
    def object_mass_matrix(self) -> Array:
        """Mass matrix of the object for `object_twist`, shape (6, 6)."""
        n, to_body = self.known.sizes.n, self._to_body
        return to_body.T @ self.known.rigid.mass_matrix(self.configuration)[n:, n:] @ to_body

    @property
    def M_O(self) -> Array:
        """Mass matrix of the object in the coordinates q_O, T_O^T object_mass_matrix T_O, shape (6, 6)."""
        return self.coordinate_map.T @ self.object_mass_matrix @ self.coordinate_map

    @property
    def hand_velocity_terms(self) -> Array:
        """Coriolis and centrifugal terms of the hand, C_F q_F' [N m], shape (n,)."""
        return self._velocity_terms()[: self.known.sizes.n]

    @property
    def object_velocity_terms(self) -> Array:
        """Coriolis and centrifugal terms for `object_twist`: wrench = object_mass_matrix twist' + these, shape (6,)."""
        n, to_body = self.known.sizes.n, self._to_body
        # R^T (v' - w x v) is the acceleration of the body's own velocity
        spun = np.concatenate([cross_matrix(self.object_twist[3:]) @ self.object_twist[:3], np.zeros(3)])
        return to_body.T @ self._velocity_terms()[n:] - self.object_mass_matrix @ spun

    @property
    def velocity_terms_O(self) -> Array:
        """Coriolis and centrifugal terms of the object in the coordinates q_O, C_O q_O', shape (6,)."""
        terms = self.object_velocity_terms + self.object_mass_matrix @ self.coordinate_map_rate_of_coordinates
        return self.coordinate_map.T @ terms

    @property
    def coordinate_map_rate_of_coordinates(self) -> Array:
        """T_O' q_O': the rate of `object_twist` while q_O' stays as it is, shape (6,)."""
        turning = np.zeros(6)
        rates_to_turning(self.object_rpy, self.object_coordinates_rate[3:], np.zeros(3), np.empty(3), turning[3:])
        return turning

    def _velocity_terms(self) -> Array:
        R, twist = self.object_rotation, self.object_twist
        v = np.concatenate([self.joint_velocity, R.T @ twist[:3], R.T @ twist[3:]])
        return self.known.rigid.velocity_terms(self.configuration, v)

    @property
    def _to_body(self) -> Array:
        """Velocity of the object in its own frame from `object_twist`, shape (6, 6)."""
        to_body = np.zeros((6, 6))
        to_body[:3, :3] = to_body[3:, 3:] = self.object_rotation.T
        return to_body


def _names() -> list[str]:
    """All that an observation can be asked for."""
    known = (*Observation.__annotations__, *vars(Observation), *ALIASES)
    return [name for name in known if not name.startswith("_")]


def _read_only(array: Array) -> Array:
    view = array.view()
    view.flags.writeable = False
    return view


def _interleave(force_rows: Array, moment_rows: Array) -> Array:
    nc, columns = moment_rows.shape
    return np.concatenate([force_rows.reshape(nc, 3, columns), moment_rows[:, None, :]], axis=1).reshape(-1, columns)
