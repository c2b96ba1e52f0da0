"""Agents: one controller for each robot, which knows its neighbours by their messages alone.

What goes from one to another are bytes, so each may run on a machine of its own. Together they command what
one controller for all would.
"""

import numpy as np
from example import arguments

from synctrl import Message, Network
from synctrl.experiments import planar_four
from synctrl.show.plots import new_figure, save, style

out, short = arguments(__doc__)
period = 2e-3  # s
experiment = planar_four(network=Network(period))
agents, central = experiment.agents(period), experiment.controller(period)
plant, (q, v) = experiment.closed_loop().plant, (experiment.cell.q0, experiment.cell.v0)
times, torques, asked = period * np.arange(20 if short else 500), [], []
for t in times:
    told = [
        message.to_bytes()
        for agent, *own in zip(agents, q, v, strict=True)
        for message in agent.tell(t, *own)
    ]
    mail = [Message.from_bytes(data) for data in told]
    torques.append(
        [
            agent.step(t, *own, [message for message in mail if message.sender in agent.hears])
            for agent, *own in zip(agents, q, v, strict=True)
        ]
    )
    asked.append(central.step(t, q, v))
    v = v + period * plant.acceleration(q, v, np.array(torques[-1]))
    q = q + period * v
same = (np.array(torques) == asked).all()
print(f"{len(told)} messages of {len(told[0])} bytes in every period; same as one controller: {same}")
with style():
    figure, axes = new_figure(2.8)
    axes[0, 0].plot(times[:50], np.array(torques)[:50, :, 0], label=experiment.cell.names)
    axes[0, 0].plot(
        times[:50:2], np.array(asked)[:50:2, :, 0], "k.", ms=4, label=["one controller for all", *"___"]
    )
    axes[0, 0].set(xlabel="time, s", ylabel="torque of joint 1, N·m", xlim=0)
    axes[0, 0].legend()
save(figure, out / "agents")
