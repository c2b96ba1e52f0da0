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
# # Four planar arms
#
# Section V-B of Sun and Mills (2002). Four two-link arms in the plane move their tips along short arcs
# while they keep their distances. Nobody knows their inertia well: the first estimate is that of links of
# 0.8 kg and 0.2 m where 1 kg and 0.3 m are true; only positions are computed with the true lengths. What
# happens when robot 1 is pushed?
#
# You will learn
#
# - what a cell is: robots, desired motions, a coupling;
# - what synchronization does where one robot is pushed, and what it does not do;
# - to read figures of errors, and a certificate that names what acted from outside.

# %%
# %matplotlib inline

import numpy as np
from IPython.display import display

from synctrl.analysis import certify
from synctrl.experiments import planar_four
from synctrl.show.animation import planar_scene
from synctrl.show.layout import cell_layout
from synctrl.show.plots import common_limits, sync_errors, tracking_errors

# %%
DURATION = 5.0  # s

# %% [markdown]
# ## The cell
#
# Robots 1 and 4 follow a circle of 5 m around the origin, robots 2 and 3 one of 6 m. In the ring every
# robot is compared with two neighbours: ε_k = c_k e_k + c_{k+1} e_{k+1} with c = (6, -5, 5, -6) m, so that
# ε = 0 keeps the radii in proportion.

# %%
experiment = planar_four()
print(experiment.cell)
print("S =\n", experiment.cell.coupling.matrix)

# %%
together = experiment.simulate(DURATION)
cell_layout(together)

# %% [markdown]
# ## With and without synchronization
#
# Independent control is the same controller with $\beta = K_\epsilon = 0$. Each tip tracks about as well as
# before. What differs is the synchronization error.

# %%
alone = planar_four(synchronized=False).simulate(DURATION)
limits = common_limits("tracking_error", together, alone)
display(tracking_errors(together, limits), tracking_errors(alone, limits))

# %%
limits = common_limits("sync_error", together, alone)
display(sync_errors(together, limits), sync_errors(alone, limits))

# %%
for name, run in (("synchronized", together), ("independent", alone)):
    e, epsilon = np.abs(run.tracking_error).max(), np.abs(run.sync_error).max()
    print(f"{name:13} largest e {1e3 * e:6.2f} mm, largest ε {1e3 * epsilon:6.2f}·10⁻³ m²")

# %% [markdown]
# ## Robot 1 is pushed
#
# A torque of 1 N·m acts on both joints of robot 1 for a quarter of a second. Synchronized, the other three
# give way with it. Independent, they move exactly as if nothing had happened, bit for bit, and robot 1
# leaves the formation.
#
# Pushed, the synchronized run warns that its step of 1 ms is too long: β and the ring of four robots answer
# errors 400 times per second, and the push begins at once. Torques are off by up to a hundredth of their
# peak in the milliseconds after; `simulate(DURATION, dt=5e-4)` resolves that and warns of nothing.

# %%
pushed_together = planar_four(disturbance="torque").simulate(DURATION)
pushed_alone = planar_four(synchronized=False, disturbance="torque").simulate(DURATION)
limits = common_limits("tracking_error", pushed_together, pushed_alone)
display(tracking_errors(pushed_together, limits), tracking_errors(pushed_alone, limits))

# %%
print("robots 2 to 4 untouched:", np.array_equal(alone.x[:, 1:], pushed_alone.x[:, 1:]))

# %% [markdown]
# ## The proof, watched
#
# Without friction and without a push every assumption of the theorem holds, and V can only fall. A push is
# power from outside: V grows, and the balance names the term.

# %%
print(certify(together))
print()
print(certify(pushed_together))

# %% [markdown]
# ## In motion
#
# The bars between neighbouring tips grow and turn red with their synchronization error.

# %%
limit = float(np.linalg.norm(pushed_alone.sync_error, axis=2).max())
planar_scene(pushed_together, limit=limit)

# %%
planar_scene(pushed_alone, limit=limit)

# %% [markdown]
# ## Exercises
#
# 1. `planar_four(phi=0.3)` moves the cell towards the end of the arms' reach. What becomes of the errors?
#    At 0.5 it is out of reach: what does the message say, and could you mend the cell by it?
# 2. With `GAINS` from `synctrl.experiments.planar_four`, try `planar_four(gains=GAINS.replace(beta=0))` and
#    the same with `K_eps=0`. Which of the two gains does the work here?
# 3. Push robot 2 in place of robot 1: `Disturbance(1, 1.0, 0.5, 0.75)` of `synctrl`, in
#    `dataclasses.replace(experiment, disturbances=[...])`. Is the cell as symmetric as it looks?
# 4. Find the smallest push that the certificate still names.
# 5. Save `together`, load it in a new session, and draw its scene from the file alone.
#
# ## Further
#
# [Why beta works](why_beta_works.ipynb) explains what you saw. [Ten thousand runs](ten_thousand.ipynb)
# varies the gains of this very cell. [My robots, my task](my_robots.ipynb) builds a cell from nothing. The
# law and its proof are in [the theory](../docs/theory.md), the symbols in [notation](../docs/notation.md).
