"""The hands of the scenarios that ship: those of softhand and those that an extra brings."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from softhand.errors import ScenarioError
from softhand.model.urdf.examination import HAND
from softhand.model.urdf.mimics import read_mimics
from softhand.model.urdf.pinocchio_model import build_model
from softhand.model.urdf.urdf import Urdf
from softhand.scenario.bodies import PlacedTip
from softhand.scenario.file import resolve_path, scenario_names
from softhand.scenario.scenario import Scenario, load_scenario


@dataclass(frozen=True)
class Hand:
    """One hand.

    Attributes:
        name: of its URDF file.
        urdf: as a scenario names it.
        tips: name of each soft fingertip, with the link that carries it where that has another name.
        scenarios: those that ship and use it.
        joints: how many move.
        motors: how many motors move them.
        mass: of all that moves [kg].
        missing: why it cannot be read and what to do; "" if it can, else there are neither joints nor mass.
    """

    name: str
    urdf: str
    tips: tuple[str, ...]
    scenarios: tuple[str, ...]
    joints: int = 0
    mass: float = 0.0
    missing: str = ""
    motors: int = 0

    def rows(self) -> list[tuple[str, str]]:
        """Label and value of each line of a table."""
        found = (
            [("to be installed", self.missing)]
            if self.missing
            else [("joints", self._joints), ("moving mass", f"{self.mass:.3g} kg")]
        )
        return [
            ("urdf", self.urdf),
            ("fingers", str(len(self.tips))),
            ("tips", ", ".join(self.tips)),
            *found,
            ("scenarios", ", ".join(self.scenarios)),
        ]

    @property
    def _joints(self) -> str:
        coupled = f", moved by {self.motors} motor{'' if self.motors == 1 else 's'}"
        return f"{self.joints}{coupled if self.motors < self.joints else ''}"


def known_hands() -> list[Hand]:
    """The hands of all scenarios that ship, in the order of their URDFs."""
    users: dict[str, list[tuple[str, Scenario]]] = {}
    for name in scenario_names():
        scenario = load_scenario(name)
        users.setdefault(scenario.hand.urdf, []).append((name, scenario))
    return [_hand(urdf, users[urdf]) for urdf in sorted(users, key=lambda urdf: Path(urdf).stem)]


def _hand(urdf: str, users: list[tuple[str, Scenario]]) -> Hand:
    tips = tuple(map(_tip, users[0][1].hand.tips))
    names = tuple(name for name, _ in users)
    try:
        file = resolve_path(urdf)
    except ScenarioError as error:
        return Hand(Path(urdf).stem, urdf, tips, names, missing=str(error))
    hand = Urdf.read(file, HAND)
    model, followers = build_model(hand), read_mimics(hand.tree)
    mass = sum(inertia.mass for inertia in list(model.inertias)[1:])
    return Hand(Path(urdf).stem, urdf, tips, names, model.nv, mass, motors=model.nv - len(followers))


def _tip(tip: str | PlacedTip) -> str:
    return tip if isinstance(tip, str) else f"{tip.label} on {tip.frame}"
