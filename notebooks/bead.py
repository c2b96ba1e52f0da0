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
# # A bead of adhesive on an edge that moves, and two beads that meet
#
# Two tasks of two UR5 each, in which nothing is held together and yet one arm has to know how the other one
# does. In the first an arm carries a plate, and the other one lays adhesive along the edge of it. In the
# second both lay adhesive on one path, from its ends, until their beads meet. Adhesive weighs nothing here.
#
# You will learn
#
# - to compare errors where they count: against a plate that moves, or along a path;
# - what is won by that, what stiffness alone would do, and what is not better;
# - to let a motion wait for those who are late.
#
# Runs are computed by the compiled engine, which needs `pip install 'synctrl[compiled]'` and a C compiler;
# `ENGINE = "pinocchio"` does without, and takes many times as long.

# %%
# %matplotlib inline

from functools import partial

import numpy as np
from IPython.display import Markdown, display

from synctrl.experiments import bead_on_edge, bead_on_path
from synctrl.experiments.bead_on_edge import GAINS
from synctrl.show import side_by_side
from synctrl.show.assembly_figures import output_curves
from synctrl.show.curves import overlay

# %%
DURATION = 5.0  # s
ENGINE = "compiled"


def table(first, *rows):
    """Rows of texts and numbers, of which the first is the heading."""
    texts = [[f"{value:.3g}" if isinstance(value, float) else value for value in row] for row in rows]
    lines = [first, ["---"] * len(first), *texts]
    return Markdown("\n".join(f"| {' | '.join(line)} |" for line in lines))


# %% [markdown]
# ## A bead on the edge of a plate that moves
#
# What is asked: the nozzle goes along the edge at 0.14 m/s, 5 mm from it and tilted by 30°, while the arm
# that carries swings the plate about. Nobody knows the plate's 2 kg. What counts is where the nozzle is
# *against the plate*. So the arm that carries has its errors counted at the place on its plate where the
# nozzle should be, and ε = e_1 - e_2 is the error of the bead. From 2 s to 2.3 s somebody leans on the arm
# that carries.
#
# Three controllers: both arms alone; both alone with Λ = 26 in the place of 6, as stiff as what comes next;
# and synchronized, with $\beta = 20$ and $K_\epsilon = 2000$.


# %%
def on_edge(**options):
    return bead_on_edge(**options).simulate(DURATION, log_dt=1e-2, engine=ENGINE)


edge = {
    "independent": on_edge(synchronized=False),
    "independent, Λ = 26": on_edge(synchronized=False, gains=GAINS.replace(Lambda=26.0, beta=0.0, K_eps=0.0)),
    "synchronized": on_edge(),
}

# %% [markdown]
# The bead goes with the plate and keeps the colour of the error with which it was laid: green is none, and
# red the largest of both runs.

# %%
side_by_side({name: edge[name] for name in ("independent", "synchronized")})

# %%
display(overlay(partial(output_curves, name="bead_error"), edge))

# %%
display(overlay(partial(output_curves, name="bead_speed"), edge))


# %% [markdown]
# In numbers, the largest from the push on: of the bead's error, of the speed along the edge against the
# desired one, and of the distance of the plate from its own path.


# %%
def worst(run, values):
    """The largest size from the push on, in mm or mm/s."""
    start = int(np.abs(run.disturbance).any(axis=(1, 2)).argmax())
    return 1e3 * float(np.abs(values[start:]).max())


def edge_row(name, run):
    logged = run.outputs
    bead = np.linalg.norm(logged["bead_error"], axis=1)
    speed = logged["bead_speed"] - logged["bead_speed_desired"]
    plate = np.linalg.norm((logged["object_pose"] - logged["object_desired"])[:, :3], axis=1)
    return name, worst(run, bead), worst(run, speed), worst(run, plate)


heading = "controller", "bead, mm", "speed, mm/s", "plate, mm"
display(table(heading, *(edge_row(name, run) for name, run in edge.items())))

