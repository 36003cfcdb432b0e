"""What kernels of a run do on symbols that are not to be followed: laws by their formulas, slip by its equations.

Slip is the root of some equations. The code that a run takes solves them with the kernel that there is; from there one
step of Newton's method is followed, which moves nothing and has the derivatives of the root: implicit functions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from softhand.contact.address import call
from softhand.contact.answer import answer_stiffness, normal_force
from softhand.contact.limit import limit_of
from softhand.contact.records import CONTACT
from softhand.contact.scaled import displacement_of, material_force, normal_stiffness_of, stiffness_of
from softhand.contact.slip import Trial, _force, _newton_step, _return, slip_velocity
from softhand.errors import ScenarioError
from softhand.laws.law import LEADING, Law
from softhand.laws.rolling import DIFFERENCE, LEAN, LENGTHS, slope_of
from softhand.model.shapes.part_call import call_part
from softhand.model.shapes.shape import CompiledShape
from softhand.model.shapes.union import Union
from softhand.numerics.addressed import addressed
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.followed import Followed, Meaning
from softhand.numerics.layouts import Layouts
from softhand.numerics.symbols import REAL, NotStraightError
from softhand.numerics.triples import dot, length, moved
from softhand.plant.plant import Plant

_DIFFERENCE = 1e-6  # as `laws.law`
_TRIAL, _ROOT = 10, 4


class Solver(NamedTuple):
    """A contact of its own, in which a slip is solved."""

    pads: Any
    contacts: Any
    numbers: Array
    """The trial, then the multiplier and the displacement that were found."""
    calls: Any
    """Address of the code and of its words: for what slips from a displacement, and for what slips at a velocity."""
    kept: Any


@compiled
def return_from(pads, contacts, numbers):
    """`_return` from a trial in ten numbers; four behind are set."""
    n = numbers
    trial = Trial((n[0], n[1], n[2]), (n[3], n[4], n[5]), (n[6], n[7], n[8]), n[9])
    n[10] = _return(pads[0], contacts[0], trial)
    n[11], n[12], n[13] = displacement_of(contacts[0])


@compiled
def slide_at(contacts, numbers):
    """`slip_velocity` with room in the first number; the multiplier and what does not slip are set."""
    contact, D = contacts[0], contacts[0].dashpot
    y = slip_velocity(contact, numbers[0])
    lever, velocity = contact.lever, contact.velocity
    v = velocity[0], velocity[1], lever * velocity[3]
    x = moved(v, -1.0, y)
    elastic = material_force(contact)
    s = elastic[0] + D[0] * x[0], elastic[1] + D[1] * x[1], elastic[2] + D[3] / (lever * lever) * x[2]
    _, e, _ = limit_of(contact.curve, s)
    numbers[10] = dot(y, e) / dot(e, e)
    numbers[11], numbers[12], numbers[13] = x


def has_obstacles(plant: Plant) -> bool:
    """Whether the object may meet other bodies, whose edges are not followed."""
    return any(support.obstacle is not None for support in plant.supports)


def solvers_of(plant: Plant, layouts: Layouts) -> list[Solver]:
    """One for each contact.

    Raises:
        ScenarioError: there are obstacles, whose edges are not followed.
    """
    if has_obstacles(plant):
        raise ScenarioError(
            "obstacle: derivatives by the steps of a run are not to be had with obstacles, whose edges are not "
            "followed; leave the obstacles out.",
            key="obstacle", value=None,
        )  # fmt: skip
    found = []
    for i in range(len(plant.contacts)):
        pads, contacts, numbers = plant.pads[i : i + 1].copy(), np.zeros(1, CONTACT), np.zeros(_TRIAL + _ROOT)
        own = Layouts()
        codes = (
            addressed(return_from, pads, contacts, numbers, layouts=own),
            addressed(slide_at, contacts, numbers, layouts=own),
        )
        calls = np.array([word for code in codes for word in (code.code, code.place)], dtype=np.int64)
        found.append(Solver(pads, contacts, numbers, calls, codes))
    return found


def still_memories(solvers: list[Solver], layouts: Layouts) -> set[int]:
    """Memories in which slip is solved."""
    return {
        layouts.number_of(array)[0] for one in solvers for array in (one.pads, one.contacts, one.numbers, one.calls)
    }


def meanings_of(plant: Plant, solvers: list[Solver]) -> Mapping[Any, Meaning]:
    """Of all functions that are not followed."""
    formulas: dict[int, tuple[Law, Callable[[Followed, Law, list[Any]], Any]]] = {}
    for law, code in plant._code.items():
        formulas[code.force.address], formulas[code.stiffness.address] = (law, _forces), (law, _stiffness)
        if code.slope is not None:
            formulas[code.slope.address], formulas[code.bend.address] = (law, _slope), (law, _bend)

    shape = plant.world.shape
    entries: dict[int, Any] = {}
    for one in (shape, *(shape.parts if isinstance(shape, Union) else ())):
        if isinstance(one, CompiledShape):
            entries[one.nearest_function] = type(one).nearest_entry
            if one.chart_function:
                entries[one.chart_function] = type(one).chart_entry  # type: ignore[attr-defined]

    def answers(followed: Followed, address: Any, arguments: Any, results: Any) -> None:
        if int(address) in entries:
            assert isinstance(shape, CompiledShape)
            followed.on_symbols(entries[int(address)])(followed.block(shape.data), results)
            return
        law, formula = formulas[int(address)]
        n = len(LEADING[law.coordinates]) + len(law.parameters())
        x = [arguments[k] for k in range(n)]
        for k, value in enumerate(formula(followed, law, x)):
            results[k] = value

    def answers_part(followed: Followed, address: Any, data: Any, first: Any, io: Any) -> None:
        followed.on_symbols(entries[int(address)])(data[int(first) :], io)

    def returns(followed: Followed, pad: Any, contact: Any, trial: Any) -> Any:
        return _returned(followed, _solver_of(followed, plant, solvers, contact), pad, contact, trial)

    def slides(followed: Followed, contact: Any, room: Any) -> Any:
        return _slid(followed, _solver_of(followed, plant, solvers, contact), contact, room)

    return {call: answers, call_part: answers_part, _return: returns, slip_velocity: slides}


def _forces(followed: Followed, law: Law, x: list[Any]) -> Any:
    return followed.on_symbols(law.force)(*x)


def _slope(followed: Followed, law: Law, x: list[Any]) -> Any:
    """As `compile_slope`."""
    values = followed.on_symbols(law.moment)(*x)
    return followed.on_symbols(slope_of)(values[0], values[1], x[LEAN], x[LEAN + 1])


def _bend(followed: Followed, law: Law, x: list[Any]) -> Any:
    """As `compile_bend`."""
    results: list[Any] = [None] * 12
    for j in range(LEAN + 2):
        step = DIFFERENCE * (x[LEAN + 2] if j < LENGTHS else 1.0)
        upper, lower = list(x), list(x)
        upper[j], lower[j] = x[j] + step, x[j] - step
        ahead, behind = _slope(followed, law, upper), _slope(followed, law, lower)
        for i in range(2):
            place = 4 + LEAN * i + j if j < LEAN else 2 * i + j - LEAN
            results[place] = (ahead[i] - behind[i]) / (2.0 * step)
    return results


def _stiffness(followed: Followed, law: Law, x: list[Any]) -> Any:
    """As `compile_law` has it: the law's own, or central differences."""
    if law.stiffness is not None:
        return followed.on_symbols(law.stiffness)(*x)
    is_polar = law.coordinates == "polar"
    n_lengths, radius = (1, x[5]) if is_polar else (3, x[6])
    results: list[Any] = [None] * 16
    for j in range(4):
        step = _DIFFERENCE * (radius if j < n_lengths else 1.0)
        sides = []
        for sign in (1.0, -1.0):
            beside = list(x)
            beside[j] = x[j] + sign * step
            if is_polar and j == 2:
                beside[4] = x[4] + sign * step
            sides.append(_forces(followed, law, beside))
        for i in range(4):
            results[4 * i + j] = (sides[0][i] - sides[1][i]) / (2.0 * step)
    return results


