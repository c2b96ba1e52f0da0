"""The page's sections on the theory: every run has its verdict, and the tables show the trials."""

from __future__ import annotations

import pickle
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from theory_cells import coupling, experiment

from synctrl import Disturbance
from synctrl.analysis import Certificate, Comparison, certify, compare
from synctrl.analysis.certify import VERDICTS
from synctrl.control.laws import SlotineLi
from synctrl.errors import ResultError
from synctrl.paper.report import SideBySide, Table, write_page
from synctrl.paper.reproduction import PLANNED
from synctrl.paper.saved_runs import SavedRuns
from synctrl.paper.theory import CERTIFIED, certificate_section, draw_certificate, examined
from synctrl.show.lyapunov_plots import growth_mark, lyapunov_figure

PUSH = Disturbance(robot=0, torque=-60.0, start=0.01, stop=0.03)


@pytest.fixture(scope="module")
def certificates() -> dict[str, Certificate]:
    link = coupling("ring", 4, 2)
    runs = {"free": experiment(link), "pushed": experiment(link, disturbances=(PUSH,))}
    return {name: certify(run.simulate(0.04, 1e-3)) for name, run in runs.items()}


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    return compare(experiment(coupling("pair", 2, 1), joints=1), [SlotineLi()], duration=0.05, dt=2.5e-3)


def test_the_section_has_a_figure_and_a_verdict_for_every_run(certificates, tmp_path: Path) -> None:
    for name, certificate in certificates.items():
        assert draw_certificate(name, certificate, tmp_path) == tmp_path / f"lyapunov_{name}.svg"
    section = certificate_section(certificates, tmp_path)
    page = write_page(tmp_path / "page.html", "page", [section]).read_text()
    assert page.count("<img") == len(certificates)
    table = next(block for block in section.blocks if isinstance(block, Table))
    assert [row[1] for row in table.rows] == [*VERDICTS[:2]]
    assert all(row[-1] == "not estimated" or len(row[-1]) < 20 for row in table.rows)
    assert "V first grows at t = 0.01" in page


def test_an_odd_number_of_figures_stands_in_one_grid_and_none_alone(certificates, tmp_path: Path) -> None:
    three = {**certificates, "third": certificates["free"]}
    rows = [block for block in certificate_section(three, tmp_path).blocks if isinstance(block, SideBySide)]
    assert [len(row.blocks) for row in rows] == [3]


def test_the_figure_shows_the_terms_that_act_and_marks_the_growth(certificates) -> None:
    figure = lyapunov_figure(certificates["free"].lyapunov)
    labels = [line.get_label() for line in figure.axes[1].get_lines()]
    assert "damping" in labels
    assert "disturbance" not in labels
    pushed = certificates["pushed"]
    figure = growth_mark(lyapunov_figure(pushed.lyapunov), pushed.growth)
    assert "disturbance" in [line.get_label() for line in figure.axes[1].get_lines()]
    assert any("disturbance" in text.get_text() for text in figure.axes[0].texts)
    shown = next(line for line in figure.axes[0].get_lines() if line.get_label() == "V")
    np.testing.assert_array_equal(shown.get_ydata(), pushed.lyapunov.V)


def test_numbers_beside_the_powers_do_not_overlap(certificates) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    for certificate in certificates.values():
        figure = lyapunov_figure(certificate.lyapunov)
        FigureCanvasAgg(figure).draw()
        panel = figure.axes[1]
        low, high = panel.get_ylim()
        labels = [tick.label1 for tick in panel.yaxis.get_major_ticks() if low <= tick.get_loc() <= high]
        boxes = sorted(((b := label.get_window_extent()).y0, b.y1) for label in labels if label.get_text())
        assert len(boxes) > 2
        assert all(top < bottom for (_, top), (bottom, _) in pairwise(boxes))


def test_a_run_in_which_nothing_happens_can_be_drawn() -> None:
    still = experiment(coupling("pair", 2, 1), joints=1, gravity=0.0, known=1.0)
    record = certify(still.simulate(2e-3, 1e-3)).lyapunov
    assert len(lyapunov_figure(record).axes) == 2


def test_certificates_and_comparisons_travel_between_processes(certificates, comparison: Comparison) -> None:
    for name, certificate in certificates.items():
        assert str(pickle.loads(pickle.dumps(certificate))) == str(certificates[name])
    assert pickle.loads(pickle.dumps(comparison)).as_dict() == comparison.as_dict()


def test_every_run_of_the_figures_is_certified() -> None:
    assert set(CERTIFIED) <= set(PLANNED)
    assert {name for name in PLANNED if name.endswith(("synchronized", "independent", "disturbed"))} < set(
        CERTIFIED
    )


def test_a_missing_run_is_a_clear_error(tmp_path: Path) -> None:
    with refused(ResultError, file=str(tmp_path / "planar_four_synchronized.npz")):
        runs = SavedRuns(tmp_path, ["planar_four_synchronized"])
        examined("planar_four_synchronized", runs, tmp_path)
