"""The catalogue: each robot in it is a mechanism, described as its own file describes it."""

from __future__ import annotations

import warnings
from importlib import metadata

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

from synctrl.errors import InputError, MissingDependencyError, RobotError, RobotWarning
from synctrl.robots.catalog import CATALOG, catalog_names, load_description
from synctrl.robots.urdf import Description, urdf_folder
from synctrl.robots.urdf.packages import data_folder

JOINTS = {
    "planar2r": 2, "a460": 3, "a460_full": 6,
    "ur3": 6, "ur3_limited": 6, "ur3_gripper": 6, "ur5": 6, "ur5_limited": 6, "ur5_gripper": 6,
    "ur10": 6, "ur10_limited": 6, "panda": 7, "xarm7": 7, "kinova": 6, "z1": 6, "so100": 5, "so101": 5,
    "talos_arm": 6, "asr_twodof": 2,
}  # fmt: skip
TABLE_I = {  # joint angles in deg, and the wrist centre they mean, in m
    (73.334, 60.333, -169.812): (0.1325, 0.4427, 0.4849),
    (90.0, 63.609, -174.729): (0.0, 0.4435, 0.4843),
    (15.252, 71.683, -181.980): (0.3912, 0.1067, 0.5050),
    (-2.973, 74.107, -185.108): (0.3912, -0.0203, 0.5050),
}


def load(name: str) -> Description:
    """A robot of the catalogue, whatever it warns of."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        return load_description(name)


def states(model: pin.Model, count: int = 5):
    """Configurations anywhere, velocities and accelerations."""
    rng = np.random.default_rng(7)
    for _ in range(count):
        q = pin.integrate(model, pin.neutral(model), rng.uniform(-3, 3, model.nv))
        yield q, *rng.standard_normal((2, model.nv))


@pytest.mark.parametrize("name", JOINTS)
def test_a_robot_has_the_joints_of_its_arm(name):
    assert load(name).model.nv == JOINTS[name]


@pytest.mark.parametrize("name", catalog_names())
def test_a_robot_of_the_catalogue_has_its_joints_tip_and_shapes(name):
    description = load(name)
    assert description.name == name
    assert description.model.nv == description.model.njoints - 1
    assert description.tip == CATALOG[name].tip and description.tip in description.links
    assert len(description.visual.geometryObjects) == sum(
        len(link.visuals) for link in description.document.links
    )
    assert (description.model.effortLimit > 0).all() and (description.model.velocityLimit > 0).all()


@pytest.mark.parametrize("name", catalog_names())
def test_only_fingers_are_locked(name):
    assert all("finger" in joint or "gripper" in joint.lower() for joint in load(name).locked)


@pytest.mark.parametrize("name", catalog_names())
def test_the_mass_matrix_is_positive_definite_anywhere(name):
    model = load(name).model
    data = model.createData()
    for q, _, _ in states(model):
        np.linalg.cholesky(pin.crba(model, data, q))


@pytest.mark.parametrize("name", catalog_names())
def test_the_regressor_times_the_parameters_is_the_torque(name):
    model = load(name).model
    data = model.createData()
    parameters = np.concatenate([inertia.toDynamicParameters() for inertia in list(model.inertias)[1:]])
    for q, v, a in states(model):
        tau = pin.rnea(model, data, q, v, a)
        regressed = pin.computeJointTorqueRegressor(model, data, q, v, a) @ parameters
        np.testing.assert_allclose(regressed, tau, rtol=0, atol=1e-9 * abs(tau).max())


@pytest.mark.parametrize("name", catalog_names())
def test_a_robot_of_the_catalogue_moves_as_its_file_says(name):
    """Against Pinocchio's own reading of the file: torques with the locked joints at rest at zero."""
    entry, mine = CATALOG[name], load(name).model
    folder = urdf_folder() if entry.own else data_folder() / "example-robot-data" / "robots"
    full = pin.buildModelFromUrdf(str(folder / entry.file))
    assert set(full.names) == {*mine.names, *entry.locked}
    rows = [full.joints[full.getJointId(joint)].idx_v for joint in list(mine.names)[1:]]
    rng = np.random.default_rng(5)
    for q, v, a in rng.uniform(-2, 2, (3, 3, mine.nv)):
        whole = np.zeros((3, full.nv))
        whole[:, rows] = q, v, a
        theirs = torque(full, *whole)[rows]
        np.testing.assert_allclose(torque(mine, q, v, a), theirs, rtol=0, atol=1e-9 * abs(theirs).max())


