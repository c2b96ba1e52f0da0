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
# # My robots, my task
#
# From nothing to a cell that is tuned and certified: three arms of your own design stand around a tray,
# lift it and turn it. Nobody knows their masses well, their joints rub, and one of them is pushed.
#
# You will learn
#
# - to write a robot as URDF, and to read what synctrl says of it;
# - to state a task for tips in the world, and to make a cell of it;
# - to get gains from the cell, to see what they promise, and to try them;
# - to read a certificate;
# - to tune the gains for two goals at once, and to look at the result in motion.
#
# You need `pip install '.[compiled,sweep,tune,notebooks]'` and a C compiler. Without one, write `ENGINE =
# "pinocchio"` below, which takes many times as long.

# %%
# %matplotlib inline

from pathlib import Path

import numpy as np
from IPython.display import display

from synctrl import (
    CartesianSpace,
    Cell,
    Coupling,
    Disturbance,
    Experiment,
    Gains,
    Member,
    Payload,
    SmoothTrajectory,
    SynctrlError,
    load_robot,
)
from synctrl.analysis import advise, certify, delay_margin
from synctrl.show import scene_of, side_by_side
from synctrl.show.curves import Curves, overlay
from synctrl.show.front_figures import front_figure
from synctrl.show.run_page import write_run_page
from synctrl.sweep import LogUniform, gain, gain_scale
from synctrl.tune import tune

# %%
DURATION = 4.0  # s
ENGINE = "compiled"

# %% [markdown]
# ## A robot file
#
# A URDF file lists *links*, which have mass, and *joints*, which connect them. Our arm is a small crane: a
# post that turns, an upper arm that lifts, and a fore arm that bends. Each is a tube along x or z, with
# radius r, length l and mass m. About its middle a solid cylinder has the moments of inertia
#
# $$I_\text{along} = \tfrac12 m r^2, \qquad I_\text{across} = \tfrac1{12} m (3 r^2 + l^2).$$
#
# All numbers are in m, kg, kg·m², rad and N·m. Every link that a joint moves needs a mass and an inertia;
# synctrl computes with them and cannot guess them.


# %%
def link(name, axis, length, radius, mass, color):
    """A link that is a solid cylinder along an axis, "x" or "z", from the origin of its joint on."""
    along, across = mass * radius**2 / 2, mass * (3 * radius**2 + length**2) / 12
    ixx, izz = (along, across) if axis == "x" else (across, along)
    middle, turn = (f"{length / 2} 0 0", "0 1.570796 0") if axis == "x" else (f"0 0 {length / 2}", "0 0 0")
    return f"""
  <link name="{name}">
    <inertial>
      <origin xyz="{middle}"/>
      <mass value="{mass}"/>
      <inertia ixx="{ixx:.6f}" ixy="0" ixz="0" iyy="{across:.6f}" iyz="0" izz="{izz:.6f}"/>
    </inertial>
    <visual>
      <origin xyz="{middle}" rpy="{turn}"/>
      <geometry><cylinder radius="{radius}" length="{length}"/></geometry>
      <material name="paint_{name}"><color rgba="{color} 1"/></material>
    </visual>
  </link>"""


def joint(name, parent, child, place, axis, lower, upper, effort):
    """A joint that turns; `effort` is the largest torque that its motor can give, N·m."""
    return f"""
  <joint name="{name}" type="revolute">
    <parent link="{parent}"/> <child link="{child}"/>
    <origin xyz="{place}"/> <axis xyz="{axis}"/>
    <limit lower="{lower}" upper="{upper}" effort="{effort}" velocity="4"/>
    <dynamics damping="0.4" friction="0.3"/>
  </joint>"""


