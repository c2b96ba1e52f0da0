"""Robots with clocks of their own: each follows its path by its clock, and no robot sees that it is off."""

import numpy as np
from refusals import refused

from synctrl import Cell, Coupling, Network, SmoothWeights
from synctrl.analysis.clocks import true_sync_error
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, planar_four

AHEAD = np.array([0.01, 0.0, 0.0, 0.0])  # s


def test_a_robot_is_told_what_is_desired_by_its_clock():
    cell, times = planar_four().cell, np.linspace(0.0, 1.0, 7)
    told = cell.with_clocks(AHEAD).reference_table(times).desired
    for i, ahead in enumerate(AHEAD):
        np.testing.assert_array_equal(told[:, :, i], cell.reference_table(times + ahead).desired[:, :, i])


def test_breaks_come_earlier_by_what_a_clock_is_ahead():
    pair = a460_pair().cell
    assert pair.with_clocks([0.5, 0.0]).breaks[-2:] == (1.5, 2.0)


def test_clocks_that_agree_change_nothing():
    plain, asked = (planar_four(network=network) for network in (Network(), Network(offset=np.zeros(4))))
    assert asked.told_cell is asked.cell
    np.testing.assert_array_equal(asked.simulate(0.02, 2e-3).q, plain.simulate(0.02, 2e-3).q)


def test_the_error_that_nobody_sees_is_what_the_robot_goes_on_in_the_time_that_its_clock_is_ahead():
    experiment = planar_four(network=Network(offset=AHEAD))
    run, cell = experiment.simulate(1.2), experiment.cell
    table = cell.reference_table(run.t)
    missed = np.matvec(table.c, table.xd_dot * AHEAD[:, None])
    true, predicted = true_sync_error(run), -cell.coupling.compare(missed)
    late = run.t > 1.0
    assert np.abs(run.sync_error[late]).max() < 0.05 * np.abs(predicted[late]).max()
    np.testing.assert_allclose(true[late], predicted[late], atol=0.03 * np.abs(predicted[late]).max())


def test_without_offsets_the_true_error_is_the_one_that_is_seen():
    run = planar_four().simulate(0.05)
    np.testing.assert_allclose(true_sync_error(run), run.sync_error, atol=1e-15)


def test_weights_are_those_of_the_time_that_a_robot_believes_in():
    weights = SmoothWeights.from_function(lambda t: [1.0 + 0.1 * t, -1.0 - 0.2 * t], 2.0, 3)
    base = a460_pair().cell
    cell = Cell(base.members, Coupling.pair(weights), base.space)
    times, ahead = np.array([0.3, 0.9]), np.array([0.2, 0.0])
    told = cell.with_clocks(ahead).weights(times)
    for part, now, later in zip(told, cell.weights(times), cell.weights(times + 0.2), strict=True):
        np.testing.assert_array_equal(part, np.stack((later[:, 0], now[:, 1]), axis=1))


def test_offsets_for_another_number_of_robots_are_refused():
    with refused(InputError, "offset"):
        planar_four(network=Network(offset=[0.1, 0.0]))
