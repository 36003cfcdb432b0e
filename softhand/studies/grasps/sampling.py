"""Grasps at rest by chance: a pose of the object, places that the fingers reach there, and a squeeze."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from softhand.assembly.plant import read_world
from softhand.contact.pairs import contact_pairs
from softhand.errors import GraspError, SofthandError
from softhand.grasping.combinations import Combinations
from softhand.grasping.places import Place, PlaceFinder
from softhand.grasping.quality import quality_in
from softhand.grasping.situation import Situation, situation_of
from softhand.model.world import own_columns
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.spatial import rotation_of
from softhand.scenario.scenario import Scenario
from softhand.studies.grasps.squeezing import contacts_at
from softhand.studies.grasps.variables import arrays_of

_SURFACE = 2000  # points of the object, of which those of a pose are drawn
_TRIED = 40  # points a finger and pose
_DRAWN = 200  # choices of places a pose, a finger each
_PER_POSE = 8  # of them that are solved
_DIRECTIONS = 400  # of the internal forces that are tried
_USE = 0.4, 0.95  # share of the friction that the squeeze leaves a grasp to use
_PRESSING = 0.5, 3.0  # [N] with which each tip presses at least


class Spread(NamedTuple):
    """Within what the pose of the object is drawn, about that of the scenario.

    Attributes:
        position: largest way along each axis of the base [m].
        turn: largest angle about a random axis [rad].
    """

    position: float = 0.01
    turn: float = 0.3


class Sampled(NamedTuple):
    """What one pose gave.

    Attributes:
        grasps: the arrays of each grasp by name, as `variables.KEPT` has them.
        refused: how often what stood in the way.
    """

    grasps: list[dict[str, Array]]
    refused: Counter[str]


class Sampler:
    """Draws poses of an object and grasps of it.

    Args:
        scenario: hand, object and its pose, laws and friction; of its grasp only the guess.
        spread: of the poses.
    """

    def __init__(self, scenario: Scenario, spread: Spread) -> None:
        self.scenario = scenario.with_values({"grasp.opening": 0.0, "grasp.standoff": (0.0, 0.0, 0.0)})
        self.spread = spread
        self.world = read_world(self.scenario)
        self.here = situation_of(self.scenario, self.world)
        self._directions = _directions(len(contact_pairs(self.world.n_tips)))
        self.finder = PlaceFinder(self.here, _SURFACE)
        if not self.finder.surface:
            raise GraspError(
                "the object has no place with room for a tip; take a larger object or smaller tips.",
                finger="", quantity="room", value=0,
            )  # fmt: skip

    def at(self, seed: int, index: int) -> Sampled:
        """The grasps of a pose, the same for the same seed and index."""
        rng = np.random.default_rng([seed, index])
        here = self._posed(rng)
        self.finder.here = here
        places = [self._places(i, rng) for i in range(self.world.n_tips)]
        refused: Counter[str] = Counter()
        if not all(places):
            refused["reach"] += 1
            return Sampled([], refused)
        torsions = [tip.torsion(depth) for tip, depth in zip(here.materials, self.finder.depths, strict=True)]
        apart = Combinations(here, places, torsions, 2.0 * self.finder.radius)
        chosen = np.unique(np.column_stack([rng.integers(len(some), size=_DRAWN) for some in places]), axis=0)
        chosen = rng.permuted(chosen, axis=0)
        use = rng.uniform(*_USE, len(chosen))
        lightest, hardest = (float(np.log(force)) for force in _PRESSING)
        pressing = np.exp(rng.uniform(lightest, hardest, len(chosen)))
        holds = self._may_hold(here, places, chosen, use)
        refused["no squeeze holds"] += int(np.count_nonzero(~holds))
        found = []
        for k in np.flatnonzero(holds)[:_PER_POSE]:
            choice = [own[place] for own, place in zip(places, chosen[k], strict=True)]
            if not all(apart.keep_apart(a, b) for i, a in enumerate(choice) for b in choice[:i]):
                refused["fingers in each other's way"] += 1
                continue
            grasp = self._solved(here, choice, float(use[k]), float(pressing[k]))
            if isinstance(grasp, str):
                refused[grasp] += 1
            else:
                found.append(grasp)
        return Sampled(found, refused)

    def _may_hold(
        self, here: Situation, places: Sequence[Sequence[Place]], chosen: AnyArray, use: Array
    ) -> NDArray[np.bool_]:
        """Which choices some squeeze holds if it is hard enough to make nothing of the weight, shape (choices,).

        Of a fixed set of directions of the internal forces, one has to keep all contacts within their cones.
        """
        points = np.stack([[places[i][k].point for k in chosen[:, i]] for i in range(chosen.shape[1])], axis=1)
        inward = -np.stack([[places[i][k].normal for k in chosen[:, i]] for i in range(chosen.shape[1])], axis=1)
        mu = np.array([[here.friction(i, -n) for i, n in enumerate(row)] for row in inward]) * use[:, None]
        pairs = contact_pairs(chosen.shape[1])
        force = np.zeros((len(chosen), len(self._directions), *points.shape[1:]))
        for k, (i, j) in enumerate(pairs):
            way = points[:, j] - points[:, i]
            way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
            each = self._directions[:, k, None] * way[:, None]
            force[:, :, i] += each
            force[:, :, j] -= each
        pressing = np.einsum("cdir,cir->cdi", force, inward)
        sideways = np.linalg.norm(force - pressing[..., None] * inward[:, None], axis=-1)
        inside: NDArray[np.bool_] = np.any(np.all(sideways <= mu[:, None] * pressing, axis=-1), axis=1)
        return inside

    def _posed(self, rng: np.random.Generator) -> Situation:
        """The object at a random pose, evenly in a cube, turned evenly up to an angle about a random axis."""
        before = self.scenario.object
        position = np.array(before.position) + rng.uniform(-1.0, 1.0, 3) * self.spread.position
        axis = rng.standard_normal(3)
        axis /= np.linalg.norm(axis)
        turn = Rotation.from_rotvec(float(rng.uniform(0.0, self.spread.turn)) * axis)
        rpy = (turn * Rotation.from_matrix(rotation_of(before.rpy))).as_euler("ZYX")[::-1]
        moved = self.scenario.with_values(
            {"object.position": np.round(position, 6).tolist(), "object.rpy": np.round(rpy, 6).tolist()}
        )
        return replace(
            self.here, scenario=moved, position=np.array(moved.object.position), rotation=rotation_of(moved.object.rpy)
        )

    def _places(self, finger: int, rng: np.random.Generator) -> list[Place]:
        """Places of one finger among random points of the surface."""
        some = rng.choice(len(self.finder.surface), min(_TRIED, len(self.finder.surface)), replace=False)
        return self.finder.places_among(finger, [self.finder.surface[k] for k in some])

    def _solved(self, here: Situation, choice: Sequence[Place], use: float, pressing: float) -> dict[str, Array] | str:
        """The grasp at rest of some places, or what stands in the way."""
        points = np.round([place.point for place in choice], 9)
        normals = -np.array([place.normal for place in choice]) @ here.rotation.T
        friction = np.array([here.friction(i, place.normal) for i, place in enumerate(choice)])
        contacts = contacts_at(here, here.to_world(points), normals, friction)
        forces = None if contacts is None else contacts.least(use, pressing)
        if contacts is None or forces is None:
            return "no squeeze holds"
        guess = self.finder.start.copy()
        for i, place in enumerate(choice):
            guess[own_columns(here.world, i)] = place.angles
        try:
            closed = here.scenario.with_values({
                "grasp.contact_points": points.tolist(),
                "grasp.joint_guess": np.round(guess, 4).tolist(),
                "grasp.internal_force": np.round(forces, 6).tolist(),
            })  # fmt: skip
            quality = quality_in(here.world, closed, with_least=False)
        except SofthandError as error:
            return getattr(error, "quantity", "") or "scenario"
        if quality.refusal is not None:
            return quality.refusal.quantity
        if max(float(np.max(finger.torque_use)) for finger in quality.fingers) > 1.0:
            return "torque"
        return arrays_of(quality, contacts.least(), closed, here.world)


def _directions(pairs: int) -> Array:
    """Directions of the internal forces, most of which squeeze, shape (directions, pairs)."""
    if pairs == 1:
        return np.ones((1, 1))
    drawn = np.random.default_rng(0).standard_normal((_DIRECTIONS, pairs))
    drawn[: _DIRECTIONS // 2] = np.abs(drawn[: _DIRECTIONS // 2])
    rows: Array = drawn / np.linalg.norm(drawn, axis=1, keepdims=True)
    return rows
