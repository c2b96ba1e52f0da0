"""The section on promises: verdicts with their meaning, and bounds beside what they bound."""

from __future__ import annotations

from dataclasses import replace

import pytest
from theory_cells import coupling, experiment

from synctrl import Disturbance
from synctrl.analysis import certify
from synctrl.analysis.certify import MEANINGS, VERDICTS, Certificate
from synctrl.paper.promises_section import PROMISED, dissipation_table, promised_means
from synctrl.paper.report import Points, Section, number, write_page
from synctrl.paper.theory import CERTIFIED

PUSH = Disturbance(robot=0, torque=[0.5], start=0.02, stop=0.08)


@pytest.fixture(scope="module")
def certificates() -> dict[str, Certificate]:
    """Of a quiet run, a pushed one, and one without damping, of which nothing is promised."""
    made = experiment(coupling("pair", 2, 1), joints=1)
    runs = {"quiet": made, "pushed": replace(made, disturbances=[PUSH])}
    found = {name: certify(each.simulate(0.1, 1e-3)) for name, each in runs.items()}
    lost = replace(found["pushed"].dissipation, reason="K_r is 0")
    return {**found, "lost": replace(found["pushed"], verdict=VERDICTS[2], dissipation=lost)}


def test_every_promised_run_is_certified() -> None:
    assert set(PROMISED) <= set(CERTIFIED)


def test_each_run_has_its_verdict_and_what_that_means(certificates) -> None:
    assert [each.verdict for each in certificates.values()] == [*VERDICTS]
    blocks = promised_means(dict(zip(PROMISED, certificates.values(), strict=False)))
    (points,) = (block for block in blocks if isinstance(block, Points))
    for sentence, meaning in zip(points.sentences, MEANINGS, strict=True):
        assert meaning in sentence
    assert "Outside the theorem: torque from outside" in points.sentences[1]
    assert "Outside" not in points.sentences[0]


def test_a_bound_stands_beside_what_it_bounds_and_none_where_nothing_is_promised(certificates) -> None:
    quiet, pushed, lost = dissipation_table(certificates).rows
    for row, found in ((quiet, certificates["quiet"]), (pushed, certificates["pushed"])):
        acted = found.dissipation
        assert row[4:7] == (number(acted.X), number(acted.X_bound), f"{acted.X / acted.X_bound:.0%}")
        assert row[7:9] == (number(acted.rest), number(acted.rest_bound))
        assert acted.X_bound >= acted.X
    assert quiet[3] == "nothing"
    assert pushed[3] == "disturbance"
    assert lost.count("–") == 5


def test_runs_that_were_not_certified_are_left_out(certificates, tmp_path) -> None:
    blocks = promised_means({PROMISED[1]: certificates["pushed"], "another": certificates["quiet"]})
    text = write_page(tmp_path / "page.html", "page", [Section("promises", tuple(blocks))]).read_text("utf-8")
    assert text.count("<tr><th scope='row'>") == 1
