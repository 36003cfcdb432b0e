"""Which settings of a controller carry stiffness and damping at the object, and damping at the joints."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from softhand.controllers.computed_torque import ComputedTorque
from softhand.controllers.controller import Controller
from softhand.controllers.object_impedance import ObjectImpedance
from softhand.controllers.regulation import Regulation
from softhand.design.effective import Effective
from softhand.errors import ScenarioError
from softhand.numerics.arrays import Array
from softhand.plugins import plugin_name

NAMES = ("regulation", "object-impedance", "computed-torque")


class Knobs(NamedTuple):
    """What a search turns."""

    stiffness: Array
    """Of the object along and about its axes [N/m, N m/rad], shape (6,)."""
    damping: Array
    """Likewise [N s/m, N m s/rad]; without effect on `regulation`."""
    joint_damping: float
    """Of all joints [N m s/rad, N s/m]."""
    force: float
    """K_N of `regulation`."""


def first_knobs(controller: Controller, felt: Effective, omega: float, zeta: float) -> Knobs:
    """Those of the object as one mass, K = omega^2 M, damped by the joints.

    Damping at the object, of object impedance and computed torque, comes to it through soft tips and a period late:
    with all of it the tips vibrate. A twentieth is where the search begins.
    """
    inertia, rate = np.diag(felt.inertia), 2.0 * zeta * omega
    share = 0.0 if isinstance(controller, Regulation) else 0.05
    return Knobs(omega**2 * inertia, share * rate * inertia, felt.joint_damping(rate), 1.0)


def with_knobs(controller: Controller, felt: Effective, knobs: Knobs) -> Controller:
    """The controller with these gains; all else of it stays.

    Raises:
        ScenarioError: it is none of `NAMES`.
    """
    K, D, inertia = knobs.stiffness, knobs.damping, np.diag(felt.inertia)
    joints = {"K_v": float(f"{knobs.joint_damping:.3g}")}
    if isinstance(controller, Regulation):
        return controller.model_copy(update={**_pose("K_O", K), "K_N": float(f"{knobs.force:.3g}"), **joints})
    if isinstance(controller, ObjectImpedance):
        more = {**_pose("M", inertia), **_pose("D", D), **_pose("K", K)}
        return controller.model_copy(update={**more, **joints})
    if isinstance(controller, ComputedTorque):
        return controller.model_copy(update={**_pose("K_p", K / inertia), **_pose("K_d", D / inertia), **joints})
    raise not_known(plugin_name("controllers", type(controller)))


def not_known(name: str) -> ScenarioError:
    """Why a controller has no gains of this kind."""
    return ScenarioError(
        f"controller.name: the gains of {name!r} cannot be designed by bandwidth; there are: {', '.join(NAMES)}; "
        "design_lqr finds a state feedback.",
        key="controller.name", value=name,
    )  # fmt: skip


def _pose(key: str, values: Array) -> dict[str, tuple[float, ...]]:
    return {f"{key}_position": _rounded(values[:3]), f"{key}_orientation": _rounded(values[3:])}


def _rounded(values: Array) -> tuple[float, ...]:
    """To three digits, as one would write them."""
    return tuple(float(f"{value:.3g}") for value in values)
