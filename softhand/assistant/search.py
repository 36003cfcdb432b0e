"""Which tips of a hand oppose each other, and in which postures: a wide search, before any object is known."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from softhand.assistant.block import fit_block
from softhand.assistant.clearance import Clearance
from softhand.assistant.facing import Postures, Seed
from softhand.assistant.fingers import Fingers, TipOnBody
from softhand.assistant.opposition import Opposing, Opposition, Sides
from softhand.errors import GraspError
from softhand.numerics.arrays import Array

MARGIN = 0.9
"""Of the faces of the box around the contacts, over the radius of a tip, at least."""

_LOOKED_AT = 60  # pairs of which it is looked at whether links are in the way
_SEEDS = 16  # pairs that others join
_JOINING = 4.0  # badness of a tip that may come to a side
_MOST = 5  # tips that hold together
_INSIDE = 2e-3  # [m] of a link in the box that count as much as a tip that lies on its rim
_PER_COUNT = 8  # oppositions of each count of tips that are kept


class Found(NamedTuple):
    """What the search found, best first, and how it went."""

    oppositions: list[Opposition]
    tried: int
    unused: dict[int, str]
    """Of each tip that no opposition has, why."""
    opposing: Opposing
    """What found them."""


def preferred_width(tips: Sequence[TipOnBody]) -> tuple[tuple[float, float], float]:
    """Bounds of the width of an object for tips of this size, and the width that is liked best [m]."""
    radius = float(np.median([tip.radius for tip in tips]))
    return (max(0.010, 1.0 * radius), 8.0 * max(radius, 0.010)), 4.0 * max(radius, 0.008)


def find_oppositions(
    fingers: Fingers,
    tips: Sequence[TipOnBody],
    names: Sequence[str],
    frozen: Array,
    rest: Array,
    progress: Callable[[float], None],
) -> Found:
    """Oppositions of as many tips as can be, those of most tips first.

    Pairs of tips that face each other are found among random postures of the whole hand; further tips join either side
    where they fit; and each set is brought to its planes.

    Args:
        fingers: the hand.
        tips: all of them.
        names: of them.
        frozen: motors that stay at rest, shape (n,).
        rest: where [rad or m], shape (n,).
        progress: called with the share done.

    Raises:
        GraspError: no two tips oppose each other; says which come nearest, and what is missing.
    """
    widths, preferred = preferred_width(tips)
    postures = Postures(fingers, tips, frozen, rest)
    progress(0.2)
    clearance = Clearance(fingers)
    seeds = postures.seeds(widths, preferred)
    opposing = Opposing(fingers, tips, widths)
    found: list[Opposition] = []
    tried, chosen = 0, _clear_ones(seeds, postures, clearance)[:_SEEDS]
    for k, seed in enumerate(chosen):
        for opposition in _growing(seed, postures, opposing, frozen):
            tried += 1
            if opposition.is_found(widths) and _is_new(opposition, found):
                found.append(opposition)
        progress(0.2 + 0.8 * (k + 1) / len(chosen))
    if not found:
        raise _nothing(seeds, opposing, frozen, names, widths)
    placed = [_out_of_the_way(one, postures, clearance) for one in found]
    ranked = sorted(placed, key=lambda one: one[1] / _INSIDE + _badness(one[0], fingers, tips, preferred))
    found = [one for one, _ in ranked]
    kept: list[Opposition] = []
    for count in sorted({len(one.sides.fingers) for one in found}, reverse=True):
        kept += [one for one in found if len(one.sides.fingers) == count][:_PER_COUNT]
    used = {i for one in found for i in one.sides.fingers}
    unused = {i: _why_unused(i, postures, seeds, names) for i in range(len(tips)) if i not in used}
    return Found(kept, tried, unused, opposing)


def _clear_ones(seeds: Sequence[Seed], postures: Postures, clearance: Clearance) -> list[Seed]:
    """The seeds with those last in which links are in the object that would be between."""
    ranked = []
    for seed in seeds[:_LOOKED_AT]:
        pair = [postures.tips[i] for i in seed.pair]
        tips = postures.fingers.at(seed.motors, pair)
        planes = [
            float(centre @ seed.normal) - sign * tip.radius
            for centre, sign, tip in zip(tips.centres, (1.0, -1.0), pair, strict=True)
        ]
        rough = Opposition(
            Sides(seed.pair, 1), seed.motors, seed.normal, (planes[0], planes[1]), tips, np.zeros(2), 0.0
        )
        ranked.append((seed.badness + _out_of_the_way(rough, postures, clearance)[1] / (5.0 * _INSIDE), seed))
    return [seed for _, seed in sorted(ranked, key=lambda one: one[0])]


def _out_of_the_way(one: Opposition, postures: Postures, clearance: Clearance) -> tuple[Opposition, float]:
    """An opposition with its idle fingers where they are least in the way, and how deep a link is in its box [m]."""
    touching = [postures.tips[i] for i in one.sides.fingers]
    block = fit_block(one, touching, MARGIN)
    used = np.any([postures.moved[i] for i in one.sides.fingers], axis=0)
    idle = [postures.moved[i] & ~used for i in range(len(postures.tips)) if i not in one.sides.fingers]
    motors = clearance.out_of_the_way(one.motors, block, touching, idle)
    return replace(one, motors=motors), clearance.depth(motors, block, touching)


def _growing(seed: Seed, postures: Postures, opposing: Opposing, frozen: Array) -> Iterator[Opposition]:
    """The pair, and the pair with one further tip after the other on either side, as long as that works."""
    tips = postures.tips
    pair = opposing.find(Sides(seed.pair, 1), seed.motors, seed.normal, frozen)
    yield pair
    for crowded in (1, 0):  # the side that the others join; the thumb stays alone on its own
        have: list[list[int]] = [[seed.pair[0]], [seed.pair[1]]]
        motors, normal = pair.motors, pair.normal
        start = seed._replace(motors=motors, normal=normal)
        plane = pair.planes[crowded]
        sign = 1.0 if crowded == 0 else -1.0
        fits = []
        for i in range(len(tips)):
            if i in seed.pair:
                continue
            height = plane + sign * tips[i].radius
            middle = pair.tips.centres[crowded]
            badness, joined = postures.joining(start, i, sign, height, middle)
            if badness < _JOINING:
                fits.append((badness, i, joined))
        for _, i, joined in sorted(fits, key=lambda fit: fit[0]):
            if len(have[0]) + len(have[1]) == _MOST:
                break
            own = postures.moved[i] & ~np.any([postures.moved[k] for side in have for k in side], axis=0)
            ahead = motors.copy()
            ahead[own] = joined[own]
            longer = [*have[crowded], i]
            sides = (
                Sides((*longer, *have[1]), len(longer)) if crowded == 0 else Sides((*have[0], *longer), len(have[0]))
            )
            opposition = opposing.find(sides, ahead, normal, frozen)
            yield opposition
            if opposition.is_found(opposing.widths):
                have[crowded] = longer
                motors, normal = opposition.motors, opposition.normal


def _is_new(one: Opposition, others: Sequence[Opposition]) -> bool:
    return all(
        one.sides.fingers != other.sides.fingers or np.max(np.abs(one.tips.centres - other.tips.centres)) > 3e-3
        for other in others
    )


def _badness(one: Opposition, fingers: Fingers, tips: Sequence[TipOnBody], preferred: float) -> float:
    """How far from straight, from amid the ranges, from opposite and from the width that is liked."""
    used = np.any(one.tips.centre_slopes != 0.0, axis=(0, 1))
    half = 0.5 * (fingers.upper - fingers.lower)
    off = np.abs(one.motors - 0.5 * (fingers.upper + fingers.lower)) / half
    crowded = float(np.mean(off[used] ** 4)) if used.any() else 0.0
    straight = float(np.mean(1.0 - one.leaning))
    inside = max(one.overhang([tips[i] for i in one.sides.fingers]), 0.0)
    return (
        inside / _INSIDE
        + straight
        + crowded
        + one.beside / one.lever / 4.0
        + abs(one.width - preferred) / (4.0 * preferred)
    )


def _nothing(
    seeds: Sequence[Seed], opposing: Opposing, frozen: Array, names: Sequence[str], widths: tuple[float, float]
) -> GraspError:
    """No two tips oppose each other: which come nearest, and what is missing."""
    if not seeds:
        return GraspError(
            "the hand has no two fingertips that move against each other; name them with --tip.",
            finger="", quantity="reach", value=0.0,
        )  # fmt: skip
    seed = seeds[0]
    one = opposing.find(Sides(seed.pair, 1), seed.motors, seed.normal, frozen)
    first, second = (names[i] for i in seed.pair)
    lacks = []
    worst = int(np.argmin(one.leaning))
    angle = float(np.degrees(np.arccos(np.clip(one.leaning[worst], -1.0, 1.0))))
    if angle > 72.0:
        lacks.append(
            f"{(first, second)[worst]} would touch {angle:.0f} deg beside the way out of its tip, beyond the rim of "
            "the ball at 72 deg: turn x of that tip towards the other finger"
        )
    off = float(np.max(np.abs(one.missed)))
    if off > 2e-5:
        lacks.append(
            f"{(first, second)[int(np.argmax(np.abs(one.missed)))]} stays {1e3 * off:.2g} mm short of its face"
        )
    if one.beside > one.lever:
        way = one.tips.centres[0] - one.tips.centres[1]
        way = way - (way @ one.normal) * one.normal
        x, y, z = 1e3 * way
        lacks.append(
            f"{first} stays ({x:.2g}, {y:.2g}, {z:.2g}) mm beside {second}, where {1e3 * one.lever:.2g} mm would do"
        )
    if not widths[0] - 1e-3 < one.width < widths[1] + 1e-3:
        side = "nearer than" if one.width < widths[0] else "farther than"
        lacks.append(
            f"the gap between them is {1e3 * one.width:.3g} mm, {side} the {1e3 * widths[0]:.3g} to "
            f"{1e3 * widths[1]:.3g} mm of an object for tips of this size"
        )
    told = "; ".join(lacks) or "but not within the limits of their joints"
    return GraspError(
        f"no two of the fingertips {', '.join(names)} oppose each other. The nearest are {first} and {second}: {told}.",
        finger=first, quantity="reach", value=off,
    )  # fmt: skip


def _why_unused(i: int, postures: Postures, seeds: Sequence[Seed], names: Sequence[str]) -> str:
    """Why no opposition has a tip."""
    best = min(
        ((*postures.joining(seed, i, sign, height, seed_middle), seed)
         for seed in seeds[:_SEEDS] if i not in seed.pair
         for sign, height, seed_middle in _sides_of(seed, postures)),
        key=lambda item: item[0], default=None,
    )  # fmt: skip
    if best is None:
        return "it was not tried"
    return f"it does not come to a side of a box between {names[best[2].pair[0]]} and {names[best[2].pair[1]]}"


def _sides_of(seed: Seed, postures: Postures) -> Iterator[tuple[float, float, Array]]:
    """Sign, height and middle of both sides of a seed."""
    tips = postures.fingers.at(seed.motors, [postures.tips[i] for i in seed.pair], with_slopes=False)
    for sign, centre in zip((1.0, -1.0), tips.centres, strict=True):
        yield sign, float(centre @ seed.normal), centre
