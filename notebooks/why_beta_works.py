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
# # Why beta works
#
# The law adds β times the integral of the synchronization errors to every robot's error. Why does that hold
# robots together? Because of what it does to the coupled velocity error r on its way to the errors: it is a
# filter, and β moves one of its poles. Two A460 show it, with friction that their model does not know.
#
# The proof is in `docs/theorem_b.md`. **Masses, inertias and friction of the A460 are invented**, see the
# notebook about the two arms.
#
# You will learn
#
# - to see the law as a filter, one for each mode of the cell;
# - what β does to the modes in which robots differ, and that it does nothing to the common one;
# - to read bounds that hold for every run.

# %%
# %matplotlib inline

import numpy as np
from IPython.display import display

from synctrl.analysis import modal_bounds
from synctrl.analysis.modal_filter import ModalFilter
from synctrl.experiments import a460_pair
from synctrl.show.animation import payload_pair_scene
from synctrl.show.modal_figures import modal_figure
from synctrl.show.plots import common_limits, new_figure, style, sync_errors

# %%
DURATION = 4.0  # s

# %% [markdown]
# ## The filter
#
# Two robots have two modes. In the common one both are wrong alike, and ε is 0; in the other they differ.
# With λ the eigenvalue of SᵀS, 0 for the first and 2 for the second, every axis of a mode obeys
#
# $$w = \frac{p}{(p + \Lambda)(p + \beta\lambda)}\, r$$
#
# Without β one factor p cancels: 1/(p + Λ), whatever the mode. With it the gain of the differences is at
# most 1/(Λ + βλ), and 0 where r is constant.

# %%
S, Lambda = np.array([[1.0, -1.0]]), np.array([8.0])
frequencies = np.geomspace(0.01, 1000, 400)  # rad/s
with style():
    figure, ((panel,),) = new_figure(3.0)
    for beta in (0.0, 2.0, 8.0, 32.0):
        modes = ModalFilter.from_matrix(S, Lambda, np.array([beta]), np.zeros(1))
        p, pull = 1j * frequencies, modes.pull[1, 0]
        gain = np.abs(p / ((p + 8.0) * (p + pull)))
        panel.loglog(frequencies, gain, label=f"β = {beta:g}: at most {modes.gain[1, 0]:.4f} s")
    panel.set(xlabel="frequency of r, rad/s", ylabel="difference over r, s")
    panel.legend()
figure

# %% [markdown]
# ## The two arms
#
# The same controller, with β and without; $K_\epsilon$ goes with it, but is in none of the gains. Friction
# near rest is faster than the step, of which runs warn; see the notebook about the two arms.

# %%
together = a460_pair().simulate(DURATION, log_dt=1e-2)
alone = a460_pair(synchronized=False).simulate(DURATION, log_dt=1e-2)
limits = common_limits("sync_error", together, alone)
display(sync_errors(together, limits), sync_errors(alone, limits))

# %% [markdown]
# ## Bounds, and the runs inside
#
# What a run may do at most, given the r that it had, is the dark band. The light band knows no r, only what
# is stored at first and how much torque the model lacks. The common mode is the same in both figures.

# %%
bounds = {"synchronized": modal_bounds(together), "independent": modal_bounds(alone)}
for name, found in bounds.items():
    print(f"{name}: {found.sentence}.")
    display(modal_figure(found))

# %% [markdown]
# ## Residual offsets
#
# At the end friction holds the arms, and r hardly changes. A filter shows then what it does to constants:
# in the common mode r/Λ stays, with β and without. In the difference it stays only without.

# %%
for name, found in bounds.items():
    for kind, j in (("common mode", 0), ("difference", 1)):
        r, w = (np.rad2deg(np.linalg.norm(part[-1, j])) for part in (found.r, found.w))
        left = np.rad2deg(np.linalg.norm(found.filter.static[j] * found.r[-1, j]))
        print(f"{name:12} {kind:11} |r| {r:6.3f} deg/s, |w| {w:.4f} deg, a constant r leaves {left:.4f} deg")

# %% [markdown]
# ## In motion
#
# The payload turns red with the synchronization error.

# %%
limit = float(np.linalg.norm(alone.sync_error, axis=2).max())
payload_pair_scene(together, limit=limit)

# %%
payload_pair_scene(alone, limit=limit)

# %% [markdown]
# ## Exercises
#
# 1. Draw the gain of the filter for a ring of four, `Coupling.signed_ring(4)`, which has three eigenvalues.
#    In which mode does β do most?
# 2. `Gains.leak` lets the integral forget. The zero of the filter moves from 0 to −l, and a constant r
#    leaves something again: look at `static` of `ModalFilter`.
# 3. `planar_four()` has β = 100. Compute what the bound of its differences is, and compare it with a run.
# 4. By the formula, how large does β have to be for the differences to be ten times smaller than the common
#    mode? Try it, and look at the torque.
#
# ## Further
#
# [Theorem B](../docs/theorem_b.md) has the proof, [gains](../docs/gains.md) how β is chosen, and [the
# tube](../docs/tube.md) bounds that need no run at all.
