"""What a fingertip law is: deformation in, force out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from math import cos, pi, sin
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numba import carray, cfunc, float64, types
from numba.np.unsafe.ndarray import to_fixed_tuple
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from softhand.dampings.damping import Damping
from softhand.errors import LawError
from softhand.laws.formula import check_formulas, uncompilable
from softhand.laws.key import make_compilable
from softhand.laws.rolling import compile_bend, compile_slope
from softhand.numerics.compiled import kernel_folder
from softhand.settings.settings import Settings

LEADING = {
    "polar": ("dr", "dtheta", "dphi", "dpsi", "phi"),
    "surface": ("dr", "s1", "s2", "psi", "lean1", "lean2"),
}
"""Arguments of a formula before the fields of its law, by the coordinates of the law."""

_DIFFERENCE = 1e-6
"""Relative step of the central differences that stand in for a missing `stiffness`."""


class Law(Settings):
    """Force of a soft hemispherical tip against its deformation.

    A subclass lists its parameters as fields and writes `force` as plain scalar Python (the `math` module, no arrays):
    it is compiled as it stands. `stiffness`, the derivatives, is optional: without it central differences are taken.
    A law chooses one of two sets of coordinates:

    `polar`, the paper's: the deformation is (dr, dtheta, dphi, dpsi), the force (Fr, Ftheta, Fphi, Fpsi); singular at
    the apex, Phi = 90 deg.

    `surface`: the deformation is (dr, s1, s2, psi), s1 and s2 the tangential displacement of the tip's material over
    the object along two axes that are fixed in the face, psi the twist about the outward normal of the tip. The force
    on the object is (f_n, f_1, f_2, tau) along the same directions. Nothing is singular.
    """

    radius: Annotated[float, Field(gt=0, le=1)]  # mm in the place of m are refused
    """Radius r of the undeformed hemisphere [m]."""

    coordinates: ClassVar[Literal["polar", "surface"]] = "polar"

    force: ClassVar[Callable[..., tuple[float, float, float, float]]]
    """Static method, force from deformation. Arguments in this order, SI units:

    polar: dr, dtheta, dphi, dpsi (radial compression [m], the two tangential angles and the torsion [rad]), phi
    (undeformed contact angle, Phi + dphi [rad]). Returns Fr [N], which pushes the object away from the tip, and the
    moments Ftheta, Fphi, Fpsi [N m].

    surface: dr, s1, s2 [m], psi [rad], then lean1, lean2: the components of x_F, the axis of the tip, along the two
    axes of the face, of length cos Phi. Returns f_n [N], which pushes the object away from the tip, f_1, f_2 [N] and
    tau [N m]; each has the sign of its displacement.

    Then the fields of the law in the order of their declaration, `radius` first, or what `parameters` has in their
    place."""

    torsion_share: ClassVar[float | None] = None
    """kappa of the largest torsion kappa mu f_z a, a = sqrt(r dr) as in a half-space: mean distance of the pressure
    from the middle over a; None for the pressure of columns. The exact limit surface takes the shape of the pressure
    from it as well, see `contact.limit.set_limit`."""

    stiffness: ClassVar[Callable[..., tuple[float, ...]] | None] = None
    """Optional static method with the arguments of `force`: the 16 derivatives of the four forces by the four
    deformations at fixed Phi, row by row. In polar coordinates phi = Phi + dphi, so that the column of dphi includes
    the derivative with respect to phi."""

    energy: ClassVar[Callable[..., float] | None] = None
    """Optional static method with the arguments of `force`: the energy [J] of which the force is the derivative, for
    laws that have one."""

    moment: ClassVar[Callable[..., tuple[float, float]] | None] = None
    """Optional static method with the arguments of `force`, for surface coordinates: what a tip that rolls has to pay,
    the moments m_1, m_2 [N m] on the object about the first and the second axis of the face. With the energy U of the
    law, its slopes U_1 = dU/dlean1, U_2 = dU/dlean2 and l3 = sqrt(1 - lean1^2 - lean2^2) they are

        m_1 = -U_2 l3,   m_2 = U_1 l3

    The third moment, m_3 = U_2 lean1 - U_1 lean2 about the normal, follows from these, as m is at a right angle to
    x_F: the contact adds it, and `force` returns as tau what belongs to the twist alone, dU/dpsi. Without `moment` a
    contact transmits none, as is right where U does not depend on the lean."""

    damping: ClassVar[Damping] = Damping()
    """What holds where a scenario names no damping."""

    deepest: ClassVar[float] = 1.0
    """dr / r up to which the law is meant to hold. A run goes on beyond, and its recording says so."""

    Phi_range: ClassVar[tuple[float, float]] = (0.0, 90.0)
    """Angles Phi [deg] for which the law is meant to hold; likewise."""

    def parameters(self) -> NDArray[np.float64]:
        """What `force` takes behind the deformation: the fields in their order, where a law says nothing else."""
        return np.array([float(value) for value in self.__dict__.values()])

    @classmethod
    def parameter_names(cls) -> tuple[str, ...]:
        """Of what `parameters` gives, `radius` first."""
        return tuple(cls.model_fields)

    def arguments(self, deformation: ArrayLike, contact_angle: float, bearing: float = 0.5 * pi) -> NDArray[np.float64]:
        """What `force`, `stiffness`, `energy` and `moment` take, at one deformation; as `__call__`."""
        values = [float(value) for value in np.asarray(deformation)]
        if self.coordinates == "polar":
            return np.array([*values, contact_angle + values[2], *self.parameters()])
        lean = cos(contact_angle)
        return np.array([*values, lean * cos(bearing), lean * sin(bearing), *self.parameters()])

    def __call__(self, deformation: ArrayLike, contact_angle: float, bearing: float = 0.5 * pi) -> NDArray[np.float64]:
        """The force at one deformation.

        Args:
            deformation: (dr, dtheta, dphi, dpsi) [m, rad, rad, rad] or (dr, s1, s2, psi) [m, m, m, rad], by the
                coordinates of the law, shape (4,).
            contact_angle: Phi of the deformed tip [rad]; a polar law is given phi = Phi + dphi.
            bearing: of the tip's axis in the face, counted from the first axis [rad]; for surface coordinates only.
                With the default, s1 and s2 lie along growing Theta and Phi.

        Returns:
            (Fr [N], Ftheta, Fphi, Fpsi [N m]) or (f_n, f_1, f_2 [N], tau [N m]), shape (4,).
        """
        return np.array(self.force(*self.arguments(deformation, contact_angle, bearing)))


@dataclass(frozen=True)
class CompiledLaw:
    """Machine code of a law: what the contact kernel calls. Holds the code alive."""

    force: Any
    stiffness: Any
    parameters: NDArray[np.float64]
    slope: Any = None
    """Of the energy by the lean; None for a law without `moment`, see `laws.rolling`."""
    bend: Any = None
    """Its derivatives by the lean; likewise."""


def compile_like(law: Law, known: Mapping[Law, CompiledLaw]) -> CompiledLaw:
    """As `compile_law`; quickly if a law of the same class with any coefficients is known.

    Raises:
        LawError: as `compile_law`.
    """
    for other, code in known.items():
        if type(other) is type(law):
            return replace(code, parameters=law.parameters())
    return compile_law(law)


def compile_law(law: Law) -> CompiledLaw:
    """Compile `force`, `stiffness` and `moment` of a law (kept on disk, so that this is slow only once).

    Raises:
        LawError: the formula uses what numba cannot compile, takes other arguments than the law has fields, or does
            not return four (sixteen, two) numbers; or a law in polar coordinates has a moment.
    """
    check_law(law)
    parameters = law.parameters()
    n_arguments = len(LEADING[law.coordinates]) + len(parameters)
    try:
        force = _compile_formula(law.force, *make_compilable(law.force), n_arguments, 4)
        if law.stiffness is None:
            is_polar = law.coordinates == "polar"
            stiffness = _compile_differences(law.force, *make_compilable(law.force), n_arguments, is_polar)
        else:
            stiffness = _compile_formula(law.stiffness, *make_compilable(law.stiffness), n_arguments, 16)
        slope, bend = None, None
        if law.moment is not None:
            own = law.moment, *make_compilable(law.moment), n_arguments
            slope, bend = compile_slope(*own), compile_bend(*own)
    except Exception as error:  # numba raises of many kinds
        raise uncompilable(law, error) from error
    return CompiledLaw(force, stiffness, parameters, slope, bend)


def check_law(law: Law) -> None:
    """Refuse a law whose formulas cannot be used, before anything is done with it.

    Raises:
        LawError: as `compile_law`; but what only the compiler refuses is not found.
    """
    name = type(law).__name__
    if law.coordinates not in LEADING:
        raise LawError(f"law '{name}': its coordinates {law.coordinates!r} are none of {', '.join(LEADING)}.", law=name)
    try:
        _check_once(law, getattr(law, "force", None), law.stiffness, law.moment)
    except TypeError:  # a law with a list among its fields, which nothing can be kept by
        check_formulas(law, LEADING[law.coordinates])


@lru_cache(256)
def _check_once(law: Law, *_formulas: Any) -> None:
    """The check takes some milliseconds, and thousands of runs may have the same law."""
    check_formulas(law, LEADING[law.coordinates])


_SIGNATURE = types.void(types.CPointer(float64), types.CPointer(float64))
_KEPT = 64  # formulas in memory


@lru_cache(_KEPT)
def _compile_formula(
    formula: Callable[..., Any], source: str, has_module: bool, n_arguments: int, n_results: int
) -> Any:
    def entry(arguments, results):
        source  # noqa: B018  a change of the formula changes this closure, and with it the key on disk
        values = formula(*to_fixed_tuple(carray(arguments, n_arguments), n_arguments))  # type: ignore[call-arg]
        for k in range(n_results):
            results[k] = values[k]

    with kernel_folder(__name__):
        return cfunc(_SIGNATURE, cache=has_module, error_model="numpy")(entry)


@lru_cache(_KEPT)
def _compile_differences(
    formula: Callable[..., Any], source: str, has_module: bool, n_arguments: int, is_polar: bool
) -> Any:
    """Stiffness by central differences of the force; in polar coordinates phi moves with dphi."""
    n_lengths, n_leading = (1, 5) if is_polar else (3, 6)

    def entry(arguments, results):
        source  # noqa: B018
        x = carray(arguments, n_arguments)
        radius = x[n_leading]
        for j in range(4):
            kept, kept_phi = x[j], x[4]
            step = _DIFFERENCE * (radius if j < n_lengths else 1.0)
            x[j] = kept + step
            if is_polar and j == 2:
                x[4] = kept_phi + step
            upper = formula(*to_fixed_tuple(x, n_arguments))  # type: ignore[call-arg]
            x[j] = kept - step
            if is_polar and j == 2:
                x[4] = kept_phi - step
            lower = formula(*to_fixed_tuple(x, n_arguments))
            x[j], x[4] = kept, kept_phi
            for i in range(4):
                results[4 * i + j] = (upper[i] - lower[i]) / (2.0 * step)

    with kernel_folder(__name__):
        return cfunc(_SIGNATURE, cache=has_module, error_model="numpy")(entry)
