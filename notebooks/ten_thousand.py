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
# # Ten thousand runs
#
# One run says what happens with these gains, these masses and this first guess. What happens with others?
# Ten thousand runs of the four planar arms of the paper, each with gains and a guess of its own, take a few
# seconds on two cores, for the compiled engine makes them side by side in the lanes of the processor.
#
# You will learn
#
# - to say what varies, and how;
# - to run a sweep that can be stopped and goes on, and to read its table;
# - to see what a gain does on the whole, and not in one example;
# - to add a measure of your own;
# - to find the run that is strange, and to make it again.
#
# You need `pip install '.[compiled,sweep,notebooks]'` and a C compiler.

# %%
# %matplotlib inline

from time import perf_counter

import numpy as np
from IPython.display import display
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from synctrl.experiments import planar_four
from synctrl.show import side_by_side
from synctrl.show.plots import new_figure, style
from synctrl.sweep import Grid, LogUniform, OwnMeasure, Sweep, Uniform, gain, gain_scale, load, model_error

# %%
RUNS = 10_000
DURATION = 2.0  # s

# %% [markdown]
# `RUNS` is all there is to make it smaller. Nothing below is copied from an earlier run: whatever number
# you see was computed from the table of the sweep above it.
#
# ## What varies
#
# Three gains, each over more than a decade, so that their logarithms are drawn evenly; and the error of the
# first estimate, $\hat\theta(0) = (1 + \delta) \theta$ with δ from −0.9 to 0.5. A factor is a name, values,
# and what a value does to the experiment.

# %%
factors = [
    gain("beta", LogUniform(5, 150)),  # 1/s
    gain("K_eps", LogUniform(0.1, 10)),  # N/m for errors weighted in m
    gain("Lambda", LogUniform(2, 50)),  # 1/s
    model_error(Uniform(-0.9, 0.5)),
]

# %% [markdown]
# ## What is measured
#
# Every run gives one row: errors and torques by their peak, RMS and more. A measure of your own is a
# function of one instant, and what is kept of its values. It is compiled with the rest, so it is written
# with arithmetic and numpy's functions alone. Here the power that all motors take together, $\sum_i
# \tau_i^T v_i$.


# %%
def power(at):
    return np.sum(at.tau * at.v)


measures = [OwnMeasure("peak_power", power, "largest", "W", "largest power of all motors together")]

# %% [markdown]
# ## Run it
#
# A sweep writes a row to its folder as soon as a run is done. Stop it when you like: the same call goes on
# where it was, and gives the same table, bit for bit, on any number of workers. Run r has random numbers of
# its own, from the seed and r alone.

# %%
sweep = Sweep(planar_four(), factors, samples=RUNS, seed=0, duration=DURATION, dt=2e-3, measures=measures)
begin = perf_counter()
sweep.run("out/sweep", workers=2, progress=False)
took = perf_counter() - begin
table = load("out/sweep")
print(f"{len(table)} runs of {DURATION:g} s in {took:.1f} s, {len(table) / took:.0f} runs per second")
print(table["status"].value_counts().to_dict())

# %%
done = table[(table["status"] == "completed") & (table["step_error"] < 2e-3)]
print(f"{len(done)} runs went to their end with a step that was short enough")
display(done[["sync_rms", "tracking_rms", "peak_torque", "peak_power"]].describe().loc[["min", "50%", "max"]])

# %% [markdown]
# `table` is a pandas DataFrame, `table.attrs["measures"]` says what each column is and in which unit. A
# step that was too long for the gains that were drawn is no reason to stop: the column `step_error` says
# so, and such runs are left out here.
#
# ## What a gain does on the whole
#
# Each dot is a run; the line is the median over tenths of the runs. A gain that matters moves the line.


# %%
def medians(x, y, parts=10):
    """Medians of y, and of x, over tenths of the runs in the order of x."""
    order = np.array_split(np.argsort(x), min(parts, len(x)))
    return [np.median(x[k]) for k in order], [np.median(y[k]) for k in order]


def plain(axis):
    """Ticks of a logarithmic axis as plain numbers, two to a decade."""
    axis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())


