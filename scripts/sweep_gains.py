"""Gains of the four planar arms: 10,000 runs, and one figure.

python scripts/sweep_gains.py [--runs 10000] [--workers 2] [--seed 0] [--out out/sweep_gains]

Every run draws beta, K_eps, Lambda and the relative error of the controller's first estimate, and lasts 2 s
in steps of 2 ms. Most runs are under continuous control. Of the rest, a third each repeats the first draws
under sampled control, a zero-order hold of torque and adaptation, with one of three periods. What was
interrupted goes on where it was.

The figure shows both errors of all continuous runs with their peak torque, and the border of stability under
sampled control: the line on which half of the runs with such errors, or such gains, diverge.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from synctrl.analysis.metrics import settling_bands
from synctrl.errors import SimulationError, SynctrlError
from synctrl.experiments import planar_four
from synctrl.show.plots import new_figure, save, style
from synctrl.show.style import ACCENT, PALETTE
from synctrl.sweep import LogUniform, Sweep, Uniform, gain, load, model_error
from synctrl.sweep.measures import MEASURES, measures
from synctrl.sweep.worker import Prepared

DURATION, DT = 2.0, 2e-3  # s
FACTORS = (
    gain("beta", LogUniform(5, 150)),
    gain("K_eps", LogUniform(0.1, 10)),
    gain("Lambda", LogUniform(2, 50)),
    model_error(Uniform(-0.9, 0.5)),
)
#: periods of sampled control, s, and how their borders are drawn
HELD = {4e-3: "-", 6e-3: "--", 8e-3: ":"}
#: share of the runs that are made with each of these periods
HELD_SHARE = 0.05
#: width of the window in which runs are counted for the border, as a share of the figure
WINDOW = 0.08


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=10_000, help="runs in all")
    parser.add_argument("--workers", type=int, default=2, help="number of processes")
    parser.add_argument("--seed", type=int, default=0, help="of the draws")
    parser.add_argument("--out", type=Path, default=Path("out/sweep_gains"), help="folder for everything")
    options = parser.parse_args()
    try:
        sweep_gains(options.out, options.runs, options.workers, options.seed)
    except SynctrlError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


def sweep_gains(out: Path, runs: int, workers: int, seed: int) -> None:
    """Run the sweeps, draw the figure, and say what was found."""
    again = max(int(HELD_SHARE * runs), 1)
    start = perf_counter()
    print(f"four arms, {DURATION:g} s in steps of {1e3 * DT:g} ms; continuous control:")
    free = make_runs(out / "continuous", max(runs - len(HELD) * again, 1), workers, seed)
    held = {}
    for period in HELD:
        print(f"the first {again} of them, torque and adaptation held for {1e3 * period:g} ms:")
        held[period] = make_runs(out / f"held_{1e3 * period:g}ms", again, workers, seed, period)
    print(f"{len(free) + len(HELD) * again} runs in {perf_counter() - start:.0f} s")
    picture, _ = save(draw(free, held), out / "sweep_gains")
    print(f"the paper's gains are stable with a period of up to {1e3 * longest_period():g} ms; see {picture}")


def make_runs(folder: Path, runs: int, workers: int, seed: int, period: float | None = None) -> Any:
    """A sweep and its table. What a run draws depends on seed and number, not on the period."""
    sweep = Sweep(
        planar_four(), FACTORS, samples=runs, seed=seed, duration=DURATION, dt=DT, control_period=period
    )
    sweep.run(folder, workers)
    return load(folder)


def longest_period() -> float:
    """Longest period, in steps of 1 ms, with which the paper's gains and first estimate do not diverge, s."""
    prepared = Prepared(planar_four(), DURATION, 1e-3)
    for milliseconds in range(1, 50):
        try:
            prepared.simulate(planar_four(), 1e-3 * (milliseconds + 1))
        except SimulationError:
            break
    return 1e-3 * milliseconds


# -- the figure -------------------------------------------------------------------------------------------


def draw(free: Any, held: dict[float, Any]) -> Any:
    """Errors, torque and the border of stability, in two panels."""
    with style():
        figure, axes = new_figure(7.2, 2, 1, height_ratios=(1.5, 1))
        draw_errors(figure, axes[0, 0], free, held)
        draw_gains(axes[1, 0], held)
    return figure


