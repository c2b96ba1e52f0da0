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
# # An adaptation of your own
#
# How a controller learns is a part of it like any other: a small class in a file of yours. It is logged,
# saved, compiled and certified as those of the package are.
#
# You will learn
#
# - what the proof of convergence asks of an adaptation, and no more than that;
# - to write the paper's adaptation in fifteen lines, and to see that it is the paper's;
# - what noise does to it, and a cure: a dead zone, derived, written and tried;
# - how a certificate finds a mistake in your proof, and names what your idea gives up.
#
# You need `pip install '.[compiled,notebooks]'` and a C compiler; `ENGINE = "pinocchio"` does without, and
# takes many times as long.

# %%
# %matplotlib inline

import numpy as np
from IPython.display import display

from synctrl.analysis import certify
from synctrl.control.adaptation import Gradient
from synctrl.experiments import a460_pair
from synctrl.show import scene_of
from synctrl.show.curves import Curves, overlay
from synctrl.simulation.devices import Noise

# %%
DURATION = 20.0  # s
ENGINE = "compiled"

# %% [markdown]
# ## What the proof asks
#
# The torque of the law is $\tau_i = Y_i \hat\theta_i + \dots$, with a regressor $Y$ that is known and
# parameters $\theta$, masses and inertias, that are not. With $s = v_\text{ref} - v$, how far the joints'
# velocities are from what the law wants, and $\tilde\theta = \theta - \hat\theta$, the rest of the law
# makes
#
# $$\dot V = -(\text{damping and synchronization}) + s^T Y \tilde\theta + \dot V_\theta,$$
#
# where $V_\theta \ge 0$ is a term of yours that measures how wrong the estimates are. So the whole duty of
# an adaptation is a storage $V_\theta$ with
#
# $$\dot V_\theta = -s^T Y \tilde\theta + (\text{powers that have a name}),$$
#
# and the theorem holds where the powers are never above zero.
#
# The paper takes $V_\theta = \tfrac1{2\Gamma} |\tilde\theta|^2$. As $\theta$ does not change, $\dot
# V_\theta = -\tfrac1\Gamma \tilde\theta^T \dot{\hat\theta}$, and
#
# $$\dot{\hat\theta} = \Gamma Y^T s \qquad (14)$$
#
# leaves no power at all.
#
# ## The paper's, in fifteen lines
#
# An adaptation comes in two halves. The first is what you write into an experiment: settings, which know
# nothing of robots. Its `bind` is given the cell, and returns the second half, which lives with it. The
# state of that is an array z with a row per robot; here z is the estimate itself. `seen` is what there is
# to see at an instant: `seen.gradient` is $Y^T s$, a row per robot, and `seen.s_q` is $s$.


# %%
class Simple:
    """The paper's adaptation, eq. (14)."""

    def __init__(self, Gamma):
        self.Gamma = Gamma

    def bind(self, cell):
        return BoundSimple(self.Gamma, cell.theta_hat0)

    def as_dict(self):
        return {"name": type(self).__name__, **vars(self)}


class BoundSimple:
    def __init__(self, Gamma, theta_hat0):
        self.Gamma, self.theta_hat0 = Gamma, theta_hat0

    def start(self):  # z at t = 0
        return self.theta_hat0.copy()

    def estimate(self, z):  # theta_hat
        return z

    def settle(self, z):  # z after a step, where others project it
        return z

    def rate(self, z, seen):  # z'
        return self.Gamma * seen.gradient

    def storage(self, z, theta):  # V_theta
        return 0.5 * np.sum((theta - z) ** 2) / self.Gamma

    def storage_rate(self, z, z_dot, theta):  # V_theta'
        return -np.sum((theta - z) * z_dot) / self.Gamma

    def powers(self, z, theta, seen):  # what V_theta' has beside -s^T Y tilde
        return {}


# %% [markdown]
# Is it the paper's? Two A460 move with it, and with the one of the package. And does the proof hold?

# %%
SHORT = min(DURATION, 1.0)  # s
mine = a460_pair(friction=False, adaptation=Simple(0.3)).simulate(SHORT)
theirs = a460_pair(friction=False, adaptation=Gradient(0.3)).simulate(SHORT)
print("largest difference of the estimates:", np.abs(mine.theta_hat - theirs.theta_hat).max())
print(certify(mine).verdict)

# %% [markdown]
# ## A mistake in a proof is found
#
# `certify` does not believe what an adaptation says of itself. It computes V along the run, and its
# derivative from `storage_rate` and the powers, and holds the two against each other. Here somebody forgot
# the minus sign.


# %%
class BoundWrong(BoundSimple):
    def storage_rate(self, z, z_dot, theta):
        return np.sum((theta - z) * z_dot) / self.Gamma


class Wrong(Simple):
    def bind(self, cell):
        return BoundWrong(self.Gamma, cell.theta_hat0)


found = certify(a460_pair(friction=False, adaptation=Wrong(0.3)).simulate(SHORT))
print(found.verdict)
for doubt in found.doubts:
    print("-", doubt)

# %% [markdown]
# Two numbers that should be equal differ by far more than numerical errors explain. A step that is too long
# is what the certificate thinks of first; if a shorter one changes nothing, it is the proof.
#
# ## What noise does
#
# Now the velocities are measured badly: noise of 0.1 rad/s. The controller samples every 2 ms, as a digital
# one does. The arms reach their goal within two seconds, and then there is nothing more to learn. Yet the
# estimates go on, driven by noise, and they go away from the truth: where $Y$ depends on the velocities, it
# has the same noise as $s$, so that the mean of $Y^T s$ is not zero.


