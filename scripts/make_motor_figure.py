"""Make the figure of docs/motors.md anew, and print the numbers that it gives.

Example: python scripts/make_motor_figure.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib import rc_context

import softhand
from softhand.numerics.arrays import Array
from softhand.plots.panels import draw_note, draw_title, finish, new_figure, panel
from softhand.plots.style import FINGERS, STYLE, WARNING, save_figure

IMAGES = Path(__file__).parent.parent / "docs" / "images"
OFF, LASTS, DAMPED = 0.5, 2.0, {"name": "kelvin-voigt", "radial": 1.0, "tangential": 1.0, "torsional": 1e-4}
NOTE = (
    "Above: target A by regulation that speaks every 5 ms, as in the scenario servo; with its servos the error goes to "
    "what friction holds, without them the run is lost. Below: the start of target A, motors off from 0.5 s on; "
    "joints whose friction is above 0.43 N m hold the box alone."
)


def errors() -> list[tuple[str, str, Array, Array]]:
    """Distance of the object from its target [mm], with servos and without."""
    found = []
    for label, color, values in (("with servos", FINGERS[0], {}), ("without", WARNING, {"actuation": None})):
        try:
            run = softhand.build(softhand.load_scenario("servo", values)).run()
        except softhand.SimulationStopped as stop:
            assert stop.recording is not None
            run = stop.recording
        away = 1e3 * np.linalg.norm(run.object_position - run.object_position_desired, axis=1)
        found.append((label, color, run.time, away))
        print(f"{label}: {away[-1]:.3g} mm at {run.time[-1]:g} s")
    return found


def switched_off(friction: float) -> tuple[Array, Array]:
    """The largest way of a joint [mrad] of a hand whose motors are switched off."""
    joints = {"armature": 1e-4, "damping": 0.003, "friction": friction}
    values = {"hand.joints": joints, "reference": {"kind": "hold"}, "fingertip.damping": DAMPED}
    simulation = softhand.build("target-a", overrides=values)
    simulation.reset()
    times, ways, start = [], [], simulation.sample().joint_position.copy()
    while simulation.time < LASTS:
        observation = simulation.sample()
        times.append(simulation.time)
        ways.append(1e3 * np.max(np.abs(observation.joint_position - start)))
        if simulation.time < OFF:
            simulation.step()
        else:
            simulation.step(np.zeros(len(start)))
    print(f"{friction:g} N m: {ways[-1]:.3g} mrad")
    return np.array(times), np.array(ways)


def main() -> None:
    """Both panels."""
    with rc_context(STYLE):
        figure = new_figure(5.2)
        room = draw_note(figure, NOTE, 0.34)
        top = draw_title(figure, "Servos under a slow loop, and gears that hold by themselves", room=room - 0.2)
        grid = figure.add_gridspec(2, 1, left=0.075, right=0.975, top=top, bottom=0.09, hspace=0.35)
        above = panel(figure, grid[0], "error [mm]", "Regulation every 5 ms")
        for label, color, time, away in errors():
            above.plot(time, away, color=color, label=label)
        above.set_ylim(0.0, 20.0)
        above.legend(loc="upper right")
        below = panel(figure, grid[1], "way [mrad]", "Largest way of a joint, motors off", bottom=True)
        for color, friction in zip(FINGERS, (0.3, 0.4, 0.45), strict=False):
            below.plot(*switched_off(friction), color=color, label=f"friction {friction:g} N m")
        below.legend(loc="upper left")
        below.set_ylim(-0.5, 14.0)
        finish(figure, LASTS)
        save_figure(figure, IMAGES / "motors.png")


if __name__ == "__main__":
    main()
