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
# # Two CRS A460 arms carry a payload
#
# Section V-A of Sun and Mills (2002). Two arms face each other and hold a level bar between their wrists.
# Both move it along a cubic path; the errors of their joints should agree, ε = e_1 - e_2.
#
# **Synthetic data.** Masses, inertias and friction of the A460 were never published; those used here are
# invented to be plausible. The size of the errors is not the paper's, the effects are.
#
# You will learn
#
# - what adaptation does with gravity, and what it cannot do with friction that nobody models;
# - what is gained by synchronization, joint by joint;
# - to tell a step that is too long from a controller that is bad.

# %%
# %matplotlib inline

import numpy as np
from IPython.display import display

from synctrl.analysis import certify
from synctrl.experiments import a460_pair
from synctrl.show.animation import payload_pair_scene
from synctrl.show.plots import common_limits, joint_trajectories, sync_errors

# %%
DURATION = 4.0  # s

# %% [markdown]
# ## Synchronized
#
# The controller adapts all thirty inertial parameters of the three moving bodies, and starts at 70 % of
# their values. It does not know that there is friction.
#
# **A `StepWarning` is right here.** With friction, runs warn that their step of 1 ms is too long: near rest
# friction answers a joint's velocity about 2000 times per second, faster than such a step can follow, so
# the first milliseconds are off. In these figures it cannot be seen. Where the start matters, ask for a
# shorter step, `simulate(DURATION, dt=1e-4)`, which warns of nothing; `engine="compiled"` makes that quick.

# %%
together = a460_pair().simulate(DURATION)
display(joint_trajectories(together, 0), joint_trajectories(together, 1))

# %% [markdown]
# Gravity pulls the second joint down at first, until the adaptation has taken it up.
#
# ## Independent
#
# The same controller with $\beta = K_\epsilon = 0$.

# %%
alone = a460_pair(synchronized=False).simulate(DURATION)
limits = common_limits("sync_error", together, alone)
display(sync_errors(together, limits), sync_errors(alone, limits))

# %%
ratio = np.abs(alone.sync_error).max(axis=(0, 1)) / np.abs(together.sync_error).max(axis=(0, 1))
for joint, value in zip(together.info["axes"], ratio, strict=True):
    print(f"{joint}: largest ε {value:.1f} times smaller with synchronization")

# %% [markdown]
# ## What friction does
#
# Friction is outside the regressor Y, so it leaves an offset at the end. In a plant without friction the
# offset goes away. Gravity leaves none, for it is in Y.

# %%
frictionless = a460_pair(friction=False).simulate(DURATION)
for name, run in (("with friction", together), ("without", frictionless)):
    print(f"{name:13} error at {run.t[-1]:g} s, deg:", np.rad2deg(run.tracking_error[-1]).round(4).tolist())

# %%
print(certify(frictionless))
print()
print(certify(together))

# %% [markdown]
# ## In motion
#
# The payload is drawn, not simulated. It turns red with the synchronization error.

# %%
limit = float(np.linalg.norm(alone.sync_error, axis=2).max())
payload_pair_scene(together, limit=limit)

# %%
payload_pair_scene(alone, limit=limit)

# %% [markdown]
# ## Exercises
#
# 1. `a460_pair(adapt_friction=True)` puts friction among what is learned. Which of the figures changes, and
#    what does the certificate say now?
# 2. Halve and double `Gamma` (`GAINS` is in `synctrl.experiments.a460_pair`). How long does the sag of the
#    second joint last?
# 3. `simulate(DURATION, dt=1e-4, engine="compiled")` resolves the start. How large was the error of the
#    first milliseconds?
# 4. With `gravity=False` nothing pulls. How large are the errors at first, and what is left of the
#    advantage of synchronization?
# 5. The wrists of the real arm are held by controllers of their own: run `a460_full_pair()`, and compare
#    the errors of the first three joints.
#
# ## Further
#
# [Why beta works](why_beta_works.ipynb) takes these arms apart into modes. [An adaptation of your
# own](own_adaptation.ipynb) changes how they learn. [Adaptations](../docs/adaptation.md) compares those
# that there are on this cell.
