"""The section of the fingertips."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Field, field_validator, model_validator

from softhand.settings.settings import OpenSettings, Positive, read_settings

MOST_ELEMENTS = 64
"""The time of a step grows as their number n, and what they are off the limit of many falls as 1 / n^2."""

Elements: TypeAlias = Annotated[int, Field(ge=1, le=MOST_ELEMENTS)]


class DampingSection(OpenSettings):
    """The damping of the tips by name, and its own parameters."""

    name: str
    """Name of the damping."""


class TipSection(OpenSettings):
    """What is different at one fingertip, and parameters of its law."""

    law: str | None = None
    """Name of the law; another than that of all tips begins from its own defaults and keeps the radius."""
    friction: Positive | None = None
    """As in `fingertip` [1]."""
    static_friction: Positive | None = None
    """As in `fingertip` [1]."""
    torsion_length: Positive | None = None
    """As in `fingertip` [m]."""
    limit: Literal["exact", "ellipse"] | None = None
    """As in `fingertip`."""
    slip_elements: Elements | None = None
    """As in `fingertip` [1]."""
    damping: DampingSection | None = None
    """As in `fingertip`, the whole table."""


class FingertipSection(OpenSettings):
    """The fingertip law by name, and its own parameters."""

    law: str
    """Name of the law."""
    friction: Positive
    """Coefficient mu of friction [1]; with `coulomb` that of a tip which slips."""
    contact: Literal["rolling", "coulomb"] = "rolling"
    """Whether friction has a limit: `rolling`, the paper's, where a tip never slips, or `coulomb`."""
    static_friction: Positive | None = None
    """Coefficient at which slip begins, with `coulomb` [1]; that of `friction` if not given."""
    torsion_length: Positive | None = None
    """Largest torsion over mu f_z [m]; from the pressure of the law if not given."""
    limit: Literal["exact", "ellipse"] = "exact"
    """Limit of force and torsion together: `exact`, that of the pressure of the law, or `ellipse`, the usual guess."""
    slip_elements: Elements = 1
    """Elements of a contact that slip by themselves, with `coulomb` [1]; at 1 a contact sticks or slips as a whole."""
    tips_touch: bool = False
    """Whether tips meet each other; otherwise they pass through each other."""
    damping: DampingSection | None = None
    """Damping of the tips; that of the law, most have none, if not given."""
    tips: dict[str, TipSection] | None = None
    """Tables by the name of a fingertip, whose keys hold there in place of these."""

    @field_validator("tips", mode="before")
    @classmethod
    def _each_tip_is_a_table(cls, tips: Any) -> Any:
        if not isinstance(tips, Mapping):
            return tips
        return {name: read_settings(TipSection, table, f"fingertip.tips.{name}") for name, table in tips.items()}

    def own(self) -> dict[str, Any]:
        """All keys but those of the law."""
        return self.model_dump(include=set(type(self).model_fields), exclude_none=True)

    def at(self, tip: str) -> FingertipSection:
        """What holds at one fingertip, without `tips`.

        Raises:
            ScenarioError: the keys of the tip and those of all tips do not agree.
        """
        if not self.tips:
            return self
        table = self.model_dump(exclude={"tips"}, exclude_none=True)
        own = self.tips[tip].model_dump(exclude_none=True) if tip in self.tips else {}
        if own.get("law", self.law) != self.law:
            table = {key: value for key, value in table.items() if key in type(self).model_fields or key == "radius"}
        return read_settings(FingertipSection, {**table, **own}, f"fingertip.tips.{tip}" if own else "fingertip")

    @property
    def has_elements(self) -> bool:
        """Whether contacts of some tips slip by elements."""
        return self.slip_elements > 1 or any((tip.slip_elements or 1) > 1 for tip in (self.tips or {}).values())

    @model_validator(mode="after")
    def _friction_falls_with_slip(self) -> FingertipSection:
        if self.static_friction is not None and self.static_friction < self.friction:
            raise ValueError(
                f"static_friction {self.static_friction:g} is below friction {self.friction:g}, that of a tip which "
                "slips; raise it or leave it out."
            )
        return self

    @model_validator(mode="after")
    def _elements_need_a_limit(self) -> FingertipSection:
        if self.slip_elements > 1 and self.contact != "coulomb":
            raise ValueError(
                f'slip_elements {self.slip_elements} needs contact = "coulomb", as a tip that rolls never slips; set '
                "that, or slip_elements = 1."
            )
        return self
