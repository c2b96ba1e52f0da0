"""The map of delay and loss: against the cell over one period, and against robots that talk."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from refusals import refused
from ur5_joints import GAINS, ur5_joints

from synctrl import Cell, Experiment, Hold, JointSpace, Member, Network
from synctrl.analysis import delay_map
from synctrl.analysis.delay_map import by_link
from synctrl.analysis.delay_margin import growth
from synctrl.analysis.frozen import freeze
from synctrl.analysis.period_margin import Exchange, sampled_growth
from synctrl.control.network import Links
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, planar_four

CELLS = {
    "planar": cache(lambda: ((e := planar_four()).cell, e.gains)),
    "A460": cache(lambda: ((e := a460_pair(friction=False)).cell, e.gains)),
    "UR5": cache(lambda: (ur5_joints(), GAINS)),
}


@pytest.mark.parametrize("name", CELLS)
def test_a_sender_for_every_link_is_the_same_cell(name):
    cell, gains = CELLS[name]()
    frozen, links = freeze(cell, gains), Links(cell.coupling)
    split = by_link(frozen, links)
    np.testing.assert_allclose(split.delayed, frozen.delayed, atol=1e-12 * abs(frozen.delayed).max())
    assert len(split.sent) == 3 * links.hearer.size * cell.m


@pytest.mark.parametrize(
    ("name", "receiver", "delay"),
    [
        ("planar", "hold", 0.02),
        ("planar", "extrapolate", 0.02),
        ("planar", "filter", 0.1),
        ("A460", "hold", 0.1),
        ("A460", "extrapolate", 0.05),
        ("UR5", "hold", 0.05),
        ("UR5", "extrapolate", 0.02),
    ],
)
def test_where_nothing_is_lost_errors_grow_as_over_one_period(name, receiver, delay):
    cell, gains = CELLS[name]()
    frozen = freeze(cell, gains)
    exact = sampled_growth(frozen, Exchange(0.01, delay, receiver, 50.0, frozen.horizon))
    found = delay_map(cell, gains, Network(0.01, receiver=receiver), [delay], [0.0], trials=2)
    assert found.growth[0, 0] == pytest.approx(exact, rel=0.1)  # modes beside the slowest one are left


@pytest.mark.parametrize("receiver", ["hold", "filter"])
def test_messages_at_once_that_come_often_are_the_ideal_exchange(receiver):
    cell, gains = CELLS["A460"]()
    network = Network(1e-3, receiver=receiver, omega=1e3)
    found = delay_map(cell, gains, network, [0.0], [0.0], trials=2, duration=1.5)
    assert found.growth[0, 0] == pytest.approx(growth(freeze(cell, gains), 0.0), rel=0.03)


@pytest.mark.parametrize("name", ["planar", "A460"])
def test_where_next_to_everything_is_lost_robots_are_alone_with_what_they_heard_first(name):
    cell, gains = CELLS[name]()
    alone = np.linalg.eigvals(freeze(cell, gains).own).real.max()
    found = delay_map(cell, gains, Network(0.02, receiver="hold"), [0.0], [0.0, 1 - 1e-12], duration=8.0)
    assert found.growth[0, 1] == pytest.approx(alone, rel=0.05)
    assert found.growth[0, 0] != pytest.approx(alone, rel=0.05)


@pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning")  # steps are judged by tiny velocities here
@pytest.mark.parametrize(
    ("name", "receiver", "delay", "duration", "dt", "start"),
    [("A460", "hold", 0.1, 2.0, 5e-3, 1e-6), ("UR5", "extrapolate", 0.05, 0.6, 2.5e-3, 1e-9)],
)
def test_robots_that_talk_lose_small_errors_as_the_map_says(name, receiver, delay, duration, dt, start):
    """Other messages are lost than in the map: rates agree as well as its seeds do with each other."""
    cell, gains = CELLS[name]()
    network = Network(0.01, delay, loss=0.3, receiver=receiver, seed=3)
    experiment = Experiment(resting(cell, start), gains.replace(Gamma=0.0), duration, network=network)
    run = experiment.simulate(dt=dt, log_dt=0.01)
    size = np.linalg.norm(np.concatenate((run.tracking_error, run.v), axis=2).reshape(len(run.t), -1), axis=1)
    half = slice(len(size) // 2, None)
    seen = np.polyfit(run.t[half], np.log(size[half]), 1)[0]
    network = Network(0.01, receiver=receiver)
    rates = [
        delay_map(cell, gains, network, [delay], [0.3], seed=seed, trials=1, duration=duration).growth[0, 0]
        for seed in range(5)
    ]
    middle, spread = np.median(rates), np.ptp(rates)
    assert abs(seen - middle) <= spread < 0.15 * abs(middle)


def resting(cell, error):
    """The robots, which know their parameters, each a little off a place at which they should stay."""
    members = [
        Member(robot, Hold(q), q + off, theta_hat0=robot.inertial_parameters, name=robot.name)
        for robot, q, sign in zip(cell.robots, cell.q0, (1, -1) * cell.n, strict=False)
        for off in [sign * error * (1 + np.arange(q.size))]
    ]
    return Cell(members, cell.coupling, JointSpace(), name="at rest")


def test_all_losses_have_the_same_chances_and_runs_repeat():
    cell, gains = CELLS["A460"]()
    both = delay_map(cell, gains, Network(0.02), [0.0, 0.1], [0.2, 0.5], trials=2, duration=2.0)
    alone = delay_map(cell, gains, Network(0.02), [0.1], [0.5], trials=2, duration=2.0)
    other = delay_map(cell, gains, Network(0.02), [0.1], [0.5], trials=2, duration=2.0, seed=1)
    np.testing.assert_allclose(both.growth[1, 1], alone.growth[0, 0], rtol=1e-9)
    assert other.growth[0, 0] != alone.growth[0, 0]


def test_delays_become_whole_periods_and_what_falls_in_every_trial_is_stable():
    cell, gains = CELLS["UR5"]()
    found = delay_map(cell, gains, Network(0.01, receiver="hold"), [0.0, 0.052], [0.0], trials=2)
    np.testing.assert_allclose(found.delays, [0.0, 0.05])
    assert found.stable.tolist() == [[True], [False]]


@pytest.mark.parametrize(
    ("network", "wrong", "subject"),
    [
        (Network(), {}, "network.period"),
        (Network(0.01, jitter=0.01), {}, "network.jitter"),
        (Network(0.01, burst=(0.1, 0.1)), {}, "network.burst"),
        (Network(0.01, event=1e-3), {}, "network.event"),
        (Network(0.01, offset=0.01), {}, "network.offset"),
        ("fast", {}, "network"),
        (Network(0.01), {"losses": [1.0]}, "losses"),
        (Network(0.01), {"delays": [-0.1]}, "delays"),
        (Network(0.01), {"delays": []}, "delays"),
        (Network(0.01), {"trials": 0}, "trials"),
        (Network(0.01), {"delays": [10.0]}, "duration"),
        (Network(0.01), {"duration": 0.0}, "duration"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(network, wrong, subject):
    cell, gains = CELLS["A460"]()
    with refused(InputError, subject):
        delay_map(cell, gains, network, **{"delays": [0.0], "losses": [0.0], **wrong})
