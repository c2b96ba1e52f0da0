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
# # Two arms that hold one payload, and what a millimetre does
#
# Two UR5 hold a box of 4 kg between them and swing it about. Fixtures that give a little connect it to the
# hands, so forces pass through it from arm to arm. Each arm has a controller of its own, which knows its arm,
# learns a share of the box, and sees no force. How hard do the arms pull on what they hold?
#
# Runs are computed by the compiled engine, which needs `pip install 'synctrl[compiled]'` and a C compiler;
# `ENGINE = "pinocchio"` does without, and takes many times as long.

# %%
# %matplotlib inline

import numpy as np
from IPython.display import HTML, display

from synctrl.experiments import carry_ur5
from synctrl.experiments.carry import GAINS
from synctrl.show import scene_of, side_by_side
from synctrl.show.assembly_figures import internal_force_curves, object_error_curves
from synctrl.show.curves import overlay

# %%
DURATION = 5.0  # s
ENGINE = "compiled"


def carried(**options):
    return carry_ur5(**options).simulate(DURATION, dt=2e-3, log_dt=1e-2, engine=ENGINE)


def squeeze(run):
    """Size of the internal force, N; both hands have the same."""
    return np.linalg.norm(run.outputs["internal_force"][:, 0, :3], axis=1)


# %% [markdown]
# ## What is held
#
# Either arm is controlled at the middle of the box, as it believes to hold it. So both are given the same
# desired motion, and ε = e_1 - e_2 says how far their ideas of where the box is are apart. The box starts
# 17 mm and two degrees beside its path. Nobody knows its mass: the first arm begins with 0.8 of its
# half, the second with nothing.
#
# The *internal* force is what the hands do to the box beyond carrying it: the part of their forces that moves
# nothing. The arrows show it.

# %%
alone = carried(synchronized=False)
HTML(scene_of(alone).html())

# %% [markdown]
# ## What synchronization does where the geometry is exact
#
# With β and K_ε the arms agree on where the box is, as far as the fixtures give. The force inside goes down
# faster than under independent control, and further.

# %%
together = carried()
display(overlay(internal_force_curves, {"independent": alone, "synchronized": together}))
for name, run in (("independent", alone), ("synchronized", together)):
    print(f"{name:14} at most {squeeze(run).max():5.1f} N, at the end {squeeze(run)[-1]:5.1f} N")

# %% [markdown]
# The path of the box hardly differs, for synchronization is about the arms and not about the box.

# %%
display(overlay(object_error_curves, {"independent": alone, "synchronized": together}))

# %% [markdown]
# ## The millimetre
#
# Now the first arm is wrong about where it holds the box, by a millimetre and half a degree. ε cannot vanish
# before the fixtures have given the whole millimetre. They resist: two springs in a row, K/2 times a
# millimetre. The integral of ε in the law does not rest until that force is there.

# %%
wrong_alone = carried(synchronized=False, geometric_error=True)
wrong = carried(geometric_error=True)
stiffness = wrong.info["grasps"][0]["stiffness"][0]
print(f"predicted: {stiffness / 2 * 1e-3:.1f} N, at the end of this run: {squeeze(wrong)[-1]:.1f} N")
print(f"independent: {squeeze(wrong_alone)[-1]:.1f} N")

# %%
HTML(side_by_side({"independent, 1 mm": wrong_alone, "synchronized, 1 mm": wrong}).html())

# %% [markdown]
# ## A leak
#
# An integral that leaks, I' = ε - ΛI, does not grow without end, and the proof of convergence holds with it.
# It keeps the harm away. It does not bring back what synchronization did with exact geometry: the independent
# controller has less force still.

# %%
leaking = carried(geometric_error=True, leak=True)
runs = {"independent": wrong_alone, "synchronized": wrong, "with a leak": leaking}
display(overlay(internal_force_curves, runs))

# %%
display(overlay(object_error_curves, runs))

# %% [markdown]
# ## A tare, an admittance, and stiff synchronization
#
# What cures it is three things more. With a *tare* the arms agree, when their hands close, on where the box
# is: the first one's idea of it is taken over, right or wrong, so a constant error vanishes from ε. With an
# *admittance* each arm feels the wrench inside and gives way to it, as a mass in honey would, so the force
# goes to zero whatever the arms believe; the leak comes with it. And once nothing is left in ε that cannot
# vanish, K_ε may be high.

# %%
STIFF = GAINS.replace(K_eps=[2e4] * 3 + [200.0] * 3)  # N/m and N·m/rad
yielding = carried(synchronized=False, geometric_error=True, admittance=True)
calm = carried(geometric_error=True, tare=True, admittance=True, gains=STIFF)
runs = {"independent": wrong_alone, "independent, admittance": yielding, "with everything": calm}
display(overlay(internal_force_curves, runs))


# %%
def off_its_path(run):
    """RMS of the distance of the box from its path, mm."""
    way = (run.outputs["object_desired"] - run.outputs["object_pose"])[:, :3]
    return 1e3 * np.sqrt((way**2).sum(axis=1).mean())


for name, run in {**runs, "with a leak": leaking, "synchronized": wrong}.items():
    force = squeeze(run)
    rms = np.sqrt((force**2).mean())
    print(f"{name:24} peak {force.max():5.1f} N, rms {rms:5.1f} N, last {force[-1]:5.1f} N", end="; ")
    print(f"box {off_its_path(run):.1f} mm off its path")

# %% [markdown]
# **What is not better.** An admittance alone, on arms that are not synchronized at all, already does much
# of this. And the box is no closer to its path than before: all of this is about what the arms do to each
# other. Which theorem such a run is about:

# %%
print(calm.experiment.closed_loop().chain.theorem)
