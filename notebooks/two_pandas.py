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
# # Two Pandas pick up two kilograms that nobody told them of
#
# Two arms move side by side, and should stay in step: ε = e_1 - e_2. A quarter of the time on, their hands
# close around a bar of two kilograms, of which the first arm gets 1.4 kg and the second 0.6 kg. The
# controllers know their arms exactly and nothing of the bar. What do ways to learn make of it?
#
# You will learn
#
# - to let robots pick up what nobody told them of;
# - what five ways to learn make of it, and what that costs;
# - to ask whether estimates are those of bodies that can exist, and when that matters.

# %%
# %matplotlib inline

import numpy as np
from IPython.display import display

from synctrl import Cell, Coupling, Cubic, Experiment, Friction, Gains, Member, Payload, load_robot
from synctrl.analysis.consistency import physical_consistency
from synctrl.control.adaptation import Ball, Gradient, Natural
from synctrl.show import scene_of
from synctrl.show.consistency_plots import consistency_figure
from synctrl.show.plots import common_limits, new_figure, style, sync_errors

# %%
DURATION = 4.0  # s
PICKED_UP = DURATION / 4
LOADS = (1.4, 0.6)  # kg

# %% [markdown]
# ## The cell

# %%
panda = load_robot("panda")
known = panda.inertial_parameters
start = np.array([0.0, -0.8, 0.0, -2.4, 0.0, 1.6, 0.8])
end = np.array([0.6, -0.2, 0.3, -1.7, 0.2, 1.9, 1.2])


def member(y):
    arm, path = panda.placed(xyz=(0, y, 0)), Cubic(start, end, 0.9 * DURATION)
    return Member(arm, path, theta_hat0=known, friction=Friction())


cell = Cell([member(0.0), member(0.8)], Coupling.pair(), name="two Pandas")
gains = Gains(Lambda=6.0, beta=6.0, K_r=(10.0, 50.0, 10.0, 24.0, 1.5, 2.0, 0.3), K_eps=2.0)
bar = [Payload(i, mass, com=(0.0, 0.0, 0.1), start=PICKED_UP) for i, mass in enumerate(LOADS)]

# %% [markdown]
# ## Ways to learn
#
# The paper's law with one number for all parameters; the same kept within a distance of what was known; the
# same in the metric of the arms' bodies; and the law whose estimates stay those of bodies by construction.

# %%
learners = {
    "nothing learned": Gradient(0.0),
    "Gradient(0.1)": Gradient(0.1),
    "Ball(0.1, 0.5)": Ball(0.1, 0.5),
    "pullback, 5": Gradient.pullback(panda, 5.0),
    "Natural(5)": Natural(5.0),
}
runs = {
    name: Experiment(cell, gains, DURATION, adaptation=learner, payloads=bar).simulate()
    for name, learner in learners.items()
}

# %% [markdown]
# ## Do they stay in step?

# %%
limits = common_limits("sync_error", *runs.values())
for name in ("nothing learned", "Gradient(0.1)", "Natural(5)"):
    print(name)
    display(sync_errors(runs[name], limits))

# %%
for name, run in runs.items():
    late = run.t > 0.75 * DURATION
    worst = np.rad2deg(np.abs(run.tracking_error).max()), np.rad2deg(np.abs(run.sync_error).max())
    left = np.rad2deg(np.abs(run.tracking_error[late]).max())
    print(f"{name:16} largest e {worst[0]:6.3f}°, late e {left:6.3f}°, largest ε {worst[1]:6.3f}°")

# %% [markdown]
# ## What do they believe to hold?
#
# The estimated mass of the last body, hand and load included, less that of the hand; dashed is the truth.
# Torque does not tell masses one by one: other bodies may take their share, and a wrong mass need not make
# a wrong torque.

# %%
with style():
    figure, axes = new_figure(3.0, 1, 2, sharey=True)
    for i, panel in enumerate(axes[0]):
        for name, run in runs.items():
            panel.plot(run.t, run.theta_hat[:, i, -10] - known[-10], label=name)
        panel.plot(run.t, np.where(run.t < PICKED_UP, 0.0, LOADS[i]), "k--", lw=0.9)
        panel.set(title=f"robot {i + 1}", xlabel="t, s")
    axes[0, 0].set_ylabel("mass at the hand, kg")
    axes[0, 1].legend(loc="upper left")
display(figure)

# %% [markdown]
# ## Could such bodies exist?
#
# Ten numbers are those of a body exactly if the eigenvalues of its pseudo-inertia are above zero. The
# theorem does not need that; whoever takes the estimates for bodies does.

# %%
for name, run in runs.items():
    print(f"{name:16} {physical_consistency(run)}")
display(consistency_figure(physical_consistency(runs["Gradient(0.1)"])))
display(consistency_figure(physical_consistency(runs["Natural(5)"])))

# %% [markdown]
# ## In motion
#
# Without learning, and with estimates that stay physical.

# %%
scene_of(runs["nothing learned"])

# %%
scene_of(runs["Natural(5)"])

# %% [markdown]
# ## Exercises
#
# 1. Let go of the bar again, with `stop=` of `Payload`. Which way to learn is quickest to forget it?
# 2. Give both arms the same share of the load. What is left of the synchronization error, and why?
# 3. Raise the rate of `Natural` threefold, and again. Where does it end, and what does the run warn of?
# 4. With $\beta = K_\epsilon = 0$, `gains.independent()`: how much of what holds the arms in step is
#    learning, and how much is synchronization?
#
# ## Further
#
# [Adaptations](../docs/adaptation.md) says of each what it does badly. [An adaptation of your
# own](own_adaptation.ipynb) writes one more. Arms that really share one load, with forces inside it, are in
# [carrying](carry.ipynb).
