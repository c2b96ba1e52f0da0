"""The paper's two cells, by their public face: the numbers of Tables I to III and the shapes of a result."""

from __future__ import annotations

import inspect

import numpy as np
import paper_model as paper
import pytest
from refusals import refused
from seams.lagging_network import Lagging
from seams.leaky_adaptation import Leaky
from seams.pulling_law import Pulling

from synctrl import Disturbance, Experiment, Gains, experiments
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, panda_four, planar_four

SHAPES = {
    "t": (),
    "tracking_error": ("n", "m"),
    "sync_error": ("p", "m"),
    "x": ("n", "m"),
    "x_desired": ("n", "m"),
    "tau": ("n", "nv"),
    "q": ("n", "nv"),
    "v": ("n", "nv"),
    "theta_hat": ("n", "P"),
}


@pytest.mark.parametrize(
    ("make", "sizes"),
    [
        (planar_four, {"n": 4, "p": 4, "m": 2, "nv": 2, "P": 3}),
        (a460_pair, {"n": 2, "p": 1, "m": 3, "nv": 3, "P": 30}),
    ],
)
def test_results_have_the_shapes_that_others_rely_on(make, sizes):
    result = make().simulate(duration=0.01)
    for name, dimensions in SHAPES.items():
        assert getattr(result, name).shape == (11, *(sizes[d] for d in dimensions)), name


@pytest.mark.parametrize(
    ("make", "face"),
    [
        (
            planar_four,
            {"synchronized": True, "disturbance": None, "phi": 0.1, "radii": "text", "gains": None},
        ),
        (a460_pair, {"synchronized": True, "friction": True, "gains": None}),
        (Experiment.simulate, {"duration": None, "dt": 1e-3, "integrator": "rk4"}),
    ],
)
def test_the_arguments_others_rely_on_are_there_in_their_order(make, face):
    parameters = {k: v.default for k, v in inspect.signature(make).parameters.items() if k != "self"}
    assert dict(list(parameters.items())[: len(face)]) == face


# -- parts of the controller, in every ready cell ---------------------------------------------------------

READY = [
    make
    for make in (getattr(experiments, name) for name in experiments.__all__)
    if inspect.signature(make).return_annotation == "Experiment"
]
PARTS = {"adaptation": Leaky(0.01, 0.1), "law": Pulling(0.1), "network": Lagging(0.01)}


@pytest.mark.parametrize("make", READY, ids=lambda make: make.__name__)
def test_every_ready_cell_takes_parts_of_ones_own_and_runs_with_them(make):
    experiment = make(**PARTS)
    info = experiment.simulate(0.001, dt=5e-4).info
    for name, part in PARTS.items():
        assert getattr(experiment, name) is part
        assert info[name] == part.as_dict()


@pytest.mark.parametrize("make", READY, ids=lambda make: make.__name__)
@pytest.mark.parametrize("name", PARTS)
def test_every_ready_cell_takes_one_part_and_keeps_the_others(make, name):
    experiment = make(**{name: PARTS[name]})
    assert {part: getattr(experiment, part) for part in PARTS} == {**dict.fromkeys(PARTS), name: PARTS[name]}
    expected = make().gains.replace(Gamma=None) if name == "adaptation" else make().gains
    assert experiment.gains == expected


def test_all_ready_cells_but_an_analysis_are_experiments():
    assert {make.__name__ for make in READY} == {*experiments.__all__} - {"quadratic_analysis"}


# -- four planar arms -------------------------------------------------------------------------------------


@pytest.mark.parametrize("phi", [0.1, 0.25])
def test_the_planar_paths_are_table_two(phi):
    experiment = planar_four(phi=phi)
    start, end = paper.desired_ends(phi)
    for i, member in enumerate(experiment.cell.members):
        np.testing.assert_allclose(member.trajectory(0.0).x, start[i], rtol=1e-14)
        np.testing.assert_allclose(member.trajectory(60.0).x, end[i], rtol=1e-14)
        np.testing.assert_allclose(
            member.trajectory(1.0).x, start[i] + (end[i] - start[i]) * (1 - np.exp(-1))
        )


def test_the_planar_radii_may_be_those_of_table_two_instead():
    for radii, expected in (("text", (5, 6, 6, 5)), ("table", (5, 6, 5, 6))):
        members = planar_four(radii=radii).cell.members
        found = [np.linalg.norm(member.trajectory(0.0).x) for member in members]
        np.testing.assert_allclose(found, expected, rtol=1e-14)


