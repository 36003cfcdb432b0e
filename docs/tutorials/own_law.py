# %% [markdown]
# # A fingertip law of your own
#
# A law says with which force a soft tip answers when it is deformed. It is one formula.

# %%
import matplotlib.pyplot as plt
import numpy as np

import softhand

# %% [markdown]
# This gel gets harder the deeper it is pressed. The formula is handed the four
# deformations, how far the tip is pressed in `dr` [m] and three angles [rad], and answers
# with a force [N] and three moments [N m]. It is compiled as it stands; derivatives are
# taken for you.


# %%
class Gel(softhand.Law):
    k: float = 1800.0  # [N/m], stiffness of a light touch
    hardening: float = 0.002  # [m], depth at which it has doubled

    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius, k, hardening):
        depth = max(dr, 0.0)
        bending = k * radius**2  # [N m/rad]
        pressed = k * depth * (1.0 + 0.5 * depth / hardening)
        return pressed, bending * dtheta, bending * dphi, 0.01 * bending * dpsi


gel = Gel(radius=0.010)
recording = softhand.simulate(
    "target-a", law=gel, overrides={"duration": 0.6, "reference.duration": 0.5}
)
forces, pressed = recording.contact_force[0, :, 2], recording.deformation[0, :, 0]
for name, force, depth in zip(recording.labels["contact"], forces, pressed, strict=True):
    print(f"{name} presses with {force:.2f} N and is {1e3 * depth:.2f} mm deep")

# %% [markdown]
# Depth against force, as the formula has it, with the three tips at the start of the run on
# the curve:

# %%
depths = np.linspace(0.0, 0.003, 60)  # [m]
figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
curve = [Gel.force(d, 0, 0, 0, 1.0, 0.010, gel.k, gel.hardening)[0] for d in depths]
axes.plot(1e3 * depths, curve, label="gel")
axes.plot(1e3 * pressed, forces, "o", label="tips at the start")
axes.set(xlabel="depth [mm]", ylabel="normal force [N]")
axes.legend()
off = softhand.summarize(recording).position_error
print(f"{off:.2f} mm off at the end; the controller knows nothing of the gel")

# %% [markdown]
# A package makes its laws, dampings, controllers, references and steppers known by name
# with an entry point,
#
# ```toml
# [project.entry-points."softhand.laws"]
# gel = "my_package.gel:Gel"
# ```
#
# and for one command a single file will do: `softhand simulate --plugin gel.py --law gel`.
# The laws that ship, and what each is good for, are on [their page](../laws.md); to fit one
# to a real tip see [Identify a tip](identify_a_tip.py).
