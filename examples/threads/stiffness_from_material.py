"""The tip is a silicone of Shore A 20. Which stiffness is that, in numbers that a simulator takes?

The law `hemisphere` has a shear modulus and Poisson's ratio, and no other coefficient. A light touch must be Hertz's
ball; deeper, it is held against the table of finite elements that the law `tabulated` brings. MuJoCo has no modulus, so
its `solref` and `solimp` are fitted to the curve of forces, in the direct format that its documentation recommends for
identification. It is a fit for one body: the same numbers on a body of four times the mass make four times the force.

Example: python examples/threads/stiffness_from_material.py
"""

from math import pi, sqrt

import numpy as np
from peer import mujoco, show
from scipy.optimize import least_squares

import softhand

RADIUS, DEPTHS = 0.010, np.linspace(0.5e-3, 3e-3, 6)  # [m]
BALL = """<mujoco><option integrator="implicitfast" gravity="0 0 0"/><worldbody>
  <geom type="plane" size="1 1 1" solref="{k} -2000" solimp="{low} {high} 0.003 0.5 1"/>
  <body pos="0 0 0.01"><freejoint/><geom type="sphere" size="0.01" mass="{mass}" priority="-1"/></body>
</worldbody></mujoco>"""


def fit(force, mass):
    """Stiffness and impedances at 0 and 3 mm that give a curve of forces [N] to a body of `mass` [kg] at rest."""

    def curve(x):
        low, high = x[1:]
        d = low + (high - low) * DEPTHS / 0.003
        return mass * np.exp(x[0]) * DEPTHS * d**2 / (high**2 * (1.0 - d))  # their page of solver parameters

    bounds = ([0.0, 0.05, 0.05], [20.0, 0.99, 0.99])
    x = least_squares(lambda x: np.log(curve(x) / force), [10.0, 0.5, 0.8], bounds=bounds).x
    return float(np.exp(x[0])), *map(float, x[1:])


def pressed(numbers, mass):
    """Force that holds a ball of `mass` at each depth, after MuJoCo's inverse dynamics at rest [N]."""
    k, low, high = numbers
    model = mujoco.MjModel.from_xml_string(BALL.format(k=-k, low=low, high=high, mass=mass))
    data, found = mujoco.MjData(model), []
    for depth in DEPTHS:
        data.qpos[2] = 0.01 - depth  # the rest is still
        mujoco.mj_inverse(model, data)
        found.append(-data.qfrc_inverse[2])
    return np.array(found)


def main():
    """Returns force over Hertz's at a touch, the largest errors against finite elements and of MuJoCo's fits."""
    material = softhand.material_of(0.5, shore_a=20)
    law = softhand.laws.Hemisphere(radius=RADIUS, G=material.G, nu=0.5)
    force = np.array([law((d, 0.0, 0.0, 0.0), 0.5 * pi)[0] for d in DEPTHS])
    touch = law((1e-6, 0.0, 0.0, 0.0), 0.5 * pi)[0] / (8.0 / 3.0 * material.G / 0.5 * sqrt(RADIUS) * 1e-6**1.5)
    rows = [
        ("modulus E", f"{3e-6 * material.G:.3f} MPa", None),
        ("force at a touch over Hertz's", f"{touch:.4f}", None),
    ]
    table = softhand.laws.Tabulated(radius=RADIUS)  # by finite elements, G = 59.7 kPa
    known = np.array(table.normal) * material.G / 59.7e3
    mine = [law((d, 0.0, 0.0, 0.0), 0.5 * pi)[0] for d in table.depths]
    elements, fits = float(np.abs(mine / known - 1.0)[:6].max()), {}  # up to 3 mm
    rows.append(("largest error beside finite elements", f"{elements:.1%}", None))
    if mujoco:
        numbers = fit(force, 0.2)
        fits = {mass: float(np.abs(pressed(numbers, mass) / force - 1.0).max()) for mass in (0.2, 0.05, 0.8)}
        rows += [(f"largest error, fitted at 0.2 kg, at {mass} kg", "0", f"{e:.1%}") for mass, e in fits.items()]
    show("Which stiffness has a tip of Shore A 20?", rows)
    return touch, elements, fits


if __name__ == "__main__":
    main()
