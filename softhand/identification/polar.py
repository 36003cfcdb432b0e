"""Any law as forces against the paper's deformation (dr, dtheta, dphi, dpsi), which is what experiments impose."""

from __future__ import annotations

import math
from collections.abc import Sequence

from softhand.laws.law import Law


def polar_force(
    law_class: type[Law], parameters: Sequence[float], setting: Sequence[float]
) -> tuple[float, float, float, float]:
    """Fr [N], Ftheta, Fphi, Fpsi [N m] at one setting.

    A law in surface coordinates is given the displacement of (43), held at the final angle,

        s_x = R cosPhi dtheta,   s_y = R dphi,   psi = dpsi + sinPhi dtheta

    and answers with forces that (48) turns into dF.

    Args:
        law_class: the law.
        parameters: its fields in their order, `radius` first.
        setting: dr [m], dtheta, dphi, dpsi, phi [rad], phi that of the undeformed tip.
    """
    if law_class.coordinates == "polar":
        return law_class.force(*setting, *parameters)
    dr, dtheta, dphi, dpsi, phi = setting
    R, sin_Phi, cos_Phi = parameters[0] - dr, math.sin(phi - dphi), math.cos(phi - dphi)
    moved = (dr, R * cos_Phi * dtheta, R * dphi, dpsi + sin_Phi * dtheta)
    f_n, f_x, f_y, tau = law_class.force(*moved, 0.0, cos_Phi, *parameters)
    return f_n, R * cos_Phi * f_x + sin_Phi * tau, R * f_y, tau