URDF = f"""<robot name="crane">
  <link name="base"/>{link("post", "z", 0.25, 0.05, 4.0, "0.30 0.33 0.38")}
{link("upper_arm", "x", 0.40, 0.035, 2.5, "0.20 0.45 0.75")}
{link("fore_arm", "x", 0.35, 0.025, 1.2, "0.93 0.53 0.18")}
  <link name="hand"/>
{joint("turn", "base", "post", "0 0 0", "0 0 1", -3.0, 3.0, 40)}
{joint("lift", "post", "upper_arm", "0 0 0.25", "0 1 0", -2.0, 1.0, 60)}
{joint("bend", "upper_arm", "fore_arm", "0.40 0 0", "0 1 0", -0.2, 2.6, 30)}
  <joint name="wrist" type="fixed">
    <parent link="fore_arm"/> <child link="hand"/> <origin xyz="0.35 0 0"/>
  </joint>
</robot>
"""
Path("out").mkdir(exist_ok=True)  # for all that is written here
Path("out/crane.urdf").write_text(URDF)
crane = load_robot("out/crane.urdf", tip="hand")
print(crane)
print(crane.report)

# %% [markdown]
# `report` has whatever was left out, assumed, or is suspicious, with the line of the file. Here it says
# that the file states friction, which acts only where somebody asks for it. We shall.
#
# Is it the arm that we meant? Look at what can be known by hand: the mass, where the hand is when all
# joints are at zero (straight ahead, 0.40 m + 0.35 m out and 0.25 m up), and the torque that holds the arm
# there, which is $g \sum_i m_i x_i$ about the joint that lifts.

# %%
straight = np.zeros(3)
masses, middles = np.array([2.5, 1.2]), np.array([0.20, 0.40 + 0.175])  # kg, m
print("mass of all moving links, kg:", crane.inertial_parameters.reshape(-1, 10)[:, 0].sum())
print("hand, m:", crane.tip_position(straight))
print("torque of gravity, N·m:", crane.gravity(straight).round(4), "by hand:", -9.81 * masses @ middles)

# %% [markdown]
# What a file must have is checked when it is read. Here is what happens if a link has no inertia: the
# message has the file, the line, what was found and what is expected.

# %%
Path("out/broken.urdf").write_text(
    URDF.replace("<inertia ", "<!-- ").replace('"/>\n    </inertial>', '" -->\n    </inertial>')
)
try:
    load_robot("out/broken.urdf")
except SynctrlError as error:
    print(error)

# %% [markdown]
# ## A task
#
# Three hands hold the rim of a round tray, 0.18 m from its middle. It goes up by 0.2 m and turns by 0.9 rad
# within three seconds, then stays. With $s(a) = 10a^3 - 15a^4 + 6a^5$, $a = t/3$, which starts and ends at
# rest, hand k is at
#
# $$p_k(t) = \begin{pmatrix} 0 \\ 0 \\ 0.35 + 0.2 s \end{pmatrix} +
# 0.18 \begin{pmatrix} \cos\varphi_k \\ \sin\varphi_k \\ 0 \end{pmatrix}, \qquad
# \varphi_k(t) = \tfrac{2\pi}{3} k + 0.9 s.$$
#
# `SmoothTrajectory` takes the position alone and finds velocity and acceleration by itself. It is told
# until when the motion is needed and when it is not smooth: at 3 s, where the hands stop.

# %%
ARMS, RIM, MOVE = 3, 0.18, 3.0  # of the tray, m; s


def along(t):
    a = np.clip(t / MOVE, 0.0, 1.0)
    return a**3 * (10 - 15 * a + 6 * a**2)


def hand(k):
    def place(t):
        s = along(t)
        angle = 2 * np.pi * k / ARMS + 0.9 * s
        return np.array([RIM * np.cos(angle), RIM * np.sin(angle), 0.35 + 0.2 * s])

    return SmoothTrajectory(place, duration=5.0, breaks=(MOVE,))


# %% [markdown]
# ## A cell
#
# A `Member` is a robot, placed in the world, with its path and with what its controller believes at first:
# 60 % of everything. `friction="urdf"` lets the joints rub as the file says, and puts friction among what
# is learned. Which joint positions belong to the start of a path is found by inverse kinematics.
#
# In a ring each arm is compared with its two neighbours. `signed_ring` compares $\epsilon_k = e_k -
# e_{k+1}$: it is zero if all three hands are off by the same, so that the tray is moved but neither bent
# nor torn.


