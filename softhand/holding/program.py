"""The squeeze as a cone program: internal forces that hold a set of loads, by Clarabel.

The unknowns are the internal forces f_N, which all loads share, and the torsions tau of each load. With W the wrench
of a load, G^f and G^tau the maps from contact forces and torsions to wrenches,

    f = (G^f)^+ (W - G^tau tau) + K f_N,   G^f f + G^tau tau = W

as (59) shares a wrench. Each contact stays in its limit surface, H(f_t, tau / l) <= (use mu f_z)^2, and each joint
within its effort, |N_F + J^fT f + J^tauT tau| <= effort. An elliptic surface is one second-order cone; any other is the
polygon inside it in (|f_t|, |tau| / l), see `surface`, of a cone p >= |f_t| and planes.

Source: Goulart, Chen, Clarabel: An interior-point solver for conic programs with quadratic objectives, 2024.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from softhand.holding.held import Held
from softhand.holding.loads import Loads
from softhand.holding.surface import facets, is_ellipse
from softhand.numerics.arrays import Array

_RANK = 1e-9  # of the largest singular value of G^f
_PRICED = 1e-4  # of the largest multiplier
_LARGEST = 1e6  # [N], beyond which a squeeze has no limit, and times an effort limit


@dataclass(frozen=True)
class Terms:
    """What counts beside contacts and loads.

    Attributes:
        use: share of the limit surface that may be used.
        effort: share of the effort limits that may be used.
        touch: least normal force [N].
        torsion: whether torsion holds anything.
    """

    use: float = 1.0
    effort: float = 1.0
    touch: float = 0.0
    torsion: bool = True


class Found(NamedTuple):
    """A solution."""

    internal_force: Array
    """f_N [N], of all that do the same the smallest, shape (np,)."""
    force: Array
    """f of each load [N], shape (loads, 3 nc)."""
    torsion: Array
    """tau of each load [N m], shape (loads, nc)."""
    joint_torque: Array
    """[N m, N], shape (loads, n)."""
    value: float
    """Of what was sought."""
    prices: Array
    """Multipliers of all limits of each load: zero for those that do not matter, shape (loads, rows)."""
    dual: float
    """The value by the multipliers, equal to `value`: no other solution does better."""


class Program:
    """The limits of one grasp, as linear maps of all that they depend on.

    Args:
        held: the contacts.
        loads: to be held.
        terms: what else counts.
    """

    def __init__(self, held: Held, loads: Loads, terms: Terms) -> None:
        self.held, self.loads, self.terms = held, loads, terms
        nc, n_pairs = len(held.friction), held.basis.shape[1]
        polygons = [i for i in range(nc) if terms.torsion and not is_ellipse(held.curve[i])]
        sizes = {"y": n_pairs, "t": nc if terms.torsion else 0, "p": len(polygons), "q": len(polygons),
                 "w": 6, "g": 3, "effort": 1, "one": 1}  # fmt: skip
        edges = np.cumsum([0, *sizes.values()])
        self._at = {key: slice(a, b) for key, a, b in zip(sizes, edges[:-1], edges[1:], strict=True)}
        self._unit = np.eye(int(edges[-1]))
        self._of_load = slice(self._at["t"].start, self._at["q"].stop)
        torsion = held.lever[:, None] * self._unit[self._at["t"]] if terms.torsion else np.zeros((nc, edges[-1]))
        left = self._unit[self._at["w"]] - held.torsion_map @ torsion
        U, values, Vt = np.linalg.svd(_scaled(held) @ held.force_map)
        rank = int(np.sum(values > _RANK * values[0]))
        share = Vt[:rank].T / values[:rank] @ U[:, :rank].T @ _scaled(held)
        self._force = share @ left + held.basis @ self._unit[self._at["y"]]
        self._torsion = torsion
        self._torque = held.hand_weight @ self._unit[self._at["g"]]
        self._torque += held.hand_force.T @ self._force + held.hand_torsion.T @ torsion
        self._equal = U[:, rank:].T @ _scaled(held) @ left
        self._rows, self._cones = self._limits(polygons)

    def _limits(self, polygons: list[int]) -> tuple[Array, list[tuple[str, int]]]:
        """Rows of s = M (all quantities) in cones, of one load."""
        import clarabel  # noqa: F401  fails here where it is missing, not in the middle

        held, terms, unit, at = self.held, self.terms, self._unit, self._at
        normal = self._force[2::3]
        planes, cones = [normal - terms.touch * unit[at["one"]]], []
        finite = np.isfinite(held.effort)
        limit = terms.effort * held.effort[finite, None] * unit[at["effort"]]
        planes += [limit - self._torque[finite], limit + self._torque[finite]]
        for i, mu in enumerate(held.friction):
            room, sliding = terms.use * mu * normal[i], self._force[3 * i : 3 * i + 2]
            spin = unit[at["t"]][i : i + 1] if terms.torsion else np.zeros((0, len(unit)))
            if i in polygons:
                k = polygons.index(i)
                p, q = unit[at["p"]][k], unit[at["q"]][k]
                edge = facets(held.curve[i])
                planes += [q - spin, q + spin, room - edge[:, :1] * p - edge[:, 1:] * q]
                cones.append(np.vstack([p, sliding]))
            else:
                cones.append(np.vstack([room, sliding, spin]))
        flat = np.vstack(planes)
        kinds = [("zero", len(self._equal)), ("plane", len(flat)), *(("cone", len(rows)) for rows in cones)]
        return np.vstack([self._equal, flat, *cones]), [kind for kind in kinds if kind[1]]

    def least(self) -> Found | None:
        """The squeeze of the least total normal force; None if none holds."""
        return self._solve(self._normal_by_squeeze())

    def largest(self) -> Found | None:
        """That of the largest; None if none holds, or if nothing limits it."""
        found = self._solve(-self._normal_by_squeeze())
        return None if found is None or np.max(np.abs(found.force)) > _LARGEST else found

    def load_factor(self) -> tuple[float, list[int]]:
        """The largest factor on the wrenches of all loads with which some squeeze holds, and which loads limit it.

        NaN and no load if no squeeze holds even without load.
        """
        found = self._solve(np.zeros(self.held.basis.shape[1]), scaled="w", most=1e3)
        if found is None:
            return float("nan"), []
        weights = np.linalg.norm(found.prices, axis=1)
        return -found.value, np.flatnonzero(weights > _PRICED * np.max(weights)).tolist()

    def effort_factor(self) -> float:
        """The least factor on the effort limits with which some squeeze holds; infinite if none does."""
        found = self._solve(np.zeros(self.held.basis.shape[1]), scaled="effort")
        return float("inf") if found is None or found.value > _LARGEST else found.value

    def _normal_by_squeeze(self) -> Array:
        return np.asarray(self.held.basis[2::3].sum(axis=0))

    def _solve(self, cost: Array, scaled: str = "", most: float = np.inf) -> Found | None:
        """Minimise cost . f_N; or with `scaled` the factor on that quantity, that on wrenches with the other sign."""
        import clarabel

        at, m, count = self._at, self._rows, len(self.loads.names)
        columns = np.column_stack([self.loads.wrenches, self.loads.gravity, np.ones((count, 2))])
        known = np.arange(at["w"].start, at["one"].stop)
        factor = np.zeros((count, len(m), 0))
        if scaled:
            moved = at["w"] if scaled == "w" else at["effort"]
            here = slice(moved.start - known[0], moved.stop - known[0])
            factor = -(columns[:, here] @ m[:, moved].T)[:, :, None]
            columns[:, here] = 0.0
        shared = np.concatenate([np.broadcast_to(-m[:, at["y"]], (count, len(m), len(cost))), factor], axis=2)
        n_shared = shared.shape[2]
        A = sparse.hstack([
            sparse.csc_matrix(shared.reshape(-1, n_shared)),
            sparse.kron(sparse.eye(count), sparse.csc_matrix(-m[:, self._of_load])),
        ])  # fmt: skip
        b = (columns @ m[:, known].T).ravel()
        q = np.zeros(A.shape[1])
        q[: len(cost)] = cost
        cones = [_cone(clarabel, *kind) for kind in self._cones] * count
        if scaled:
            q[len(cost)] = -1.0 if scaled == "w" else 1.0
            row = sparse.csc_matrix(([1.0, -1.0], ([0, 1], [len(cost)] * 2)), shape=(2, A.shape[1]))
            A, b = sparse.vstack([A, row]), np.concatenate([b, [min(most, 1e9), 0.0]])
            cones.append(clarabel.NonnegativeConeT(2))
        settings = clarabel.DefaultSettings()
        settings.verbose, settings.max_threads = False, 1
        solution = clarabel.DefaultSolver(
            sparse.csc_matrix((A.shape[1],) * 2), q, sparse.csc_matrix(A), b, cones, settings
        ).solve()
        if str(solution.status) not in ("Solved", "AlmostSolved"):
            return None
        x, z = np.array(solution.x), np.array(solution.z)
        return self._read(x, z, float(q @ x), -float(b @ z), n_shared)

    def _read(self, x: Array, z: Array, value: float, dual: float, n_shared: int) -> Found:
        count, at = len(self.loads.names), self._at
        free = self.held.basis.shape[1]
        all_of = np.zeros((count, len(self._unit)))
        all_of[:, at["y"]] = x[:free]
        all_of[:, self._of_load] = x[n_shared:].reshape(count, -1)
        all_of[:, at["w"]], all_of[:, at["g"]] = self.loads.wrenches, self.loads.gravity
        all_of[:, -2:] = 1.0
        least_norm = np.linalg.pinv(self.held.basis, rcond=1e-9) @ (self.held.basis @ x[:free])
        return Found(
            least_norm,
            all_of @ self._force.T,
            all_of @ self._torsion.T,
            all_of @ self._torque.T,
            value,
            z[: count * len(self._rows)].reshape(count, -1),
            dual,
        )


def _scaled(held: Held) -> Array:
    """Moments as forces."""
    return np.diag(np.repeat([1.0, 1.0 / held.length], 3))


def _cone(clarabel: Any, kind: str, size: int) -> Any:
    kinds = {"zero": clarabel.ZeroConeT, "plane": clarabel.NonnegativeConeT, "cone": clarabel.SecondOrderConeT}
    return kinds[kind](size)
