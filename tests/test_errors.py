"""What an error carries beside its message: what it is about, what was found, and where it was read."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused

from synctrl import checks
from synctrl.errors import InputError, RobotError

REFUSALS = {
    "no numbers": (checks.finite_array, ("dt", "1"), None),
    "another shape": (checks.finite_array, ("dt", [1.0, 2.0], (3,)), (2,)),
    "not finite": (checks.finite_array, ("dt", [1.0, np.inf]), np.inf),
    "not one per joint": (checks.per_joint, ("dt", [1.0, 2.0], 3), (2,)),
    "not symmetric": (checks.symmetric_matrix, ("dt", [[1.0, 2.0], [0.0, 1.0]], 2), None),
    "no number": (checks.finite_number, ("dt", True), None),
    "not above zero": (checks.positive_number, ("dt", -0.5), -0.5),
    "below zero": (checks.non_negative_number, ("dt", -0.5), -0.5),
    "too few": (checks.count, ("dt", 2, 3), 2),
    "no index": (checks.index, ("dt", 2, 2), None),
    "no later end": (checks.window, ("dt", 0.2, 0.1), None),
    "no truth value": (checks.boolean, ("dt", 1), None),
    "another type": (checks.instance, ("dt", 1, str, "a text"), None),
    "unknown word": (checks.choice, ("dt", "c", ("a", "b")), None),
    "two lines": (checks.label, ("dt", "a\nb"), None),
}


@pytest.mark.parametrize(("check", "arguments", "found"), REFUSALS.values(), ids=REFUSALS)
def test_a_check_says_which_argument_is_at_fault_and_begins_its_message_with_it(check, arguments, found):
    with refused(InputError, "dt", found=found) as caught:
        check(*arguments)
    assert str(caught.value).startswith("dt: expected ")


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
