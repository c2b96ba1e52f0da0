"""A recording for Foxglove, read again: frames, joints and numbers, as any reader of MCAP files finds them.

The reader below knows nothing of synctrl. It finds in `/tf` where joints and tips were, and in
`/sync_error` the errors of a pair. Foxglove opens the file with the layout that lies beside it.
"""

import numpy as np
from example import arguments
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from synctrl.experiments import planar_four
from synctrl.show.plots import new_figure, save, style
from synctrl.show.style import robot_color

out, short = arguments(__doc__)
result = planar_four().simulate(0.1 if short else 2.0, dt=1e-3)
path = result.to_mcap(out / "for_foxglove.mcap", fps=60)
frames, errors = [], []
with path.open("rb") as file:
    reader = make_reader(file, decoder_factories=[DecoderFactory()])
    for _, channel, message, found in reader.iter_decoded_messages(topics=["/tf", "/sync_error"]):
        if channel.topic == "/tf":
            frames.append({each.child_frame_id: each.translation for each in found.transforms})
        else:
            errors.append((message.log_time / 1e9, found.robot_1__robot_2.x, found.robot_1__robot_2.y))

with style():
    figure, ((plane, time),) = new_figure(3.6, 1, 2, width=7.4)
    for k in range(1, 5):
        names = f"robot {k}/joint1", f"robot {k}/joint2", f"sphere tip of robot {k}"
        for each in frames[:: max(1, len(frames) // 8)]:
            points = np.array([(each[name].x, each[name].y) for name in names])
            plane.plot(*points.T, "o-", ms=3, color=robot_color(k - 1), alpha=0.4)
    plane.set(aspect="equal", xlabel="x, m", ylabel="y, m", title="arms, from /tf")
    t, *coordinates = np.array(errors).T
    time.plot(t, 1e4 * np.transpose(coordinates), label=["x", "y"])
    time.set(xlabel="time, s", ylabel="error of robots 1 and 2, cm²", title="from /sync_error")
    time.legend()
save(figure, out / "for_foxglove")
