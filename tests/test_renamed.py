"""What had another name in version 0.1 still works, and warns with the name of today."""

from __future__ import annotations

import warnings
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from synctrl import Controller
from synctrl.control.adaptation import Natural
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, planar_four
from synctrl.renamed import names_elsewhere
from synctrl.robots.urdf import urdf_folder

#: names by the module that had them, and the module that has them now
MOVED = {
    "synctrl.control.controller": ("synctrl.control.laws.sun_mills", ["REFERENCE_ACCELERATIONS"]),
    "synctrl.show.lyapunov_plots": ("synctrl.analysis.lyapunov", ["ENERGIES", "POWERS", "THEOREM"]),
    "synctrl.robots.robot": ("synctrl.robots.catalog", ["load_robot"]),
    "synctrl.show.plots": ("synctrl.show.legends", ["WIDE", "NARROW"]),
    "synctrl.show.scene": ("synctrl.show.shown", ["NOTEBOOK_LIMIT"]),
    "synctrl.simulation.simulate": ("synctrl.simulation.engines", ["run_reference"]),
    "synctrl.coupling.weights": ("synctrl.coupling.desired", ["check_weights"]),
    "synctrl.tasks.rotations": ("synctrl.checks", ["rotation_matrix"]),
}
#: names by the module that had them, the module that has them now, and what they are called there
RENAMED = [
    ("synctrl.analysis.lyapunov", "lyapunov_of", "synctrl.analysis.lyapunov", "lyapunov"),
    ("synctrl.analysis.convergence", "convergence_of", "synctrl.analysis.convergence", "convergence"),
    (
        "synctrl.analysis.gain_condition",
        "gain_condition_of",
        "synctrl.analysis.gain_condition",
        "gain_condition",
    ),
    ("synctrl.analysis.claims", "Quantity", "synctrl.paper.claims", "Finding"),
    ("synctrl.analysis.judge", "Comparison", "synctrl.paper.judge", "Agreement"),
    ("synctrl.experiments.batch", "Job", "synctrl.paper.reproduction", "PlannedRun"),
    ("synctrl.experiments.reproduction", "JOBS", "synctrl.paper.reproduction", "PLANNED"),
    ("synctrl.experiments.reproduction", "judge_jobs", "synctrl.paper.reproduction", "judge_runs"),
    ("synctrl.sweep.distributions", "Distribution", "synctrl.sweep.distributions", "Values"),
    ("synctrl.compiled.engine", "Block", "synctrl.compiled.engine", "DesiredStretch"),
    ("synctrl.show.report", "Row", "synctrl.paper.report", "SideBySide"),
    ("synctrl.show.shapes", "Shape", "synctrl.show.shapes", "Solid"),
    ("synctrl.robots.mechanism", "Joint", "synctrl.robots.mechanism", "MechanismJoint"),
    ("synctrl.simulation.recorder", "describe", "synctrl.simulation.recorder", "describe_run"),
]
#: what version 0.1 exported
EXPORTED = {
    "synctrl": (
        "Attached AxisRotation BaseParameters CartesianSpace Cell Circle "
        "Controller Coupling Cubic Damping Disturbance Experiment "
        "ExponentialApproach Friction FrictionParameters FullParameters "
        "FunctionOrientation FunctionTrajectory Gains Hold JointSpace "
        "LinearParameters Member Payload PoseSpace PoseTrajectory Redundancy "
        "Result Robot SynchronizationFunction SynctrlError inverse_kinematics "
        "load_robot simulate"
    ),
    "synctrl.analysis": "Certificate certify",
    "synctrl.experiments": (
        "a460_full_pair a460_pair mixed_four mobile_robot panda_four planar_four "
        "quadratic_analysis rigid_object ur5_payload"
    ),
    "synctrl.show.animation": "payload_pair_scene planar_scene",
    "synctrl.show.plots": (
        "common_limits joint_trajectories new_figure plain save style sync_errors tracking_errors"
    ),
    "synctrl.sweep": (
        "Choice Factor Grid LogUniform Normal Sweep Uniform control_period "
        "disturbance_scale disturbance_start gain gain_scale initial_estimates "
        "initial_positions initial_velocities load model_error trajectories "
        "true_parameters weights"
    ),
    "synctrl.sweep.variations": "scaled_coupling",
    "synctrl.sweep.evaluation": "kept_file",
    "synctrl.tune": "Tuned tune",
}


@pytest.mark.parametrize("module", EXPORTED)
def test_what_version_0_1_exported_is_there_and_warns_of_nothing(module):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        missing = [name for name in EXPORTED[module].split() if not hasattr(import_module(module), name)]
    assert not missing


