"""The skin of the tips of a scenario."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softhand.errors import ScenarioError
from softhand.model.world import World
from softhand.scenario.instruments import periods_of, stride_of
from softhand.scenario.scenario import Scenario
from softhand.scenario.tactile import TactileSection
from softhand.settings.guesses import did_you_mean
from softhand.tactile.pattern import taxel_pattern
from softhand.tactile.taxels import NUMBERS, Taxels

MOST_NUMBERS = 25_000_000
"""Of the samples that are on their way during a delay, 200 MB."""


def read_taxels(scenario: Scenario, world: World) -> Taxels | None:
    """The taxels of a scenario; None where the tips have no skin.

    Raises:
        ScenarioError: the tip that a dead taxel is said to be of is not there, or the samples of a delay do not fit
            into memory.
    """
    section = scenario.tactile
    if section is None:
        return None
    period = scenario.control_period
    taxels = Taxels(
        taxel_pattern(section.count, section.pattern),
        _dead(section, [tip.name for tip in world.tips]),
        section.hysteresis,
        (section.noise, section.shear_noise),
        section.seed,
        stride_of(section.rate, period),
        periods_of(section.delay, period),
    )
    numbers = NUMBERS * taxels.dead.size
    if taxels.on_their_way * numbers > MOST_NUMBERS:
        longest = max(MOST_NUMBERS // numbers - 1, 0) * taxels.stride * period
        raise ScenarioError(
            f"tactile.delay: got {section.delay:.12g} s, but so many samples of {taxels.dead.size} taxels do not fit "
            f"into memory; give at most {longest:.12g}, a lower tactile.rate, or a smaller tactile.count.",
            key="tactile.delay", value=section.delay,
        )  # fmt: skip
    return taxels


def _dead(section: TactileSection, tips: list[str]) -> NDArray[np.bool_]:
    """Which are dead, shape (nc, taxels)."""
    given = section.dead if isinstance(section.dead, dict) else dict.fromkeys(tips, section.dead)
    dead = np.zeros((len(tips), section.count), bool)
    for tip, numbers in given.items():
        key = f"tactile.dead.{tip}" if isinstance(section.dead, dict) else "tactile.dead"
        if tip not in tips:
            raise ScenarioError(
                f"{key}: the hand has no tip {tip!r}{did_you_mean(tip, tips)}; there are: {', '.join(tips)}.",
                key=key, value=tip,
            )  # fmt: skip
        dead[tips.index(tip), [number - 1 for number in numbers]] = True
    draws = np.random.default_rng(section.seed).permutation(dead.size)[: round(section.dead_share * dead.size)]
    dead.ravel()[draws] = True
    return dead
