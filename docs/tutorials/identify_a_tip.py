# %% [markdown]
# # Identify a tip
#
# You have pressed a fingertip against a plate and measured depth and force. Which law is
# it, with which coefficients, and how sure is that?

# %%
from pathlib import Path

import softhand

Path("press.csv").write_text("""\
# made up for this tutorial: a tip pressed straight against a plate, each depth twice
# radius [mm] = 10
phi [deg],dr [mm],Fr [N]
75,0.5,0.31
75,0.5,0.28
75,1.0,1.22
75,1.0,1.17
75,2.0,4.69
75,2.0,4.78
75,2.5,7.46
75,2.5,7.35
75,3.0,10.58
75,3.0,10.71
""")

# %% [markdown]
# The header has units, so nothing is guessed. We fit a law of our own, in which the force
# goes with some power of the depth:


# %%
class Press(softhand.Law):
    k: float = 100.0  # [N], force at a depth of one radius
    power: float = 2.0  # 2 for the columns of the paper, 1.5 for Hertz

    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius, k, power):
        return k * (max(dr, 0.0) / radius) ** power, 0.0, 0.0, 0.0


found = softhand.identify("press.csv", law=Press)
for name, one in found.coefficients.items():
    print(f"{name:<6} {one.value:8.3f}   95 % interval {one.low:.3f} to {one.high:.3f}")

# %% [markdown]
# The power is 2 within its interval, and 1.5 is far outside: this tip is no Hertz contact.
# Do the residuals agree with the repeats? If they were much wider, the law would have the
# wrong form, whatever its coefficients.

# %%
print(
    f"scatter about the fit {found.noise[0]:.3f} N, between repeats {found.repeats[0]:.3f} N"
)

# %% [markdown]
# What the data do not tell is said too:

# %%
for finding in found.findings:
    print(finding.text)

# %% [markdown]
# `found.law` is the fitted law, to be handed to `softhand.simulate`, and `found.to_toml()`
# the lines for a scenario. The command `softhand identify press.csv` also draws the fit and
# compares laws: [Identification](../identification.md).
