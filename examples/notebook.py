# %% [markdown]
"""# A grasp in a loop of your own

Open this file in Jupyter with [jupytext](https://jupytext.readthedocs.io), or run it: `python examples/notebook.py`.
"""

# %%
import numpy as np

import softhand

scenario = softhand.load_scenario("target-a", {"fingertip.damping": {"name": "kelvin-voigt"}})
simulation = softhand.build(scenario)

# %% [markdown]
# Half a second, one control period at a time. `sample` observes and asks the controller. `step` holds its torque, or
# another one: here that of a drive which knows steps of 5 mN m only.

# %%
while simulation.time < 0.5:
    observation = simulation.sample()
    simulation.step(0.005 * np.round(simulation.torque / 0.005))
print(f"At {simulation.time:.1f} s the box is at {np.round(1e3 * observation.object_position, 2)} mm.")

# %% [markdown]
# Save the state, and go on from there twice: as it would have been, and with a push of 2 N for 20 ms.

# %%
saved = simulation.save()


def go_on(push):
    """Where the box is during the next 0.4 s [m], shape (samples, 3)."""
    simulation.reset(saved)
    positions = []
    while simulation.time < 0.9:
        positions.append(simulation.sample().object_position.copy())
        if simulation.time < 0.52:
            simulation.push(force=push)
        simulation.step()
    return np.array(positions)


off = np.linalg.norm(go_on((2.0, 0.0, 0.0)) - go_on((0.0, 0.0, 0.0)), axis=1)
print(f"The push moves the box by {1e3 * off.max():.2f} mm; at the end {1e3 * off[-1]:.2f} mm of that are left.")

# %% [markdown]
# `run` goes on to the end, without the push, and gives a recording. In a notebook the last line of a cell shows itself.

# %%
recording = simulation.run(start=saved)
print(f"It ends {softhand.summarize(recording).position_error:.3f} mm from where it shall be.")
softhand.draw_run(recording)
