"""Damping of the tips' material, for any fingertip law."""

from typing import TYPE_CHECKING

from softhand.plugins import attributes

if TYPE_CHECKING:  # for editors
    from softhand.dampings.damping import Damping as Damping
    from softhand.dampings.fung import Fung as Fung
    from softhand.dampings.hunt_crossley import HuntCrossley as HuntCrossley
    from softhand.dampings.kelvin_voigt import KelvinVoigt as KelvinVoigt
else:
    __getattr__, __dir__ = attributes("dampings")