# %%
def noisy(adaptation):
    experiment = a460_pair(friction=False, adaptation=adaptation, sensors=[Noise(v=0.1)])
    return experiment.simulate(DURATION, control_period=2e-3, log_dt=1e-2, engine=ENGINE)


def learned(result):
    """How far all estimates are from the truth, and how far the joints are from their paths."""
    wrong = np.linalg.norm(result.theta_hat - result.experiment.cell.theta, axis=(1, 2))[:, None]
    off = 1e3 * np.linalg.norm(result.tracking_error, axis=2).max(axis=1, keepdims=True)
    return [
        Curves("estimates", "kg, kg·m, kg·m²", wrong, ["|θ - θ̂|"]),
        Curves("arms", "mrad", off, ["largest |e|"]),
    ]


drifting = noisy(Simple(0.3))
display(overlay(learned, {"eq. (14)": drifting}))

# %% [markdown]
# ## An idea: sleep where there is only noise
#
# Learn only where $s$ is too large to be noise. With the share
#
# $$a(s) = \frac{|s|^4}{|s|^4 + \sigma^4}$$
#
# that is almost 0 below $\sigma$ and almost 1 above, let $\dot{\hat\theta} = \Gamma Y^T s\, a(s)$. The same
# storage then has
#
# $$\dot V_\theta = -\tilde\theta^T Y^T s\, a
# = -s^T Y \tilde\theta + \underbrace{(1 - a)\, s^T Y \tilde\theta}_{\text{asleep}}.$$
#
# The power "asleep" can have either sign. So the theorem does not hold while the adaptation sleeps: that is
# what the idea gives up, and it has to say so.
#
# It is written with arithmetic alone, without `if`: so the compiled engine can trace it, and makes C of it.


# %%
class Sleepy(Simple):
    """Eq. (14), asleep where s is small; `width` is sigma, rad/s."""

    def __init__(self, Gamma, width):
        self.Gamma, self.width = Gamma, width

    def bind(self, cell):
        return BoundSleepy(self.Gamma, self.width, cell.theta_hat0)


class BoundSleepy(BoundSimple):
    def __init__(self, Gamma, width, theta_hat0):
        super().__init__(Gamma, theta_hat0)
        self.width = width

    def awake(self, seen):
        size = np.sum(seen.s_q**2, axis=1, keepdims=True) ** 2
        return size / (size + self.width**4)

    def rate(self, z, seen):
        return self.Gamma * seen.gradient * self.awake(seen)

    def powers(self, z, theta, seen):
        return {"asleep": np.sum((theta - z) * seen.gradient * (1.0 - self.awake(seen)))}


# %% [markdown]
# Three joints with noise of 0.1 rad/s each make an $|s|$ of about 0.17 rad/s. Is a width of 0.3 enough, or
# 0.4?

# %%
runs = {"eq. (14)": drifting, **{f"σ = {width}": noisy(Sleepy(0.3, width)) for width in (0.3, 0.4)}}
display(overlay(learned, runs))
for name, run in runs.items():
    late = run.t > 0.6 * DURATION
    off = 1e3 * np.linalg.norm(run.tracking_error[late], axis=2).max()
    wrong = np.linalg.norm(run.theta_hat[-1] - run.experiment.cell.theta)
    print(f"{name:9} largest late e {off:5.2f} mrad, estimates off by {wrong:.2f} at the end")

# %% [markdown]
# The drift is gone, or nearly. **What is not better**: whoever sleeps learns slowly, and an error that is
# smaller than the noise is never learned away. Without noise it can be seen best: eq. (14) brings the
# errors to zero, and the dead zone leaves what is below its width.

# %%
still = {
    "eq. (14)": a460_pair(friction=False, adaptation=Simple(0.3)),
    "σ = 0.3": a460_pair(friction=False, adaptation=Sleepy(0.3, 0.3)),
}
quiet = {name: each.simulate(min(DURATION, 5.0), log_dt=1e-2, engine=ENGINE) for name, each in still.items()}
display(overlay(learned, quiet))

# %% [markdown]
# ## The certificate
#
# It knows our adaptation by what `powers` says, and the verdict names it.

# %%
print(certify(a460_pair(friction=False, adaptation=Sleepy(0.3, 0.3)).simulate(SHORT)))

# %% [markdown]
# ## In motion
#
# With noise, asleep at rest. A result remembers with which adaptation it was made.

# %%
print(runs["σ = 0.4"].info["adaptation"])
scene_of(runs["σ = 0.4"])

# %% [markdown]
# ## Exercises
#
# 1. Write `Leaky`: $\dot{\hat\theta} = \Gamma Y^T s - \nu (\hat\theta - \hat\theta_0)$. Derive its power,
#    and let the certificate check it. What becomes of the drift, and what of the late errors?
# 2. Let `Sleepy` sleep joint by joint: a share for every entry of $s$. You need $Y$ itself,
#    `seen.regressor`, (n, nv, P). Which power does it have?
# 3. Noise with a filter behind it: add `DifferencedVelocity(omega=200.0)` after the `Noise`. Is a dead zone
#    still needed?
# 4. The state z may have more columns than there are parameters. Add one that remembers the mean of $|s|$,
#    and let σ follow it.
# 5. Sweep σ with `synctrl.sweep.adaptation(Grid([Sleepy(0.3, w) for w in ...]))`, see [ten thousand
#    runs](ten_thousand.ipynb).
#
# ## Further
#
# [Adaptations](../docs/adaptation.md) has those of the package, with what each does badly. [Adding a
# part](../docs/architecture.md#adding-a-part) has laws, networks, spaces and plants of your own. [Two
# Pandas](two_pandas.ipynb) compares ways to learn where a load is picked up.
