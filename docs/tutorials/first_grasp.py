# %% [markdown]
# # A first grasp
#
# Three fingers with soft tips hold a box, carry it a little way and turn it. Here is how to
# run that, change it, look at it and keep it.

# %%
import numpy as np

import softhand

print(*softhand.scenario_names()[:10], "...", sep=", ")

# %% [markdown]
# These are some of the scenarios that ship: each is a hand, an object, how they touch at
# the start, a controller, and what is asked for. We take `target-a`, the main example:
# lower the box, tilt it about all three axes and grip it harder.

# %%
quicker = {"duration": 1.2, "reference.duration": 0.8}  # [s]
recording = softhand.simulate("target-a", overrides=quicker)
for label, value in softhand.summarize(recording).rows():
    if "error" in label or "friction" in label:
        print(f"{label:<28}{value}")

# %% [markdown]
# *Friction use* says how near a tip came to slipping: the sideways force as a share of what
# friction allows. At 1 it would slip.
#
# The recording has everything that happened as arrays, the time first. Lengths are in
# metres, forces in newtons, angles in radians.

# %%
print("samples, numbers:", recording.object_position.shape)
print("the box went from", 1e3 * recording.object_position[0], "mm")
print("              to", np.round(1e3 * recording.object_position[-1], 3), "mm")
print("each tip presses with", np.round(recording.contact_force[-1, :, 2], 2), "N at the end")

# %% [markdown]
# One picture shows the whole run: where the object is and should be, the squeeze, and how
# near each tip is to slipping.

# %%
softhand.draw_run(recording)

# %% [markdown]
# Change anything by its name in the scenario. A heavier box needs more friction; how much
# more?

# %%
for mass in (0.2, 0.25, 0.3):  # [kg]
    run = softhand.simulate("target-a", mass=mass, overrides=quicker)
    summary = softhand.summarize(run)
    print(
        f"{mass:.2f} kg: friction use {summary.friction_use:.2f}, at {summary.friction_finger}"
    )

# %% [markdown]
# Keep a run as a file that also opens in xarray, MATLAB and anything else that reads
# NetCDF-4, and read it again:

# %%
recording.save("run.nc")
again = softhand.load_recording("run.nc")
print("the same numbers:", np.array_equal(again.object_position, recording.object_position))

# %% [markdown]
# `softhand view run.nc` shows it in the browser in 3-D, `softhand report run.nc` makes one
# page of film and curves that you can mail: see [Viewer](../viewer.md) and [Reports and
# films](../report.md).
#
# Next: [write a controller](own_controller.py).
