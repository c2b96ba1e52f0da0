"""Mutations of good descriptions: refused with a `RobotError`, or taken with the dynamics of the file."""

from __future__ import annotations

import warnings
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st
from plain import positions_held, read_by_pinocchio, same_dynamics, with_joints_held
from urdf_corpus import GOOD, write

from synctrl.errors import RobotError, RobotWarning
from synctrl.robots.urdf import Description, read_urdf, urdf_folder

SEEDS = (
    GOOD,
    (urdf_folder() / "planar2r" / "planar2r.urdf").read_text(encoding="utf-8"),
    (urdf_folder() / "a460" / "a460_full.urdf").read_text(encoding="utf-8"),
)
WORDS = (
    "", " ", "nan", "inf", "-inf", "abc", "1,5", "0x1p3", "1_0", "1e999", "-0", "0", "-1", "1", "2",
    "1e16", "-1e16", "1e-16", "1e-300", "1e-320", "1e8", "0 0 0", "1 0 0", "0 0 1e-7", "1e16 1e16 1e16",
    "1 2", "nan 0 0", "universe", "base", "upper", "fore", "link1", "joint1", "shoulder", "fixed", "floating",
    "planar", "revolute", "continuous", "prismatic", "spherical", "../x.stl",
    "package://a/b.stl", "/etc/passwd",
    "<", "&", "\"'>", "\n", "nobody", "0.5 0.5 0.5 0.5", "é", "a" * 1000,
)  # fmt: skip
TAGS = (
    "link",
    "joint",
    "inertial",
    "mass",
    "inertia",
    "origin",
    "axis",
    "limit",
    "visual",
    "mimic",
    "mesh",
    "gazebo",
    "loop_joint",
    "xacro:macro",
    "x",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Where the mutants are written, one over the other."""
    return tmp_path_factory.mktemp("mutants")


def outcome(folder: Path, content: str | bytes) -> Description | RobotError:
    """What becomes of a description; anything but these two ends the test."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        try:
            return read_urdf(write(folder, content))
        except RobotError as error:
            return error


def check(result: Description | RobotError) -> None:
    """An error that can be printed, or a mechanism: finite, with a positive definite mass matrix."""
    event(type(result).__name__)
    if isinstance(result, RobotError):
        assert str(result).isprintable() and len(str(result)) < 2000
        return
    model, rng = result.model, np.random.default_rng(1)
    data = model.createData()
    assert model.nv >= 1 and model.existFrame(result.tip)
    for _ in range(3):
        q = pin.integrate(model, pin.neutral(model), rng.uniform(-1, 1, model.nv))
        v, a = rng.standard_normal((2, model.nv))
        np.linalg.cholesky(pin.crba(model, data, q))
        tau = pin.rnea(model, data, q, v, a)
        regressor = pin.computeJointTorqueRegressor(model, data, q, v, a)
        acceleration = pin.aba(model, data, q, v, tau)
        for values in (tau, regressor, acceleration):
            assert np.isfinite(values).all()
    judged_by_pinocchio(result)
    for shape in result.visual.geometryObjects:
        assert np.isfinite(shape.placement.homogeneous).all() and np.isfinite(shape.meshScale).all()


def judged_by_pinocchio(result: Description) -> None:
    """What Pinocchio alone reads without complaint has the same dynamics here, held joints fixed in both."""
    model, complaint = read_by_pinocchio(result.path)
    positions = positions_held(result)
    if model is None or complaint or not set(positions) <= set(model.names):
        event("not judged by Pinocchio")
        return
    event("judged by Pinocchio")
    if list(result.model.names)[1:] == [name for name in list(model.names)[1:] if name not in positions]:
        same_dynamics(result.model, with_joints_held(model, positions) if positions else model, 1e-5)


numbers = st.floats(allow_nan=True, allow_infinity=True).map(repr)
values = st.sampled_from(WORDS) | numbers | st.lists(numbers, min_size=3, max_size=3).map(" ".join)


@st.composite
def mutants(draw: Callable) -> str:
    """A good description after one to three changes of its elements and attributes."""
    root = ET.fromstring(draw(st.sampled_from(SEEDS)))
    for _ in range(draw(st.integers(1, 3))):
        change = draw(st.sampled_from((delete, duplicate, rename, adopt, set_value, drop_value, swap_values)))
        change(draw, root)
    return ET.tostring(root, encoding="unicode")


def inner(draw: Callable, root: ET.Element) -> tuple[ET.Element, ET.Element] | None:
    """An element inside the robot and its parent, if one is left."""
    pairs = [(parent, child) for parent in root.iter() for child in parent]
    return draw(st.sampled_from(pairs)) if pairs else None


def delete(draw: Callable, root: ET.Element) -> None:
    if pair := inner(draw, root):
        pair[0].remove(pair[1])


def duplicate(draw: Callable, root: ET.Element) -> None:
    if pair := inner(draw, root):
        pair[0].append(ET.fromstring(ET.tostring(pair[1])))


def rename(draw: Callable, root: ET.Element) -> None:
    if pair := inner(draw, root):
        pair[1].tag = draw(st.sampled_from(TAGS))


def adopt(draw: Callable, root: ET.Element) -> None:
    """Copy an element to another place."""
    one, other = inner(draw, root), inner(draw, root)
    if one and other:
        other[1].append(ET.fromstring(ET.tostring(one[1])))


def attribute(draw: Callable, root: ET.Element) -> tuple[ET.Element, str] | None:
    found = [(element, key) for element in root.iter() for key in sorted(element.attrib)]
    return draw(st.sampled_from(found)) if found else None


def set_value(draw: Callable, root: ET.Element) -> None:
    if found := attribute(draw, root):
        found[0].set(found[1], draw(values))


def drop_value(draw: Callable, root: ET.Element) -> None:
    if found := attribute(draw, root):
        del found[0].attrib[found[1]]


def swap_values(draw: Callable, root: ET.Element) -> None:
    one, other = attribute(draw, root), attribute(draw, root)
    if one and other:
        (a, key), (b, name) = one, other
        first, second = a.get(key), b.get(name)
        a.set(key, second)
        b.set(name, first)


@st.composite
def scratched(draw: Callable) -> bytes:
    """A good description with bytes changed, left out, repeated, put in, or its end cut off."""
    data = draw(st.sampled_from(SEEDS)).encode()
    at = draw(st.integers(0, len(data)))
    length = draw(st.integers(1, 200))
    kind = draw(st.sampled_from(("cut", "flip", "omit", "repeat", "insert")))
    tail = {
        "cut": b"",
        "flip": bytes(byte ^ (1 << draw(st.integers(0, 7))) for byte in data[at : at + 1]) + data[at + 1 :],
        "omit": data[at + length :],
        "repeat": data[at : at + length] + data[at:],
        "insert": draw(st.binary(max_size=8)) + data[at:],
    }
    return data[:at] + tail[kind]


@settings(max_examples=400, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(mutants())
def test_a_mutant_is_a_mechanism_or_a_robot_error(folder, content):
    check(outcome(folder, content))


@settings(max_examples=200)
@given(scratched())
def test_scratched_bytes_are_a_mechanism_or_a_robot_error(folder, content):
    check(outcome(folder, content))


@settings(max_examples=100)
@given(st.binary(max_size=300))
def test_any_bytes_are_a_robot_error(folder, content):
    assert isinstance(outcome(folder, content), RobotError)


@settings(max_examples=200)
@given(seed=st.sampled_from(SEEDS), data=st.data())
def test_any_number_in_place_of_a_good_one_is_a_mechanism_or_a_robot_error(folder, seed, data):
    """One attribute, one finite number of any size: what is let through has to have dynamics without NaN."""
    root = ET.fromstring(seed)
    numeric = [
        (element, key)
        for element in root.iter()
        for key in element.attrib
        if key in ("value", "xyz", "rpy", "lower", "upper", "effort", "velocity") or key.startswith("i")
    ]
    element, key = data.draw(st.sampled_from(numeric))
    words = element.get(key).split()
    exponent = data.draw(st.integers(-18, 17))
    words[data.draw(st.integers(0, len(words) - 1))] = repr(data.draw(st.floats(-10, 10)) * 10.0**exponent)
    element.set(key, " ".join(words))
    check(outcome(folder, ET.tostring(root, encoding="unicode")))


def test_the_seeds_are_good(folder):
    for seed in SEEDS:
        assert isinstance(outcome(folder, seed), Description)
