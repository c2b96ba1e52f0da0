"""What an error carries beside its message: what it is about, what was found, and where it was read."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from refusals import refused

from synctrl import (
    AxisRotation,
    CartesianSpace,
    Circle,
    Coupling,
    FunctionTrajectory,
    Hold,
    JointSpace,
    Redundancy,
    SynchronizationFunction,
    checks,
    load_robot,
)
from synctrl.errors import CouplingError, InputError, RobotError, SynctrlError

ARM = load_robot("planar2r")

REFUSALS = {
    "no numbers": (checks.finite_array, ("dt", "1"), "1"),
    "another shape": (checks.finite_array, ("dt", [1.0, 2.0], (3,)), (2,)),
    "not finite": (checks.finite_array, ("dt", [1.0, np.inf]), np.inf),
    "not one per joint": (checks.per_joint, ("dt", [1.0, 2.0], 3), (2,)),
    "not symmetric": (checks.symmetric_matrix, ("dt", [[1.0, 2.0], [0.0, 1.0]], 2), ((1.0, 2.0), (0.0, 1.0))),
    "no number": (checks.finite_number, ("dt", True), True),
    "not above zero": (checks.positive_number, ("dt", -0.5), -0.5),
    "below zero": (checks.non_negative_number, ("dt", -0.5), -0.5),
    "too few": (checks.count, ("dt", 2, 3), 2),
    "no index": (checks.index, ("dt", 2, 2), 2),
    "no later end": (checks.window, ("dt", 0.2, 0.1), (0.2, 0.1)),
    "no truth value": (checks.boolean, ("dt", 1), 1),
    "another type": (checks.instance, ("dt", 1, str, "a text"), "int"),
    "no such part": (checks.offers, ("dt", 1, ("bind",), "a part"), 1),
    "a class for an object": (checks.offers, ("dt", str, ("split",), "a text"), "type"),
    "an array of another shape": (checks.shaped, ("dt", [1.0], (2,)), (1,)),
    "unknown word": (checks.choice, ("dt", "c", ("a", "b")), "c"),
    "two lines": (checks.label, ("dt", "a\nb"), "a\nb"),
}

#: a refusal for every argument that parts of a cell are made of
ARGUMENTS = {
    "axes": lambda: CartesianSpace("xw"),
    "redundancy, weights": lambda: Redundancy(weights=[-1.0, 1.0]).spread([ARM]),
    "redundancy, posture": lambda: Redundancy(posture=[]).spread([ARM]),
    "start": lambda: AxisRotation(2 * np.eye(3), (0, 0, 1), Hold([0.0])),
    "center": lambda: Circle([0.0], 1.0, 1.0),
    "first, second": lambda: Circle([0.0, 0.0], 1.0, 1.0, first=[1.0, 1.0]),
    "position": lambda: FunctionTrajectory(lambda t: [np.nan], lambda t: [0.0], lambda t: [0.0]),
    "function": lambda: SynchronizationFunction(3, 2, 1),
    "robots": lambda: SynchronizationFunction(np.add, 1, 1),
    "A_dot, A_ddot": lambda: SynchronizationFunction.from_matrices([1, -1], 1, A_dot=np.zeros),
    "trajectories": lambda: SynchronizationFunction.from_matrices([1, -1], 1).coupling([Hold([0])], 1.0),
    "edges": lambda: Coupling(2, [(0, 1e300)], [(1, 1)], [1, 1]),
    "joint space": lambda: JointSpace().bind([ARM, load_robot("wheel")]),
    "CartesianSpace('xyz')": lambda: CartesianSpace("xyz").bind([ARM]),
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("subject", "make"), ARGUMENTS.items(), ids=ARGUMENTS)
def test_a_refusal_names_the_argument_and_begins_its_message_with_it(subject, make):
    with refused(SynctrlError, subject) as caught:
        make()
    assert str(caught.value).startswith(f"{subject}: ")


@pytest.mark.parametrize(("check", "arguments", "found"), REFUSALS.values(), ids=REFUSALS)
def test_a_check_says_which_argument_is_at_fault_and_begins_its_message_with_it(check, arguments, found):
    with refused(InputError, "dt", found=found) as caught:
        check(*arguments)
    assert str(caught.value).startswith("dt: expected ")


def test_what_was_found_is_plain_whatever_it_was():
    class Own:
        pass

    endless: list = []
    endless.append(endless)
    for value, found in {
        "an object of the caller's": (Own(), "Own"),
        "a class": (Own, "type"),
        "numbers of numpy": ([np.float64(0.5), np.int64(2)], (0.5, 2)),
        "an array": (np.eye(2), ((1.0, 0.0), (0.0, 1.0))),
        "objects in an array": (np.array([Own(), 1]), ("Own", 1)),
        "objects in a list": (["a", [Own()], None], ("a", ("Own",), None)),
    }.values():
        for error in (InputError("no", found=value), InputError("no").about("dt", found=value)):
            assert repr(error.found) == repr(found)
    assert "list" in repr(InputError("no", found=endless).found)


@pytest.mark.parametrize(
    ("found", "shown"),
    [(0.1 + 0.2, "0.3"), (np.float64(-2.0), "-2"), (np.int64(3), "3"), ("x y", "'x y'"), ((2, 3), "(2, 3)")],
)
def test_an_error_about_something_unexpected_says_it_in_its_message_and_its_data(found, shown):
    error = RobotError.expected("two of them", found, "links", file="a.urdf", line=7)
    assert type(error) is RobotError and error.found == found
    assert (error.subject, error.file, error.line) == ("links", "a.urdf", 7)
    assert str(error) == f"a.urdf:7: links: expected two of them, found {shown}"
    assert str(RobotError.expected("two", found, shown="none at all")) == "expected two, found none at all"


@pytest.mark.parametrize("whole", [3, np.int64(3), np.uint8(3)])
def test_a_whole_number_of_numpy_counts_as_one(whole):
    assert (checks.count("dt", whole), checks.index("dt", whole, 4)) == (3, 3)


def test_an_error_about_no_part_alone_has_its_message_and_no_subject():
    error = InputError("what is wrong")
    assert (str(error), error.subject, error.found) == ("what is wrong", None, None)


def test_an_error_in_a_description_begins_with_file_and_line():
    error = RobotError("expected one", subject="joint 'elbow'", file="arm.urdf", line=7)
    assert str(error) == "arm.urdf:7: joint 'elbow': expected one"
    assert (error.file, error.line, error.subject) == ("arm.urdf", 7, "joint 'elbow'")
    assert str(RobotError("no such file", file="arm.urdf")) == "arm.urdf: no such file"


def test_a_kind_of_ones_own_keeps_what_it_set_before_the_message():
    class Own(InputError):
        def __init__(self, found):
            self.found = found
            super().__init__("what is wrong")

    assert Own(3).found == 3


def test_data_that_are_added_leave_the_message_and_travel_along():
    error = CouplingError("the weight has no inverse").about("c", robot=1, time=0.5)
    again = pickle.loads(pickle.dumps(error))
    for each in (error, again):
        assert str(each) == "the weight has no inverse"
        assert (each.subject, each.robot, each.time) == ("c", 1, 0.5)
