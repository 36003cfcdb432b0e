"""The derivatives of followed sums by some of what they read, as machine code that writes all of them at once.

The sums are a graph: its vertices are numbers, each edge is the derivative of one by another that it is computed from.
A vertex between is eliminated by a product for each pair of an edge into it and an edge out of it, until the edges lead
from what is read to what is wanted [Griewank and Walther, Evaluating Derivatives, 2008, chapters 9 and 10]. Those with
the fewest pairs go first. What does not depend on one another costs nothing, which a tangent with a lane for each
number that is read does not know. The lanes are for others of the same kind: one text computes as much for each.
"""

from __future__ import annotations

import heapq
from collections.abc import Collection, Sequence
from typing import Any, NamedTuple

from softhand.numerics.followed import FollowedSums
from softhand.numerics.lanes_text import LanesText
from softhand.numerics.llvm_text import ENTRY
from softhand.numerics.partials import partial_of
from softhand.numerics.symbols import REAL, TRUTH, WHOLE, Place, Symbol


class Edge(NamedTuple):
    """A derivative: a sign, times a number of the text if there is one."""

    sign: int
    name: str | None


class Eliminated:
    """A code i64 f(words, numbers), and what it reads and writes.

    All is in lanes: the words are what it reads, then addresses of places that it writes to before it calls others; the
    numbers are derivatives, then values. It returns in which lanes the numbers take the way of the sums, bit by bit.

    Args:
        sums: what is computed.
        sources: places by which derivatives are taken.
        wanted: what is differentiated: symbols, or plain numbers.
        values: symbols or numbers that are written as they are.
        lanes: numbers beside one another.

    Attributes:
        text: of the code.
        read: places that it reads, in the order of its words.
        written: places behind them.
        entries: row, an index of `wanted`, and place, one of `sources`, of each derivative, by rows.
    """

    def __init__(
        self, sums: FollowedSums, sources: Collection[Place], wanted: Sequence[Any], values: Sequence[Any], lanes: int
    ) -> None:
        self._sums, self._wanted = sums, list(wanted)
        self._text = LanesText(lanes)
        self._sources = {
            k: rest[1] for k, (word, *rest) in enumerate(sums.steps)
            if word == "load" and rest[0] == REAL and rest[2] == 0 and rest[1] in sources
        }  # fmt: skip
        self.read: list[Place] = []
        self.written: list[Place] = []
        self.entries: list[tuple[int, Place]] = []
        self._places: dict[Place, int] = {}
        needed = self._needed([*wanted, *values])
        for k in sorted(needed):
            word, *rest = sums.steps[k]
            if word == "load" and rest[1] not in self._places and not self._is_late(rest):
                self._places[rest[1]] = len(self.read)
                self.read.append(rest[1])
        mask = self._compute(needed)
        numbers: list[str] = []
        for row, edges in enumerate(self._eliminated()):
            for k, edge in sorted(edges.items()):
                self.entries.append((row, self._sources[k]))
                numbers.append(self._plain(edge))
        numbers += [self._text.operand(value if isinstance(value, Symbol) else float(value)) for value in values]
        self.text = self._whole(mask, numbers)

    # -------------------------------------------------------------------------------------------------- the sums

    def _needed(self, ends: Sequence[Any]) -> set[int]:
        steps = self._sums.steps
        waiting = [one.index for one in ends if isinstance(one, Symbol)]
        waiting += [k for k, step in enumerate(steps) if step[0] in ("store", "invoke", "require")]
        found: set[int] = set()
        while waiting:
            k = waiting.pop()
            if k not in found:
                found.add(k)
                waiting += [item.index for item in steps[k] if isinstance(item, Symbol)]
        return found

    def _is_late(self, rest: Sequence[Any]) -> bool:
        """Whether a load is of what another code has written meanwhile."""
        return rest[2] != 0

    def _compute(self, needed: set[int]) -> str:
        """The sums themselves; the truth that their way is taken."""
        text, sums = self._text, self._sums
        mask = text.literal(TRUTH, True)
        for k in sorted(needed):
            word, *rest = sums.steps[k]
            if word == "load" and not self._is_late(rest):
                kind = text.kind(rest[0])
                place = self._places[rest[1]] * text.lanes
                text.lines += [f"%a{k} = getelementptr i64, i64* %words, i64 {place}",
                               f"%p{k} = bitcast i64* %a{k} to {kind}*",
                               f"%s{k} = load {kind}, {kind}* %p{k}, align 8"]  # fmt: skip
            elif word == "load":
                self._load_late(k, rest)
            elif word == "store":
                self._store(k, rest)
            elif word == "invoke":
                self._invoke(k, rest)
            elif word == "require":
                mask = text.named(f"and {text.kind(TRUTH)} {mask}, {text.operand(rest[0], TRUTH)}")
            else:
                text.step(k, word, rest, sums.kinds)
        return mask

    def _lane(self, kind: str, value: str, lane: int) -> str:
        text = self._text
        return value if text.lanes == 1 else text.named(f"extractelement {text.kind(kind)} {value}, i32 {lane}")

    def _address(self, place: Place, lane: int) -> str:
        """Of a place that lies elsewhere in each lane."""
        if place not in self.written:
            self.written.append(place)
        return f"%w{self.written.index(place)}x{lane}"

    def _store(self, k: int, rest: Sequence[Any]) -> None:
        kind = rest[0]
        value = self._text.operand(rest[2], kind)
        for lane in range(self._text.lanes):
            own = self._lane(kind, value, lane)
            self._text.lines += [f"%q{k}x{lane} = bitcast i64* {self._address(rest[1], lane)} to {kind}*",
                                 f"store {kind} {own}, {kind}* %q{k}x{lane}"]  # fmt: skip

    def _load_late(self, k: int, rest: Sequence[Any]) -> None:
        text, found = self._text, "undef"
        for lane in range(text.lanes):
            name = f"%s{k}" if text.lanes == 1 else f"%l{k}x{lane}"
            text.lines += [f"%q{k}x{lane} = bitcast i64* {self._address(rest[1], lane)} to double*",
                           f"{name} = load double, double* %q{k}x{lane}"]  # fmt: skip
            if text.lanes > 1:
                to = f"%s{k}" if lane == text.lanes - 1 else f"%i{k}x{lane}"
                text.lines.append(f"{to} = insertelement {text.kind(REAL)} {found}, double {name}, i32 {lane}")
                found = to

    def _invoke(self, k: int, rest: Sequence[Any]) -> None:
        for lane in range(self._text.lanes):
            code, place = (self._address(one, lane) for one in rest[:2])
            self._text.lines += [f"%c{k}x{lane} = load i64, i64* {code}",
                                 f"%h{k}x{lane} = inttoptr i64 %c{k}x{lane} to void (i64*, i64*)*",
                                 f"%d{k}x{lane} = load i64, i64* {place}",
                                 f"%e{k}x{lane} = inttoptr i64 %d{k}x{lane} to i64*",
                                 f"call void %h{k}x{lane}(i64* %e{k}x{lane}, i64* %e{k}x{lane})"]  # fmt: skip

    def _whole(self, mask: str, numbers: Sequence[str]) -> str:
        text, lanes = self._text, self._text.lanes
        lines = [f"define i64 @{ENTRY}(i64* %words, double* %numbers) {{"]
        for n in range(len(self.written)):
            for lane in range(lanes):
                place = (len(self.read) + n) * lanes + lane
                lines += [f"%b{n}x{lane} = getelementptr i64, i64* %words, i64 {place}",
                          f"%j{n}x{lane} = load i64, i64* %b{n}x{lane}",
                          f"%w{n}x{lane} = inttoptr i64 %j{n}x{lane} to i64*"]  # fmt: skip
        lines += text.lines
        kind = text.kind(REAL)
        for n, number in enumerate(numbers):
            lines += [f"%y{n} = getelementptr double, double* %numbers, i64 {n * lanes}",
                      f"%z{n} = bitcast double* %y{n} to {kind}*",
                      f"store {kind} {number}, {kind}* %z{n}, align 8"]  # fmt: skip
        if lanes == 1:
            lines.append(f"%bits = zext i1 {mask} to i64")
        else:
            lines += [f"%all = bitcast {text.kind(TRUTH)} {mask} to i{lanes}", f"%bits = zext i{lanes} %all to {WHOLE}"]
        return "\n".join([*lines, "ret i64 %bits", "}", *text.declarations()])

    # --------------------------------------------------------------------------------------------------- the graph

    def _eliminated(self) -> list[dict[int, Edge]]:
        """Edges from what is read to each that is wanted."""
        into, out = self._graph()
        steps = len(self._sums.steps)
        between = {k for k in into if k not in self._sources and k < steps}
        cost = {k: len(into[k]) * len(out[k]) for k in between}
        waiting = [(c, -k) for k, c in cost.items()]  # the last of them first: there is less behind it
        heapq.heapify(waiting)
        while waiting:
            c, k = heapq.heappop(waiting)
            k = -k
            if k not in between or c != cost[k]:
                continue
            between.discard(k)
            before, after = into.pop(k), out.pop(k)
            for i in before:
                out[i].discard(k)
                out[i] |= after
            for j in sorted(after):
                self._go_through(into[j], into[j].pop(k), before)
            for n in (*before, *after):
                if n in between and cost[n] != (new := len(into[n]) * len(out[n])):
                    cost[n] = new
                    heapq.heappush(waiting, (new, -n))
        return [into.get(steps + row, {}) for row in range(len(self._wanted))]

    def _go_through(self, edges: dict[int, Edge], last: Edge, before: dict[int, Edge]) -> None:
        """Edges into one vertex, once that before the last edge is gone."""
        for i, first in before.items():
            self._add(edges, i, Edge(first.sign * last.sign, self._product(first.name, last.name)))

    def _add(self, edges: dict[int, Edge], i: int, way: Edge) -> None:
        known = edges.get(i)
        edges[i] = way if known is None else self._sum(known, way)

    def _graph(self) -> tuple[dict[int, dict[int, Edge]], dict[int, set[int]]]:
        """Edges into each vertex that matters, and which vertices it has edges to."""
        sums, steps = self._sums, len(self._sums.steps)
        into: dict[int, dict[int, Edge]] = {k: {} for k in self._sources}
        trees: dict[int, dict[int, list[Any]]] = {}
        for k, (word, *rest) in enumerate(sums.steps):
            if sums.kinds[k] != REAL or word == "load":
                continue
            own: dict[int, list[Any]] = {}
            for n, item in enumerate(rest):
                if isinstance(item, Symbol) and (item.index in into or item.index in trees):
                    partial = partial_of(Symbol(sums, k), word, rest, n)
                    if partial is not None:
                        own.setdefault(item.index, []).append(partial)
            if own:
                trees[k] = own
        ends = {steps + row: value.index for row, value in enumerate(self._wanted) if isinstance(value, Symbol)}
        needed: set[int] = set()
        waiting = [k for k in ends.values() if k in into or k in trees]
        while waiting:
            k = waiting.pop()
            if k not in needed:
                needed.add(k)
                waiting += trees.get(k, ())
        for k, own in trees.items():
            if k in needed:
                into[k] = {}
                for i, partials in own.items():
                    for partial in partials:
                        self._add(into[k], i, self._edge(partial))
        into = {k: edges for k, edges in into.items() if k in needed}
        into |= {k: {i: Edge(1, None)} for k, i in ends.items() if i in into}
        out: dict[int, set[int]] = {k: set() for k in into}
        for k, edges in into.items():
            for i in edges:
                out[i].add(k)
        return into, out

    def _edge(self, partial: Any) -> Edge:
        return Edge(partial, None) if isinstance(partial, int) else Edge(1, self._text.value(partial))

    def _product(self, a: str | None, b: str | None) -> str | None:
        if a is None or b is None:
            return b if a is None else a
        return self._text.real("fmul", sorted((a, b)))

    def _sum(self, a: Edge, b: Edge) -> Edge:
        one = self._text.literal(REAL, 1.0)
        return Edge(a.sign, self._text.real("fadd" if a.sign == b.sign else "fsub", [a.name or one, b.name or one]))

    def _plain(self, edge: Edge) -> str:
        if edge.name is None:
            return self._text.literal(REAL, edge.sign)
        return edge.name if edge.sign > 0 else self._text.real("fneg", [edge.name])
