"""The linear model of a control period, as a result with names and units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.errors import GraspError
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record

_FORGOTTEN = 1e-9  # of a motion, left after a period
_BY = "SI, by the names of rows and columns"


class Switch(NamedTuple):
    """What a state is so close to that the model holds on one side of it alone."""

    where: str
    """Name of the contact, or of the joint."""
    what: str
    """`touch`, `slip`, `surface` (another face, edge or vertex) or `effort limit`."""
    side: str
    """On which the model holds, such as `sticks`."""


@dataclass(frozen=True, eq=False, repr=False)
class ClosedLoop(Record):
    """(x, m)' = A (x, m) + B u + E p and y = C (x, m) + D u + F p, u what is added to the command of the controller.

    m are the numbers in the memory of the controller that change with x, directly or through others.

    Attributes:
        A: shape (s + m, s + m).
        B: shape (s + m, n); zero for a command that an effort limit cuts, as in D.
        E: shape (s + m, p).
        C: shape (y, s + m).
        D: shape (y, n).
        F: shape (y, p).
        K: the command by (x, m), zero where an effort limit holds, shape (n, s + m).
        states: names of x, then of m.
    """

    units: ClassVar = dict.fromkeys("ABECDFK", _BY)

    A: Array
    B: Array
    E: Array
    C: Array
    D: Array
    F: Array
    K: Array
    states: tuple[str, ...]

    def eigenvalues(self) -> NDArray[np.complex128]:
        """Of A, the largest first; all within the unit circle where small motions die out."""
        return _sorted_eigenvalues(self.A)

    def __repr__(self) -> str:
        return f"<ClosedLoop: {len(self.states)} states, largest eigenvalue {np.abs(self.eigenvalues()[0]):.6g}>"


@dataclass(frozen=True, eq=False, repr=False)
class Linearization(Record):
    """One control period beside a state: x' = A x + B u + E p, y = C x + D u + F p.

    x, u and p are displacements from that state, its torques and the parameters, x' that from where the period ends, y
    that of what is recorded where it begins. From the state itself x' is drift + A x + B u + E p, but for the turn of
    the object's axes within the period.

    Attributes:
        time: of the state [s].
        period: for which the torques are held [s].
        A: shape (s, s).
        B: shape (s, n).
        E: shape (s, p).
        C: shape (y, s).
        D: shape (y, n).
        F: shape (y, p).
        drift: where the period ends that nothing moves, from the state, in the coordinates of x, shape (s,).
        output: y itself there, in place of a displacement, shape (y,).
        states: names of x: joints, object along and about its own axes, their rates, then what each contact stores.
        inputs: names of u, the joints.
        parameters: names of p.
        outputs: names of y.
        state_units: of x.
        input_units: of u.
        parameter_units: of p.
        output_units: of y.
        switches: what the state is at, or within a step of the differences; there the model is that of its own side.
        closed: the same with the controller; None if it was not asked for.
    """

    units: ClassVar = {"time": "s", "period": "s", **dict.fromkeys([*"ABECDF", "drift", "output"], _BY)}

    time: float
    period: float
    A: Array
    B: Array
    E: Array
    C: Array
    D: Array
    F: Array
    drift: Array
    output: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    parameters: tuple[str, ...]
    outputs: tuple[str, ...]
    state_units: tuple[str, ...]
    input_units: tuple[str, ...]
    parameter_units: tuple[str, ...]
    output_units: tuple[str, ...]
    switches: tuple[Switch, ...]
    closed: ClosedLoop | None = None

    def eigenvalues(self) -> NDArray[np.complex128]:
        """Of A, with held torques, the largest first; those of the loop are `closed.eigenvalues()`."""
        return _sorted_eigenvalues(self.A)

    def continuous(self) -> tuple[Array, Array]:
        """A and B of dx/dt = A x + B u, of which this is what a held torque does in a period: the logarithm of the map.

        It is that of the steps as they are computed, off the plant's by the square of their length.

        Returns:
            A, shape (s, s), and B, shape (s, n).

        Raises:
            GraspError: the map has no such logarithm, as where a motion is forgotten in one step.
        """
        from scipy.linalg import logm

        s, n = self.B.shape
        values = self.eigenvalues()
        lost = np.abs(values) < _FORGOTTEN
        if np.any(lost | ((values.real <= 0.0) & (values.imag == 0.0))):
            what = "forgets a motion" if np.any(lost) else "turns a motion around"
            raise GraspError(
                f"the period at t = {self.time:g} s {what} within {self.period:g} s, so that no model of continuous "
                "time does what it does; take a state at which no contact slips, or shorter periods.",
                finger="", quantity="continuous", value=float(np.min(np.abs(values))),
            )  # fmt: skip
        both = np.block([[self.A, self.B], [np.zeros((n, s)), np.eye(n)]])
        rate = np.real(logm(both)) / self.period
        return rate[:s, :s], rate[:s, s:]

    def __repr__(self) -> str:
        counts = {
            "states": self.states, "inputs": self.inputs, "parameters": self.parameters, "outputs": self.outputs
        }  # fmt: skip
        told = [f"{len(names)} {what}" for what, names in counts.items() if names]
        told += (
            [f"at a switch: {', '.join(f'{one.where} ({one.what})' for one in self.switches)}"] if self.switches else []
        )
        told += [f"closed: {self.closed!r}"] if self.closed else []
        return f"<Linearization: {self.period:g} s from t = {self.time:g} s, {', '.join(told)}>"


def _sorted_eigenvalues(A: Array) -> NDArray[np.complex128]:
    values: NDArray[np.complex128] = np.linalg.eigvals(A).astype(np.complex128)
    return values[np.argsort(-np.abs(values), kind="stable")]