def test_the_planar_arms_start_at_rest_on_their_paths_as_table_three_says():
    cell = planar_four().cell
    np.testing.assert_allclose(cell.q0, paper.Q_START, rtol=1e-15)
    np.testing.assert_array_equal(cell.v0, 0)
    for robot, q, member in zip(cell.robots, cell.q0, cell.members, strict=True):
        np.testing.assert_allclose(robot.tip_position(q)[:2], member.trajectory(0.0).x, atol=1e-14)
        np.testing.assert_allclose(robot.tip_pose(np.zeros(2)).rotation, np.eye(3), atol=1e-15)


def test_the_planar_cell_is_nearly_square():
    corners = np.array([member.trajectory(0.0).x for member in planar_four().cell.members])
    sides = [np.linalg.norm(corners[i] - corners[j]) for i, j in ((0, 1), (2, 3), (0, 3), (1, 2))]
    np.testing.assert_allclose(sides, [1.0, 1.0, 1.0, 1.2], atol=5e-3)


def test_the_planar_parameters_and_first_guess_are_equation_fifty():
    cell = planar_four().cell
    np.testing.assert_allclose(cell.theta, np.tile(paper.theta(1, 0.3, 1, 0.3), (4, 1)), rtol=1e-14)
    np.testing.assert_allclose(cell.theta_hat0, np.tile(paper.theta(0.8, 0.2, 0.8, 0.2), (4, 1)), rtol=1e-14)


def test_the_planar_coupling_is_the_ring_of_forty_seven():
    coupling = planar_four().cell.coupling
    np.testing.assert_array_equal(coupling.matrix, np.eye(4) + np.eye(4)[[1, 2, 3, 0]])
    weights = coupling.weights(np.zeros(1), 2).c[0]
    np.testing.assert_array_equal(weights, np.array([6, -5, 5, -6])[:, None, None] * np.eye(2))


def test_the_gains_are_the_papers():
    assert planar_four().gains == Gains(Lambda=10.0, beta=100.0, K_r=1.0, K_eps=1.0, Gamma=0.1)
    assert a460_pair().gains == Gains(Lambda=8.0, beta=8.0, K_r=(80.0, 80.0, 100.0), K_eps=10.0, Gamma=0.3)


@pytest.mark.parametrize("make", [planar_four, a460_pair])
def test_independent_means_no_beta_and_no_k_eps_and_nothing_else(make):
    synchronized, independent = make().gains, make(synchronized=False).gains
    assert not independent.beta.any() and not independent.K_eps.any()
    assert independent.replace(beta=synchronized.beta, K_eps=synchronized.K_eps) == synchronized


@pytest.mark.parametrize("make", [planar_four, a460_pair])
def test_own_gains_are_used(make):
    gains = make().gains.replace(Lambda=3.0)
    assert make(gains=gains).gains == gains
    assert make(synchronized=False, gains=gains).gains == gains.independent()


def test_the_papers_push_is_one_newton_metre_on_robot_one():
    (push,) = planar_four(disturbance="torque").disturbances
    assert (push.robot, push.start, push.stop) == (0, 0.5, 0.75)
    np.testing.assert_array_equal(np.broadcast_to(push.torque, 2), [1.0, 1.0])
    own = Disturbance(2, 0.5, 0.1, 0.2)
    assert tuple(planar_four(disturbance=own).disturbances) == (own,)
    assert tuple(planar_four(disturbance=[own, push]).disturbances) == (own, push)
    assert tuple(planar_four().disturbances) == ()


# -- two A460 ---------------------------------------------------------------------------------------------

TABLE_ONE = np.array(
    [
        [[73.3340, 60.3330, -169.8120], [15.2520, 71.6830, -181.9800]],
        [[90.0, 63.6090, -174.7290], [-2.9730, 74.1070, -185.1080]],
    ]
)


def test_the_a460_move_from_and_to_the_angles_of_table_one():
    members = a460_pair().cell.members
    for i, member in enumerate(members):
        np.testing.assert_allclose(np.rad2deg(member.trajectory(0.0).x), TABLE_ONE[0, i], rtol=1e-14)
        for t in (2.0, 4.0):
            np.testing.assert_allclose(np.rad2deg(member.trajectory(t).x), TABLE_ONE[1, i], rtol=1e-14)
        assert not member.trajectory(0.0).x_dot.any() and not member.trajectory(2.0).x_dot.any()
        assert member.trajectory(1.9).x_dot.all()


def wrists(row: int) -> np.ndarray:
    robots = a460_pair().cell.robots
    return np.array([r.tip_position(np.deg2rad(q)) for r, q in zip(robots, TABLE_ONE[row], strict=True)])


