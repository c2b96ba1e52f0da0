"""An independent judge: MuJoCo, reading the same URDF with its own parser, drives the same closed loop."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

from synctrl import (
    Cell,
    Coupling,
    Cubic,
    Experiment,
    Friction,
    Gains,
    Hold,
    Member,
    Robot,
    load_robot,
    simulate,
)
from synctrl.errors import InputError, MissingDependencyError
from synctrl.experiments import a460_pair, planar_four
from synctrl.robots.documents import planar_arm
from synctrl.robots.urdf import describe
from synctrl.robots.urdf.document import Document, Inertial, Pose
from synctrl.simulation.mujoco import MujocoArm, _for_mujoco

#: equal accelerations up to rounding in chains of seven bodies
SAME = 1e-10
#: what the errors of two runs may differ by, relative to the largest error
AGREEMENT = 1e-9

NAMES = ("planar2r", "a460", "a460_full", "ur5", "panda", "xarm7", "kinova")


def difference(a, b, array: str) -> float:
    """Largest difference of an array of two results, relative to its largest value."""
    one, other = getattr(a, array), getattr(b, array)
    return np.abs(one - other).max() / np.abs(one).max()


def pair(name: str, friction: Friction | None = None) -> Experiment:
    """Two of a robot, turned and tilted, that move in joint space and start from half their parameters."""
    members = []
    for i in range(2):
        robot = load_robot(name).placed((0.3 * i, 1.0, -0.2), (0.3, -0.4 * i, 0.5 + i))
        start = np.linspace(-0.7, 0.9, robot.nv) + 0.2 * i
        path = Cubic(start, start + np.linspace(0.5, -0.4, robot.nv), 1.0)
        guess = 0.5 * robot.inertial_parameters
        members.append(Member(robot, path, theta_hat0=guess, friction=friction or Friction()))
    cell = Cell(members, Coupling.pair(), name=f"two {name}")
    return Experiment(cell, Gains(Lambda=5.0, beta=2.0, K_r=5.0, K_eps=5.0, Gamma=0.05), 0.25)


@pytest.mark.parametrize("name", NAMES)
def test_mujoco_and_pinocchio_compute_the_same_acceleration(name: str) -> None:
    rng = np.random.default_rng(0)
    robot = load_robot(name).placed(rng.normal(size=3), rng.uniform(-3, 3, 3)).with_armature(0.02)
    arm = MujocoArm(robot)
    for q, v, tau in rng.uniform(-3, 3, (20, 3, robot.nv)):
        expected = robot.forward_dynamics(q, v, tau)
        assert np.abs(arm.acceleration(q, v, tau) - expected).max() <= SAME * np.abs(expected).max()


@pytest.mark.parametrize("name", ["a460", "ur5", "panda"])
def test_a_run_with_mujoco_as_the_plant_has_the_same_errors(name: str) -> None:
    experiment = pair(name)
    ours, theirs = experiment.simulate(dt=2e-3), experiment.simulate(dt=2e-3, plant="mujoco")
    assert theirs.info["plant"] == "mujoco"
    assert np.abs(ours.tracking_error).max() > 1e-4, "nothing to compare"
    for array in ("tracking_error", "sync_error", "tau"):
        assert difference(ours, theirs, array) < AGREEMENT


@pytest.mark.parametrize("experiment", [planar_four(disturbance="torque"), a460_pair(friction=False)])
def test_the_cells_of_the_paper_agree(experiment: Experiment) -> None:
    ours, theirs = experiment.simulate(0.6), experiment.simulate(0.6, plant="mujoco")
    for array in ("tracking_error", "sync_error"):
        assert difference(ours, theirs, array) < AGREEMENT


def test_friction_acts_on_either_plant() -> None:
    rough, smooth = pair("a460", Friction(3.0, 2.0)), pair("a460")
    ours, theirs = rough.simulate(0.1), rough.simulate(0.1, plant="mujoco")
    assert difference(ours, theirs, "tracking_error") < AGREEMENT
    assert difference(theirs, smooth.simulate(0.1, plant="mujoco"), "tracking_error") > 0.01


def test_sampled_control_and_adaptive_methods_drive_mujoco_too() -> None:
    experiment = pair("a460")
    for options in ({"control_period": 2e-3}, {"integrator": "RK45"}):
        ours = experiment.simulate(0.05, **options)
        theirs = experiment.simulate(0.05, plant="mujoco", **options)
        assert difference(ours, theirs, "tracking_error") < 1e-7


def heavier(document: Document) -> Document:
    """The document with a last moving link a tenth heavier."""
    last = [link for link in document.links if link.inertial is not None][-1]
    inertial: Inertial = replace(last.inertial, mass=1.1 * last.inertial.mass)
    links = tuple(replace(link, inertial=inertial) if link is last else link for link in document.links)
    return replace(document, links=links)


def test_mujoco_reads_the_urdf_and_not_pinocchios_model() -> None:
    """A model and a URDF that describe different robots: a judge would blame the law, so it is refused."""
    robot = load_robot("a460")
    other = Robot(robot.model, robot.tip, document=heavier(robot.document))
    with refused(InputError, "plant='mujoco', robot 'a460'", found="joint3"):
        MujocoArm(other)
    cell = Cell([Member(each, Hold(np.zeros(3))) for each in (robot, other)], Coupling.pair())
    run = Experiment(cell, Gains(1, 1, 1, 1, 1), 0.1).plan(None, 1e-3, plant="mujoco")
    with refused(InputError, "plant='mujoco', robot 'a460'", found="joint3"):
        run.check()


@pytest.mark.parametrize("name", NAMES)
def test_mujoco_and_pinocchio_compute_the_same_mass_matrix(name: str) -> None:
    robot = load_robot(name).placed((0.1, 0.2, 0.3), (0.4, 0.5, 0.6)).with_armature(0.02)
    arm = MujocoArm(robot)
    for q in np.random.default_rng(3).uniform(-3, 3, (5, robot.nv)):
        expected = robot.mass_matrix(q)
        np.testing.assert_allclose(arm.mass_matrix(q), expected, rtol=0, atol=SAME * np.abs(expected).max())


@pytest.mark.parametrize("name", NAMES)
def test_mujoco_gets_inertias_in_the_axes_of_their_links(name: str) -> None:
    """Versions before 4.0 overlook other axes, silently."""
    document = load_robot(name).document
    inertials = [link.inertial for link in _for_mujoco(document).links]
    assert all(inertial is None or inertial.origin.rpy == (0, 0, 0) for inertial in inertials)
    place = pin.SE3.Random()
    for link, inertial in zip(document.links, inertials, strict=True):
        if inertial is not None:
            expected = link.inertial.parameters(place)
            np.testing.assert_allclose(inertial.parameters(place), expected, atol=1e-14 * link.inertial.mass)


def test_a_robot_with_inertias_in_turned_axes_moves_as_its_model_does() -> None:
    document = load_robot("ur5").document
    turned = [
        link.inertial and replace(link.inertial, origin=Pose(link.inertial.origin.xyz, (0.4, -0.5, 0.6)))
        for link in document.links
    ]
    links = tuple(replace(link, inertial=i) for link, i in zip(document.links, turned, strict=True))
    description = describe(replace(document, links=links))
    robot = Robot(description.model, description.tip, document=description.document)
    q, v, tau = np.random.default_rng(4).uniform(-2, 2, (3, robot.nv))
    expected = robot.forward_dynamics(q, v, tau)
    assert np.abs(MujocoArm(robot).acceleration(q, v, tau) - expected).max() <= SAME * np.abs(expected).max()


def test_inertias_in_turned_axes_are_turned() -> None:
    turned = Inertial(2.0, (1.0, 0.1, 0.2, 2.0, 0.3, 2.5), Pose((0.1, 0.2, 0.3), (0.4, -0.5, 0.6)))
    place = pin.SE3(pin.exp3(np.array([0.3, 0.2, 0.1])), np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(turned.in_link_axes.parameters(place), turned.parameters(place), rtol=1e-13)
    assert turned.in_link_axes.origin == Pose((0.1, 0.2, 0.3))


def test_a_mujoco_that_reads_inertias_wrongly_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is an extra: pip install 'synctrl[mujoco]'")
    monkeypatch.setattr(mujoco, "__version__", "3.12.0")
    with refused(MissingDependencyError, found="3.12.0"):
        pair("a460").simulate(0.01, plant="mujoco")


def test_mujoco_obeys_no_joint_limits_and_no_damping_of_its_own() -> None:
    robot = load_robot("panda")
    q, v = np.full(robot.nv, 5.0), np.full(robot.nv, 2.0)
    arm = MujocoArm(robot)
    expected = robot.forward_dynamics(q, v, np.zeros(robot.nv))
    np.testing.assert_allclose(arm.acceleration(q, v, np.zeros(robot.nv)), expected, rtol=1e-9)


def test_a_planar_arm_from_numbers_agrees() -> None:
    description = describe(planar_arm([0.5, 0.4, 0.3], [2.0, 1.5, 1.0]))
    robot = Robot(description.model, description.tip, document=description.document)
    q, v, tau = np.random.default_rng(2).uniform(-2, 2, (3, 3))
    found = MujocoArm(robot).acceleration(q, v, tau)
    np.testing.assert_allclose(found, robot.forward_dynamics(q, v, tau), rtol=1e-10)


def test_a_robot_with_other_parameters_is_the_same_to_mujoco() -> None:
    robot = load_robot("ur5")
    rng = np.random.default_rng(5)
    other = robot.with_parameters(rng.uniform(0.9, 1.1, 6).repeat(10) * robot.inertial_parameters)
    for q, v, tau in rng.uniform(-2, 2, (3, 3, 6)):
        found = MujocoArm(other).acceleration(q, v, tau)
        np.testing.assert_allclose(found, other.forward_dynamics(q, v, tau), rtol=1e-8, atol=1e-8)


def test_a_robot_without_a_urdf_is_refused() -> None:
    robot = load_robot("a460")
    other = Robot(robot.model, robot.tip, name=robot.name)
    with refused(InputError, "plant='mujoco', robot 'a460'"):
        MujocoArm(other)


def test_a_robot_that_mujoco_cannot_read_is_refused_before_anything_runs() -> None:
    other = Robot(load_robot("planar2r").model, "tip", name="planar2r")
    cell = Cell([Member(other, Hold(np.zeros(2)))] * 2, Coupling.pair())
    run = Experiment(cell, Gains(1, 1, 1, 1, 1), 0.1).plan(None, 1e-3, plant="mujoco")
    with refused(InputError, "plant='mujoco', robot 'planar2r'"):
        run.check()


def test_without_mujoco_the_message_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with refused(MissingDependencyError, "MuJoCo"):
        pair("a460").simulate(0.01, plant="mujoco")


def test_the_function_simulate_takes_the_plant_too() -> None:
    experiment = pair("planar2r")
    result = simulate(experiment.cell, experiment.gains, 0.01, plant="mujoco")
    assert result.info["plant"] == "mujoco"


def test_an_unknown_plant_and_a_compiled_one_are_refused() -> None:
    experiment = pair("planar2r")
    with refused(InputError, "plant"):
        experiment.simulate(0.01, plant="bullet")
    with refused(InputError, "plant", found="plant='mujoco'"):
        experiment.simulate(0.01, plant="mujoco", engine="compiled")
