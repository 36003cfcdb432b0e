"""A dashpot beside each spring."""

from __future__ import annotations

from softhand.dampings.damping import Channels, Damping
from softhand.settings.settings import NonNegative


class KelvinVoigt(Damping):
    """Kelvin-Voigt: F + c d', a dashpot beside each spring of the law [F].

    The force jumps when a tip touches with speed. Use `hunt-crossley` for impacts.
    """

    radial: NonNegative = 1.0
    """Damping c along the normal [N s/m]."""
    tangential: NonNegative = 1.0
    """Damping c in the two tangential directions [N s/m]."""
    torsional: NonNegative = 1e-4
    """Damping c of the torsion [N m s/rad]."""

    def viscosity(self) -> Channels:
        """The three c."""
        return self.radial, self.tangential, self.torsional