def torque(model: pin.Model, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Inverse dynamics at joint positions counted from the neutral configuration."""
    return pin.rnea(model, model.createData(), pin.integrate(model, pin.neutral(model), q), v, a)


@pytest.mark.parametrize("name", sorted(set(catalog_names()) - {"so101"}))
@pytest.mark.filterwarnings("error")
def test_a_robot_of_the_catalogue_loads_without_a_warning(name):
    load_description(name)


def test_the_one_oddity_of_a_stock_file_is_said():
    with pytest.warns(RobotWarning, match="link 'gripper_frame_link', origin: <origin> is not read"):
        load_description("so101")


@pytest.mark.parametrize(("angles", "wrist"), TABLE_I.items())
def test_the_wrist_centres_of_table_one_come_out(angles, wrist):
    description = load("a460")
    model, q = description.model, np.radians(angles)
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    found = data.oMf[model.getFrameId("wrist")].translation
    np.testing.assert_allclose(found, wrist, atol=1e-4)
    assert (model.lowerPositionLimit < q).all() and (q < model.upperPositionLimit).all()


def test_the_a460_of_three_joints_is_the_reduction_of_the_one_of_six():
    three, six = load("a460"), load("a460_full")
    held = [six.model.getJointId(f"joint{k}") for k in (4, 5, 6)]
    reduced, shapes = pin.buildReducedModel(six.model, six.visual, held, pin.neutral(six.model))
    assert list(reduced.names) == list(three.model.names)
    for one, other in zip(reduced.inertias, three.model.inertias, strict=True):
        np.testing.assert_allclose(one.toDynamicParameters(), other.toDynamicParameters(), rtol=0, atol=1e-12)
    for one, other in zip(reduced.jointPlacements, three.model.jointPlacements, strict=True):
        assert one == other
    for limit in ("lowerPositionLimit", "upperPositionLimit", "effortLimit", "velocityLimit"):
        np.testing.assert_array_equal(getattr(reduced, limit), getattr(three.model, limit))
    wrists = [model.frames[model.getFrameId("wrist", pin.BODY)] for model in (reduced, three.model)]
    assert wrists[0].parentJoint == wrists[1].parentJoint
    assert wrists[0].placement.isApprox(wrists[1].placement, 1e-15)
    places = [
        sorted(tuple(np.round(g.placement.translation, 9)) for g in visual.geometryObjects)
        for visual in (shapes, three.visual)
    ]
    assert places[0] == places[1]


def test_the_last_three_axes_of_the_full_a460_meet_in_the_wrist_centre():
    model = load("a460_full").model
    data = model.createData()
    for q, _, _ in states(model):
        pin.framesForwardKinematics(model, data, q)
        wrist = data.oMf[model.getFrameId("wrist")].translation
        for joint in (4, 5, 6):
            np.testing.assert_allclose(data.oMi[joint].translation, wrist, atol=1e-12)


def test_the_planar_arm_feels_no_gravity_and_reaches_with_the_paper_s_lengths():
    description = load("planar2r")
    model = description.model
    data = model.createData()
    for q, _, _ in states(model):
        np.testing.assert_allclose(pin.computeGeneralizedGravity(model, data, q), 0, atol=1e-15)
        pin.framesForwardKinematics(model, data, q)
        tip = data.oMf[model.getFrameId("tip")].translation
        a, b = q[0], q[0] + q[1]
        expected = [0.3 * (np.cos(a) + np.cos(b)), 0.3 * (np.sin(a) + np.sin(b)), 0]
        np.testing.assert_allclose(tip, expected, atol=1e-15)


def test_an_unknown_name_lists_the_near_ones():
    with refused(RobotError, "robot", found="pandas"):
        load_description("pandas")


@pytest.mark.parametrize("path", ["no/such/robot", "robot.urdf"])
def test_a_text_that_looks_like_a_path_is_one(path):
    with refused(RobotError, None, file=path, line=None):
        load_description(path)


def test_a_path_is_read_as_a_file():
    description = load_description(urdf_folder() / "planar2r" / "planar2r.urdf")
    assert description.model == load("planar2r").model


def test_what_is_neither_name_nor_path_is_refused():
    with refused(InputError, "robot"):
        load_description(5)


@pytest.mark.parametrize("source", ["planar2r", urdf_folder() / CATALOG["planar2r"].file])
@pytest.mark.parametrize("value", [0, "joint1", ["joint1"]])
@pytest.mark.parametrize("option", ["locked", "inertials", "xacro_args"])
def test_what_is_no_mapping_is_refused_by_the_name_of_the_option(option, value, source):
    with refused(InputError, option):
        load_description(source, **{option: value})


@pytest.mark.parametrize("source", ["planar2r", urdf_folder() / CATALOG["planar2r"].file])
def test_a_tip_that_is_no_name_is_refused(source):
    with refused(InputError, "tip"):
        load_description(source, tip=3)


def test_folders_of_packages_are_asked_for_robots_of_the_catalogue_too():
    with refused(InputError, "package_dirs"):
        load_description("planar2r", package_dirs=3)


def test_without_example_robot_data_the_own_robots_load_and_the_others_say_what_is_missing(monkeypatch):
    def missing(name: str):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "distribution", missing)
    assert load_description("a460").model.nv == 3
    with refused(MissingDependencyError, "robot 'ur5'"):
        load_description("ur5")
