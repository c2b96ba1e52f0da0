"""The figure of messages shows those of the run, named by who hears whom, and only where there are some."""

from __future__ import annotations

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from refusals import refused

from synctrl import Experiment, Network
from synctrl.errors import InputError

pytest.importorskip("matplotlib", reason="figures are an extra: pip install 'synctrl[plot]'")


def run(network):
    return Experiment(small_cell(), SMALL_GAINS, 0.05, network=network).simulate(dt=2e-3)


def test_every_count_and_age_is_drawn_for_its_link():
    result = run(Network(period=5e-3, delay=[[0, 2e-3], [8e-3, 0]], loss=0.2))
    figure = result.plot("traffic")["traffic"]
    drawn = [[line.get_ydata() for line in panel.lines] for panel in figure.axes]
    for lines, name, factor in zip(
        drawn, ("messages_sent", "messages_heard", "message_age"), (1, 1, 1e3), strict=True
    ):
        np.testing.assert_allclose(np.transpose(lines), factor * result.outputs[name])
    names = [text.get_text() for text in figure.axes[2].get_legend().get_texts()]
    assert names == ["1 hears 2", "2 hears 1"]


def test_it_is_among_the_figures_of_runs_with_messages_alone():
    assert "traffic" in result_names(Network(period=5e-3))
    assert "traffic" not in result_names(Network(delay=5e-3))
    with refused(InputError):
        run(Network(delay=5e-3)).plot("traffic")


def result_names(network):
    return list(run(network).plot())
