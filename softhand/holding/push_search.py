"""The search over directions for the push that is lost first."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from softhand.holding.between import Between
from softhand.holding.edge import Edge
from softhand.holding.pushed_run import PushedRun
from softhand.holding.pushing import Pushing
from softhand.numerics.arrays import Array

CLOSE = 0.02
"""In the directions that count one push is survived and one, by no more than this share larger, is lost."""

_COARSE = 12  # directions that are pushed from the bound on; the others begin by what these promise
_FIRST = 1.03  # times that
_FEW = 6  # of the worst directions, which are looked at closer
_ROUNDS, _AT_ONCE = 4, 4  # of other directions
_SUSPECT = 1.05  # times the worst; what promises less is tried
_LESS = 0.97  # of a push that was lost, from where on its edge is looked for


class PushSearch:
    """Edges along many ways.

    Args:
        pushing: runs them.
        bound: what the linear answer promises along ways, finite and above 0.
        use: the largest use of a limit surface without push.
        first: times the bound is pushed first.
    """

    def __init__(self, pushing: Pushing, bound: Callable[[Array], Array], use: float, first: float) -> None:
        self._pushing, self._bound, self._use, self._first = pushing, bound, use, first
        self._between = Between(bound)

    def edges(self, ways: Array, asked: list[int]) -> list[Edge]:
        """Of each way; close brackets of those asked for, of the few worst others, and of all below these."""
        begin, later = ways[:_COARSE], ways[_COARSE:]
        edges = self._pushing.map(self._find, list(zip(begin, self._first * self._bound(begin), strict=True)))
        promised = self._between.promised(later, begin, np.array([edge.guess for edge in edges]))
        edges += self._pushing.map(self._find, list(zip(later, _FIRST * promised, strict=True)))
        others = [int(k) for k in np.argsort([edge.guess for edge in edges]) if k not in asked]
        chosen, closed = [*asked, *others[:_FEW]], set()
        while chosen:
            self._pushing.map(self._close, [(ways[k], edges[k]) for k in chosen])
            closed |= {*chosen}
            least = min(edges[k].low for k in closed)
            chosen = [k for k, edge in enumerate(edges) if k not in closed and edge.low < least]
        return edges

    def between(self, ways: Array, edges: list[Edge]) -> tuple[Array, list[Edge]]:
        """Other ways with a smaller edge than all of these, each with a close bracket."""
        known = [edge.guess for edge in edges]
        worst, tried, lost = min(edge.low for edge in edges), ways, []
        for _ in range(_ROUNDS if worst else 0):
            suspects = self._between.worst(tried, np.array(known), _SUSPECT * worst, _AT_ONCE)
            found = self._pushing.map(self._look, [(way, worst) for way in suspects])
            tried, known = np.vstack([tried, suspects]), [*known, *(edge.guess for edge in found)]
            lost += [(way, edge) for way, edge in zip(suspects, found, strict=True) if edge.end]
            worst = min([worst, *(edge.low for edge in found if edge.end)])
            if not any(edge.end for edge in found):
                break
        return np.array([way for way, _ in lost]).reshape(-1, 3), [edge for _, edge in lost]

    def _find(self, run: PushedRun, way: Array, size: float) -> Edge:
        edge = Edge(self._use)
        edge.find(lambda amount: run.push(amount * way), size)
        return edge

    def _close(self, run: PushedRun, way: Array, edge: Edge) -> None:
        edge.close(lambda amount: run.push(amount * way), CLOSE)

    def _look(self, run: PushedRun, way: Array, size: float) -> Edge:
        edge = Edge(self._use)
        edge.look(lambda amount: run.push(amount * way), size)
        if edge.end:
            edge.find(lambda amount: run.push(amount * way), _LESS * size)
            self._close(run, way, edge)
        return edge
