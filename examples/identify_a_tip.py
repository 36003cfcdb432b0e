"""Coefficients of a fingertip law from measured forces, with intervals.

Example: python examples/identify_a_tip.py
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import softhand

PRESSED = """\
# made up for this example: a tip pressed straight against a plate, each depth twice
# radius [mm] = 10
phi [deg],dr [mm],Fr [N]
75,0.5,0.31
75,0.5,0.28
75,1.0,1.22
75,1.0,1.17
75,2.0,4.69
75,2.0,4.78
75,2.5,7.46
75,2.5,7.35
75,3.0,10.58
75,3.0,10.71
"""


class Press(softhand.Law):
    """The radial force alone, as a power of the depth."""

    k: float = 100.0
    """Force at a depth of one radius [N]."""
    power: float = 2.0
    """Of the depth [1]; 2 for the columns of the paper, 1.5 for Hertz."""

    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius, k, power):
        """Radial force [N] and three moments [N m], here none."""
        return k * (max(dr, 0.0) / radius) ** power, 0.0, 0.0, 0.0


def main():
    """Fit, and return the coefficients k [N] and power."""
    with TemporaryDirectory() as folder:
        file = Path(folder, "press.csv")
        file.write_text(PRESSED)
        found = softhand.identify(file, law=Press)
    k, power = found.coefficients["k"], found.coefficients["power"]
    print(f"The force goes with the power {power.value:.3f} ({power.low:.3f} to {power.high:.3f}, 95 %) of the depth;")
    print(f"at a depth of one radius it would be {k.value:.0f} N ({k.low:.0f} to {k.high:.0f} N).")
    print(f"Fr scatters by {found.noise[0]:.3f} N about the fit, by {found.repeats[0]:.3f} N between repeats.")
    for finding in found.findings:
        print(finding.text)
    return k.value, power.value


if __name__ == "__main__":
    main()
