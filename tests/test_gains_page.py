"""The page about gains: its blocks run, what they print is on it, and its numbers are those of runs."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np
import pytest

from synctrl import Cell, Coupling, Cubic, Friction, Gains, Member, Payload, load_robot, simulate
from synctrl.analysis import advise

PAGE = (Path(__file__).parents[1] / "docs" / "gains.md").read_text("utf-8")


def test_the_blocks_run_and_the_advice_is_the_one_that_is_shown():
    names: dict = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for block in re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL):
            exec(compile(block, "docs/gains.md", "exec"), names)
    assert names["result"].status == names["better"].status == "completed"
    (shown,) = re.findall(r"```text\n(.*?)```", PAGE, flags=re.DOTALL)
    assert str(names["advice"]) == shown.rstrip()


def pair() -> Cell:
    robot, q = load_robot("ur5"), np.array([0.1, -1.2, 1.4, -0.6, 0.5, 0.3])
    way, guess = Cubic(q, q + 0.4, 0.8), 0.7 * robot.inertial_parameters
    return Cell([Member(robot, way, q0=q, theta_hat0=guess, friction=Friction())] * 2, Coupling.pair())


def rows() -> list[tuple[str, ...]]:
    number = r"([\d.]+)"
    return re.findall(rf"(?m)^\| {number} \| {number} \| {number} \| {number} \| {number} \| (.*?) \|$", PAGE)


def test_beta_and_k_eps_do_what_the_table_says():
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    cell = pair()
    gains = Gains.suggest(cell, 8.0)
    assert len(rows()) == 8
    for beta, K_eps, peak, left, error, delay in rows():
        some = gains.replace(beta=float(beta) * gains.beta, K_eps=float(K_eps) * gains.K_eps)
        run = simulate(cell, some, 2.0, payloads=[Payload(0, 2.0)], engine="compiled")
        apart, off = (np.rad2deg(np.abs(part)) for part in (run.sync_error, run.tracking_error))
        found = apart.max(), apart[-1].max(), off.max()
        told, last = np.array([peak, left, error], float), np.array([1e-3, 1e-4, 1e-3])
        assert (np.abs(found - told) < 0.6 * last).all()
        margin = advise(cell, some, duration=1.0).delay.delay
        assert delay == ("every" if np.isinf(margin) else f"{1e3 * margin:.1f} ms")


def test_inertia_differs_from_joint_to_joint_as_the_page_says():
    M = np.array([row["inertia"] for row in advise(pair(), Gains(8, 4, 40, 40, 0.1)).rows[:6]])
    (told,) = re.findall(r"differs by a factor of (\d+) between", PAGE)
    assert M.max() / M.min() == pytest.approx(float(told), rel=0.05)