# %%
def member(k):
    angle = 2 * np.pi * k / ARMS
    place = 0.65 * np.array([np.cos(angle), np.sin(angle), 0.0])
    arm = crane.placed(xyz=place, rpy=(0, 0, angle + np.pi), name=f"crane {k + 1}")
    true = Member(arm, hand(k), friction="urdf").theta
    return Member(arm, hand(k), theta_hat0=0.6 * true, friction="urdf", name=arm.name)


cell = Cell(
    [member(k) for k in range(ARMS)],
    Coupling.signed_ring(ARMS),
    CartesianSpace("xyz"),
    name="three cranes and a tray",
)
print(cell)
print("start, rad:", cell.q0[0].round(3), "by", cell.starts[0])
print("learned of each arm:", cell.parameters[0].names[-9:])

# %% [markdown]
# ## Gains
#
# A controller has many numbers, but you need to say only one: how fast errors should go away. The rest
# follows from the arms' inertia along their paths, see [choosing gains](../docs/gains.md).

# %%
gains = Gains.suggest(cell, bandwidth=8.0)  # rad/s
for name in ("Lambda", "beta", "K_r", "K_eps"):
    print(f"{name:6} {np.round(getattr(gains, name), 2).tolist()}")

# %% [markdown]
# Are they good? `advise` looks at small errors along the path: which step and which delay the loop takes,
# what torque is to be expected against the motors' limits, and what should be changed first, if anything.

# %%
advise(cell, gains)

# %% [markdown]
# ## A run
#
# After one second somebody leans on crane 1: 12 N·m at its post for 0.3 s. `independent()` is the same
# controller without synchronization, $\beta = K_\epsilon = 0$: that is what we compare with.

# %%
push = Disturbance(robot=0, torque=(12.0, 0.0, 0.0), start=1.0, stop=1.3)


def run(gains, **options):
    experiment = Experiment(cell, gains, DURATION, disturbances=[push], **options)
    return experiment.simulate(engine=ENGINE)


together, alone = run(gains), run(gains.independent())
together.plot("tracking_error", "sync_error", "torque")

# %% [markdown]
# The push is shaded. Errors are those of the hands in the world; torque stays far below what the motors can
# give. `result.plot()` without names shows all that there is.
#
# What holds the tray together are the synchronization errors. Beside those of independent arms:


# %%
def apart(result):
    """How far the three hands are from where they should be to each other, mm."""
    size = 1e3 * np.linalg.norm(result.sync_error, axis=2).max(axis=1, keepdims=True)
    return [Curves("hands against each other", "mm", size, ["largest |ε|"])]


display(overlay(apart, {"independent": alone, "synchronized": together}))

# %% [markdown]
# ## A certificate
#
# `certify` watches the proof of convergence along a run: is $V$ what it should be, does it only fall, and
# did anything act that the theorem does not know? The push is such a thing. So the first run is *bounded by
# Theorem A*, with the bound beside what happened; without the push it is *covered by the theorem*.

# %%
quiet = Experiment(cell, gains, DURATION).simulate(engine=ENGINE)
print(certify(quiet))
print()
print(certify(together))

# %% [markdown]
# Nothing here says that errors are small. For that there are the figures, and [the tube](../docs/tube.md),
# which bounds errors before a run.
#
# ## Tuning
#
# The suggestion is a good beginning. What is best depends on what you want, and goals are at odds. Whoever
# holds hands together pulls all three along with the one that is pushed: a smaller synchronization error ε,
# or a smaller tracking error e? `tune` searches β and multiples of $K_\epsilon$ and Γ, with the same push,
# and gives the *front*: all runs to which no other one is preferable in both. Runs that are too fast for
# their step do not count.

# %%
GENERATIONS = 6

