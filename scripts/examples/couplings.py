"""Ring, star, chain, all to all: who is compared with whom decides how the others hear of a push.

Six arms hold still, and the first is pushed. Its errors spread along the lines of the coupling.
"""

import numpy as np
from example import arguments

from synctrl import Cell, Coupling, Disturbance, Gains, Hold, Member, load_robot, simulate
from synctrl.show.plots import new_figure, save, style
from synctrl.show.style import robot_color

out, short = arguments(__doc__)
n, arm, q0 = 6, load_robot("planar2r"), [0.3, 1.0]
members = [Member(arm.placed((0, 0.5 * k, 0)), Hold(q0), q0=q0) for k in range(n)]
gains = Gains(Lambda=10, beta=10, K_r=2, K_eps=10, Gamma=0.1)
push = Disturbance(robot=0, torque=1.0, start=0.1, stop=0.4)
made = Coupling.signed_ring(n), Coupling.star(n, leader=1), Coupling.chain(n), Coupling.complete(n)
angle = 2 * np.pi * np.arange(n) / n
places = np.stack((np.sin(angle), np.cos(angle)), axis=1)

with style():
    figure, axes = new_figure(4.2, 2, 4, width=8.5, sharey="row", height_ratios=(1, 1.3))
    for (graph, panel), coupling in zip(axes.T, made, strict=True):
        run = simulate(Cell(members, coupling), gains, 0.2 if short else 1.2, dt=2e-3, disturbances=[push])
        for pair in coupling.edges:
            graph.plot(*places[pair].T, color="#a3acb7", zorder=0)
        for k in range(n):
            graph.plot(*places[k], "o", ms=13, color=robot_color(k))
            graph.annotate(k + 1, places[k], ha="center", va="center", color="white", size=8)
            panel.plot(
                run.t, np.rad2deg(np.linalg.norm(run.tracking_error[:, k], axis=1)), label=f"arm {k + 1}"
            )
        graph.set(title=coupling.name, aspect="equal", xlim=(-1.4, 1.4), ylim=(-1.4, 1.4))
        graph.set_axis_off()
        panel.set(xlabel="time, s", xlim=(0, run.t[-1]))
    axes[1, 0].set(ylabel="error, deg", ylim=0)
    figure.legend(*panel.get_legend_handles_labels(), loc="outside lower center", ncols=n)
save(figure, out / "couplings")
