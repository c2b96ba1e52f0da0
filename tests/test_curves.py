"""Figures of tasks of assembly show what a run logged, and no other run has them; runs lie on one another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from test_carried_scene import run, with_output  # noqa: F401
from test_panels import check_places

from synctrl import Result
from synctrl.errors import InputError
from synctrl.show.assembly_figures import (
    CURVES,
    internal_force_curves,
    object_error_curves,
    output_curves,
)
from synctrl.show.curves import overlay
from synctrl.show.panels import WIDTH
from synctrl.show.run_figures import NARROWEST
from synctrl.tasks.rotations import exp, quaternion


def off(run: Result, by: np.ndarray) -> Result:  # noqa: F811
    """The run whose object should have been off by a displacement, m, and a rotation vector, rad, (6,)."""
    from synctrl.assembly.body import place_of

    place, R = place_of(run.outputs["object_pose"])
    desired = np.hstack([place + by[:3], quaternion(exp(by[3:]) @ R)])
    return replace(run, outputs={**run.outputs, "object_desired": desired})


def test_the_error_of_the_object_is_desired_less_actual(run):  # noqa: F811
    by = np.array([1e-3, -2e-3, 3e-3, 0.01, 0.02, -0.03])
    position, turned = object_error_curves(off(run, by))
    np.testing.assert_allclose(position.values, np.tile(1e3 * by[:3], (len(run.t), 1)), atol=1e-9)
    np.testing.assert_allclose(turned.values, np.tile(np.rad2deg(by[3:]), (len(run.t), 1)), atol=1e-9)


def test_sizes_of_force_and_moment_are_drawn_for_each_hand(run):  # noqa: F811
    force, moment = internal_force_curves(run)
    inside = run.outputs["internal_force"]
    for k in range(2):
        np.testing.assert_allclose(force.values[:, k] ** 2, (inside[:, k, :3] ** 2).sum(axis=1))
        np.testing.assert_allclose(moment.values[:, k] ** 2, (inside[:, k, 3:] ** 2).sum(axis=1))
    pins = with_output(run, "internal_force", inside[..., :2], "N", ("grasp", "coordinate"))
    (only,) = internal_force_curves(pins)
    assert only.names == run.names


def test_a_run_has_the_figures_of_what_it_logged_and_no_others(run):  # noqa: F811
    assert {"internal_force"} == set(run.plot()) & set(CURVES)  # nobody said where the plate should be
    assert not run.plot().missing.keys() & set(CURVES)
    told = off(run, np.zeros(6))
    gap = with_output(told, "gap_error", np.linspace(0, 1e-3, len(run.t)), "m", ())
    assert set(gap.plot()) & set(CURVES) == {"internal_force", "object_error", "gap_error"}
    with refused(InputError, f"run '{run.info['title']}', outputs, gap_error"):
        run.plot("gap_error")


@pytest.mark.parametrize("shape", [(), (1,), (3,), (2, 3)])
def test_any_output_becomes_as_many_curves_as_it_has_entries(run, shape):  # noqa: F811
    values = np.random.default_rng(0).normal(size=(len(run.t), *shape))
    named = with_output(run, "bead_error", values, "m", tuple(f"axis {k}" for k in range(len(shape))))
    (curves,) = output_curves(named, "bead_error")
    assert curves.label == "mm" and len({*curves.names}) == len(curves.names)
    np.testing.assert_allclose(curves.values, 1e3 * values.reshape(len(run.t), -1))
    for width in (NARROWEST, WIDTH):
        check_places(named.plot("bead_error", width=width)["bead_error"])


def test_runs_lie_on_one_another_in_a_colour_each_as_far_as_they_go(run):  # noqa: F811
    shorter = run.decimated(4)
    figure = overlay(internal_force_curves, {"one": run, "a $much longer$ name": shorter})
    check_places(figure)
    for panel, curves in zip(figure.axes, internal_force_curves(run), strict=True):
        lines = panel.get_lines()
        colors = [line.get_color() for line in lines]
        assert colors[0] == colors[1] != colors[2] == colors[3]
        assert lines[0].get_linestyle() == lines[2].get_linestyle() != lines[1].get_linestyle()
        np.testing.assert_array_equal(lines[1].get_ydata(), curves.values[:, 1])
        np.testing.assert_array_equal(lines[3].get_xdata(), shorter.t)


def test_runs_that_have_not_the_same_curves_are_not_laid_on_one_another(run):  # noqa: F811
    inside = run.outputs["internal_force"][..., :2]
    pins = with_output(run, "internal_force", inside, "N", ("grasp", "coordinate"))
    for runs in ({}, [run], {"one": run, "pins": pins}):
        with refused(InputError, "runs"):
            overlay(internal_force_curves, runs)
