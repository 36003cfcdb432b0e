# %% [markdown]
# # From the paper's gains to ten minutes
#
# The paper's controller brings the box to its target in a second. Will it hold the box for
# ten minutes? And if not, which gains will, how late may they be, how noisy may the sensors
# be, and how hard may somebody push?

# %%
import numpy as np

import softhand

held = softhand.load_scenario("target-a", {"reference": {"kind": "hold"}, "duration": 600.0})

# %% [markdown]
# ## Lost after some seconds
#
# The grasp of target A, asked to stay where it is. Nothing touches it, and still:

# %%
before = softhand.stability(held)
print(before.modes[0])
runs = softhand.rollout(held, {"mass": [0.2]}, every=0.1)
print(runs.outcomes[0].reason, runs.outcomes[0].time)

# %% [markdown]
# Small motions grow at 5.2 1/s, from rounding to a tip that rolls over its rim. The mode says
# what moves: an abduction joint swings against the box, at 66 Hz. The torque is computed a
# sample late, and nothing takes the energy out.
#
# ## Gains for a bandwidth
#
# How fast shall the box follow, and how well damped? The search says which gains do that, and
# what the loop bears.

# %%
design = softhand.design_gains("target-a", 4.0, 0.2)
gains = {"controller": {"name": design.name, **design.settings}}
for label, paper, found in design.rows():
    print(f"{label:<36}{paper:<26}{found}")

# %% [markdown]
# ## Or a regulator
#
# A linear-quadratic regulator takes weights in place of a bandwidth, and one gain for each
# motion that it sees. Its gains are a file that any scenario can name.

# %%
softhand.design_lqr(held).save("gains.toml")
feedback = {"controller": {"name": "state-feedback", "gain_file": "gains.toml"}}

# %% [markdown]
# ## Ten minutes
#
# 600,000 control periods each, in the compiled loop:

# %%
runs = softhand.rollout(held, [gains, feedback], every=1.0)
for outcome, position in zip(runs.outcomes, runs.object_position, strict=True):
    off = np.linalg.norm(position - position[0], axis=1).max()
    print(f"{outcome.reason} after {outcome.time:g} s, never more than {1e9 * off:.2g} nm off")

# %% [markdown]
# ## With sensors as they are
#
# One `[sensing]` section for all controllers: encoders of 0.1 mrad, a camera of 0.1 mm. What
# noise leaves in the pose follows from the linear loop, without a run, and a run agrees.

# %%
noisy = softhand.load_scenario(
    "target-a",
    {
        "reference": {"kind": "hold"},
        "duration": 4.0,
        "sensing.joint_position.noise": 1e-4,
        "sensing.object_position.noise": 1e-4,
        **gains,
    },
)
scatter = softhand.stability(noisy).scatter
for label, value in scatter.rows():
    print(f"{label:<48}{value}")
run = softhand.simulate(noisy)
print("seen in a run", 1e6 * np.std(run.object_position[1000:], axis=0), "um")

# %% [markdown]
# ## How near is slip?
#
# Which internal forces would do, and which push is too much:

# %%
for label, value in softhand.squeeze(held).rows():
    print(f"{label:<36}{value}")
push = softhand.worst_push(softhand.load_scenario("target-a", gains), count=12)
print(f"{push.worst:.2f} N along {np.round(push.worst_direction, 2)}: {push.worst_end}")

# %% [markdown]
# [Designing gains](../design.md), [stability](../stability.md), [sensing](../sensing.md) and
# [squeeze](../squeeze.md) go on from here.
