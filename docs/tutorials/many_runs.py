# %% [markdown]
# # Many runs at once
#
# How heavy may the box be, and how hard must the fingers squeeze? That is one run for each
# pair of numbers. `rollout` makes them in threads, in compiled code.

# %%
from itertools import product

import matplotlib.pyplot as plt
import numpy as np

import softhand

MASSES = (0.1, 0.2, 0.4, 0.6)  # [kg]
SQUEEZES = (2.0, 4.0, 6.0)  # [N]
cases = list(product(MASSES, SQUEEZES))
forces = [[squeeze, squeeze, 0.75 * squeeze] for _, squeeze in cases]

runs = softhand.rollout(
    softhand.load_scenario(
        "target-a", {"fingertip.contact": "coulomb", "duration": 0.5}
    ),  # tips that can slip
    {
        "mass": [mass for mass, _ in cases],
        "grasp.internal_force": forces,
        "reference.internal_force": forces,
    },
    variables=("object_position", "slip_travel"),
)
print(runs)

# %% [markdown]
# Each column is a list with a value for each run. A run that is lost disturbs no other: its
# outcome says why and when, and its numbers are NaN from there on.

# %%
print("mass [kg]" + "".join(f"{f'{squeeze:g} N':>18}" for squeeze in SQUEEZES))
for row, mass in enumerate(MASSES):
    told = []
    for column in range(len(SQUEEZES)):
        index = row * len(SQUEEZES) + column
        outcome, slip = (
            runs.outcomes[index],
            1e3 * runs.slip_travel[index, -1].max(),
        )  # [mm]
        ends = {
            "finished": f"slips {slip:.2f} mm" if slip > 0.0 else "holds",
            "grasp": "no grasp",
        }
        told.append(ends.get(outcome.reason, f"lost at {outcome.time:.2f} s"))
    print(f"{mass:9.1f}" + "".join(f"{text:>18}" for text in told))

# %% [markdown]
# The same as numbers: `runs.object_position` has the shape (runs, samples, 3).

# %%
height = 1e3 * (runs.object_position[:, :, 2] - runs.object_position[:, :1, 2])
figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
for (mass, squeeze), line in zip(cases, height, strict=True):
    if squeeze == 6.0 and np.isfinite(line).any():
        axes.plot(runs.time, line, label=f"{mass:g} kg")
axes.set(xlabel="time [s]", ylabel="height of the box [mm]", title="squeezed with 6 N")
axes.legend()

# %% [markdown]
# `runs.save("runs.nc")` keeps them, `runs.to_xarray()` hands them on with what was varied
# as coordinates. Controllers of your own run as fast if they are
# [compiled](own_controller.py). More: [Many runs](../many-runs.md).
