"""Grasps proposed: contact points that the fingers of a hand reach and from which they hold the object.

The surface is sampled, each finger keeps the points that it reaches (`places`), and from the combinations with the
largest force-closure margin (`combinations`) the contacts are moved on along the surface (`refinement`). A proposal has
been solved as a grasp at rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any, ClassVar

import numpy as np

from softhand.assembly.plant import read_world
from softhand.errors import GraspError
from softhand.grasping.combinations import Choice, Combinations
from softhand.grasping.places import PRESSING, Place, PlaceFinder
from softhand.grasping.quality import GraspQuality, quality_in
from softhand.grasping.quality_rows import least_reserve
from softhand.grasping.reaching import reachable_place
from softhand.grasping.refinement import refine
from softhand.grasping.situation import Situation, situation_of
from softhand.model.world import own_columns
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.scenario.scenario import Scenario

USE = 0.7
"""Share of the friction that a proposal uses at its start."""
TORQUE_USE = 0.8
"""Largest share of an effort limit."""

_FEW = 3  # of the best combinations that are refined, if fewer proposals are asked for
_MOST_SOLVED = 400  # combinations
_DIGITS = 9  # of a contact point [m]: on its face, and two points in balance, to rounding


@dataclass(frozen=True, eq=False)
class Proposal(Record):
    """A grasp at rest that was found.

    Attributes:
        scenario: the one asked for, with this grasp; its fingers start open if they did.
        quality: its figures, with the fingers closed.
    """

    units: ClassVar = {"contact_points": "m", "internal_force": "N", "joint_guess": "rad, m of slides", "margin": "N/N"}
    unreported: ClassVar = frozenset({"scenario"})

    scenario: Scenario
    quality: GraspQuality

    @property
    def margin(self) -> float:
        """Force-closure margin, by which proposals are ranked, [N] for one newton of normal force in all."""
        return self.quality.margin

    @property
    def contact_points(self) -> Array:
        """In the object frame [m], shape (nc, 3)."""
        return np.array(self.scenario.grasp.contact_points)

    @property
    def internal_force(self) -> Array:
        """The least f_N that keep the conditions [N], shape (pairs,)."""
        return self.quality.internal_force

    @property
    def joint_guess(self) -> Array:
        """Where the inverse kinematics starts [rad or m], shape (n,)."""
        return np.array(self.scenario.grasp.joint_guess or ())

    def section(self) -> str:
        """The section [grasp] of a scenario file."""
        grasp = self.scenario.grasp
        points = "".join(f"    [{', '.join(map(_short, point))}],\n" for point in self.contact_points)
        start, least, guess = (
            ", ".join(map(_short, values)) for values in (grasp.internal_force, self.internal_force, self.joint_guess)
        )
        note = f", open; least once it is closed: {least}" if grasp.opening else ", at the start"
        opening = f"opening = {_short(grasp.opening)}  # [m]\n" if grasp.opening else ""
        if any(grasp.standoff):
            opening += f"standoff = [{', '.join(map(_short, grasp.standoff))}]  # [m]\n"
        reach = f'reach = "{grasp.reach}"\n' if grasp.reach != "fingers" else ""
        return (
            f"[grasp]\ncontact_points = [  # [m], object frame, one a fingertip\n{points}]\n{opening}"
            f"internal_force = [{start}]  # [N]{note}\njoint_guess = [{guess}]  # [rad or m]\n{reach}"
        )


@dataclass(frozen=True, eq=False)
class Proposals(Record, Sequence[Proposal]):
    """Proposed grasps, best first; a sequence of them.

    Attributes:
        proposals: one or more.
    """

    proposals: tuple[Proposal, ...]

    def __getitem__(self, index: Any) -> Any:
        return self.proposals[index]

    def __len__(self) -> int:
        return len(self.proposals)

    def rows(self) -> list[tuple[str, ...]]:
        """A table with one row a proposal; the first row are the names of its columns."""
        rows: list[tuple[str, ...]] = [("", "margin", "friction use", "torque use", "to a limit", "Phi")]
        for k, proposal in enumerate(self.proposals, start=1):
            fingers = proposal.quality.fingers
            rows.append(
                (
                    f"proposal {k}",
                    f"{proposal.margin:.3f} N per newton",
                    f"{max(finger.friction_use for finger in fingers):.2f}",
                    f"{100.0 * max(finger.torque_use.max() for finger in fingers):.0f} %",
                    least_reserve(fingers),
                    ", ".join(f"{math.degrees(finger.Phi):.0f}" for finger in fingers) + " deg",
                )
            )
        return rows


def propose_grasps(
    scenario: Scenario,
    count: int = 5,
    seed: int = 0,
    points: int = 300,
    progress: Callable[[float], None] | None = None,
) -> Proposals:
    """Grasps of the object of a scenario where it lies, best first.

    The quality is the force-closure margin of `closure_margin`, among grasps at rest that

    - reach each point within the joint limits, `RESERVE` or `TRAVEL` from them, stretched to `STRETCH` at most,
    - touch with `PHI`, up to the apex with a law in surface coordinates, with room around the point on the surface,
    - keep links clear of object and other fingers,
    - use at most `USE` of the friction under the smallest internal forces with which each tip presses with `PRESSING`,
    - use at most `TORQUE_USE` of each effort limit.

    The internal forces of a proposal are those smallest ones. Two proposals differ by more than a radius of the tip at
    one contact at least. The same arguments give the same proposals.

    Args:
        scenario: hand, object and its pose; of its grasp only the number of contacts and the guess are used.
        count: most proposals returned.
        seed: of the random choices.
        points: about how many points of the surface are tried.
        progress: called with the share done, 0 to 1.

    Returns:
        One or more proposals.

    Raises:
        GraspError: nothing was found; says which finger reaches nothing, or that no combination holds.
    """
    report = progress or (lambda share: None)
    world = read_world(scenario)
    here = situation_of(scenario, world)
    finder = PlaceFinder(here, points)
    places = []
    for i in range(world.n_tips):
        places.append(finder.places(i))
        report(0.3 * (i + 1) / world.n_tips)
    _check_reach(here, places, len(finder.surface))
    torsions = [tip.torsion(depth) for tip, depth in zip(here.materials, finder.depths, strict=True)]
    combinations = Combinations(here, places, torsions, 2.0 * finder.radius)
    solver, wanted = _Solver(here, finder), max(count, _FEW)
    seeds: list[Array] = []
    found: list[Proposal] = []
    best_first = combinations.best_first(np.random.default_rng(seed))
    for choice in islice(best_first, _MOST_SOLVED):
        places_of = np.array([place.point for place in choice])
        if not finder.is_new(places_of, [*seeds, *(one.contact_points for one in found)]):
            continue
        rough = solver.solve(choice)
        if rough is None:
            continue
        seeds.append(places_of)
        known = [one.contact_points for one in found]
        for proposal in (solver.solve(refine(choice, combinations, finder)), rough):
            if proposal is not None and finder.is_new(proposal.contact_points, known):
                found.append(proposal)
                break
        report(0.3 + 0.7 * len(found) / wanted)
        if len(found) == wanted:
            break
    report(1.0)
    if not found:
        raise GraspError(
            f"no grasp at rest found: {', '.join(str(len(reached)) for reached in places)} points are in reach of the "
            "fingers, but no combination tried holds the object; raise fingertip.friction, move the object, or try "
            "more points.",
            finger="", quantity="margin", value=0.0,
        )  # fmt: skip
    return Proposals(tuple(sorted(found, key=lambda proposal: -proposal.margin)[:count]))


def _check_reach(here: Situation, places: list[list[Place]], tried: int) -> None:
    """GraspError for fingers that reach nothing; says where the object would have to be."""
    missing = [tip.name for tip, found in zip(here.world.tips, places, strict=True) if not found]
    if not missing:
        return
    try:
        remedy = f"{reachable_place(here)}, or give another grasp.joint_guess."
    except GraspError as error:
        remedy = str(error)
    names = " and ".join(missing)
    raise GraspError(
        f"{names} {'reaches' if len(missing) == 1 else 'reach'} none of {tried} points of the object well; {remedy}",
        finger=missing[0], quantity="reach", value=0,
    )  # fmt: skip


class _Solver:
    """From places to a grasp at rest."""

    def __init__(self, here: Situation, finder: PlaceFinder) -> None:
        self._here, self._finder = here, finder

    def solve(self, choice: Choice) -> Proposal | None:
        """The grasp at rest of a combination, None if there is none that keeps the conditions."""
        here, balanced = self._here, self._balanced(choice) if len(choice) == 2 else choice
        if balanced is None:
            return None
        points = np.round([place.point for place in balanced], _DIGITS)
        normals = -np.array([place.normal for place in balanced]) @ here.rotation.T
        friction = np.array([here.friction(i, place.normal) for i, place in enumerate(balanced)])
        forces = here.squeeze(here.to_world(points), normals, friction, USE, PRESSING)
        if forces is None:
            return None
        guess = self._finder.start.copy()
        for i, place in enumerate(balanced):
            guess[own_columns(here.world, i)] = place.angles
        grasp = {"grasp.contact_points": points.tolist(), "grasp.joint_guess": np.round(guess, 4).tolist()}
        squeezed = (np.sign(forces) * np.ceil(1000.0 * np.abs(forces) - 1e-6) / 1000.0).tolist()
        held = {"grasp.internal_force": squeezed, "grasp.opening": 0.0, "grasp.standoff": (0.0, 0.0, 0.0)}
        closed = here.scenario.with_values({**grasp, **held})
        quality = quality_in(here.world, closed)
        if not self._is_good(quality):
            return None
        if not here.scenario.grasp.opening:
            return Proposal(closed, quality)
        scenario = here.scenario.with_values(grasp)
        return Proposal(scenario, quality) if quality_in(here.world, scenario).refusal is None else None

    def _is_good(self, quality: GraspQuality) -> bool:
        """Whether a grasp is at rest, closed, and away from the limits of its joints."""
        if quality.refusal is not None or not quality.margin > 0.0:
            return False
        return all(
            np.all(finger.reserve >= 0.9 * self._finder.reserve[list(tip.columns)])
            and finger.torque_use.max() <= TORQUE_USE
            for tip, finger in zip(self._here.world.tips, quality.fingers, strict=True)
        )

    def _balanced(self, choice: Choice) -> Choice | None:
        """Two points moved so that the centre of mass lies above or below their line: it carries no moment about it."""
        here = self._here
        gravity = here.rotation.T @ here.world.gravity
        if np.linalg.norm(gravity) == 0.0:
            return choice
        points, normals = [place.point for place in choice], [place.normal for place in choice]
        for _ in range(50):
            across = np.cross(points[1] - points[0], gravity)
            if np.linalg.norm(across) < 1e-6 * np.linalg.norm(gravity):
                return None  # one above the other
            across /= np.linalg.norm(across)
            off = float(across @ (here.centre - points[0]))
            if abs(off) < 1e-13:
                break
            nearest = [here.shape.nearest(point + off * across) for point in points]
            points, normals = [point for point, _ in nearest], [normal for _, normal in nearest]
        one, other = (
            self._finder.place(i, point, normal, place.angles)
            for i, (point, normal, place) in enumerate(zip(points, normals, choice, strict=True))
        )
        return None if one is None or other is None else (one, other)


def _short(value: float) -> str:
    return repr(round(float(value), _DIGITS) + 0.0)