search = [
    gain("beta", LogUniform(0.5, 40.0)),  # 1/s
    gain_scale("K_eps", LogUniform(0.2, 20.0)),
    gain_scale("Gamma", LogUniform(0.1, 3.0)),
]
found = tune(
    Experiment(cell, gains, DURATION, disturbances=[push]),
    search,
    minimize=("sync_rms", "tracking_rms"),
    limits={"step_error": 2e-3},
    generations=GENERATIONS,
    progress=False,
)
front_figure(found)

# %% [markdown]
# The run that is chosen is the *knee* of the front. Its gains are in `found.gains`, and every other run of
# the front is a word away: `found.best("sync_rms")`.

# %%
print("chosen:", {name: round(value, 2) for name, value in found.values.items()})
tuned = run(found.gains)
runs = {"independent": alone, "suggested": together, "tuned": tuned}
for name, result in runs.items():
    epsilon = 1e3 * np.linalg.norm(result.sync_error, axis=2).max()
    e = 1e3 * np.linalg.norm(result.tracking_error, axis=2).max()
    torque = np.abs(result.tau).max()
    print(f"{name:12} largest ε {epsilon:5.2f} mm, largest e {e:5.2f} mm, torque {torque:.1f} N·m")
display(overlay(apart, runs))

# %% [markdown]
# Gains are tuned for what was tried. So try what was not: crane 2 picks up 0.8 kg that nobody told of, and
# the arms hear each other late.

# %%
load = Payload(robot=1, mass=0.8, start=0.5)
loaded = {name: run(g, payloads=[load]) for name, g in (("suggested", gains), ("tuned", found.gains))}
display(overlay(apart, loaded))
print("The certificate with the load:", certify(loaded["tuned"]).verdict)
for name, chosen in (("suggested", gains), ("tuned", found.gains)):
    print(f"{name}: {delay_margin(cell, chosen)}")

# %% [markdown]
# The suggested $K_\epsilon$ is one with which a theorem tolerates every constant delay. The tuned one is
# larger: now the roots of the linearized cell decide, and what they say holds for small errors. The stiffer
# the coupling against the damping $K_r$, the less delay arms take, see [delays](delay.ipynb); where
# messages are late, add `maximize="delay_margin"` to the search.
#
# ## In motion
#
# The bars between the tips grow and turn red with the synchronization error.

# %%
side_by_side({"independent": alone, "tuned": tuned})

# %% [markdown]
# ## Keep it
#
# A result is a file without code, which opens years later with its robots. A scene is one HTML file, and a
# page has everything to show a colleague: a summary, the certificate in words, figures, and the arms in
# motion.

# %%
tuned.save("out/tuned.npz")
scene_of(tuned).write("out/tuned.html")
page = write_run_page(tuned, "out/page", certify(tuned))
for path in (*sorted(Path("out").glob("tuned.*")), page):
    print(path, path.stat().st_size // 1024, "kB")

# %% [markdown]
# ## Exercises
#
# 1. Make the fore arm of crane 2 twice as heavy in a file of its own, and tell its controller nothing.
#    Which of the figures notices? (The members of a cell may be of different kinds.)
# 2. `Coupling.star(3)` compares cranes 2 and 3 with crane 1 alone, the one that is pushed. Predict what it
#    does to the largest ε, then try it.
# 3. Let the push be ten times as strong. When does a motor saturate, and what does the certificate say
#    then?
# 4. Ask for `bandwidth=20`, and for `bandwidth=20, period=4e-3`. What changes in $K_r$, and why?
# 5. Give the tray a second motion, down again within two seconds, with a further entry in `breaks`.
#
# ## Further
#
# [Robots from files](../docs/robots.md) has all that a file may hold. [Tuning](../docs/tuning.md) has
# further goals and limits. [Taking it to a robot](to_a_robot.ipynb) runs such a controller in a loop of
# your own, and [carrying](carry.ipynb) gives the tray a mass and the hands a grip.
