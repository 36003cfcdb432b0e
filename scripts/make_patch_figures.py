"""Make the figures of docs/patch.md anew, and print its numbers.

Example: python scripts/make_patch_figures.py
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

import softhand
from softhand.dampings.fung import Fung
from softhand.laws.hemisphere import Hemisphere
from softhand.patch.mindlin import CattaneoMindlin
from softhand.plots.style import DASHED, FINGERS, STYLE, save_figure

IMAGES = Path(__file__).parent.parent / "docs" / "images"
G, NU, A, N, MU = 58.6e3, 0.5, 0.005, 4.0, 0.5
RINGS, SECTORS = 16, 24


def columns(rings: int = RINGS, sectors: int = 12) -> softhand.Patch:
    """A tip of the reference material, pressed with 4 N over 5 mm."""
    patch = softhand.Patch(A, G, NU, MU, rings, sectors)
    patch.press(N, A)
    return patch


def draw_loop(axes: Axes) -> None:
    """A cycle of shear to 80 % of the limit, beside Cattaneo and Mindlin."""
    ball, patch = CattaneoMindlin(MU, N, A, G, NU), columns()
    turn = 0.8 * ball.most
    up, down = np.linspace(0.0, turn, 13), np.linspace(turn, -turn, 25)
    states = [patch.load(f, 0.0, 0.0) for f in (*up, *down[1:], *-down[1:])]
    x, f = (np.array([getattr(state, name)[0] for state in states]) for name in ("displacement", "force"))
    axes.plot(1e3 * x, f, ".", ms=4, color=FINGERS[0], label="columns")
    fine = np.linspace(-turn, turn, 400)
    axes.plot(1e3 * ball.loading(fine[fine >= 0]), fine[fine >= 0], color="black", lw=0.9, label="Cattaneo, Mindlin")
    axes.plot(1e3 * ball.unloading(fine, turn), fine, color="black", lw=0.9)
    axes.plot(-1e3 * ball.unloading(-fine, turn), fine, color="black", lw=0.9)
    axes.set(xlabel="displacement [mm]", ylabel="shear [N]", title="One cycle of shear")
    axes.legend(loc="upper left")
    print(f"loop: {1e3 * (states[-1].lost - states[12].lost):.4f} mJ, exact {1e3 * ball.loss(turn):.4f} mJ")


def draw_map(axes: Axes, shear: float, spin: float, title: str) -> None:
    """Which columns slip, with their forces, under shares of the largest shear and torsion."""
    patch = columns(RINGS, SECTORS)
    largest = 3.0 * math.pi / 16.0 * MU * N * A
    for k in range(1, 7):
        state = patch.load(k / 6 * shear * MU * N, 0.0, k / 6 * spin * largest)
    half, cells = math.pi / SECTORS, []
    for inner, outer in zip(patch.edges[:-1], patch.edges[1:], strict=True):
        for s in range(SECTORS):
            t = 2.0 * half * s + half * np.linspace(-1.0, 1.0, 5)
            ring = np.concatenate([inner * np.exp(1j * t), outer * np.exp(1j * t[::-1])])
            cells.append(1e3 * np.stack([ring.real, ring.imag], axis=1))
    share = np.linalg.norm(patch.forces, axis=1) / patch.limits
    colours = np.where(share[:, None] >= 0.99, [[0.84, 0.37, 0.0, 0.75]], [[0.0, 0.45, 0.70, 0.15]])
    axes.add_collection(PolyCollection(cells, facecolors=colours, edgecolors="white", linewidths=0.3))
    places, forces = 1e3 * patch.points[::2], patch.forces[::2]
    axes.quiver(*places.T, *forces.T, width=0.004, color="black", scale=25.0 * np.abs(forces).max())
    reach = 1.05e3 * A
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
    axes.set_title(f"{title}: {state.slipped:.0%} slips")
    axes.grid(visible=False)


def draw_creep(axes: Axes) -> None:
    """Shaken between 0.3 and 0.8 of the limit: LuGre, elasto-plastic, columns."""
    stiffness, lever = 8.0 * G * A / (2.0 - NU), 0.59 * A
    models: dict[str, softhand.Bristles | softhand.Patch] = {
        "LuGre": softhand.Bristles(stiffness, MU * N, lever),
        "elasto-plastic": softhand.Bristles(stiffness, MU * N, lever, breakaway=0.9),
        "columns": columns(12),
    }
    time = np.linspace(0.0, 10.0, 301)
    shear = MU * N * (0.55 - 0.25 * np.cos(2.0 * np.pi * time)) * np.minimum(1.0, 4.0 * time)
    for (name, model), colour in zip(models.items(), (FINGERS[1], FINGERS[2], FINGERS[0]), strict=True):
        x = np.array([model.load(f, 0.0, 0.0).displacement[0] for f in shear])
        axes.plot(time, 1e3 * x, color=colour, label=name, lw=1.0)
        print(f"{name}: {1e3 * (x[-1] - x[-31]):.4f} mm in the last cycle")
    axes.set(xlabel="cycles", ylabel="displacement [mm]", title="Shaken between 0.3 and 0.8 of the limit")
    axes.legend(loc="upper left")


def draw_growth(axes: Axes) -> None:
    """The largest torsion of a tip that relaxes, under a steady force and at a steady depth."""
    law, damping, time = Hemisphere(radius=0.010, G=G, nu=NU), Fung(), np.logspace(-3, 1.0, 200)
    force = softhand.limit_under_force(law, damping, MU, N, time)
    depth = softhand.limit_at_depth(law, damping, MU, float(force.depth[0]), time)
    axes.semilogx(time, 1e3 * force.torsion, color=FINGERS[0], label="steady force 4 N")
    axes.semilogx(time, 1e3 * depth.torsion, color=FINGERS[1], ls=DASHED, label="steady depth")
    axes.set_xticks([0.001, 0.01, 0.1, 1.0, 10.0], ["0.001", "0.01", "0.1", "1", "10"])
    axes.set(xlabel="time [s]", ylabel="largest torsion [N mm]", title="A tip that relaxes (fung)")
    axes.legend(loc="lower left")
    print(f"torsion: {1e3 * force.torsion[0]:.3f} to {1e3 * force.torsion[-1]:.3f} N mm")


def draw() -> Figure:
    """Six panels."""
    with rc_context(STYLE):
        figure = Figure(figsize=(9.6, 6.0))
        panels = figure.subplots(2, 3)
        figure.subplots_adjust(left=0.065, right=0.985, top=0.95, bottom=0.085, hspace=0.36, wspace=0.28)
        draw_loop(panels[0, 0])
        draw_map(panels[0, 1], 0.8, 0.0, "0.8 shear")
        draw_map(panels[0, 2], 0.5, 0.7, "0.5 shear, 0.7 torsion")
        draw_creep(panels[1, 0])
        draw_growth(panels[1, 1])
        draw_run(panels[1, 2])
    return figure


def draw_run(axes: Axes) -> None:
    """Share of each contact that slips, along target A with a mu that holds."""
    found = softhand.incipient_slip(
        softhand.simulate("target-a", overrides={"fingertip.contact": "coulomb", "fingertip.friction": 0.7})
    )
    for i, name in enumerate(found.labels["contact"]):
        axes.plot(found.time, found.slipped_share[:, i], color=FINGERS[i], label=name.replace("_", " "), lw=0.9)
    axes.set(xlabel="time [s]", ylabel="slipped share [-]", title="Target A, mu 0.7", ylim=(0.0, 1.0))
    axes.legend(loc="upper right")
    print(f"microslip {1e3 * found.microslip_loss[-1]} mJ, use {found.limit_surface_use.max(axis=0)}")


def print_ellipsoid() -> None:
    """How far the ellipsoid is off the limit of contacts that are not flat."""
    rng = np.random.default_rng(1)
    for radius in (math.inf, 0.030, 0.015, 0.010, -0.015):
        limit = softhand.CurvedLimit.of(MU, N, A, 1.0 / radius)
        E, unit = limit.ellipsoid(), np.array([1.0, 1.0, 1.0, 1.0 / A, 1.0 / A, 1.0 / A])
        twists = unit * rng.normal(size=(2000, 6))
        ratios = [math.sqrt(twist @ E @ twist) / limit.power(twist) for twist in twists]
        moment = limit.wrench([1.0, *[0.0] * 5])[4]
        print(
            f"R {1e3 * radius:g} mm: ellipsoid {min(ratios):.3f} to {max(ratios):.3f} of the limit, "
            f"sliding {limit.power([1, 0, 0, 0, 0, 0]) / (MU * N):.3f} mu N, moment {1e3 * moment:.3f} N mm, "
            f"roll {1e3 * limit.power([0, 0, 0, 0, 1, 0]):.4f} N mm"
        )


def main() -> None:
    """Write the figure."""
    save_figure(draw(), IMAGES / "patch.png")
    print_ellipsoid()


if __name__ == "__main__":
    main()
