"""Figures by name: any run has them, with the right units, and all words have their place at any width."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from refusals import refused
from sliders import GANTRY, SCARA, load, pair
from test_panels import check_places

from synctrl import Coupling, Disturbance, Experiment, Result
from synctrl.errors import InputError
from synctrl.show.legends import columns_that_fit, pair_colors, shortened, text_width
from synctrl.show.run_figures import FIGURES, NARROWEST, Gallery
from synctrl.simulation.result import LAYOUT


@pytest.fixture(scope="module")
def scaras(tmp_path_factory: pytest.TempPathFactory) -> Result:
    robot = load(tmp_path_factory.mktemp("scara"), "scara", SCARA, effort=30.0)
    return pair((robot, robot)).simulate(dt=2e-3)


@pytest.fixture(scope="module")
def gantries(tmp_path_factory: pytest.TempPathFactory) -> Result:
    robot = load(tmp_path_factory.mktemp("gantry"), "gantry", GANTRY)
    return pair((robot, robot)).simulate(dt=2e-3)


@pytest.fixture(scope="module")
def star() -> Result:
    push = Disturbance(robot=1, torque=np.array([0.5, 0.0]), start=0.02, stop=0.06)
    cell = small_cell(4, coupling=Coupling.star(4))
    return Experiment(cell, SMALL_GAINS, 0.1, disturbances=(push,)).simulate(dt=5e-3)


def labels(figure) -> list[str]:
    return [panel.get_ylabel() for panel in figure.axes]


def words(figure) -> list[str]:
    legends = [*figure.legends, *(panel.get_legend() for panel in figure.axes if panel.get_legend())]
    return [text.get_text() for legend in legends for text in legend.get_texts()]


@pytest.mark.parametrize("width", [NARROWEST, 3.5])
@pytest.mark.parametrize("name", FIGURES)
def test_all_words_have_their_place_in_a_narrow_figure(scaras, name, width):
    figure = scaras.plot(name, width=width)[name]
    assert figure.get_figwidth() == width
    check_places(figure)


@pytest.mark.parametrize("name", FIGURES)
def test_names_of_any_length_keep_their_place(star, name):
    robots = [
        {
            **about,
            "name": f"{k} {'a very long name ' * 9}",
            "joints": [f"{j} {'joint' * 20}" for j in range(2)],
        }
        for k, about in enumerate(star.info["robots"])
    ]
    axes = [f"{k} {'coordinate ' * 9}" for k in range(2)]
    check_places(
        replace(star, info={**star.info, "robots": robots, "axes": axes}).plot(name, width=NARROWEST)[name]
    )


def test_a_run_has_all_figures_in_their_order_and_says_what_it_is(scaras):
    found = scaras.plot()
    assert isinstance(found, Gallery) and [*found] == [*FIGURES] and not found.missing
    assert repr(found) == f"Figures of 'slides': {', '.join(FIGURES)}"
    assert [*scaras.plot("torque")] == ["torque"]


def test_what_slides_is_drawn_in_millimetres_and_newtons(gantries):
    found = gantries.plot()
    assert labels(found["tracking_error"]) == ["tracking error e, mm"]
    assert labels(found["torque"]) == ["force, N"] * 2
    assert labels(found["path"]) == ["mm"] * 3
    assert [panel.get_title(loc="left") for panel in found["path"].axes] == ["rail", "bridge", "lift"]


def test_joints_of_different_units_have_panels_of_their_own(scaras):
    found = scaras.plot()
    assert labels(found["sync_error"]) == ["synchronization error ε, deg", "synchronization error ε, mm"]
    assert labels(found["torque"]) == ["torque, N·m", "force, N"] * 2
    assert labels(found["path"]) == ["deg", "deg", "mm", "deg"]
    lift = found["tracking_error"].axes[1].get_lines()[1:]
    for k, line in enumerate(lift):
        np.testing.assert_allclose(line.get_ydata(), 1e3 * scaras.tracking_error[:, k, 2])


def test_limits_of_torque_are_in_the_legend_and_drawn_where_torque_comes_near(scaras):
    figure = scaras.plot("torque")["torque"]
    assert words(figure)[:3] == ["shoulder, ±30", "elbow, ±30", "wrist, ±30"]
    levels = [float(line.get_ydata()[0]) for line in figure.axes[0].get_lines() if len(line.get_ydata()) == 2]
    tau = scaras.tau[:, 0, [0, 1, 3]]
    near = [sign * 30.0 for k in range(3) for sign in (1, -1) if (sign * tau[:, k]).max() > 15]
    assert levels == near and levels


def test_a_run_whose_limits_nobody_knows_says_so(scaras):
    robots = [{k: v for k, v in r.items() if k != "torque_limits"} for r in scaras.info["robots"]]
    found = replace(scaras, info={**scaras.info, "robots": robots}).plot()
    assert [*found] == [*FIGURES] and "robot 1, robot 2" in found.missing["torque limits"]
    assert "Not shown: torque limits" in repr(found) and "Not shown: torque limits" in found._repr_html_()


def test_a_figure_that_cannot_be_drawn_is_missing_by_name_and_refused_where_it_was_asked_for(scaras):
    astray = replace(scaras, theta_hat=np.full_like(scaras.theta_hat, 1e40))
    found = astray.plot()
    assert [*found] == [name for name in FIGURES if name != "estimates"]
    assert "went astray" in found.missing["estimates"]
    with refused(InputError, f"run '{scaras.info['title']}', theta_hat", found=1e40):
        astray.plot("estimates")


def test_nothing_logged_an_unknown_name_and_no_width_are_refused(scaras):
    empty = replace(scaras, **{name: getattr(scaras, name)[:0] for name in LAYOUT})
    with refused(InputError, f"run '{scaras.info['title']}'", found=0):
        empty.plot()
    with pytest.raises(InputError) as caught:
        scaras.plot("torques")
    assert caught.value.subject == "figure"
    for width in (2.0, float("nan")):
        with pytest.raises(InputError) as caught:
            scaras.plot(width=width)
        assert caught.value.subject == "width"


def test_estimates_that_move_most_are_drawn_and_named(star):
    figure = star.plot("estimates")["estimates"]
    moved = np.ptp(star.theta_hat[:, 0], axis=0)
    names = star.info["robots"][0]["parameters"]
    shown = words(figure)[:6]
    assert {*shown} == {names[k] for k in np.argsort(-moved, kind="stable")[:6]}


def test_a_loaded_run_has_the_same_figures(scaras, tmp_path):
    again = Result.load(scaras.save(tmp_path / "run.npz"))
    ours, theirs = (run.plot("torque").save(tmp_path / name) for run, name in ((scaras, "a"), (again, "b")))
    assert [file.name for file in ours] == ["torque.png", "torque.svg"]
    assert [file.read_bytes() for file in ours] == [file.read_bytes() for file in theirs]
    assert [*again.plot()] == [*FIGURES]


def test_a_notebook_shows_pictures_and_no_markup_of_names(scaras):
    run = replace(scaras, info={**scaras.info, "title": "<script>"})
    html = run.plot("path", width=3.5)._repr_html_()
    assert html.count("data:image/png;base64,") == 1 and "<script" not in html


def test_pairs_have_different_colours(star):
    kinds = (Coupling.star(4), Coupling.star(4, 3), Coupling.ring(4), Coupling.chain(4), Coupling.complete(4))
    for coupling in kinds:
        run = replace(star, info={**star.info, "pairs": coupling.edges.tolist()})
        assert len({*pair_colors(run)}) == coupling.pairs


def test_a_legend_has_as_many_columns_as_fit():
    assert columns_that_fit(["a"] * 5, 6.4) == 5 and columns_that_fit(["a"] * 5, 1.2) == 2
    assert columns_that_fit(["long " * 30, "b"], 3.5) == 1 and columns_that_fit(["a"] * 30, 100.0) == 7


def test_words_are_cut_off_where_there_is_no_room():
    assert shortened("elbow", 100.0, 9) == "elbow" and text_width("  ", 9) == 0
    cut = shortened("shoulder_pan_joint", 50.0, 9)
    assert cut.endswith("…") and text_width(cut, 9) <= 50.0 and "shoulder".startswith(cut[:4])
