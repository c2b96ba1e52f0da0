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
# hands, so forces pass through it from arm to arm. Each arm has a controller of its own, which knows its
# arm, learns a share of the box, and sees no force. How hard do the arms pull on what they hold?
#
# You will learn
#
# - what forces inside a held object are, and where they come from;
# - why exact geometry makes synchronization gentle, and a millimetre makes it pull;
# - what a leak, a tare and an admittance do about it, and what they leave as it is;
# - to hold an object of your own.
#
# Runs are computed by the compiled engine, which needs `pip install 'synctrl[compiled]'` and a C compiler;
# `ENGINE = "pinocchio"` does without, and takes many times as long.

# %%
# %matplotlib inline

from functools import partial

import numpy as np
from IPython.display import display

from synctrl import Cell, Coupling, Experiment, Friction, Gains, Hold, Member, load_robot
from synctrl.assembly.body import CarriedObject
from synctrl.assembly.grasp import Fixture, Grasp
from synctrl.assembly.plant import CarryingPlant
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
# 17 mm and two degrees beside its path. Nobody knows its mass: the first arm begins with 0.8 of its half,
# the second with nothing.
#
# The *internal* force is what the hands do to the box beyond carrying it: the part of their forces that
# moves nothing. The arrows show it.

# %%
alone = carried(synchronized=False)
scene_of(alone)

# %% [markdown]
# ## What synchronization does where the geometry is exact
#
# With β and $K_\epsilon$ the arms agree on where the box is, as far as the fixtures give. The force inside
# goes down faster than under independent control, and further.

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
# Now the first arm is wrong about where it holds the box, by a millimetre and half a degree. ε cannot
# vanish before the fixtures have given the whole millimetre. They resist: two springs in a row, K/2 times a
# millimetre. The integral of ε in the law does not rest until that force is there.

# %%
wrong_alone = carried(synchronized=False, geometric_error=True)
wrong = carried(geometric_error=True)
stiffness = wrong.info["grasps"][0]["stiffness"][0]
print(f"predicted: {stiffness / 2 * 1e-3:.1f} N, at the end of this run: {squeeze(wrong)[-1]:.1f} N")
print(f"independent: {squeeze(wrong_alone)[-1]:.1f} N")

# %%
side_by_side({"independent, 1 mm": wrong_alone, "synchronized, 1 mm": wrong})

# %% [markdown]
# ## A leak
#
# An integral that leaks, I' = ε - ΛI, does not grow without end, and the proof of convergence holds with
# it. It keeps the harm away. It does not bring back what synchronization did with exact geometry: the
# independent controller has less force still.

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
# vanish, $K_\epsilon$ may be high.

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

# %% [markdown]
# ## An object of your own
#
# A cell of your own takes three things more: a `CarriedObject`, a `Grasp` for each hand with the `Fixture`
# that gives, and `CarryingPlant` as its plant. Here two planar arms hold a plate of half a kilogram, at
# rest, in the plane in which gravity does no work for them. With $m g = 4.9$ N, each hand should bear the
# half of it.

# %%
arm = load_robot("planar2r")
arms = arm.placed((-0.6, 0, 0), name="left"), arm.placed((0.6, 0, 0), (0, 0, np.pi), name="right")
q0 = [1.2, -1.6], [-1.2, 1.6]  # rad
hands = [robot.tip_pose(q) for robot, q in zip(arms, q0, strict=True)]
middle = 0.5 * (hands[0].translation + hands[1].translation)

plate = CarriedObject(mass=0.5, box=(0.43, 0.1, 0.02), name="plate")
fixture = Fixture(stiffness=(1e4, 20.0), damping=(50.0, 0.1))  # N/m and N·m/rad, N·s/m and N·m·s/rad
grasps = [Grasp(i, hand.translation - middle, hand.rotation, fixture) for i, hand in enumerate(hands)]
members = [Member(robot, Hold(q), q0=q, friction=Friction()) for robot, q in zip(arms, q0, strict=True)]
own = Experiment(
    Cell(members, Coupling.pair(), name="a plate of my own"),
    Gains(Lambda=8, beta=8, K_r=2, K_eps=5, Gamma=0.1),
    duration=0.1,
    plant_type=partial(CarryingPlant, body=plate, grasps=grasps, at=(middle, np.eye(3))),
)
held = own.simulate(dt=2e-4, engine=ENGINE)
print("N, upwards, by either hand:", held.outputs["hand_wrench"][-1, :, 2].round(3))

# %% [markdown]
# ## Exercises
#
# 1. Halve the stiffness of the fixtures of the box (`stiffness=` of `carry_ur5` is said in its docstring).
#    Predict the force of the millimetre before you run it.
# 2. Turn the error of geometry into one of two millimetres. Is the force twice as large with the leak, too?
# 3. Give your own plate a load: let `members` move it by 5 cm within a second, with `Cubic` for each hand.
#    Which internal force is there at most?
# 4. A hand may open: give one `Grasp` an `until`, with `HandlingPlant` as the plant, and let the other one
#    bear all.
# 5. How much of all this does independent control with stiff gains do? Try `GAINS.replace(Lambda=...,
#    beta=0, K_eps=0)`.
#
# ## Further
#
# [Robots that hold one object](../docs/assembly.md) has the proofs, hand-overs, rigid grasps, and the tare
# and admittance in full. [Adhesive](bead.ipynb) has tasks in which nothing is held and yet robots have to
# know of each other.