def test_both_wrists_move_level_along_minus_x_of_the_world():
    way = wrists(1) - wrists(0)
    np.testing.assert_allclose(way, [[-0.1325, 0, 0], [-0.127, 0, 0]], atol=2e-3)


def test_the_payload_is_half_a_metre_long_level_and_across_the_way():
    for row in range(2):
        span = np.subtract(*wrists(row)[::-1])
        assert abs(np.linalg.norm(span) - 0.5) < 6e-3
        assert abs(span[2]) < 3e-3 and abs(span[0]) < 6e-3


def test_the_a460_know_seventy_percent_of_themselves_and_nothing_of_friction():
    cell = a460_pair().cell
    np.testing.assert_allclose(cell.theta_hat0, 0.7 * cell.theta, rtol=1e-14)
    for member in cell.members:
        np.testing.assert_array_equal(member.friction.viscous, [5, 6, 4])
        np.testing.assert_array_equal(member.friction.coulomb, [4, 6, 4])
        assert member.friction.smoothing == 0.01
    for member in a460_pair(friction=False).cell.members:
        assert not np.any(member.friction.viscous) and not np.any(member.friction.coulomb)


def test_epsilon_of_the_a460_is_the_difference_of_the_errors(a460_run):
    run = a460_run()
    e = run.tracking_error
    np.testing.assert_array_equal(run.sync_error[:, 0], e[:, 0] - e[:, 1])


# -- claims that any reader of the paper expects ----------------------------------------------------------


def test_the_planar_errors_die_out(planar_run):
    for synchronized in (True, False):
        run = planar_run(synchronized)
        assert np.abs(run.tracking_error[-1]).max() < 0.02 * np.abs(run.tracking_error).max()


def test_synchronized_planar_arms_stay_much_closer_together(planar_run):
    together, alone = (np.abs(planar_run(s).sync_error).max(axis=(0, 2)) for s in (True, False))
    assert (together < 0.2 * alone).all()


def test_synchronized_a460_stay_closer_together_on_every_joint(a460_run):
    together, alone = (np.sqrt((a460_run(s).sync_error[:, 0] ** 2).mean(axis=0)) for s in (True, False))
    assert (together < alone).all()


def test_friction_leaves_small_offsets_on_both_a460(a460_run):
    with_friction, without = (a460_run(True, friction) for friction in (True, False))
    offset = np.abs(with_friction.tracking_error[-1]).max()
    assert 1e-4 < offset < np.deg2rad(2)
    assert np.abs(without.tracking_error[-1]).max() < offset


@pytest.mark.parametrize(
    ("make", "subject"),
    [
        (lambda: planar_four(phi="wide"), "phi"),
        (lambda: planar_four(phi=np.nan), "phi"),
        (lambda: planar_four(phi=[0.1, 0.2]), "phi"),
        (lambda: planar_four(radii="own"), "radii"),
        (lambda: planar_four(disturbance="force"), "disturbance"),
        (lambda: planar_four(disturbance=3.0), "disturbance"),
        (lambda: planar_four(disturbance=np.zeros(3)), "disturbance"),
        (lambda: planar_four(disturbance=Disturbance(4, 1.0, 0.0, 1.0)), "disturbance, robot"),
        (lambda: planar_four(disturbance=["torque"]), "disturbances"),
        (lambda: planar_four(gains=7.0), "gains"),
        (lambda: planar_four(synchronized=False, gains=7.0), "gains"),
        (lambda: planar_four(gains=Gains(1, 1, (1, 1, 1), 1, 1)), "K_r"),
        (lambda: planar_four(reference_acceleration="best"), "reference_acceleration"),
        (lambda: planar_four(k_r_space="tip"), "k_r_space"),
        (lambda: a460_pair(gains={"Lambda": 3}), "gains"),
        (lambda: a460_pair(synchronized=False, gains={"Lambda": 3}), "gains"),
        (lambda: a460_pair(gains=Gains(1, 1, 1, 1, np.ones(29))), "Gamma"),
    ],
)
def test_wrong_arguments_are_refused_at_once(make, subject):
    with refused(InputError, subject):
        make()


@pytest.mark.parametrize(
    ("make", "name", "value"),
    [
        (planar_four, "synchronized", "no"),
        (panda_four, "synchronized", 0),
        (a460_pair, "friction", 1),
        (a460_pair, "adapt_friction", "yes"),
    ],
)
def test_a_switch_is_true_or_false(make, name, value):
    with refused(InputError, name):
        make(**{name: value})
