"""A dashpot beside each spring."""

from __future__ import annotations

from softhand.dampings.damping import Channels, Damping
from softhand.settings.settings import NonNegative


class KelvinVoigt(Damping):
    """Kelvin-Voigt: F + c d', a dashpot beside each spring of the law [F].

    The force jumps when a tip touches with speed. Use `hunt-crossley` for impacts.

    Attributes:
        radial: c of the normal direction [N s/m].
        tangential: c of the two tangential directions [N s/m].
        torsional: c of the torsion [N m s/rad].
    """

    radial: NonNegative = 1.0
    tangential: NonNegative = 1.0
    torsional: NonNegative = 1e-4

    def viscosity(self) -> Channels:
        """The three c."""
        return self.radial, self.tangential, self.torsional
