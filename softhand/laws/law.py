"""What a fingertip law is: deformation in, force out."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numba import carray, cfunc, float64, njit, types
from numba.core.errors import NumbaError
from numba.extending import register_jitable
from numba.np.unsafe.ndarray import to_fixed_tuple
from numpy.typing import ArrayLike, NDArray

from softhand.compiled import kernel_folder
from softhand.errors import LawError
from softhand.settings import Positive, Settings

N_DEFORMATION = 5
"""dr, dtheta, dphi, dpsi and phi come before the parameters of a law."""

_DIFFERENCE = 1e-6
"""Relative step of the central differences that stand in for a missing `stiffness`."""


class Law(Settings):
    """Deformation force of a soft hemispherical tip, dF = (Fr, Ftheta, Fphi, Fpsi).

    A subclass lists its parameters as fields and writes `force` as plain scalar Python (the `math` module, no arrays):
    it is compiled as it stands. `stiffness`, the derivatives, is optional: without it central differences are taken.

    Attributes:
        radius: radius r of the undeformed hemisphere [m].
    """

    radius: Positive

    force: ClassVar[Callable[..., tuple[float, float, float, float]]]
    """Static method, force from deformation. Arguments in this order, SI units: dr, dtheta, dphi, dpsi (radial
    compression [m], the two tangential angles and the torsion [rad]), phi (undeformed contact angle, Phi + dphi [rad]),
    then the fields of the law in the order of their declaration, `radius` first. Returns Fr [N], which pushes the
    object away from the tip, and the moments Ftheta, Fphi, Fpsi [N m]."""

    stiffness: ClassVar[Callable[..., tuple[float, ...]] | None] = None
    """Optional static method with the arguments of `force`: the 16 values d dF_i / d delta_j at fixed Phi, row by row.
    As phi = Phi + dphi, the column of dphi includes the derivative with respect to phi."""

    def parameters(self) -> NDArray[np.float64]:
        """The fields in the order in which `force` takes them."""
        return np.array([float(value) for value in dict(self).values()])

    def __call__(self, deformation: ArrayLike, contact_angle: float) -> NDArray[np.float64]:
        """dF at one deformation.

        Args:
            deformation: (dr, dtheta, dphi, dpsi) [m, rad, rad, rad], shape (4,).
            contact_angle: Phi of the deformed tip [rad]; the law is given phi = Phi + dphi.

        Returns:
            (Fr [N], Ftheta, Fphi, Fpsi [N m]), shape (4,).
        """
        dr, dtheta, dphi, dpsi = (float(value) for value in np.asarray(deformation))
        return np.array(self.force(dr, dtheta, dphi, dpsi, contact_angle + dphi, *self.parameters()))


@dataclass(frozen=True)
class CompiledLaw:
    """Machine code of a law: what the contact kernel calls. Holds the code alive."""

    force: Any
    stiffness: Any
    parameters: NDArray[np.float64]


def compile_law(law: Law) -> CompiledLaw:
    """Compile `force` and `stiffness` of a law (kept on disk, so that this is slow only once).

    Raises:
        LawError: the formula uses what numba cannot compile, takes other arguments than the law has fields, or does
            not return four (or sixteen) numbers.
    """
    if not hasattr(law, "force"):
        raise LawError(
            f"law '{type(law).__name__}' has no formula; write the static method `force`.", law=type(law).__name__
        )
    parameters = law.parameters()
    n_arguments = N_DEFORMATION + len(parameters)
    name = type(law).__name__
    _check_formula(law, n_arguments)
    try:
        force = _compile_formula(law.force, n_arguments, 4)
        if law.stiffness is None:
            stiffness = _compile_differences(law.force, n_arguments)
        else:
            stiffness = _compile_formula(law.stiffness, n_arguments, 16)
    except NumbaError as error:
        raise LawError(
            f"law '{name}': its formula cannot be compiled: {_reason(law, n_arguments) or error}. "
            "Write it with plain numbers, `if` and the functions of `math`.",
            law=name,
        ) from error
    return CompiledLaw(force, stiffness, parameters)


def _check_formula(law: Law, n_arguments: int) -> None:
    """The formula runs in plain Python on a small deformation and returns the right count of numbers."""
    name = type(law).__name__
    formulas: list[tuple[Callable[..., Any], int]] = [(law.force, 4)]
    if law.stiffness is not None:
        formulas.append((law.stiffness, 16))
    arguments = (1e-4, 1e-3, 1e-3, 1e-3, 1.0, *law.parameters())
    for formula, n_results in formulas:
        try:
            inspect.signature(formula).bind(*arguments)
        except TypeError as error:
            fields = ", ".join(dict(law))
            raise LawError(
                f"law '{name}': {formula.__name__} must take dr, dtheta, dphi, dpsi, phi, {fields} "
                f"({n_arguments} numbers): {error}.",
                law=name,
            ) from error
        results = np.asarray(formula(*arguments), dtype=float)
        if results.shape != (n_results,) or not np.all(np.isfinite(results)):
            raise LawError(
                f"law '{name}': {formula.__name__} must return {n_results} finite numbers, got {results.tolist()} "
                f"at dr = 0.1 mm, the angles 1 mrad, phi = 1 rad.",
                law=name,
            )


def _reason(law: Law, n_arguments: int) -> str:
    """What numba says of the first formula that it refuses, in one line."""
    for formula in filter(None, (law.force, law.stiffness)):
        try:
            njit(formula).compile((float64,) * n_arguments)
        except NumbaError as error:
            lines = [line.strip() for line in str(error).splitlines() if line.strip()]
            place = next((line.removesuffix(":") for line in lines if line.startswith("File ")), "")
            return f"{lines[min(1, len(lines) - 1)]} ({place})"
    return ""


_SIGNATURE = types.void(types.CPointer(float64), types.CPointer(float64))


def _compile_formula(formula: Callable[..., Any], n_arguments: int, n_results: int) -> Any:
    source, has_module = _make_compilable(formula)

    def entry(arguments, results):
        source  # noqa: B018  a change of the formula changes this closure, and with it the key on disk
        values = formula(*to_fixed_tuple(carray(arguments, n_arguments), n_arguments))  # type: ignore[call-arg]
        for k in range(n_results):
            results[k] = values[k]

    with kernel_folder():
        return cfunc(_SIGNATURE, cache=has_module, error_model="numpy")(entry)


def _compile_differences(formula: Callable[..., Any], n_arguments: int) -> Any:
    """Stiffness by central differences of the force; phi moves with dphi."""
    source, has_module = _make_compilable(formula)

    def entry(arguments, results):
        source  # noqa: B018
        x = carray(arguments, n_arguments)
        radius = x[N_DEFORMATION]
        for j in range(4):
            kept, kept_phi = x[j], x[4]
            step = _DIFFERENCE * (radius if j == 0 else 1.0)
            x[j] = kept + step
            if j == 2:
                x[4] = kept_phi + step
            upper = formula(*to_fixed_tuple(x, n_arguments))  # type: ignore[call-arg]
            x[j] = kept - step
            if j == 2:
                x[4] = kept_phi - step
            lower = formula(*to_fixed_tuple(x, n_arguments))
            x[j], x[4] = kept, kept_phi
            for i in range(4):
                results[4 * i + j] = (upper[i] - lower[i]) / (2.0 * step)

    with kernel_folder():
        return cfunc(_SIGNATURE, cache=has_module, error_model="numpy")(entry)


def _make_compilable(formula: Callable[..., Any]) -> tuple[str, bool]:
    """Let numba compile a formula and the plain functions that it calls.

    Returns:
        A text that changes when any of them does: the bytecode and the values of the constants of the module, which
        numba freezes into the code. And whether all have a module; what has none cannot be loaded from disk again.
    """
    found: dict[int, str] = {}
    has_module = True
    waiting = [formula]
    while waiting:
        function = waiting.pop()
        if id(function) in found:
            continue
        register_jitable(function)
        has_module = has_module and function.__module__ in sys.modules
        code = function.__code__
        names = inspect.getclosurevars(function)
        values = {**names.globals, **names.nonlocals}
        waiting += [value for value in values.values() if inspect.isfunction(value)]
        constants = sorted((name, repr(value)) for name, value in values.items() if not callable(value))
        found[id(function)] = repr((code.co_code, code.co_consts, code.co_names, constants))
    return "\n".join(found.values()), has_module
