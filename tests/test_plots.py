"""Figures: what is drawn is what was computed, in the colours and line styles that are promised."""

from __future__ import annotations

import errno
import os
import re
from dataclasses import replace
from itertools import combinations, pairwise

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgb
from refusals import refused

from synctrl.errors import InputError, ResultError
from synctrl.experiments import a460_pair, planar_four
from synctrl.show.layout import cell_layout
from synctrl.show.plots import common_limits, joint_trajectories, save, sync_errors, tracking_errors
from synctrl.show.style import LINE_STYLES, PALETTE, display, line_style, robot_color


@pytest.fixture(scope="module")
def planar():
    return planar_four().simulate(0.2, dt=2e-3)


@pytest.fixture(scope="module")
def disturbed():
    return planar_four(disturbance="torque", synchronized=False).simulate(0.8, dt=2e-3)


@pytest.fixture(scope="module")
def pair():
    return a460_pair().simulate(0.2, dt=2e-3)


def lines(panel):
    """Lines of a panel that show a signal over time."""
    return [line for line in panel.get_lines() if len(line.get_xdata()) > 2]


def legend(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_colour_is_the_robot_and_line_style_the_axis(planar):
    (panel,) = tracking_errors(planar).axes
    drawn = {}
    for line in lines(panel):
        drawn[to_hex(line.get_color()), line.get_linestyle()] = line.get_ydata()
    assert len(drawn) == 8
    for robot in range(4):
        for axis in range(2):
            shown = drawn[robot_color(robot), line_style(axis)]
            np.testing.assert_array_equal(shown, 1e3 * planar.tracking_error[:, robot, axis])
    assert panel.get_ylabel() == "tracking error e, mm"


def test_the_legend_names_every_robot_axis_and_disturbance(planar, disturbed):
    assert legend(tracking_errors(planar)) == ["robot 1", "robot 2", "robot 3", "robot 4", "x", "y"]
    assert legend(sync_errors(planar)) == ["ε₁", "ε₂", "ε₃", "ε₄", "x", "y"]
    assert legend(tracking_errors(disturbed))[-1] == "torque on robot 1"


def test_a_disturbance_is_shaded_while_it_acts(disturbed):
    for panel in sync_errors(disturbed).axes:
        (window,) = panel.patches
        assert (window.get_x(), window.get_x() + window.get_width()) == (0.5, 0.75)


def test_angles_are_in_degrees_with_actual_solid_and_desired_dash_dot(pair):
    panels = joint_trajectories(pair, 1).axes
    assert [panel.get_ylabel() for panel in panels] == [f"joint{k}, deg" for k in (1, 2, 3)]
    for joint, panel in enumerate(panels):
        actual, desired = lines(panel)
        assert (actual.get_linestyle(), desired.get_linestyle()) == ("-", "-.")
        assert to_hex(actual.get_color()) == robot_color(1)
        np.testing.assert_allclose(actual.get_ydata(), np.rad2deg(pair.q[:, 1, joint]))
        np.testing.assert_allclose(desired.get_ydata(), np.rad2deg(pair.x_desired[:, 1, joint]))


@pytest.mark.parametrize("robot", [-1, 2, True, "robot 1"])
def test_a_robot_that_is_not_there_is_refused(pair, robot):
    with refused(InputError, "robot", found=robot):
        joint_trajectories(pair, robot)


def test_figures_that_are_compared_show_the_same_range(planar, disturbed):
    limits = common_limits("sync_error", planar, disturbed)
    for run in (planar, disturbed):
        assert sync_errors(run, limits).axes[0].get_ylim() == tuple(1e3 * np.array(limits))
        assert limits[0] <= run.sync_error.min() <= run.sync_error.max() <= limits[1]


def test_what_is_small_beside_its_counterpart_is_magnified_and_the_title_says_how_much(planar, disturbed):
    limits = common_limits("sync_error", planar, disturbed)
    assert len(sync_errors(disturbed, limits).axes) == 1
    above, below = sync_errors(planar, limits).axes
    factor = np.ptp(above.get_ylim()) / np.ptp(below.get_ylim())
    assert f"1/{factor:.2g} of the range" in below.get_title(loc="left")
    np.testing.assert_array_equal(lines(above)[0].get_ydata(), lines(below)[0].get_ydata())


def test_lines_that_coincide_are_all_seen(planar):
    equal = np.repeat(planar.tracking_error[:, :1], 4, axis=1)
    (panel,) = tracking_errors(replace(planar, tracking_error=equal)).axes
    widths = [line.get_linewidth() for line in sorted(lines(panel)[:4], key=lambda line: line.get_zorder())]
    assert all(below > above for below, above in pairwise(widths))


def test_the_same_run_gives_the_same_files(planar, tmp_path):
    one, two = (save(sync_errors(planar), tmp_path / name) for name in ("one", "two"))
    for a, b in zip(one, two, strict=True):
        assert a.stat().st_size > 1000
        assert a.read_bytes() == b.read_bytes()
    assert one[0].read_bytes().startswith(b"\x89PNG\r\n\x1a\n")


def test_a_picture_has_the_resolution_of_its_figure(planar, tmp_path):
    figure = sync_errors(planar)
    pixels = figure.get_size_inches() * figure.dpi // 1
    for _ in range(2):
        header = save(figure, tmp_path / "picture")[0].read_bytes()[16:24]  # width and height, in a PNG
        assert (np.frombuffer(header, ">u4") == pixels).all()


def test_a_vector_figure_holds_no_script_date_or_address_to_load(planar, tmp_path):
    text = save(cell_layout(planar), tmp_path / "layout")[1].read_text("utf-8")
    assert text.rstrip().endswith("</svg>")
    assert "<script" not in text
    assert "<dc:date>" not in text
    assert not re.search(r"""href\s*=\s*["'](?!#)""", text)


def test_drawing_leaves_the_settings_of_matplotlib_alone(planar, tmp_path):
    with matplotlib.rc_context({"axes.grid": False, "font.size": 17.0}):
        before = dict(matplotlib.rcParams)
        save(tracking_errors(planar), tmp_path / "figure")
        assert dict(matplotlib.rcParams) == before


def test_the_settings_of_the_user_leave_the_figures_alone(planar, tmp_path):
    plain = save(tracking_errors(planar), tmp_path / "plain")[1].read_bytes()
    with matplotlib.rc_context({"font.size": 30.0, "axes.facecolor": "black", "text.usetex": True}):
        assert save(tracking_errors(planar), tmp_path / "styled")[1].read_bytes() == plain


@pytest.mark.parametrize("name", ["$x", "$\\nonsense{$", "<b>&", "a_b^c"])
def test_names_are_text_and_never_formulas_or_markup(planar, tmp_path, name):
    info = dict(planar.info)
    info["robots"] = [{**robot, "name": name} for robot in info["robots"]]
    info["axes"] = ["x", "y"]
    named = replace(planar, info=info)
    for figure in (tracking_errors(named), joint_trajectories(named, 0), cell_layout(named)):
        save(figure, tmp_path / "named")
    text = tracking_errors(named).legends[0].get_texts()[0].get_text()
    assert text.replace(r"\$", "$") == name


def test_the_layout_shows_bases_reach_and_the_distances_at_the_end(planar):
    surroundings, cell = cell_layout(planar).axes
    texts = [text.get_text() for text in cell.texts]
    for name in planar.names:
        assert name in texts
    for i, j in planar.info["pairs"]:
        assert f"{np.linalg.norm(planar.x[-1, i] - planar.x[-1, j]):.3f} m" in texts
    assert {"5 m", "6 m"} <= {text.get_text() for text in surroundings.texts}
    for robot, base in enumerate(r.tip_position([0, 0]) for r in planar.experiment.cell.robots):
        reach = next(
            line
            for line in lines(cell)
            if line.get_linestyle() == ":" and to_hex(line.get_color()) == robot_color(robot)
        )
        distance = np.hypot(*(reach.get_xydata() - (base[:2] - [0.6, 0])).T)
        np.testing.assert_allclose(distance, 0.6, atol=1e-9)


def test_a_layout_needs_a_planar_run_and_its_experiment(planar, pair):
    with refused(InputError, "result", found=("joint1", "joint2", "joint3")):
        cell_layout(pair)
    with refused(InputError, "experiment", found="no experiment"):
        cell_layout(replace(planar, experiment=None))


def test_a_run_without_instants_and_a_folder_that_is_a_file_are_clear_errors(planar, tmp_path):
    nothing = {name: getattr(planar, name)[:0].copy() for name in ("t", "tracking_error")}
    with refused(InputError, f"run '{planar.info['title']}'", found=0):
        tracking_errors(replace(planar, **nothing))
    (tmp_path / "file").write_text("")
    with refused(ResultError, file=str(tmp_path / "file" / "figure"), found=os.strerror(errno.EEXIST)):
        save(tracking_errors(planar), tmp_path / "file" / "figure")


#: linear RGB as seen without red and without green receptors, after Vienot, Brettel and Mollon 1999
BLIND = {
    "nobody": np.eye(3),
    "protanopes": np.array([[0.11238, 0.88762, 0], [0.11238, 0.88762, 0], [0.00401, -0.00401, 1]]),
    "deuteranopes": np.array([[0.29275, 0.70725, 0], [0.29275, 0.70725, 0], [-0.02234, 0.02234, 1]]),
}
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def linear(color):
    c = np.array(to_rgb(color))
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def lab(rgb):
    """CIE L*a*b* of linear RGB: equal distances look equally different."""
    x, y, z = np.cbrt(TO_XYZ @ np.clip(rgb, 0, 1) / TO_XYZ.sum(axis=1))
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("who", BLIND)
def test_the_colours_of_four_robots_can_be_told_apart(who):
    for a, b in combinations(PALETTE[:4], 2):
        assert np.linalg.norm(lab(BLIND[who] @ linear(a)) - lab(BLIND[who] @ linear(b))) > 15, (a, b)


def test_colours_stand_out_from_white_and_repeat_when_robots_are_many():
    for color in PALETTE:
        assert 1.05 / (TO_XYZ[1] @ linear(color) + 0.05) >= 3.0, f"{color} is too pale on white"
    assert robot_color(len(PALETTE)) == robot_color(0)
    assert line_style(len(LINE_STYLES)) == line_style(0)


def test_units_are_the_ones_people_read():
    assert display("rad") == ("deg", np.rad2deg(1.0))
    assert display("m") == ("mm", 1000.0)
    assert display("N·m") == ("N·m", 1.0)
