"""Parts of a period that are alike, followed one by one and differentiated beside one another, one a lane.

What a part computes depends on its way: whether a tip slips, say. There is a code for each way, which does all lanes at
once and tells in which of them the way is taken; for the others there is another code. Where the sums of two parts are
the same but for where their numbers lie, they share it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.numerics.arrays import AnyArray
from softhand.numerics.eliminated import Eliminated
from softhand.numerics.followed import Followed, FollowedSums, Meaning, offsets_of
from softhand.numerics.kept_codes import KeptCodes
from softhand.numerics.layouts import Layouts
from softhand.numerics.llvm_text import assembled, loaded
from softhand.numerics.symbols import NotStraightError, Place, Symbol

BEGIN, FIRST, DRIFT, END, SWITCHES = range(5)
"""Phases, in the order in which derivatives are put together: what depends on the begin alone; on the first
acceleration too; the configuration at the end; what depends on that; on which side of the switches numbers lie."""
PHASES = 5
LARGEST = 4
"""Lanes of a code."""

Wanted = Sequence[tuple[int, int, Any]]
"""Phase, row and what is differentiated, by phases."""


class Part(NamedTuple):
    """One of its kind."""

    function: Callable[..., Any]
    """In plain Python on compiled functions."""
    arguments: tuple[Any, ...]
    wanted: Callable[[Followed], Wanted]
    """What of it is differentiated."""
    first_switch: int
    """Row of its first switch; there is room for `ROOM_FOR_SWITCHES`."""


ROOM_FOR_SWITCHES = 40

_LONG = 45_000
"""Lines of a text beyond which it is not optimized, nor are later ways of parts that stand beside one another: that
takes a quarter of a minute, and gives the same bits a little sooner."""


class Setting(NamedTuple):
    """What all parts have in common."""

    tables: tuple[AnyArray, ...]
    patterns: tuple[AnyArray, ...]
    meanings: Mapping[Any, Meaning]
    layouts: Layouts
    columns: Mapping[Place, int]
    """Numbers by which derivatives are taken, and the row of each."""


class Code(NamedTuple):
    """A way, as it is kept on disk: machine code and what it reads and writes, by the order of places in its form."""

    content: bytes
    read: tuple[int, ...]
    written: tuple[int, ...]
    rows: tuple[int, ...]
    """Of each derivative, an index of what is wanted."""
    columns: tuple[int, ...]
    """Likewise, an index of the places."""


class Way:
    """One way of a family.

    Attributes:
        code: what it does.
        address: of the machine code.
        sources: addresses of what it reads, shape (read, lanes).
        written: addresses that it is given, shape (written, lanes).
        rows: of each derivative, shape (lanes, entries).
        columns: likewise.
        phases: where those of each phase begin, and their end, shape (PHASES + 1,).
        known: bits of the lanes that it is known for.
        switches: how many values stand behind the derivatives, one a row of the last phase.
    """

    def __init__(self, code: Code, lanes: int, phases: NDArray[np.int64], switches: int) -> None:
        self.code, self.address = code, loaded(code.content)
        self.phases, self.switches, self.known = phases, switches, 0
        self.sources = np.zeros((len(code.read), lanes), np.int64)
        self.written = np.zeros((len(code.written), lanes), np.int64)
        self.rows = np.zeros((lanes, len(code.rows)), np.int64)
        self.columns = np.zeros((lanes, len(code.rows)), np.int64)


class Family:
    """Some parts of one kind.

    Attributes:
        ways: that were followed.

    Args:
        parts: as many as there are, at most `LARGEST`.
        setting: of all of them.
    """

    def __init__(self, parts: Sequence[Part], setting: Setting) -> None:
        self.parts, self._setting = list(parts), setting
        self.lanes = 1 if len(parts) == 1 else 2 if len(parts) == 2 else LARGEST
        self.ways: list[Way] = []
        self._known: dict[str, Way] = {}

    def follow(self, lane: int) -> None:
        """The way that a part takes with the numbers as they are now."""
        part, setting = self.parts[lane], self._setting
        followed = Followed(
            part.function, part.arguments, setting.tables, frozenset(), setting.meanings, setting.layouts, None,
            setting.patterns,
        )  # fmt: skip
        sums = followed.sums
        wanted = list(part.wanted(followed))
        switches = [one for one in dict.fromkeys(followed.notes) if isinstance(one, Symbol)]
        if len(switches) > ROOM_FOR_SWITCHES:
            raise NotStraightError("more switches than there is room for")
        wanted += [(SWITCHES, part.first_switch + k, value) for k, value in enumerate(switches)]
        values = [value for _, _, value in wanted]
        form = Form(sums, values, setting.columns)
        told = hashlib.sha256(repr((form.told, len(switches), self.lanes)).encode()).hexdigest()
        way = self._known.get(told)
        if way is None:
            code = self._code(told, sums, form, values, switches)
            starts = [sum(wanted[row][0] < phase for row in code.rows) for phase in range(PHASES + 1)]
            way = self._known[told] = Way(code, self.lanes, np.array(starts, dtype=np.int64), len(switches))
            self.ways.append(way)
        self._put(way, lane, form.places, [row for _, row, _ in wanted])

    def _code(self, told: str, sums: FollowedSums, form: Form, values: list[Any], switches: list[Any]) -> Code:
        is_later = self.lanes > 1 and bool(self.ways)  # alone in a lane it has other last bits if not optimized
        store = KeptCodes(__name__, f"{told} {is_later}")
        kept = store.found()
        if kept is None:
            made = Eliminated(sums, self._setting.columns, values, switches, self.lanes)
            number = {place: k for k, place in enumerate(form.places)}
            is_rare = is_later or made.text.count("\n") > _LONG
            kept = (
                assembled(made.text, 0 if is_rare else 1), tuple(number[place] for place in made.read),
                tuple(number[place] for place in made.written), tuple(row for row, _ in made.entries),
                tuple(number[place] for _, place in made.entries),
            )  # fmt: skip
            store.keep(kept)
        return Code(*kept)

    def _put(self, way: Way, lane: int, places: list[Place], rows: list[int]) -> None:
        """Where the numbers of a lane lie; lanes of which nothing is known do what this one does."""
        at = [self._setting.layouts.places[memory] + begin for memory, begin in places]
        code = way.code
        for k in range(self.lanes):
            if k == lane or not way.known:
                way.sources[:, k] = [at[n] for n in code.read]
                way.written[:, k] = [at[n] for n in code.written]
        way.rows[lane] = [rows[n] for n in code.rows]
        way.columns[lane] = [self._setting.columns[places[n]] for n in code.columns]
        way.known |= 1 << lane


def families_of(kinds: Iterable[Sequence[Part]], setting: Setting) -> list[Family]:
    """Families of parts, those of one kind as many together as there are lanes."""
    return [Family(parts[k : k + LARGEST], setting) for parts in kinds for k in range(0, len(parts), LARGEST)]


def places_of(array: AnyArray, layouts: Layouts) -> list[Place]:
    """Where the numbers of an array lie, in their order."""
    number, begin = layouts.number_of(array)
    return [(number, begin + int(offset)) for offset in offsets_of(array).ravel()]


class Form:
    """What some sums compute, apart from where the numbers lie.

    Attributes:
        places: all that they read and write, in the order of the sums.
        told: the same for sums of the same form.
    """

    def __init__(self, sums: FollowedSums, values: Sequence[Any], columns: Mapping[Place, int]) -> None:
        known: dict[Place, int] = {}

        def told(item: Any) -> Any:
            if isinstance(item, Symbol):
                return "s", item.index
            if isinstance(item, tuple):
                return "p", known.setdefault(item, len(known))
            return type(item).__name__, item

        steps = tuple(tuple(map(told, step)) for step in sums.steps)
        ends = tuple(map(told, values))
        self.places = list(known)
        self.told = steps, ends, tuple(place in columns for place in known)
