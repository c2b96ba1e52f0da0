"""A map of delay and loss: where small errors fall, where they grow, and how fast, without any run.

Two UR5 that exchange messages every 10 ms, for two kinds of what is believed between messages.
"""

import numpy as np
from example import arguments

from synctrl import Network
from synctrl.analysis import delay_map
from synctrl.experiments import ur5_payload
from synctrl.show.delay_figures import delay_map_figure
from synctrl.show.plots import save

out, short = arguments(__doc__)
arms = ur5_payload()
count = 2 if short else 9
delays, losses = np.linspace(0, 0.04, count), np.linspace(0, 0.8, count)  # s, and shares
maps = {
    receiver: delay_map(arms.cell, arms.gains, Network(0.01, receiver=receiver), delays, losses, trials=2)
    for receiver in ("hold", "filter")
}
save(delay_map_figure({"two UR5": maps}), out / "delay_map")