@pytest.mark.parametrize(("old", "name"), [(old, name) for old in MOVED for name in MOVED[old][1]])
def test_a_name_that_has_moved_is_the_same_thing_and_says_where_it_is(old, name):
    with pytest.warns(DeprecationWarning, match=f"{old}.{name} is deprecated: use {MOVED[old][0]}.{name}"):
        found = getattr(import_module(old), name)
    assert found is getattr(import_module(MOVED[old][0]), name)


@pytest.mark.parametrize(("old", "name", "home", "today"), RENAMED)
def test_a_name_that_is_another_one_now_is_the_same_thing_and_says_which(old, name, home, today):
    with pytest.warns(DeprecationWarning, match=f"{home}.{name} is deprecated: use {home}.{today}"):
        found = getattr(import_module(old), name)
    assert found is getattr(import_module(home), today)


def test_a_document_is_read_from_its_file_as_before():
    reader = import_module("synctrl.robots.urdf.reader")
    file = urdf_folder() / "planar2r" / "planar2r.urdf"
    with pytest.warns(DeprecationWarning, match=r"read_document is deprecated: use .*reader\.read_text"):
        document = reader.read_document(file)
    assert document == reader.read_text(file, file.read_bytes())


@pytest.mark.parametrize("old", MOVED)
def test_other_names_are_as_unknown_as_before(old):
    with pytest.raises(
        AttributeError, match=f"module '{old}' has no attribute 'nothing'"
    ):  # as Python says it
        import_module(old).nothing  # noqa: B018


def test_arguments_of_the_papers_cells_have_the_places_that_they_had():
    for made in (
        a460_pair(True, True, None, "paper", "task"),
        planar_four(True, None, 0.1, "text", None, "paper", "task"),
    ):
        assert (made.reference_acceleration, made.k_r_space) == ("paper", "task")


@pytest.fixture(scope="module")
def seen():
    """A controller and what it is asked."""
    experiment = a460_pair()
    state = experiment.closed_loop().controller
    cell = experiment.cell
    asked = {
        "reference": cell.references(np.array([0.5]))[0],
        "motion": np.stack((cell.q0, cell.v0)),
        "integral": state.network.start(),
    }
    return Controller(cell, experiment.gains), asked


def test_arguments_and_results_of_the_controller_have_their_old_names(seen):
    controller, asked = seen
    z = controller.adaptation.start()
    new = controller.evaluate(z=z, **asked)
    with pytest.warns(DeprecationWarning, match=r"evaluate\(z=\.\.\.\)"):
        old = controller.evaluate(theta_hat=z, **asked)
    np.testing.assert_array_equal(old.tau, new.tau)
    with pytest.warns(DeprecationWarning, match="z_dot"):
        np.testing.assert_array_equal(old.theta_hat_dot, new.z_dot)
    with pytest.warns(DeprecationWarning, match="adaptation.Gamma"):
        assert controller.Gamma is controller.adaptation.Gamma


def test_another_adaptation_has_no_gamma():
    experiment = a460_pair(adaptation=Natural(0.1))
    controller = Controller(experiment.cell, experiment.gains, adaptation=experiment.adaptation)
    with pytest.warns(DeprecationWarning), pytest.raises(AttributeError):
        controller.Gamma  # noqa: B018


def test_names_of_today_warn_of_nothing(seen):
    controller, asked = seen
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        signals = controller.evaluate(z=controller.adaptation.start(), **asked)
        assert signals.z_dot.shape == signals.theta_hat.shape


def test_the_warning_has_the_line_of_whoever_asks():
    with pytest.warns(DeprecationWarning) as caught:
        from synctrl.show.plots import WIDE  # noqa: F401
    assert {Path(each.filename) for each in caught} == {Path(__file__)}


def test_an_argument_under_both_of_its_names_is_refused(seen):
    controller, asked = seen
    z = controller.adaptation.start()
    with pytest.raises(TypeError, match="under two names, 'theta_hat' and 'z'"):  # a TypeError has no data
        controller.evaluate(z=z, theta_hat=z, **asked)


@pytest.mark.parametrize("missing", ["z", "integral"])
def test_an_argument_that_is_missing_is_named(missing, seen):
    controller, asked = seen
    given = {**asked, "z": controller.adaptation.start()}
    given.pop(missing)
    with refused(InputError, missing, found=None):
        controller.evaluate(**given)


def test_a_home_is_looked_up_only_when_it_is_asked_for():
    find = names_elsewhere("synctrl.old", ".nowhere", "thing")
    with pytest.raises(ModuleNotFoundError):
        find("thing")


def test_a_load_of_0_1_is_a_payload_that_is_there_from_the_beginning():
    from synctrl.robots.payload import Load, Payload

    with pytest.warns(DeprecationWarning, match=r"payload\.Load is deprecated: use .*Payload"):
        load = Load(2.0, com=(0.1, 0.0, 0.0), frame="tool")
    assert isinstance(load, Payload) and (load.mass, load.frame, load.start) == (2.0, "tool", 0.0)