def cloud(columns, y, scale, label):
    """y times a scale over each of the columns, and its medians."""
    with style():
        figure, axes = new_figure(2.9, 1, len(columns), sharey=True)
        for panel, (name, symbol) in zip(axes[0], columns.items(), strict=True):
            x, values = done[name].to_numpy(), scale * done[y].to_numpy()
            panel.plot(x, values, ".", ms=1.2, alpha=0.4, color="#9aa3ad", rasterized=True)
            panel.plot(*medians(x, values), "-", lw=2)
            panel.set(xlabel=symbol, yscale="log", xscale="linear" if x.min() < 0 else "log")
            for axis in [panel.yaxis, *[panel.xaxis] * bool(x.min() > 0)]:
                plain(axis)
        axes[0, 0].set_ylabel(label)
    return figure


COLUMNS = {"beta": "β, 1/s", "K_eps": "K_ε", "Lambda": "Λ, 1/s", "model_error": "δ"}
cloud(COLUMNS, "sync_rms", 1e6, "sync error, rms, 10⁻⁶ m²")

# %%
cloud(COLUMNS, "tracking_rms", 1e3, "tracking error, rms, mm")

# %% [markdown]
# In numbers: the correlation of ranks is 1 where more of a factor always means more of a measure, −1 where
# it always means less, 0 where it does not matter.

# %%
ranks = done[[*COLUMNS, "sync_rms", "tracking_rms", "peak_torque", "peak_power"]].rank()
display(ranks.corr().loc[[*COLUMNS], ["sync_rms", "tracking_rms", "peak_torque", "peak_power"]].round(2))

# %% [markdown]
# ## Both errors at once
#
# The best runs are in the lower left: there Λ is large and, which the colour shows, β. Why not always so?
# Look at what is paid for it, in the table above and in the step that such gains need.

# %%
same = Sweep(planar_four(), [gain_scale("beta", Grid([1.0]))], duration=DURATION, dt=2e-3).run_one(0)
with style():
    figure, ((panel,),) = new_figure(3.6)
    order = np.random.default_rng(0).permutation(len(done))
    x, y, c = (done[name].to_numpy()[order] for name in ("tracking_rms", "sync_rms", "beta"))
    dots = panel.scatter(1e3 * x, 1e6 * y, 3, c, norm="log", cmap="viridis", lw=0, rasterized=True)
    bar = figure.colorbar(dots, label="β, 1/s")
    star = {"ms": 13, "mfc": "white", "mec": "#b0001e", "label": "the paper's gains and first estimate"}
    panel.plot(1e3 * same["tracking_rms"], 1e6 * same["sync_rms"], "*", **star)
    panel.set(xlabel="tracking error, rms, mm", ylabel="sync error, rms, 10⁻⁶ m²", xscale="log", yscale="log")
    panel.legend()
    for axis in (panel.xaxis, panel.yaxis, bar.ax.yaxis):
        plain(axis)
figure

# %% [markdown]
# ## The strange one
#
# Which run is worst, and why? Every run can be made again by its number, with everything in it.

# %%
worst, best = int(done["sync_rms"].idxmax()), int(done["sync_rms"].idxmin())
display(done.loc[[worst, best], [*COLUMNS, "sync_rms", "tracking_rms", "peak_torque"]])
runs = {f"run {r}, {name}": sweep.simulate(r) for r, name in ((worst, "the worst"), (best, "the best"))}
again = np.abs(next(iter(runs.values())).tau).max()
print("made again, the same peak torque:", np.isclose(again, done.loc[worst, "peak_torque"]))

# %%
side_by_side(runs)

# %% [markdown]
# ## Exercises
#
# 1. Add the factor `true_parameters(Uniform(0.5, 2.0), robot=1)`: robot 2 is another one than its
#    controller believes. Which of the rows of the table of ranks changes most?
# 2. Sample the control: `control_period=6e-3`. How many runs stop now, and at which β?
#    (`scripts/sweep_gains.py` draws the border.)
# 3. Stop the sweep half way with the stop button of the notebook, and run the cell again. How many runs
#    were made twice?
# 4. Write a measure of the largest distance between the tips of robots 1 and 2.
# 5. Compare 100 and 10,000 runs: which of the conclusions above would you have drawn from a hundred?
#
# ## Further
#
# [Sweeps](../docs/sweeps.md) has all factors, what runs in lanes, and clusters; [tuning](../docs/tuning.md)
# searches in the place of drawing.
