"""Generate the example measurements of `softhand identify --example`: the paper's law plus noise, no experiment.

The settings are those of the experiments of [Nakashima] section 2.3 (Figs. 9-12), four repeats of each. The paper's own
points are not published as numbers and are not used.

Example: python scripts/make_identification_data.py
"""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np

from softhand.identification.record import EXAMPLE
from softhand.laws.nakashima import Nakashima

LAW = Nakashima(radius=0.010, k_r=0.377e6, k_phi=0.166e6, k_theta=0.0266e9, k_psi=0.0488e9)
REPEATS = 4
NOISE = {"Fr": 0.4, "Ftheta": 1.0, "Fphi": 0.8, "Fpsi": 0.4}  # standard deviation [N, N mm]
SEED = 2026

HEADER = f"""\
# GENERATED, NOT MEASURED: the law of Nakashima, Shibata and Hayakawa with their coefficients,
# k_r = 0.377, k_phi = 0.166 N/mm^2, k_theta = 0.0266, k_psi = 0.0488 N/mm^3, plus normal noise of
# {NOISE["Fr"]} N, {NOISE["Ftheta"]}, {NOISE["Fphi"]} and {NOISE["Fpsi"]} N mm (Fr, Ftheta, Fphi, Fpsi).
# Settings like those of Figs. 9-12 of their paper, {REPEATS} repeats each; none of its points.
# Made by scripts/make_identification_data.py of softhand.
# phi is the contact angle of the undeformed tip.
# radius [mm] = 10
"""


def settings() -> list[tuple[str, float, float, float, float, float]]:
    """Measured component, phi [deg], dr [mm], dtheta, dphi, dpsi [deg]."""
    rows: list[tuple[str, float, float, float, float, float]] = []
    rows += [("Fr", phi, dr, 0, 0, 0) for phi, dr in product((90, 80, 70, 60), (1, 2, 3, 4, 5))]
    rows += [("Fphi", phi, 3, 0, dphi, 0) for phi, dphi in product((90, 80, 70, 60), (4, 8, 12, 16, 20))]
    rows += [("Ftheta", phi, 3, dtheta, 0, 0) for phi, dtheta in product((60, 50, 40), (4, 8, 12, 16, 20))]
    rows += [("Fpsi", 90, 4, 0, 0, dpsi) for dpsi in (4, 8, 12, 16, 20)]
    rows += [("Fpsi", 90, dr, 0, 0, 20) for dr in (1, 2, 3, 5)]
    return rows


def generate() -> str:
    """The text of the file."""
    rng = np.random.default_rng(SEED)
    names = list(NOISE)
    lines = [
        HEADER + "phi [deg],dr [mm],dtheta [deg],dphi [deg],dpsi [deg],Fr [N],Ftheta [N mm],Fphi [N mm],Fpsi [N mm]"
    ]
    for measured, phi, dr, *angles in settings():
        k = names.index(measured)
        force = LAW.force(1e-3 * dr, *np.radians(angles), np.radians(phi), *LAW.parameters())
        exact = force[k] * (1.0 if k == 0 else 1e3)
        for _ in range(REPEATS):
            cells = [""] * 4
            cells[k] = f"{exact + rng.normal(0.0, NOISE[measured]):.3f}"
            lines.append(",".join([f"{phi:g}", f"{dr:g}", *(f"{angle:g}" for angle in angles), *cells]))
    return "\n".join(lines) + "\n"


def main(file: Path = EXAMPLE) -> None:
    """Write the file into the package."""
    file.write_text(generate(), encoding="utf-8")
    print(f"wrote {file}")


if __name__ == "__main__":
    main()
