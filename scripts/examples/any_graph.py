"""Any graph: pairs of robots with a weight each, or a graph of networkx.

Arms 1 to 3 hold together tightly, arms 4 and 5 do, and a weak edge is between the two groups.
"""

import numpy as np
from example import arguments

from synctrl import Cell, Coupling, Cubic, Gains, Member, load_robot, simulate
from synctrl.show import scene_of
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
edges = [(0, 1, 1.0), (1, 2, 1.0), (0, 2, 1.0), (3, 4, 1.0), (2, 3, 0.2)]  # from, to, weight
coupling = Coupling.from_graph(edges)
arm, rng = load_robot("planar2r"), np.random.default_rng(2)
way = Cubic([0.2, 1.0], [0.9, 0.5], duration=1.0)
starts = np.array([0.2, 1.0]) + rng.uniform(-0.3, 0.3, (5, 2))  # rad, each off its path
members = [Member(arm.placed((0, 0.7 * k, 0)), way, q0=q0) for k, q0 in enumerate(starts)]
gains = Gains(Lambda=2, beta=5, K_r=2, K_eps=20, Gamma=0.05)
run = simulate(Cell(members, coupling, name="any graph"), gains, 0.1 if short else 2.0, dt=1e-3)
scene_of(run).write(out / "any_graph.html")

with style():
    figure, axes = new_figure(3.0, 1, 2, width=7.5)
    for k, (i, j, weight) in enumerate(edges):
        label = f"{i + 1} and {j + 1}" + (", weak" if weight < 1 else "")
        axes[0, 0].plot(run.t, np.rad2deg(run.sync_error[:, k, 0] / weight), label=label)
    for i in range(5):
        axes[0, 1].plot(run.t, np.rad2deg(run.tracking_error[:, i, 0]), label=f"arm {i + 1}")
    for panel, title in zip(axes[0], ("apart from each other", "apart from the path"), strict=True):
        panel.set(title=f"joint 1, {title}", xlabel="time, s", ylabel="deg", xlim=(0, run.t[-1]))
        panel.legend()
save(figure, out / "any_graph")