def draw_errors(figure: Any, axes: Any, free: Any, held: dict[float, Any]) -> None:
    """Synchronization against tracking error of every run, peak torque in colour."""
    from matplotlib.colors import LogNorm

    done = free[free["status"] == "completed"]
    x, y = (1e3 * done[name] for name in ("tracking_rms", "sync_rms"))
    norm = LogNorm(*np.quantile(done["peak_torque"], (0.01, 0.99)))
    dots = axes.scatter(x, y, 3, done["peak_torque"], norm=norm, cmap="viridis", lw=0, rasterized=True)
    bar = figure.colorbar(dots, ax=axes, aspect=35, extend="both", label="peak torque, N·m")
    for period, table in held.items():
        again = table.loc[table.index.intersection(done.index)]
        where = np.log(np.stack([x[again.index], y[again.index]], axis=1))
        draw_border(axes, where, again, period, (np.exp, np.exp))
    axes.plot(*paper_errors(), **STAR)
    axes.set(xscale="log", yscale="log", xlabel="tracking error, rms, mm")
    axes.set(xlim=(0.9 * x.min(), 1.1 * x.max()), ylim=(0.8 * y.min(), 5 * y.max()))
    axes.set_ylabel("synchronization error, rms, 10⁻³ m²")
    axes.legend(loc="upper left", ncols=2)
    for axis in (axes.xaxis, axes.yaxis, bar.ax.yaxis):
        plain_ticks(axis)


def paper_errors() -> tuple[float, float]:
    """Tracking and synchronization error of the paper's gains and first estimate, in the figure's units."""
    result = planar_four().simulate(DURATION, DT, engine="compiled")
    row = dict(zip(MEASURES, measures(result, settling_bands(result)), strict=True))
    return 1e3 * row["tracking_rms"], 1e3 * row["sync_rms"]


def draw_gains(axes: Any, held: dict[float, Any]) -> None:
    """Which beta and which first estimates are stable with the middle period, and all borders."""
    period = list(held)[1]
    table = held[period]
    for status, color in (("completed", PALETTE[0]), ("stopped", PALETTE[1])):
        rows = table[table["status"] == status]
        label = {"completed": "stable", "stopped": "diverges"}[status] + f" at {1e3 * period:g} ms"
        axes.plot(rows["beta"], rows["model_error"], "o", ms=2.5, mew=0, color=color, label=label)
    axes.set(xscale="log", xlabel="β, 1/s", ylabel="relative error of the first estimate")
    axes.set(xlim=(4.5, 170), ylim=(-1.0, 0.95))
    for period, table in held.items():
        where = np.stack([np.log(table["beta"]), table["model_error"]], axis=1)
        draw_border(axes, where, table, period, (np.exp, np.asarray))
    cell, gains = planar_four().cell, planar_four().gains
    axes.plot(gains.beta, np.mean(cell.theta_hat0 / cell.theta) - 1, **STAR)
    axes.legend(loc="upper left", ncols=3, columnspacing=1.2)
    plain_ticks(axes.xaxis)


def plain_ticks(axis: Any) -> None:
    """Ticks of a logarithmic axis as plain numbers, two to a decade."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())


STAR = {
    "marker": "*",
    "ms": 13,
    "ls": "",
    "mfc": "white",
    "mec": ACCENT,
    "mew": 1.4,
    "label": "the paper's gains",
}


def draw_border(axes: Any, where: np.ndarray, table: Any, period: float, back: tuple) -> None:
    """The line on which half of the runs diverge.

    Args:
        axes: to draw on.
        where: of each run, (runs, 2).
        table: the runs.
        period: of sampled control, s.
        back: from each coordinate of `where` to that of the axes.
    """
    stopped = (table["status"] != "completed").to_numpy()
    if stopped.all() or not stopped.any():
        return
    x, y, share = stopped_share(where, stopped)
    if not np.nanmin(share) < 0.5 < np.nanmax(share):
        return
    options = {"levels": [0.5], "colors": "#222222", "linewidths": 1.5, "linestyles": HELD[period]}
    axes.contour(back[0](x), back[1](y), share, **options)
    text = f"half diverge at {1e3 * period:g} ms"
    axes.plot([], [], HELD[period], color="#222222", lw=1.5, label=text)


def stopped_share(where: np.ndarray, stopped: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Share of runs that stopped, on a grid: a mean under a Gaussian window; NaN where there are none."""
    low, high = where.min(axis=0), where.max(axis=0)
    x, y = np.linspace(low, high, 80).T
    width = WINDOW * (high - low)
    near_x = np.exp(-0.5 * ((x[:, None] - where[:, 0]) / width[0]) ** 2)
    near_y = np.exp(-0.5 * ((y[:, None] - where[:, 1]) / width[1]) ** 2)
    count = near_y @ near_x.T
    share = (near_y * stopped) @ near_x.T / np.maximum(count, 1e-300)
    return x, y, np.where(count > 0.05 * count.max(), share, np.nan)


if __name__ == "__main__":
    sys.exit(main())
