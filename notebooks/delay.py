# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # How much delay can this cell take?
#
# In the paper every robot knows at once what all the others do. Real robots tell each other, and what they
# tell comes late, seldom, or not at all. Two UR5 that move together are asked here how much of that they
# take, and what helps them to take more.
#
# You will learn
#
# - what robots send each other, and how little it is;
# - to ask a cell how much delay, which period and which loss it takes, before any run;
# - what a theorem says about it in one eigenvalue per robot;
# - to cure a cell that takes too little.
#
# Runs are computed by the compiled engine, which needs `pip install 'synctrl[compiled]'` and a C compiler;
# `ENGINE = "pinocchio"` does without, and takes many times as long.

# %%
# %matplotlib inline

import numpy as np
from IPython.display import display

from synctrl import Network
from synctrl.analysis import certify, delay_map, delay_margin, period_margin
from synctrl.control.laws import SunMills
from synctrl.experiments import a460_pair, planar_four, ur5_payload
from synctrl.experiments.ur5_payload import GAINS
from synctrl.show import scene_of
from synctrl.show.curves import Curves, overlay
from synctrl.show.delay_figures import delay_map_figure
from synctrl.show.network_figures import traffic

# %%
DURATION = 1.0  # s
ENGINE = "compiled"


def run(network=None, **options):
    """Two UR5 whose hands move together, over a network."""
    experiment = ur5_payload(network=network, **options)
    return experiment.simulate(DURATION, 2e-3, engine=ENGINE)


def epsilon(result):
    """How far the hands are from where they should be to each other, and how hard the last joints work."""
    apart = 1e3 * np.linalg.norm(result.sync_error[:, 0, :3], axis=1, keepdims=True)
    torque = np.abs(result.tau[:, :, 5]).max(axis=1, keepdims=True)
    return [Curves("hands", "mm", apart, ["|ε|"]), Curves("torque of joint 6", "N·m", torque, ["largest"])]


# %% [markdown]
# ## What robots send
#
# Each robot integrates its own weighted error, W' = w, and sends W, w and w' with the time. Of its own W
# and those of its neighbours it makes what the paper's law wants: E = Σ S_ki ∫ε_k. After any number of lost
# messages the next one restores E. Here the arms talk every 10 ms, messages take 10 to 20 ms, and a fifth
# is lost.

# %%
network = Network(period=0.01, delay=0.01, jitter=0.01, loss=0.2, receiver="filter", omega=50.0, seed=1)
talking = run(network)
display(traffic(talking))

# %%
scene_of(talking)

# %% [markdown]
# ## The margin
#
# Freeze the cell where it starts, and look at small errors: linear equations with a delay. From which delay
# on do they swing, and which joint does?

# %%
arms = ur5_payload()
margin = delay_margin(arms.cell, arms.gains)
print(margin)
for delay in (0.0, 0.01, 0.02, 0.03, 0.05):
    print(f"{1e3 * delay:3.0f} ms: small errors grow with {margin.growth(delay):+.2f} 1/s")

# %% [markdown]
# Runs of the nonlinear cell show it, here with estimates that stay as they are, Γ = 0. Below the margin the
# delay is hardly seen. Beyond it the sixth joints swing ever more, although each arm by itself is well
# damped.

# %%
shorter, longer = 0.5 * margin.delay, 1.4 * margin.delay
fixed = GAINS.replace(Gamma=0.0)
late = {
    "at once": run(gains=fixed),
    "half the margin": run(Network(delay=shorter), gains=fixed),
    "1.4 times the margin": run(Network(delay=longer), gains=fixed),
}
display(overlay(epsilon, late))

# %% [markdown]
# With adaptation the swinging fades in this run. The analysis cannot see it, for it takes parameters as
# known, and no theorem covers it: the margin is that of arms that have learned all there is.

# %%
adapting = run(Network(delay=longer))
display(overlay(epsilon, {"Γ = 0": late["1.4 times the margin"], "adapting": adapting}))

# %% [markdown]
# ## The theorem
#
# If $K_r - \frac{a}{4\Lambda} J^T c^T K_\epsilon c J$ is positive definite for every robot, with a the
# largest entry of the diagonal of SᵀS, then *every* constant delay is tolerated. One eigenvalue for each
# robot is all that has to be looked at. Both cells of the paper have it.

# %%
cells = {"four planar arms": planar_four(), "two A460": a460_pair(friction=False), "two UR5": arms}
for name, each in cells.items():
    found = delay_margin(each.cell, each.gains)
    print(f"{name:17} least eigenvalue {min(found.least_eigenvalue):7.3g}: {found}")

# %% [markdown]
# ## Messages, receivers, and loss
#
# Between two messages a robot has to believe something: what it heard last ("hold"), where that was going
# ("extrapolate", not for long), or what a filter makes of it. How seldom may robots send?

# %%
for receiver in ("hold", "extrapolate", "filter"):
    longest = period_margin(arms.cell, arms.gains, receiver=receiver, longest=0.5)
    print(f"{receiver:12} {'more than 500' if np.isinf(longest) else f'{1e3 * longest:.0f}':>13} ms")

# %% [markdown]
# And with loss? Every message of every link is lost or not by chance. Blue is where small errors fall in
# all of three trials, red where they grow, and the line is between. Larger errors are another matter: with
# "hold" every message makes the torque jump, and a jump may be too much for arms that are not linear.

# %%
delays, losses = np.arange(0.0, 0.09, 0.01), np.arange(0.0, 0.91, 0.3)
maps = {
    receiver: {
        name: delay_map(
            each.cell, each.gains, Network(0.01, receiver=receiver), delays, losses, trials=2, duration=3.0
        )
        for name, each in cells.items()
    }
    for receiver in ("hold", "filter")
}
display(delay_map_figure(maps))

# %% [markdown]
# ## The cure
#
# The theorem says it: more $K_r$ for the joint that swings, less $K_\epsilon$, or just the damping that is
# missing. `SunMills(injection=True)` adds $\frac{a}{4\Lambda} J^T c^T K_\epsilon r$ to the torque, and any
# constant delay is tolerated again.

# %%
cured = run(Network(delay=longer), gains=fixed, law=SunMills(injection=True))
display(overlay(epsilon, {"without": late["1.4 times the margin"], "with injection": cured}))

# %% [markdown]
# The same arms that learn: the certificate says which theorem covers the run, and with which margin.

# %%
learning = run(Network(delay=longer), law=SunMills(injection=True))
print(certify(learning).delay_condition)

# %%
scene_of(learning)

# %% [markdown]
# ## Robots of their own
#
# `experiment.agents(period)` gives every robot a controller of its own, which knows its own joints and the
# messages that came, and nothing else: that is what runs on the computers of a real cell.
# `docs/own_loop.md` shows how.

# %% [markdown]
# ## Exercises
#
# 1. By how much does the margin grow if `K_r` of the sixth joint is doubled? Predict it from the theorem,
#    then ask `delay_margin`.
# 2. Let one link alone be late: `delay` may be a matrix, with a row for each sender. Which of the two
#    directions hurts more?
# 3. At which loss does "hold" with a period of 10 ms leave the blue? Look at one run there.
# 4. `Network(event=...)` sends only what is news. How many messages are left, and how much worse is ε?
# 5. Clocks that are off: `offset=`. What does the certificate call it?
#
# ## Further
#
# [Robots that hear each other late](../docs/network.md) has the theorems, and [how much delay can a cell
# take](../docs/delays.md) the analysis. [Taking it to a robot](to_a_robot.ipynb) sends these messages over
# a wire of your own.
