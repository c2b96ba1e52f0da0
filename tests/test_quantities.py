"""Figures of single quantities show what they say: paths of tips, phase portraits, spectra, runs on runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from refusals import refused
from sliders import SCARA, load, pair

from synctrl import Cell, Coupling, Cubic, Experiment, Gains, Member, Result, load_robot
from synctrl.analysis.consistency import physical_consistency
from synctrl.errors import InputError
from synctrl.show import consistency, internal_forces, overlays, phase_portraits, spectra, tip_paths
from synctrl.show.overlays import ALWAYS
from synctrl.show.run_figures import ON_REQUEST
from synctrl.show.spectrum_figures import FEWEST, spectrum
from synctrl.simulation.result import LAYOUT


@pytest.fixture(scope="module")
def star() -> Result:
    return Experiment(small_cell(4, coupling=Coupling.star(4)), SMALL_GAINS, 0.1).simulate(dt=5e-3)


@pytest.fixture(scope="module")
def scaras(tmp_path_factory: pytest.TempPathFactory) -> Result:
    robot = load(tmp_path_factory.mktemp("scara"), "scara", SCARA, effort=30.0)
    return pair((robot, robot)).simulate(dt=2e-3)


def first(run: Result, count: int) -> Result:
    return replace(run, **{name: getattr(run, name)[:count].copy() for name in LAYOUT})


# -- paths of tips -----------------------------------------------------------------------------------------


def test_tips_are_drawn_where_the_robots_have_them(star):
    figure, robots = tip_paths(star), star.experiment.cell.robots
    for i, (panel, robot) in enumerate(zip(figure.axes, robots, strict=True)):
        actual, desired, start = panel.get_lines()
        tips = np.array([robot.tip_position(q[: robot.nv])[:2] for q in star.q[:, i]])
        np.testing.assert_allclose(actual.get_xydata(), tips)
        np.testing.assert_allclose(start.get_xydata(), tips[:1])
        np.testing.assert_allclose(desired.get_xydata(), star.x_desired[:, i])


def test_paths_in_space_are_seen_from_two_sides_and_all_panels_have_one_scale(scaras):
    panels = tip_paths(scaras).axes
    assert len(panels) == 4
    assert [panel.get_ylabel() for panel in panels] == ["y, m", "z, m"] * 2
    spans = [np.ptp(limits) for panel in panels for limits in (panel.get_xlim(), panel.get_ylim())]
    np.testing.assert_allclose(spans, spans[0])
    boxes = [panel.bbox for panel in panels]
    np.testing.assert_allclose([box.width / box.height for box in boxes], 1.0)
    for panel in panels:
        (left, right), (low, high) = panel.get_xlim(), panel.get_ylim()
        for x, y in (line.get_xydata().T for line in panel.get_lines()):
            assert left < x.min() and x.max() < right and low < y.min() and y.max() < high


def test_a_loaded_run_has_the_same_paths(star, tmp_path):
    again = Result.load(star.save(tmp_path / "run.npz"))
    for ours, theirs in zip(tip_paths(star).axes, tip_paths(again).axes, strict=True):
        for a, b in zip(ours.get_lines(), theirs.get_lines(), strict=True):
            np.testing.assert_allclose(a.get_xydata(), b.get_xydata(), atol=1e-12)


# -- phase portraits ---------------------------------------------------------------------------------------


def test_errors_that_vanish_as_the_gains_say_run_along_the_line(star):
    slope = float(star.info["gains"]["Lambda"])
    t = np.linspace(0.0, 0.1, 2001)
    decays = np.exp(-slope * t)[:, None, None] * np.ones((1, *star.tracking_error.shape[1:]))
    run = replace(first(star, 1), t=t, tracking_error=decays)
    for panel in phase_portraits(run).axes:
        (line,) = (each for each in panel.get_lines() if each.get_linestyle() == "--")
        ends = line.get_xydata()
        assert np.diff(ends[:, 1]) / np.diff(ends[:, 0]) == pytest.approx(-slope)
        e, rate = panel.get_lines()[0].get_xydata().T
        np.testing.assert_allclose(rate, -slope * e, rtol=1e-4)


def test_a_phase_portrait_needs_three_instants_that_are_apart(star):
    for count in (1, 2):
        with refused(InputError, f"run '{star.info['title']}'", found=count):
            phase_portraits(first(star, count))
    with refused(InputError, "result, t"):
        phase_portraits(replace(star, t=np.zeros_like(star.t)))


# -- spectra -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("cycles", [3, 10, 40])
def test_a_swing_has_its_amplitude_at_its_frequency_and_an_offset_does_not_matter(cycles):
    t = np.arange(256) * 1e-2
    swing = 7.0 + 0.3 * np.sin(2 * np.pi * cycles / 2.56 * t + 0.4)
    frequencies, amplitudes = spectrum(t, swing)
    assert frequencies[amplitudes.argmax()] == pytest.approx(cycles / 2.56)
    assert amplitudes.max() == pytest.approx(0.3)
    assert amplitudes[np.abs(frequencies - cycles / 2.56) > 1.5 / 2.56].max() < 1e-9


def test_instants_that_are_few_or_uneven_have_no_spectrum(star):
    with refused(InputError, "t", found=FEWEST - 1):
        spectra(first(star, FEWEST - 1))
    with refused(InputError, "t"):
        spectra(replace(star, t=star.t**2))


def test_units_that_differ_have_spectra_of_their_own(scaras):
    labels = [panel.get_ylabel() for panel in spectra(scaras).axes]
    assert sorted(labels) == sorted([f"amplitude, {unit}" for unit in ("deg", "mm", "deg", "mm", "N·m", "N")])


# -- estimates as bodies -----------------------------------------------------------------------------------


def test_eigenvalues_of_estimated_bodies_are_drawn_and_a_cell_without_bodies_is_refused(star):
    arm = load_robot("planar2r")

    def member(y: float) -> Member:
        way = Cubic([0.2, 0.8], [0.6, 1.2], duration=0.05)
        theta_hat0 = 0.5 * arm.inertial_parameters
        return Member(arm.placed(xyz=(0, y, 0)), way, q0=[0.2, 0.8], theta_hat0=theta_hat0)

    gains = Gains(Lambda=8, beta=8, K_r=2, K_eps=5, Gamma=0.01)
    run = Experiment(Cell([member(0), member(1)], Coupling.pair()), gains, 0.05).simulate(dt=5e-4)
    found = physical_consistency(run)
    for panel, values in zip(consistency(run).axes, found.smallest, strict=True):
        for line, expected in zip(panel.get_lines(), values.T, strict=False):
            np.testing.assert_array_equal(line.get_ydata(), expected)
        assert any(np.ptp(line.get_ydata()) == 0 == line.get_ydata()[0] for line in panel.get_lines())
    with refused(InputError, "experiment"):
        consistency(replace(run, experiment=None))


def test_what_is_not_carried_has_no_internal_force(star):
    with pytest.raises(InputError):
        internal_forces(star)


# -- runs on one another -----------------------------------------------------------------------------------


def test_every_run_is_drawn_in_its_colour_over_its_own_time(scaras):
    shorter = first(scaras, 20)
    found = overlays({"whole": scaras, "part": shorter})
    assert [*found] == [*ALWAYS]
    robot, lift = 0, 2
    panel = next(p for p in found["tracking_error"].axes if p.get_ylabel() == "e, mm")
    whole, part = panel.get_lines()
    assert whole.get_color() != part.get_color()
    np.testing.assert_allclose(whole.get_ydata(), 1e3 * scaras.tracking_error[:, robot, lift])
    np.testing.assert_array_equal(part.get_xdata(), shorter.t)


def test_runs_of_other_cells_and_unknown_figures_are_refused(scaras, star):
    with refused(InputError, "runs"):
        overlays({"one": scaras, "other": star}, "torque")
    with refused(InputError, "runs"):
        overlays({})
    with refused(InputError, "figure", found="estimate"):
        overlays({"one": star}, "estimate")


def test_figures_on_request_are_drawn_only_then(star):
    assert not {*star.plot()} & {*ON_REQUEST}
    assert [*star.plot("tip_path", "spectrum")] == ["tip_path", "spectrum"]