def _solver_of(followed: Followed, plant: Plant, solvers: list[Solver], contact: Any) -> tuple[Solver, int, int]:
    """The solver of a row of the contacts, the memory that the row lies in, and where it begins there."""
    _, memory, begin, _, _ = contact._parts
    number, first = followed.layouts.number_of(plant.contacts)
    assert memory == number
    return solvers[(begin - first) // CONTACT.itemsize], memory, begin


def _solved(followed: Followed, where: tuple[Solver, int, int], given: list[Any], which: int) -> tuple[Any, Any]:
    """Hands the contact as it is now to the code that solves, and takes the multiplier and the displacement from it."""
    solver, memory, begin = where
    sums = followed.sums
    contacts, _ = followed.layouts.number_of(solver.contacts)
    numbers, _ = followed.layouts.number_of(solver.numbers)
    calls, _ = followed.layouts.number_of(solver.calls)
    for place, kind in list(sums.written.items()):
        if place[0] == memory and begin <= place[1] < begin + CONTACT.itemsize:
            own = contacts, place[1] - begin
            sums.step("", "store", kind, own, sums.memory[place], len(sums.steps))
            _put(solver.contacts, own[1], kind, _value(sums, sums.memory[place]))
    for k, number in enumerate(given):
        sums.step("", "store", REAL, (numbers, 8 * k), number, len(sums.steps))
        solver.numbers[k] = _value(sums, number)
    sums.step("", "invoke", (calls, 16 * which), (calls, 16 * which + 8), len(sums.steps))
    solver.kept[which]()
    version = len(sums.steps)
    m, *x = (sums.step(REAL, "load", REAL, (numbers, 8 * (_TRIAL + k)), version) for k in range(_ROOT))
    if not solver.numbers[_TRIAL] > 0.0:
        raise NotStraightError("slip that no direction was found for")
    return m, tuple(x)


def _value(sums: Any, item: Any) -> Any:
    return sums.values[item.index] if hasattr(item, "index") and hasattr(item, "sums") else item


def _put(contacts: Any, begin: int, kind: str, value: Any) -> None:
    memory = contacts.view(np.uint8)
    if kind == REAL:
        memory[begin : begin + 8].view(np.float64)[0] = value
    else:
        memory[begin : begin + 8].view(np.int64)[0] = value


def _returned(followed: Followed, where: tuple[Solver, int, int], pad: Any, contact: Any, trial: Any) -> Any:
    """`_return`: the equations of `slip_to_limit` as `_closest_point` has them."""
    m, x = _solved(followed, where, [*trial.x0, *trial.push, *trial.dash, trial.least], 0)
    on = followed.on_symbols
    s = on(_force)(pad, contact, trial, x)
    normal = contact.grip * on(normal_force)(pad, contact)
    presses = normal > trial.least
    room = normal if presses else trial.least
    H, e, by_s = on(limit_of)(contact.curve, s)
    root = on(length)((H**0.5, 0.0, 0.0)) if not hasattr(H, "sums") else H.sums.step(REAL, "sqrt", H)
    use = root / room
    off = tuple(a - b - m * c for a, b, c in zip(trial.x0, x, e, strict=True))
    on(answer_stiffness)(pad, contact)
    K = list(on(stiffness_of)(contact))
    for k in range(3):
        K[4 * k] = K[4 * k] + trial.dash[k]
    by_x = [sum(K[3 * j + k] * e[j] for j in range(3)) / (root * room) for k in range(3)]
    if presses:
        rise = on(normal_stiffness_of)(contact)
        by_x = [a - contact.grip * use / room * b for a, b in zip(by_x, rise, strict=True)]
    dx, dm = on(_newton_step)(tuple(K), e, by_s, tuple(by_x), off, use, m)
    on(_force)(pad, contact, trial, tuple(a + b for a, b in zip(x, dx, strict=True)))
    return m + dm


def _slid(followed: Followed, where: tuple[Solver, int, int], contact: Any, room: Any) -> Any:
    """`slip_velocity`."""
    m, x = _solved(followed, where, [room], 1)
    on = followed.on_symbols
    lever, D, velocity = contact.lever, contact.dashpot, contact.velocity
    dash = D[0], D[1], D[3] / (lever * lever)
    K = (dash[0], 0.0, 0.0, 0.0, dash[1], 0.0, 0.0, 0.0, dash[2])
    v = velocity[0], velocity[1], lever * velocity[3]
    elastic = on(material_force)(contact)
    s = tuple(a + b * c for a, b, c in zip(elastic, dash, x, strict=True))
    H, e, by_s = on(limit_of)(contact.curve, s)
    root = H.sums.step(REAL, "sqrt", H)
    use = root / room
    off = tuple(a - b - m * c for a, b, c in zip(v, x, e, strict=True))
    by_x = tuple(a * b / (root * room) for a, b in zip(dash, e, strict=True))
    dx, _ = on(_newton_step)(K, e, by_s, by_x, off, use, m)
    return tuple(a - b - c for a, b, c in zip(v, x, dx, strict=True))
