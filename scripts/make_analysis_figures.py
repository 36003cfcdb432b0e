"""Make the figures of docs/identification, stability, workspace and grasp.md anew, and print their numbers.

Example: python scripts/make_analysis_figures.py
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

import softhand
from softhand.assembly.parts import read_law
from softhand.closed_loop.gain_loop import close_gain_loop
from softhand.closed_loop.lyapunov import lyapunov
from softhand.closed_loop.scan import scan
from softhand.closed_loop.start import held_start
from softhand.grasping.poses import Poses
from softhand.grasping.workspace import largest_box, ranges, share_held
from softhand.identification.fit import fit_law
from softhand.identification.measurements import EXAMPLE, read_measurements
from softhand.laws.nakashima import Nakashima
from softhand.plots.angle_force import draw_angle_force
from softhand.plots.grasp import draw_grasp
from softhand.plots.identification import draw_fit
from softhand.plots.lyapunov import draw_lyapunov
from softhand.plots.modes import draw_modes
from softhand.plots.stability import draw_scan
from softhand.plots.stability_along import draw_stability_along
from softhand.plots.workspace import draw_workspace

IMAGES = Path(__file__).parent.parent / "docs" / "images"


def make_identification() -> None:
    """The fit of the example, and Remark 3."""
    measurements = read_measurements([EXAMPLE])
    fit = fit_law(measurements, Nakashima, measurements.radius or math.nan)
    softhand.save_figure(draw_fit(fit, "nakashima"), IMAGES / "identification.png")
    law = read_law(softhand.load_scenario("target-a"))
    softhand.save_figure(draw_angle_force(law), IMAGES / "remark3.png")


def make_stability() -> None:
    """V along the paper's step with nearly no sampling, the table of control periods, and the scan."""
    values = {"reference.kind": "step", "control_period": 2e-4, "stepper.step": 2e-4, "duration": 0.6}
    recording = softhand.simulate(softhand.load_scenario("target-a", values))
    found = lyapunov(recording, every=25)
    title = "Target A by a step, torque held for 0.2 ms"
    softhand.save_figure(draw_lyapunov(found, found.invariant, title), IMAGES / "lyapunov.png")
    for label, value in found.rows():
        print(f"{label:<46}{value}")
    for begin, end, gain in sorted(found.spans(), key=lambda span: -span[2])[:3]:
        print(f"rises by {1e3 * gain:.3g} mJ from {begin:.4g} to {end:.4g} s by {found.cause(begin, end)}")
    scenario = softhand.load_scenario("target-a")
    loop = close_gain_loop(held_start(scenario))
    K_O = loop.K_O
    print(f"share of the contact stiffness {loop.use:.3f}, growth without sampling {loop.growth(K_O):.3f} 1/s")
    for period in (1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5):
        print(f"{1e3 * period:g} ms: {loop.held_growth([K_O], period)[0]:+.3g} 1/s")
    swept = scan(scenario, np.geomspace(0.3, 30.0, 61).tolist(), np.geomspace(0.1, 100.0, 91).tolist())
    figure = draw_scan(swept, "Where regulation is lost, about the start of target-a", scenario.control_period)
    softhand.save_figure(figure, IMAGES / "stability.png")
    softhand.save_figure(
        draw_modes(softhand.stability(scenario), "Small motions about the start of target-a"), IMAGES / "modes.png"
    )
    along = softhand.stability_along("grasp-and-lift", 121)
    title = "Growth of small motions along grasp-and-lift"
    softhand.save_figure(draw_stability_along(along, title), IMAGES / "along.png")


def make_workspace() -> None:
    """Planes of poses, and the table."""
    scenario = softhand.load_scenario("target-a")
    poses = Poses(scenario)
    title = "Poses that can be held, about the start of target-a"
    softhand.save_figure(draw_workspace(poses, title, count=241), IMAGES / "workspace.png")
    beyond = Poses(scenario, (math.radians(1.0), math.radians(179.0)))
    for space, name in ((poses, "up to the apex"), (beyond, "beyond the apex too")):
        factor = largest_box(space)
        print(
            f"{name}: {100.0 * share_held(space)[0]:.1f} %, all within {20.0 * factor:.3g} mm, {30.0 * factor:.3g} deg"
        )
        for way in ranges(space):
            scale = 1e3 if way.name in "xyz" else math.degrees(1.0)
            print(f"  {way.name} {scale * way.lower:+.1f} {scale * way.upper:+.1f}  {way.lower_end}; {way.upper_end}")


def make_grasp() -> None:
    """The grasp of target-a, and the margins of what is proposed in its place."""
    scenario = softhand.load_scenario("target-a")
    quality = softhand.grasp_quality(scenario)
    softhand.save_figure(draw_grasp(quality, "Grasp of target-a"), IMAGES / "grasp_quality.png")
    print(f"margin {quality.margin:.3f}, proposed {softhand.propose_grasps(scenario, count=1)[0].margin:.3f}")


def main() -> None:
    """All of them."""
    make_identification()
    make_stability()
    make_workspace()
    make_grasp()


if __name__ == "__main__":
    main()
