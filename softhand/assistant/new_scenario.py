"""From the URDF of a hand to a scenario that holds a box, in one call."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from softhand.assistant.block import fit_block
from softhand.assistant.draft import Draft
from softhand.assistant.fingers import Fingers
from softhand.assistant.found_scenario import NewScenario, Tip
from softhand.assistant.opposition import Opposition
from softhand.assistant.search import MARGIN, Found, find_oppositions
from softhand.assistant.tips import FoundTip, arm_motors, find_tips
from softhand.assistant.trial import IN_THE_WAY, OUT_OF_REACH, Bench, Trial
from softhand.errors import GraspError, ModelError
from softhand.model.urdf.pinocchio_model import build_model
from softhand.numerics.arrays import Array
from softhand.scenario.blank import read_hand
from softhand.scenario.scenario import Scenario, load_scenario

FRICTION = 0.8
"""mu that is assumed [1]."""

_MARGINS = 1.4, MARGIN, 0.65  # of the faces of the box around the contacts, over the radius of a tip
_GRASPS = 14  # oppositions whose grasp is tried
_RUNS = 4  # grasps that are run
_DEEPER = 2  # times in which depths are taken over

Progress = Callable[[str, float], None]


def new_scenario(
    urdf: str | Path,
    file: str | Path | None = None,
    *,
    tips: Sequence[str] = (),
    friction: float = FRICTION,
    wrong_sign: str = "",
    progress: Progress | None = None,
) -> NewScenario:
    """A scenario in which a hand holds a box, found from its URDF alone.

        found = softhand.new_scenario("my_hand.urdf", "my_hand.toml")
        recording = softhand.simulate(found.scenario)

    Fingertips are found at the outermost links, a ball as wide as their shapes are there. Postures in which tips oppose
    each other are searched all over the ranges of the joints; the box is what fits between, where they are. The squeeze
    is the least in which each tip presses and uses half of its friction. The gains are those of a list under which no
    small motion grows, and the scenario is run for 2 s with a push. Ways to oppose are tried until one passes all.

    Args:
        urdf: of the hand.
        file: of the scenario that is written, the object beside it as NAME-box.urdf; nothing is written if None, and
            then the scenario names files that are gone.
        tips: links whose fingers alone are taken; all if empty.
        friction: mu between tips and object.
        wrong_sign: of joints that follow others by `<mimic>` to where their limits do not let them: "limits" or
            "multiplier"; such a hand is refused if it is not said.
        progress: called with what is done and the share of it.

    Raises:
        ModelError: the URDF cannot be read as a hand, or has no two fingertips.
        ScenarioError: `wrong_sign` is none, or there is no such joint.
        GraspError: nothing holds; says what stands in the way.
        SofthandError: a file cannot be written.
    """
    urdf, tell = Path(urdf), progress or (lambda what, share: None)
    tell("reading the hand", 0.0)
    hand, remedies = read_hand(urdf, wrong_sign)
    model = build_model(hand)
    fingers = Fingers(hand, model)
    found_tips = find_tips(hand, model, fingers, tips)
    bodies, names = [tip.on_body for tip in found_tips], [tip.name for tip in found_tips]
    if len(found_tips) < 2:
        raise ModelError(
            f"{urdf}: got one fingertip, {names[0]}; a hand that holds something needs two or more. Name the links "
            "with --tip, as often as there are fingers.",
            file=str(urdf),
        )
    frozen = arm_motors(fingers, bodies)
    found = find_oppositions(
        fingers, bodies, names, frozen, fingers.rest, lambda share: tell("opposing fingertips", share)
    )
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(Path(folder))
        best, count = _first_that_holds(
            _Walk(urdf, remedies, fingers, found_tips, friction, bench, found, frozen, tell)
        )
        scenario: Scenario | None = best.scenario
        files: tuple[str, ...] = ()
        text, block = "", best.draft.block.urdf("box")
        if file is not None:
            files = _write(best.draft, Path(file))
            scenario, text = load_scenario(Path(file)), Path(file).read_text(encoding="utf-8")
    assert scenario is not None
    return _result(best, scenario, text, block, files, remedies, found, count)


@dataclass(frozen=True, eq=False)
class _Walk:
    urdf: Path
    remedies: list[str]
    fingers: Fingers
    tips: list[FoundTip]
    friction: float
    bench: Bench
    found: Found
    frozen: Array
    tell: Progress

    def draft(self, opposition: Opposition, margin: float) -> Draft:
        """Before it is squeezed."""
        chosen = [self.tips[i] for i in opposition.sides.fingers]
        count = len(chosen)
        unused = [
            (self.tips[i].name, self.found.unused.get(i, "the grasp without it is better, or the only one that holds"))
            for i in range(len(self.tips))
            if i not in opposition.sides.fingers
        ]
        return Draft(
            hand=self.urdf,
            remedies=tuple(self.remedies),
            tips=tuple(chosen),
            unused=tuple(unused),
            block=fit_block(opposition, [tip.on_body for tip in chosen], margin),
            friction=self.friction,
            pressing=1.0,
            squeeze=np.zeros(count * (count - 1) // 2),
            motors=self.fingers.names,
            is_coupled=self.fingers.is_coupled,
            guess=np.round(opposition.motors, 5),
        )

    def grasp(self, opposition: Opposition) -> Trial:
        """The grasp of an opposition, its box with as much margin as the links leave."""
        trial = self.bench.grasp(self.draft(opposition, _MARGINS[0]))
        for _ in range(_DEEPER):  # fingers that cannot reach each point need the depths that they are pressed to
            if trial.stage != OUT_OF_REACH or trial.depths is None:
                break
            opposition = self.found.opposing.find(
                opposition.sides, opposition.motors, opposition.normal, self.frozen, trial.depths
            )
            trial = self.bench.grasp(self.draft(opposition, _MARGINS[0]))
        for margin in _MARGINS[1:]:
            if trial.holds or trial.stage != IN_THE_WAY:
                break
            trial = self.bench.grasp(self.draft(opposition, margin))
        return trial

    def run(self, trial: Trial, opposition: Opposition) -> Trial:
        """A grasp with gains, and run."""
        can_move = bool(np.count_nonzero(np.any(opposition.tips.centre_slopes != 0.0, axis=(0, 1))) > 1)
        return self.bench.run(trial, can_move, lambda share: self.tell("gains and a run", share))


def _first_that_holds(walk: _Walk) -> tuple[Trial, int]:
    """The first grasp that passes all, those of most tips first; and how many were tried."""
    failed: list[Trial] = []
    spare: list[tuple[Trial, Opposition]] = []
    runs, chosen = 0, _in_turn(walk.found.oppositions)[:_GRASPS]
    for k, opposition in enumerate(chosen):
        walk.tell("grasping", k / len(chosen))
        trial = walk.grasp(opposition)
        if trial.holds:
            runs += 1
            trial = walk.run(trial, opposition)
            if trial.holds:
                return trial, k + 1
        elif trial.is_spare:
            spare.append((trial, opposition))
        failed.append(trial)
        if runs == _RUNS:
            break
    for trial, opposition in spare[:_RUNS]:
        trial = walk.run(trial, opposition)
        if trial.holds:
            return trial, len(failed)
        failed.append(trial)
    far = max(failed, key=lambda trial: trial.stage)
    names, refusal = " and ".join(tip.name for tip in far.draft.tips), far.refusal.rstrip(".")
    raise GraspError(
        f"{walk.urdf}: {len(failed)} grasps were tried and none holds. The farthest came {names}, but {refusal}. "
        "Take other fingers with --tip, more friction with --friction, or write the grasp by hand: docs/hands.md.",
        finger="", quantity="grasp", value=float(len(failed)),
    )  # fmt: skip


def _in_turn(oppositions: Sequence[Opposition]) -> list[Opposition]:
    """Some with most tips, then some with one less, and so on, and then what is left of each."""
    counts = sorted({len(one.sides.fingers) for one in oppositions}, reverse=True)
    groups = [[one for one in oppositions if len(one.sides.fingers) == count] for count in counts]
    first = [one for group in groups for one in group[:3]]
    return first + [one for group in groups for one in group[3:]]


def _write(draft: Draft, file: Path) -> tuple[str, ...]:
    from softhand.recording.whole_file import write_whole

    block = box_file(file)
    write_whole(block, lambda: draft.block.urdf("box").encode())
    write_whole(file, lambda: draft.text(file, block).encode())
    return str(file), str(block)


def box_file(file: Path) -> Path:
    """Where the object of a scenario is written."""
    return file.with_name(f"{file.stem}-box.urdf")


def _result(
    trial: Trial, scenario: Scenario, text: str, block: str, files: tuple[str, ...], remedies: list[str], found: Found,
    count: int,
) -> NewScenario:  # fmt: skip
    draft, quality, gains, summary = trial.draft, trial.quality, trial.gains, trial.summary
    assert quality is not None and gains is not None and summary is not None
    return NewScenario(
        scenario=scenario,
        text=text,
        object_text=block,
        files=files,
        remedies=tuple(remedies),
        tips=tuple(
            Tip(tip.name, tip.link, tuple(map(float, tip.on_body.centre)), tip.rpy, tip.on_body.radius, tip.why)
            for tip in draft.tips
        ),
        unused=dict(draft.unused),
        object_size=draft.block.size,
        object_mass=draft.block.mass,
        object_position=tuple(map(float, draft.block.position)),
        object_rpy=draft.block.rpy,
        internal_force=tuple(map(float, draft.squeeze)),
        margin=quality.margin,
        friction_use=max(float(finger.friction_use) for finger in quality.fingers),
        torque_use=max(float(finger.torque_use.max(initial=0.0)) for finger in quality.fingers),
        period=gains.period,
        gains={name: value for name, value, _ in gains.settings},
        growth=gains.growth,
        collisions=tuple(f"{one.one} and {one.other}, {1e3 * one.depth:.2g} mm" for one in trial.collisions),
        position_error=summary.position_error,
        orientation_error=summary.orientation_error,
        tried=(found.tried, count),
        quality=quality,
    )
