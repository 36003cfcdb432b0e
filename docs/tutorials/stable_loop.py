# %% [markdown]
# # Is my loop stable?
#
# A controller that holds an object can still lose it slowly: small motions grow a little
# each second. softhand computes how fast, before anything is run.

# %%
import matplotlib.pyplot as plt
import numpy as np

import softhand

found = softhand.stability(softhand.load_scenario("target-a"))
for label, value in found.rows():
    print(f"{label:<48}{value}")

# %% [markdown]
# Two numbers matter. *Growth without sampling* is that of a controller which reacts at
# once: below zero, all motions die out. *Growth with torques held* is that of the real one,
# which computes a torque once a millisecond and holds it: above zero, the grasp of this
# example would be lost if it were held for long.
#
# The reason is the force feedback. With `K_N` above 1 the measured force comes back with
# the other sign, a sample late.

# %%
for gain in (1.5, 1.0, 0.5):
    scenario = softhand.load_scenario("target-a", {"controller.K_N": gain})
    tried = softhand.stability(scenario)
    print(f"K_N = {gain}: {tried.held_growth:+.2f} 1/s")

# %% [markdown]
# The first of the modes in the table says what swings there. How far a setting can go before
# the loop is lost is found as well:

# %%
margins = softhand.stability("hold", with_margins=True).margins
print(f"torques may come {1e3 * margins.delay:.2f} ms late")
print(f"and be held for {1e3 * margins.period:.2f} ms")
for gain in margins.gains:
    print(f"{gain.name} times {gain.factors}")

# %% [markdown]
# More damping in the joints helps as well. The scenario `hold` has both; there a push dies
# out:

# %%
push = {"force": [0.1, 0.0, 0.0], "duration": 0.05}  # [N], [s]
held = softhand.load_scenario("hold", {"duration": 2.0, "push": [push]})
print(f"growth {softhand.stability(held).held_growth:+.2f} 1/s")
recording = softhand.simulate(held)
off = 1e3 * np.linalg.norm(recording.object_position - recording.object_position[0], axis=1)
print(f"pushed by {off.max():.2f} mm; {1e3 * off[-1]:.2f} um are left after 2 s")

# %%
figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
axes.semilogy(recording.time, np.maximum(off, 1e-6))
axes.set(xlabel="time [s]", ylabel="off its place [mm]")

# %% [markdown]
# This works for a controller of your own too: it is differenced through what it is handed
# and what it remembers. [Stability](../stability.md) says how, and what is not seen: effort
# limits, slip, large motions.
