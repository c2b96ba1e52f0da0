"""Whatever is wrong with the input: one clear error of the toolkit, before anything runs."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused

from synctrl import (
    CartesianSpace,
    Cell,
    Circle,
    Controller,
    Coupling,
    Cubic,
    Disturbance,
    Experiment,
    Friction,
    FullParameters,
    Gains,
    Hold,
    JointSpace,
    Member,
    Payload,
    Robot,
    SynctrlError,
    load_robot,
    simulate,
)
from synctrl.checks import finite_array, finite_number, non_negative_number, positive_number
from synctrl.errors import CouplingError, InputError, RobotError
from synctrl.experiments import planar_four

ARM = load_robot("planar2r")
GOOD = Hold([0.0, 1.0])
NO_NUMBERS = [
    None,
    "ten",
    "10",
    b"10",
    [1, "2"],
    [1, [2]],
    {},
    ...,
    1j,
    np.array([1 + 0j]),
    [True, None],
]
NOT_FINITE = [np.nan, np.inf, -np.inf, [1.0, np.nan]]


def pair(*members: Member, **options) -> Cell:
    members = members or (Member(ARM, GOOD), Member(ARM, GOOD))
    return Cell(members, options.pop("coupling", Coupling.pair()), **options)


def refuses(make, subject: str | None, kind: type[SynctrlError] = SynctrlError, **data) -> None:
    """What is made is refused by an error about this subject."""
    with refused(kind, subject, **data):
        make()


# -- numbers ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", NO_NUMBERS, ids=repr)
def test_what_is_no_number_is_no_array_of_numbers(value):
    refuses(lambda: finite_array("K", value), "K", InputError)


@pytest.mark.parametrize("value", NOT_FINITE, ids=repr)
def test_numbers_have_to_be_finite(value):
    refuses(lambda: finite_array("K", value), "K", InputError)


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), max_size=5))
def test_good_numbers_arrive_unchanged_read_only_and_apart(values):
    source = np.array(values, dtype=float)
    array = finite_array("K", source)
    np.testing.assert_array_equal(array, source)
    assert not array.flags.writeable and not np.shares_memory(array, source)


@pytest.mark.parametrize("check", [finite_number, positive_number, non_negative_number])
@pytest.mark.parametrize("value", [*NO_NUMBERS, *NOT_FINITE, True, [1.0], np.ones((1, 1))], ids=repr)
def test_a_single_number_is_a_single_number(check, value):
    refuses(lambda: check("dt", value), "dt", InputError)


def test_signs_are_checked():
    refuses(lambda: positive_number("dt", 0.0), "dt", found=0.0)
    refuses(lambda: non_negative_number("k", -1e-9), "k", found=-1e-9)
    assert (positive_number("dt", np.float32(0.5)), non_negative_number("k", 0)) == (0.5, 0.0)


# -- gains ------------------------------------------------------------------------------------------------

GAINS = {"Lambda": 4.0, "beta": 4.0, "K_r": 1.0, "K_eps": 2.0, "Gamma": 0.2}


@pytest.mark.parametrize("name", GAINS)
@pytest.mark.parametrize("value", [*NO_NUMBERS, *NOT_FINITE, -1.0, [1.0, -1e-12]], ids=repr)
def test_a_gain_that_is_no_gain_is_named(name, value):
    if name == "Gamma" and value is None:
        return  # which says that an adaptation is given instead
    refuses(lambda: Gains(**{**GAINS, name: value}), name, InputError)
    refuses(lambda: Gains(**GAINS).replace(**{name: value}), name, InputError)


def test_lambda_and_k_r_have_to_be_above_zero_and_the_others_need_not():
    for name in ("Lambda", "K_r"):
        refuses(lambda name=name: Gains(**{**GAINS, name: 0.0}), name, found=0.0)
    Gains(**{**GAINS, "beta": 0.0, "K_eps": 0.0, "Gamma": 0.0})


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("Lambda", (3,)),
        ("Lambda", (1,)),
        ("Lambda", (2, 2)),
        ("beta", (3,)),
        ("beta", (2, 2)),
        ("K_eps", (4,)),
        ("K_eps", (2, 2)),
        ("K_r", (3,)),
        ("K_r", (3, 2)),
        ("K_r", (2, 2, 2)),
        ("Gamma", (19,)),
        ("Gamma", (20, 20)),
        ("Gamma", (3, 20)),
    ],
)
def test_a_gain_of_the_wrong_size_is_named_with_the_right_ones(name, shape):
    gains = Gains(**{**GAINS, name: np.ones(shape)})
    refuses(
        lambda: Experiment(pair(), gains, 1.0),
        name,
        found=shape,
    )


def test_unknown_gains_are_named():
    refuses(lambda: SMALL_GAINS.replace(K_epsilon=1.0), "gains", found="K_epsilon")


@pytest.mark.parametrize("gains", [None, 3.0, GAINS, "paper"])
def test_gains_are_gains(gains):
    refuses(lambda: Experiment(pair(), gains, 1.0), "gains", InputError)
    refuses(lambda: simulate(pair(), gains, 1.0), "gains", InputError)


# -- initial states, members, cells -----------------------------------------------------------------------


@pytest.mark.parametrize("name", ["q0", "v0", "theta_hat0"])
@pytest.mark.parametrize(
    "value", ["here", [np.nan] * 2, [1.0], [[0.0, 1.0]], np.zeros(3), 1.0, [np.inf, 0]], ids=repr
)
def test_a_wrong_initial_state_is_named_with_its_robot(name, value):
    refuses(
        lambda: pair(Member(ARM, GOOD), Member(ARM, GOOD, **{name: value})), f"robot 2, {name}", InputError
    )
    named = Member(ARM, GOOD, name="left", **{name: value})
    refuses(lambda: pair(Member(ARM, GOOD), named), f"left, {name}", InputError)


@pytest.mark.parametrize(
    ("make", "subject"),
    [
        (lambda: Cell([], Coupling.pair()), "coupling"),
        (lambda: Cell([Member(ARM, GOOD)], Coupling.pair()), "coupling"),
        (lambda: Cell([Member(ARM, GOOD)] * 3, Coupling.pair()), "coupling"),
        (lambda: Cell([ARM, ARM], Coupling.pair()), "members"),
        (lambda: Cell(None, Coupling.pair()), "members"),
        (lambda: Cell(5, Coupling.pair()), "members"),
        (lambda: pair(coupling="pair"), "coupling"),
        (lambda: pair(coupling=None), "coupling"),
        (lambda: pair(space="joint"), "space"),
        (lambda: pair(space=JointSpace), "space"),
        (lambda: pair(Member("planar2r", GOOD), Member(ARM, GOOD)), "robot"),
        (lambda: pair(Member(None, GOOD), Member(ARM, GOOD)), "robot"),
        (lambda: pair(Member(ARM, None), Member(ARM, GOOD)), "robot 1, trajectory"),
        (lambda: pair(Member(ARM, [0.0, 1.0]), Member(ARM, GOOD)), "robot 1, trajectory"),
        (lambda: pair(Member(ARM, GOOD), Member(ARM, np.sin, [0, 0])), "robot 2, trajectory"),
        (lambda: pair(Member(ARM, GOOD), Member(ARM, Hold([0.0]))), "robot 2, trajectory"),
        (
            lambda: pair(Member(ARM, GOOD), Member(ARM, Hold([0.0] * 3), [0, 1])),
            "robot 2, trajectory",
        ),
        (lambda: pair(Member(ARM, GOOD), Member(ARM, GOOD, friction=0.5)), "robot 2, friction"),
        (
            lambda: pair(Member(ARM, GOOD), Member(ARM, GOOD, friction=Friction([1, 2, 3]))),
            "robot 2, friction, viscous",
        ),
        (
            lambda: pair(Member(ARM, GOOD), Member(ARM, GOOD, friction=Friction(0, [[1, 2]]))),
            "robot 2, friction, coulomb",
        ),
        (lambda: pair(Member(ARM, GOOD), Member(ARM, GOOD, parameters="most")), "robot 2, parameters"),
        (lambda: pair(Member(ARM, GOOD, name=5), Member(ARM, GOOD)), "name"),
        (lambda: pair(Member(ARM, GOOD), Member(ARM, GOOD), name=7), "name"),
        (lambda: pair(Member(ARM, GOOD, name="a"), Member(ARM, GOOD, name="a")), "name"),
        (lambda: pair(Member(ARM, GOOD, name="robot 2"), Member(ARM, GOOD)), "name"),
        (
            lambda: Cell([Member(ARM, Hold([9.0, 0.0]))] * 2, Coupling.pair(), CartesianSpace("xy")),
            "robot 1, trajectory",
        ),
    ],
)
def test_cells_that_do_not_fit_together_are_refused(make, subject):
    refuses(make, subject)


def test_parameters_of_another_robot_are_refused():
    from synctrl import FullParameters

    other = FullParameters(load_robot("a460"))
    refuses(lambda: pair(Member(ARM, GOOD), Member(ARM, GOOD, parameters=other)), "robot 2, parameters")


@pytest.mark.parametrize("bad", [np.nan, "x"])
def test_own_trajectories_are_looked_at_before_anything_runs(bad):
    class Own:
        dimension, breaks = 2, ()

        def __call__(self, t):
            zeros = np.zeros((*np.shape(t), 2))
            return SimpleNamespace(x=zeros, x_dot=zeros, x_ddot=zeros + bad) if bad != "x" else zeros

    told: list[float] = []
    refuses(
        lambda: simulate(
            pair(Member(ARM, GOOD), Member(ARM, Own(), [0.0, 1.0])), SMALL_GAINS, 0.1, progress=told.append
        ),
        "robot 2, trajectory",
    )
    assert told == []


@pytest.mark.parametrize(
    ("make", "subject"),
    [
        (lambda: Friction(viscous=-1.0), "viscous"),
        (lambda: Friction(coulomb=[1.0, -0.1]), "coulomb"),
        (lambda: Friction(viscous=np.nan), "viscous"),
        (lambda: Friction(coulomb="some"), "coulomb"),
        (lambda: Friction(smoothing=0.0), "smoothing"),
        (lambda: Friction(smoothing=-1.0), "smoothing"),
        (lambda: Friction(smoothing=[0.1, 0.2]), "smoothing"),
    ],
)
def test_friction_that_drives_is_refused(make, subject):
    refuses(make, subject, InputError)


# -- runs -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "subject"),
    [
        ({"dt": 0.0}, "dt"),
        ({"dt": -1e-3}, "dt"),
        ({"dt": np.nan}, "dt"),
        ({"dt": "fast"}, "dt"),
        ({"dt": None}, "dt"),
        ({"dt": [1e-3, 1e-3]}, "dt"),
        ({"dt": True}, "dt"),
        ({"dt": 2.0}, "dt"),
        ({"dt": 1e-9}, "dt"),
        ({"duration": 0.0}, "duration"),
        ({"duration": -1.0}, "duration"),
        ({"duration": np.inf}, "duration"),
        ({"duration": "long"}, "duration"),
        ({"integrator": "euler"}, "integrator"),
        ({"integrator": "dop853"}, "integrator"),
        ({"integrator": None}, "integrator"),
        ({"integrator": ["rk4"]}, "integrator"),
        ({"integrator": np.array(["rk4", "rk4"])}, "integrator"),
        ({"integrator": "LSODA", "rtol": 0.0}, "rtol"),
        ({"integrator": "LSODA", "atol": -1.0}, "atol"),
        ({"integrator": "LSODA", "rtol": "tight"}, "rtol"),
        ({"progress": "bar"}, "progress"),
    ],
)
def test_a_run_that_cannot_be_is_refused(options, subject):
    refuses(lambda: Experiment(small_cell(), SMALL_GAINS, 1.0).simulate(**options), subject, InputError)


@pytest.mark.parametrize(
    ("options", "subject"),
    [
        ({"duration": 0.0}, "duration"),
        ({"duration": "long"}, "duration"),
        ({"duration": None}, "duration"),
        ({"cell": None}, "cell"),
        ({"cell": [Member(ARM, GOOD)]}, "cell"),
        ({"disturbances": [1.0]}, "disturbances"),
        ({"disturbances": Disturbance(0, 1.0, 0.0, 1.0)}, "disturbances"),
        ({"disturbances": None}, "disturbances"),
        ({"disturbances": [Disturbance(2, 1.0, 0.0, 1.0)]}, "disturbance, robot"),
        ({"disturbances": [Disturbance(-1, 1.0, 0.0, 1.0)]}, "disturbance, robot"),
        ({"disturbances": [Disturbance(0.0, 1.0, 0.0, 1.0)]}, "disturbance, robot"),
        ({"disturbances": [Disturbance(True, 1.0, 0.0, 1.0)]}, "disturbance, robot"),
        ({"disturbances": [Disturbance("arm 1", 1.0, 0.0, 1.0)]}, "disturbance, robot"),
        (
            {"disturbances": [Disturbance(0, (1.0, 1.0, 1.0), 0.0, 1.0)]},
            "disturbance, torque",
        ),
        ({"disturbances": [Disturbance(0, [[1.0, 1.0]], 0.0, 1.0)]}, "disturbance, torque"),
        ({"payloads": Payload(0, 1.0)}, "payloads"),
        ({"payloads": 5}, "payloads"),
        ({"title": 3}, "title"),
        ({"reference_acceleration": "fast"}, "reference_acceleration"),
        ({"k_r_space": "world"}, "k_r_space"),
    ],
)
def test_an_experiment_that_cannot_be_is_refused_when_it_is_made(options, subject):
    whole = {"cell": small_cell(), "gains": SMALL_GAINS, "duration": 1.0, **options}
    refuses(lambda: Experiment(**whole), subject, InputError)


@pytest.mark.parametrize(
    ("window", "subject"),
    [
        ((0, 1.0, 0.5, 0.5), "disturbance"),
        ((0, 1.0, 0.6, 0.5), "disturbance"),
        ((0, 1.0, -0.1, 0.5), "disturbance"),
        ((0, 1.0, np.nan, 0.5), "disturbance, start"),
        ((0, 1.0, 0.1, np.inf), "disturbance, stop"),
        ((0, 1.0, "now", 0.5), "disturbance, start"),
        ((0, np.nan, 0.0, 0.5), "disturbance, torque"),
        ((0, "much", 0.0, 0.5), "disturbance, torque"),
    ],
)
def test_disturbances_without_a_window_are_refused(window, subject):
    refuses(lambda: Disturbance(*window), subject, InputError)


# -- couplings --------------------------------------------------------------------------------------------


def run_with(c, n: int = 2) -> None:
    told: list[float] = []
    coupling = Coupling.pair(c=c) if n == 2 else Coupling.ring(n, c=c)
    try:
        simulate(small_cell(n, coupling=coupling), SMALL_GAINS, 0.1, dt=1e-2, progress=told.append)
    finally:
        assert told == []


@pytest.mark.parametrize(
    ("c", "robot"),
    [
        ((1.0, 0.0), 1),
        ([[1.0, 1.0], [1.0, 0.0]], 1),
        ([np.eye(2), np.ones((2, 2))], 1),
        ([np.eye(2), [[1.0, 1.0], [1.0, 1.0 + 1e-14]]], 1),
        ([[[1.0, 2.0], [2.0, 4.0]], np.eye(2)], 0),
    ],
)
def test_weights_without_an_inverse_are_refused_before_anything_runs(c, robot):
    refuses(lambda: run_with(c), "c", CouplingError, robot=robot)


def moving(*functions):
    """Weights f_i(t) I from (f, f', f'') of each robot."""
    eye = np.eye(2)
    return lambda t: tuple([f[k](t) * eye for f in functions] for k in range(3))


ONE = (lambda t: 1.0, lambda t: 0.0, lambda t: 0.0)
THROUGH_ZERO = (lambda t: 1 - 20 * t, lambda t: -20.0, lambda t: 0.0)  # zero at 0.05 s, between two instants?
BESIDE = (lambda t: 1 - t / 0.0333, lambda t: -1 / 0.0333, lambda t: 0.0)


@pytest.mark.parametrize("weight", [THROUGH_ZERO, BESIDE], ids=["at an instant", "between two"])
def test_weights_that_lose_their_inverse_on_the_way_are_refused_before_anything_runs(weight):
    refuses(lambda: run_with(moving(ONE, weight)), "c", CouplingError, robot=1)


@pytest.mark.parametrize(
    ("c", "subject"),
    [
        (3.0, "c"),
        ((1.0, 1.0, 1.0), "c"),
        ([[1.0, 1.0, 1.0]] * 2, "c"),
        ([np.eye(3)] * 2, "c"),
        ((1.0, np.nan), "c"),
        (("a", "b"), "c"),
        (lambda t: np.eye(2), "c"),
        (lambda t: None, "c"),
        (lambda t: (1.0, 2.0, 3.0), "c"),
        (lambda t: ([np.eye(2) * np.nan] * 2, np.zeros((2, 2, 2)), np.zeros((2, 2, 2))), "c"),
    ],
)
def test_weights_of_the_wrong_kind_are_refused_before_anything_runs(c, subject):
    refuses(lambda: run_with(c), subject)


@pytest.mark.parametrize("n", [0, 1, -3, 2.0, "4", None, True])
def test_a_coupling_needs_two_robots_at_least(n):
    refuses(lambda: Coupling.ring(n), "robots")


@pytest.mark.parametrize(
    ("edges", "signs", "subject"),
    [
        ([(0, 0)], [(1, 1)], "edge 0, of robots [0, 0]"),
        ([(0, 2)], [(1, 1)], "edge 0, of robots [0, 2]"),
        ([(0, -1)], [(1, 1)], "edge 0, of robots [0, -1]"),
        ([(0, 0.5)], [(1, 1)], "edges"),
        ([(0, 1)], [(1, 0)], "edge 0, of robots [0, 1]"),
        ([(0, 1)], [(1, 1, 1)], "edges"),
        ([(0, 1)], [(1, np.nan)], "signs"),
        ([], np.zeros((0, 2)), "edges"),
        ("01", [(1, 1)], "edges"),
    ],
)
def test_edges_that_are_none_are_refused(edges, signs, subject):
    refuses(lambda: Coupling(2, edges, signs, (1.0, 1.0)), subject)


def test_groups_that_nothing_connects_are_refused():
    refuses(lambda: Coupling(4, [(0, 1), (2, 3)], [(1, 1)] * 2, np.ones(4)), "edges", CouplingError)


# -- robots -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [None, 3, ["planar2r"], b"planar2r"])
def test_a_robot_has_a_name_or_a_path(name):
    refuses(lambda: load_robot(name), "robot", InputError, found=type(name).__name__)


@pytest.mark.parametrize(
    ("name", "subject", "found"),
    [
        ("planar3r", "robot", "planar3r"),
        ("", "robot", ""),
        ("nowhere/robot.urdf", None, "no such file"),
        ("/", None, "a folder"),
        ("a\0b", "robot", "a\0b"),
    ],
)
def test_a_robot_that_is_not_there_is_an_error_of_the_toolkit(name, subject, found):
    refuses(lambda: load_robot(name), subject, RobotError, found=found)


def test_parameters_of_the_wrong_size_are_refused():
    refuses(lambda: ARM.with_parameters(np.ones(10)), "pi", InputError, found=(10,))
    refuses(lambda: ARM.with_parameters(np.full(20, np.nan)), "pi", InputError)
    refuses(lambda: ARM.placed(rpy="up"), "rpy", InputError, found="up")


def test_a_robot_is_made_of_a_model():
    refuses(lambda: Robot("planar2r", "tip"), "model", InputError)
    refuses(lambda: load_robot("planar2r", tip=3), "tip", InputError, found="int")
    refuses(lambda: FullParameters("planar2r"), "robot", InputError, found="str")


def test_a_controller_is_made_of_a_cell_and_gains():
    refuses(lambda: Controller(ARM, SMALL_GAINS), "cell", InputError, found="Robot")
    refuses(lambda: Controller(small_cell(), 3.0), "gains", InputError)


# -- together ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "make",
    [
        lambda: Cubic([0.0], [1.0], "slow"),
        lambda: Circle("here", 1.0, 1.0),
        lambda: planar_four(phi=np.inf),
        lambda: Gains(None, 1, 1, 1, 1),
        lambda: Coupling.pair(c=None),
    ],
)
def test_one_except_clause_catches_all(make):
    with pytest.raises(SynctrlError):
        make()
