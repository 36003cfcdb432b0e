"""An opposition tried in earnest: a box, a squeeze, a start at rest, gains, and a run with a push."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from softhand.analysis.summary import Summary, summarize
from softhand.assembly.build import simulate
from softhand.assembly.collisions import collisions_at_start
from softhand.assembly.plant import read_world
from softhand.assembly.resolve import resolve
from softhand.assistant.clearance import shapes_of
from softhand.assistant.draft import Draft
from softhand.assistant.gains import Gains, find_gains
from softhand.collision.record import Collision
from softhand.errors import SofthandError
from softhand.grasping.quality import GraspQuality, quality_in
from softhand.grasping.situation import situation_of
from softhand.numerics.arrays import Array
from softhand.scenario.scenario import Scenario, load_scenario

USE = 0.5
"""Share of the friction that is used at the start."""
PRESSING = 1.5, 0.8, 0.4
"""Least normal forces of a tip that are tried, [N]."""
TORQUE_USE = 0.7
"""Largest share of an effort limit."""
DEEP, CARRYING = 1e-3, 3e-3
"""[m] by which a link may be in the object, and, where nothing else is found, one that carries a tip."""

OUT_OF_REACH, IN_THE_WAY = 2, 3
"""Stages of a trial: no start at rest; a grasp at rest that is none to take, most often as links are in the box."""

_KEPT = 1.0  # [mm] to which the object must be back after the push
_TURNED = 1.0  # [deg]
_PUSH = 0.2  # of the weight
_WHEN, _LONG = 0.3, 0.2  # [s]


@dataclass(frozen=True, eq=False)
class Trial:
    """What became of a draft.

    Attributes:
        draft: with its squeeze and gains.
        scenario: of it.
        quality: of its grasp.
        collisions: at the start.
        gains: that it has; None where it did not come so far.
        summary: of 2 s in which it was pushed; None likewise.
        refusal: why it does not hold; "" if it does.
        stage: how far it came; the greater the farther.
        depths: how deep the squeeze presses each tip in [m], shape (tips,); None if it is not known.
        is_spare: whether nothing is wrong but that links which carry tips are a little in the object.
    """

    draft: Draft
    scenario: Scenario | None
    quality: GraspQuality | None
    collisions: tuple[Collision, ...]
    gains: Gains | None
    summary: Summary | None
    refusal: str
    stage: int
    depths: Array | None = None
    is_spare: bool = False

    @property
    def holds(self) -> bool:
        """Whether it is a scenario to begin from."""
        return not self.refusal


class Bench:
    """Where drafts are tried: a folder for their files."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._count = folder, 0

    def load(self, draft: Draft) -> Scenario:
        """The scenario of a draft, from its text."""
        self._count += 1
        block, file = self._folder / f"box-{self._count}.urdf", self._folder / f"draft-{self._count}.toml"
        block.write_text(draft.block.urdf("box"), encoding="utf-8")
        file.write_text(draft.text(file, block), encoding="utf-8")
        return load_scenario(file)

    def grasp(self, draft: Draft) -> Trial:
        """The draft with a squeeze that holds the box at rest, or why there is none."""
        trial = Trial(draft, None, None, (), None, None, "nothing was tried", 0)
        try:
            scenario = self.load(draft)
            world = read_world(scenario)
            here = situation_of(scenario, world)
        except SofthandError as error:
            return replace(trial, refusal=str(error))
        surface = [here.shape.nearest(point) for point in draft.block.points]
        points = here.to_world(np.array([point for point, _ in surface]))
        normals = -np.array([normal for _, normal in surface]) @ here.rotation.T
        friction = np.array([here.friction(i, normal) for i, (_, normal) in enumerate(surface)])
        for pressing in PRESSING:
            forces = here.squeeze(points, normals, friction, USE, pressing)
            if forces is None:
                return replace(trial, refusal="no squeeze keeps all contacts within their friction", stage=1)
            squeeze = np.sign(forces) * np.ceil(1000.0 * np.abs(forces) - 1e-6) / 1000.0
            ahead = replace(draft, squeeze=squeeze, pressing=pressing)
            closed = scenario.with_values({"grasp.internal_force": squeeze.tolist()})
            try:
                quality = quality_in(world, closed)
            except SofthandError as error:
                return replace(trial, draft=ahead, refusal=str(error), stage=2)
            ahead = replace(ahead, margin=quality.margin)
            pressing_of = np.einsum("ij,ij->i", quality.forces, normals)
            depths = np.array([one.depth(float(f)) for one, f in zip(here.materials, pressing_of, strict=True)])
            trial = Trial(ahead, closed, quality, (), None, None, "", 4, depths)
            if quality.refusal is not None:
                trial = replace(trial, refusal=str(quality.refusal), stage=2)
                if quality.refusal.quantity == "reach":
                    return trial
                continue
            use = max(float(finger.torque_use.max(initial=0.0)) for finger in quality.fingers)
            if use > TORQUE_USE:
                trial = replace(
                    trial, refusal=f"the torques take {100.0 * use:.0f} % of the effort limits at the start", stage=3
                )
                continue
            if not quality.margin > 0.0:
                return replace(trial, refusal="the grasp has no force closure", stage=3)
            return self._clear(trial)
        return trial

    def _clear(self, trial: Trial) -> Trial:
        """Whether the links stay outside the box."""
        assert trial.scenario is not None
        try:
            setup = resolve(trial.scenario)
            found = collisions_at_start(setup, shapes_of(setup.world.hand)).found
        except SofthandError as error:
            return replace(trial, refusal=f"its collisions cannot be told: {error}", stage=3)
        carrying = {tip.link for tip in trial.draft.tips}
        deep = [one for one in found if "object" in (one.one, one.other) and one.depth > DEEP]
        is_spare = all(one.depth <= CARRYING and carrying & {one.one, one.other} for one in deep)
        trial = replace(trial, collisions=tuple(found), is_spare=is_spare)
        if deep:
            worst = max(deep, key=lambda one: one.depth)
            link = worst.other if worst.one == "object" else worst.one
            return replace(trial, refusal=f"{link} is {1e3 * worst.depth:.2g} mm inside the box", stage=3)
        return trial

    def run(self, trial: Trial, can_move: bool, progress: Callable[[float], None]) -> Trial:
        """A grasp with gains, simulated for 2 s with a push."""
        assert trial.scenario is not None
        try:
            gains = find_gains(trial.scenario, can_move, lambda done: progress(0.8 * done))
        except SofthandError as error:
            return replace(trial, refusal=str(error), stage=5)
        draft = trial.draft.with_gains(gains.period, gains.settings)
        try:
            scenario = self.load(draft)
        except SofthandError as error:
            return replace(trial, refusal=str(error), stage=5)
        trial = replace(trial, draft=draft, scenario=scenario, gains=gains, refusal="")
        if gains.growth > 0.1:
            return replace(
                trial, refusal=f"small motions grow at {gains.growth:+.2g} 1/s with all gains that were tried", stage=6
            )
        force = [_PUSH * 9.81 * draft.block.mass * share for share in (0.6, 0.6, -0.5)]
        push = {"on": "object", "force": force, "start": _WHEN, "duration": _LONG}
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                recording = simulate(scenario.with_values({"push": [push]}))
                summary = summarize(recording)
        except SofthandError as error:
            return replace(trial, refusal=f"the run is lost: {error}", stage=7)
        progress(1.0)
        trial = replace(trial, summary=summary, stage=8)
        if not recording.complete:
            return replace(trial, refusal=f"the run ends at {recording.stop_time:.3g} s: {recording.reason}", stage=7)
        if summary.position_error > _KEPT or summary.orientation_error > _TURNED:
            return replace(
                trial, stage=7,
                refusal=f"2 s with a push leave the box {summary.position_error:.2g} mm and "
                f"{summary.orientation_error:.2g} deg away",
            )  # fmt: skip
        return trial