# %% [markdown]
# **What is not better.** The plate leaves its path all the same when somebody leans on its arm, and takes
# the nozzle along: the bead is right, and the plate is not where it should be; stiff arms hold it better.
# The speed along the edge, on which the thickness of the bead depends, gains least. And part of all this
# can be had without any synchronization, by arms that are stiff.
#
# ## Two beads that meet
#
# Each arm goes its part of a path, to meet the other one at 3.8 s, with 20 mm between the nozzles. Shortly
# before, the first is pushed back for half a second; joints rub, of which no controller knows. They are
# compared along the path alone, in four ways:
#
# - not at all;
# - `gap`: ε is the error of the gap between the nozzles, so where the first is late the second moves up;
# - `gap_weighted`: the same, the more the closer they are;
# - `phase`: ε is by how much time one is later than the other, which keeps the place where they meet.

# %%
MODES = "independent", "gap", "gap_weighted", "phase"


def on_path(mode):
    return bead_on_path(mode).simulate(DURATION, dt=2e-4, log_dt=1e-2, engine=ENGINE)


path = {mode: on_path(mode) for mode in MODES}

# %%
side_by_side({name: path[name] for name in ("independent", "gap_weighted")})

# %%
display(overlay(partial(output_curves, name="gap_error"), path))


# %%
def path_row(name, run):
    met = run.info["meeting"] or {"gap_error": np.nan, "off": np.nan}
    gap, speeds = run.outputs["gap_error"], run.outputs["speed_error"]
    each = [worst(run, speeds[:, k]) for k in (0, 1)]
    return name, 1e3 * met["gap_error"], worst(run, gap), 1e3 * met["off"], *each


heading = (
    "compared",
    "gap where they meet, mm",
    "worst gap, mm",
    "place, mm",
    "speed of 1, mm/s",
    "of 2, mm/s",
)
display(table(heading, *(path_row(name, run) for name, run in path.items())))

# %% [markdown]
# With the gap compared its error where they meet is a tenth of what it was, or less; `gap_weighted` leaves
# the arms alone while they are far apart, and is the best of the four where they meet. `phase` keeps the
# place and not the gap.
#
# **What is not better.** The second arm pays for the first: its speed is off by several times what it would
# have been alone, and its dispenser has to follow. Stiffer arms that are not synchronized would also leave
# a small gap.
#
# ## A motion that waits
#
# With `override=True` all that is desired goes on at a feed, which falls where the arms lag along the path.
# Here without friction, which would ask for a shorter step, and not in the compiled engine, which has no
# motion that waits.

# %%
waiting = bead_on_path(override=True, friction=False).simulate(min(DURATION, 4.5), dt=4e-3, log_dt=2e-2)
display(overlay(partial(output_curves, name="feed"), {"gap_weighted, waiting": waiting}))

# %%
without = bead_on_path(friction=False).simulate(DURATION, dt=1e-3, log_dt=1e-2, engine=ENGINE)
for name, run in (("without", without), ("with", waiting)):
    if met := run.info["meeting"]:
        print(
            f"{name:8} they meet at {met['time']:.2f} s, {1e3 * abs(met['off']):.1f} mm beside the place,",
            end=" ",
        )
        print(f"with a gap that is off by {1e3 * abs(met['gap_error']):.1f} mm")

# %% [markdown]
# They meet a little later, closer to the place: the motion has waited for the first arm.

# %% [markdown]
# ## Exercises
#
# 1. In the first task double the push. Is the bead twice as bad?
# 2. Which of Λ, β and $K_\epsilon$ matters for the speed along the edge, on which the thickness depends?
# 3. In the second task let the *second* arm be pushed. Are `gap` and `phase` as good as before?
# 4. Lay the bead on a path of your own: [assembly](../docs/assembly.md) has `Path` and `AlongPath`.
#
# ## Further
#
# [Robots that hold one object](../docs/assembly.md) has both tasks with their proofs. [Taking it to a
# robot](to_a_robot.ipynb) goes on from here to a loop of your own.
