"""Laws are compared fairly: what is made equal is equal, and words follow the numbers."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from theory_cells import coupling, experiment

from synctrl import Disturbance, Friction
from synctrl.analysis import Comparison, compare, side_by_side
from synctrl.analysis.comparison import sizes_of, undisturbed
from synctrl.analysis.free_gain import factor_for, free_gain, scaled, slowest_rate, under
from synctrl.analysis.trial_rows import Row
from synctrl.analysis.verdict import about_gravity, sentences, summary
from synctrl.control.laws import ChungSlotine, PDGravity, SlotineLi, SunMills
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, planar_four

RUN = {"duration": 0.1, "dt": 2e-3}
PUSH = Disturbance(robot=0, torque=[0.5], start=0.02, stop=0.08)


def small(**changes):
    return replace(experiment(coupling("pair", 2, 1), joints=1), **changes)


@pytest.fixture(scope="module")
def found() -> Comparison:
    laws = {"alone": SlotineLi(), "damped": ChungSlotine(0.5), "not damped": ChungSlotine(0.0)}
    return compare(small(disturbances=[PUSH]), laws, **RUN)


def rows(found: Comparison, law: str) -> dict[str, Row]:
    return {row.rule: row for row in found.rows if row.law == law}


def test_what_a_rule_makes_equal_is_equal_in_the_quiet_run(found: Comparison) -> None:
    ours = found.rows[0].quiet
    solved = [row for row in found.rows[1:] if row.value is not None and row.rule != "equal pole"]
    assert {row.rule for row in solved} == {"equal peak torque", "equal tracking"}
    for row in solved:
        size = {"equal peak torque": "peak_torque", "equal tracking": "tracking_rms"}[row.rule]
        assert getattr(row.quiet, size) == pytest.approx(getattr(ours, size), rel=1e-2)


def test_a_law_without_a_gain_of_its_own_has_the_lambda_of_the_first_at_equal_pole(found: Comparison) -> None:
    row = rows(found, "alone")["equal pole"]
    assert (row.gain, row.value) == ("Lambda", found.rows[0].value)


def test_a_gain_that_cannot_be_solved_for_is_a_row_that_says_so(found: Comparison) -> None:
    row = rows(found, "not damped")["equal peak torque"]
    assert (row.value, row.quiet, row.disturbed) == (None, None, None)
    assert "K_2" in row.remark
    assert any(row.remark in sentence for sentence in found.verdict)


def test_a_row_is_the_run_that_its_gain_makes(found: Comparison) -> None:
    row = rows(found, "alone")["equal tracking"]
    whole = under(small(disturbances=[PUSH]), SlotineLi())
    whole = replace(whole, gains=whole.gains.replace(Lambda=row.value))
    assert sizes_of(whole.simulate(**RUN)) == row.disturbed
    assert sizes_of(undisturbed(whole).simulate(**RUN)) == row.quiet


def test_disturbances_show_in_the_disturbed_runs_alone(found: Comparison) -> None:
    calm = compare(small(), [SlotineLi()], **RUN)
    assert calm.situations == ("quiet",)
    assert calm.rows[0].quiet == found.rows[0].quiet
    assert found.rows[0].disturbed != found.rows[0].quiet


def test_friction_that_the_model_has_stays_in_the_quiet_runs_and_other_friction_does_not() -> None:
    unknown, known = (undisturbed(a460_pair(adapt_friction=knows)) for knows in (False, True))
    assert not any(m.friction.viscous.any() or m.friction.coulomb.any() for m in unknown.cell.members)
    assert known.cell.members[0].friction == a460_pair().cell.members[0].friction != Friction()
    np.testing.assert_array_equal(known.cell.theta_hat0, a460_pair(adapt_friction=True).cell.theta_hat0)


def test_the_slowest_mode_of_a_spring_and_a_damper_is_that_of_its_quadratic() -> None:
    run = under(small(), PDGravity(0.2))
    K_r, rates = float(run.gains.K_r), []
    for robot in run.cell.robots:
        M = robot.mass_matrix(np.zeros(1))[0, 0]
        rates.append((K_r - np.sqrt(K_r**2 - 4 * M * 0.2)) / (2 * M))
    assert slowest_rate(run) == pytest.approx(min(rates))
    assert slowest_rate(scaled(run, 0.5)) < slowest_rate(run)


def test_the_pole_that_is_made_equal_is_that_of_the_first_law_whichever_it_is() -> None:
    first = under(small(), PDGravity(0.2))
    row = compare(first, [SlotineLi()], ["equal pole"], **RUN).rows[1]
    assert row.value == pytest.approx(slowest_rate(first)) != first.gains.Lambda


def test_damping_in_task_space_stays_there_and_is_in_the_slowest_mode() -> None:
    """With M q'' + J^T (K_r q' + K_p q) = 0 and K_p = a K_r, modes tend to a pole at -a as K_r grows."""
    arms = planar_four()
    stiff = arms.gains.replace(K_r=1e4)
    for said in ({"k_r_space": "task"}, {"law": SunMills(k_r_space="task")}):
        run = under(replace(arms, gains=stiff, **said), PDGravity(5e4))
        assert run.closed_loop().controller.k_r_space == "task"
        assert slowest_rate(run) == pytest.approx(5.0, rel=1e-2)
    assert under(arms, PDGravity(5e4)).closed_loop().controller.k_r_space == "joint"


@pytest.mark.parametrize(
    "law", [SlotineLi(), ChungSlotine(0.4), PDGravity(3.0)], ids=lambda law: type(law).__name__
)
def test_scaling_multiplies_the_free_gain_and_nothing_else(law) -> None:
    run = under(small(), law)
    (name, value), (again, twice) = free_gain(run), free_gain(scaled(run, 2.0))
    assert (name, again) == (name, name)
    np.testing.assert_allclose(twice, 2 * np.asarray(value))
    other = "K_r" if name == "Lambda" else "Lambda"
    np.testing.assert_array_equal(getattr(scaled(run, 2.0).gains, other), getattr(run.gains, other))


@pytest.mark.parametrize("root", [0.2, 1.0, 7.0])
def test_the_factor_is_the_root_of_the_excess(root: float) -> None:
    assert factor_for(lambda factor: factor / root - 1) == pytest.approx(root, rel=1e-3)


def test_a_jump_over_zero_is_no_root() -> None:
    assert factor_for(lambda factor: -0.5 if factor < 3 else float("inf")) is None


def test_laws_that_are_none_or_have_the_same_name_are_refused() -> None:
    for laws in ([], [SlotineLi(), SlotineLi()], [SlotineLi]):
        with refused(InputError, "laws"):
            compare(small(), laws, **RUN)


def test_the_verdict_follows_the_numbers(found: Comparison) -> None:
    ours, row = found.rows[0], rows(found, "alone")["equal pole"]
    factors = {"tracking_rms": 4.0, "tracking_peak": 3.0, "sync_rms": 8.0, "sync_peak": 5.0}
    for power, word in ((1, "larger"), (-1, "smaller")):
        sizes = {name: factor**power * getattr(ours.quiet, name) for name, factor in factors.items()}
        changed = [ours, replace(row, quiet=replace(row.quiet, **sizes))]
        (first,) = sentences(changed, ["quiet"], "N·m")
        assert first.endswith(" N·m of torque.")
        for said in ("RMS e 4", "peak e 3", "RMS ε 8", "peak ε 5"):
            assert f"{said} times {word}" in first
        assert summary(changed, ["quiet"]).startswith("Better") == (word == "smaller")
        for peak in ("tracking_peak", "sync_peak"):
            sizes_with_peak = replace(row.quiet, **sizes | {peak: 2 * getattr(ours.quiet, peak)})
            assert not summary([ours, replace(row, quiet=sizes_with_peak)], ["quiet"]).startswith("Better")
    missing = [ours, rows(found, "not damped")["equal peak torque"]]
    assert not summary(missing, ["quiet"]).startswith("Better")  # what could not be run is not better


def test_rules_that_are_left_out_have_no_rows_and_unknown_ones_are_refused() -> None:
    few = compare(small(), [SlotineLi()], ["equal pole"], **RUN)
    assert [row.rule for row in few.rows] == ["as given", "equal pole"]
    with refused(InputError, "rules"):
        compare(small(), [SlotineLi()], ["equal luck"], **RUN)


def test_a_law_that_wants_exact_gravity_is_compared_without_adaptation() -> None:
    pushed = small(disturbances=[PUSH])
    (row,) = compare(pushed, [PDGravity(3.0)], ["equal pole"], **RUN).rows[1:]
    gains = pushed.gains.independent()
    still, learning = (
        replace(pushed, law=PDGravity(row.value), gains=gains.replace(Gamma=Gamma))
        for Gamma in (0.0, gains.Gamma)
    )
    assert sizes_of(still.simulate(**RUN)) == row.disturbed != sizes_of(learning.simulate(**RUN))
    assert sizes_of(undisturbed(still).simulate(**RUN)) == row.quiet


def test_experiments_side_by_side_are_rows_of_what_each_does(found: Comparison) -> None:
    whole = small(disturbances=[PUSH])
    loose = replace(whole, gains=whole.gains.replace(K_eps=0.0))
    rows = side_by_side({"whole": whole, "without K_eps": loose, "again": whole}, **RUN).rows
    assert [row.law for row in rows] == ["whole", "without K_eps", "again"]
    assert (rows[0].quiet, rows[0].disturbed) == (found.rows[0].quiet, found.rows[0].disturbed)
    assert rows[1].disturbed == sizes_of(loose.simulate(**RUN))
    assert replace(rows[2], law="whole") == rows[0] != rows[1]


def test_no_experiments_and_what_is_none_are_refused_side_by_side() -> None:
    with refused(InputError, "experiments"):
        side_by_side({}, **RUN)
    with refused(InputError, "experiments, law"):
        side_by_side({"law": SlotineLi()}, **RUN)


def test_it_is_said_where_gravity_takes_most_of_a_torque_that_is_made_equal(found: Comparison) -> None:
    (sentence,) = about_gravity(found.rows, 0.8)
    assert "80%" in sentence
    assert not about_gravity(found.rows, 0.2)
    assert not about_gravity(found.rows[:1], 0.8)


def test_gravity_takes_most_of_the_peak_torque_of_the_a460_and_nothing_of_the_planar_arms() -> None:
    loaded, level = (
        side_by_side({"whole": run}, duration=0.01) for run in (a460_pair(friction=False), planar_four())
    )
    assert loaded.gravity > 0.5
    assert level.gravity == 0


def test_a_comparison_is_plain_data_and_a_table(found: Comparison) -> None:
    data = json.loads(json.dumps(found.as_dict()))
    assert [row["law"] for row in data["rows"]] == [row.law for row in found.rows]
    assert data["verdict"] == list(found.verdict)
    lines = str(found).splitlines()
    assert sum(line.startswith("damped ") for line in lines) >= 3
