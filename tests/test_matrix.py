"""Every coupling with everything that makes use of a run: what works for one works for all."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell

from synctrl import (
    CartesianSpace,
    Cell,
    Coupling,
    Cubic,
    Experiment,
    Member,
    Result,
    SynchronizationFunction,
    load_robot,
)
from synctrl.analysis import compare, side_by_side
from synctrl.analysis.certify import certify
from synctrl.analysis.convergence import convergence, identify
from synctrl.analysis.gain_condition import gain_condition, gain_condition_in_box
from synctrl.analysis.lyapunov import lyapunov
from synctrl.analysis.metrics import as_data, metrics, row_names, settling_bands
from synctrl.analysis.replay import replay
from synctrl.control.laws import SlotineLi
from synctrl.errors import NonFiniteError
from synctrl.paper.claims import errors_converge, sync_error_is_much_smaller
from synctrl.paper.fairness import fair_section, taken_apart
from synctrl.paper.judge import compare_runs
from synctrl.paper.paper_sections import metrics_tables
from synctrl.paper.plant_sections import identification_section
from synctrl.paper.report import Section, Text, Verdicts, write_page
from synctrl.paper.theory import certificate_section, draw_certificate
from synctrl.show import scene_of
from synctrl.show.animation import formation_scene, planar_scene
from synctrl.show.layout import cell_layout
from synctrl.show.lyapunov_plots import lyapunov_figure
from synctrl.show.plots import common_limits, joint_trajectories, sync_errors, tracking_errors
from synctrl.simulation.guard import Alarm
from synctrl.simulation.guard import stopped as stopped_by
from synctrl.sweep.description import describe_base
from synctrl.sweep.factors import Setup
from synctrl.sweep.measures import MEASURES, definitions, measures
from synctrl.sweep.variations import with_scaled_weights
from synctrl.sweep.worker import Prepared

DURATION, DT = 0.01, 1e-3  # s
needs_casadi = pytest.mark.skipif(
    importlib.util.find_spec("casadi") is None,
    reason="CasADi is an extra: pip install 'synctrl[compiled]'",
)


def turning(n: int) -> Callable:
    """Weights that change with time, with their derivatives."""
    signs = np.array([(-1.0) ** i for i in range(n)])
    return lambda t: (signs * (2 + np.sin(3 * t)), signs * 3 * np.cos(3 * t), signs * -9 * np.sin(3 * t))


def of_a_function(moving: bool, graph: Callable[..., Coupling] | None = None) -> Coupling:
    """The coupling of sum_i A_i(t) x_i + b(t) = 0 for the paths of the small cell of four."""
    paths = [member.trajectory for member in small_cell(4).members]

    def A(t: float) -> np.ndarray:  # noqa: N802
        return np.array([1.0, 2.0, -1.0, 0.5]) * (1 + moving * 0.3 * np.sin(t + np.arange(4)))

    def b(t: float) -> np.ndarray:
        return -sum(a * path(t).x for a, path in zip(A(t), paths, strict=True))

    return SynchronizationFunction.from_matrices(A, 2, b).coupling(paths, 1.0, graph)


COUPLINGS: dict[str, Callable[[], Coupling]] = {
    "pair": Coupling.pair,
    "pair, moving": lambda: Coupling.pair(turning(2)),
    "sum of 2": lambda: Coupling.sum(2),
    "sum of 3": lambda: Coupling.sum(3),
    "sum of 4, moving": lambda: Coupling.sum(4, turning(4)),
    "sum of 3, matrices": lambda: Coupling.sum(3, [[[2.0, 1.0], [0.0, 1.0]]] * 3, unit="m").normalized(),
    "sum of 3, weighted": lambda: Coupling.sum(3).weighted([2.0]),
    "ring of 4": lambda: Coupling.ring(4),
    "ring of 4, moving": lambda: Coupling.ring(4, turning(4)),
    "signed ring of 3": lambda: Coupling.signed_ring(3),
    "chain of 4": lambda: Coupling.chain(4),
    "star of 4": lambda: Coupling.star(4, leader=2),
    "complete of 3": lambda: Coupling.complete(3),
    "weighted chain": lambda: Coupling.chain(3).weighted([2.0, 0.5]),
    "graph": lambda: Coupling.from_graph([(0, 1, 2.0), (1, 2, 1.0), (0, 3, 0.5)]),
    "edges by hand": lambda: Coupling(3, [(0, 1), (1, 2)], [(1.0, -2.0), (0.5, 1.0)], np.ones(3)),
    "function of 4": lambda: of_a_function(moving=False),
    "function of 4, moving": lambda: of_a_function(moving=True),
    "function of 4 as a ring": lambda: of_a_function(True, Coupling.ring),
}


@cache
def experiment(name: str) -> Experiment:
    coupling = COUPLINGS[name]()
    return Experiment(small_cell(coupling.robots, coupling=coupling, name=name), SMALL_GAINS, DURATION)


@cache
def run(name: str) -> Result:
    return experiment(name).simulate(dt=DT)


@cache
def independent(name: str) -> Result:
    made = experiment(name)
    return replace(made, gains=made.gains.independent()).simulate(dt=DT)


# -- consumers --------------------------------------------------------------------------------------------


def measured(name: str, folder: Path) -> None:
    result = run(name)
    names = row_names(result, "sync_error")
    assert len(names) == len(set(names)) == result.sync_error.shape[1]
    data = as_data(result, metrics(result))
    assert set(data["sync_error"]["values"]) == set(names)
    json.dumps(data, allow_nan=False)


def drawn(name: str, folder: Path) -> None:
    result, other = run(name), independent(name)
    limits = common_limits("sync_error", result, other)
    figures = [joint_trajectories(result, k) for k in range(result.x.shape[1])]
    figures += [tracking_errors(result), sync_errors(result), cell_layout(result)]
    assert all(figure.axes for figure in figures)
    sync_errors(result, limits).canvas.draw()


def shown(name: str, folder: Path) -> None:
    assert planar_scene(run(name)).write(folder / "scene.html").stat().st_size > 1e4


def certified(name: str, folder: Path) -> None:
    found = certify(run(name))
    assert found.verdict in str(found)
    assert lyapunov_figure(lyapunov(run(name))).axes


def conditioned(name: str, folder: Path) -> None:
    paper = replace(experiment(name), reference_acceleration="paper")
    assert np.isfinite(gain_condition(paper.simulate(dt=DT)).margin)
    assert np.isfinite(gain_condition_in_box(paper, [0.3, 1.0], [0.5, 1.2], samples=8).margin)


def replayed(name: str, folder: Path) -> None:
    again = replay(run(name))
    assert len(again.logged) == len(run(name).t)
    convergence(run(name))


def identified(name: str, folder: Path) -> None:
    assert len(identify(run(name))) == experiment(name).cell.n


def compared(name: str, folder: Path) -> None:
    made, options = experiment(name), {"duration": 5 * DT, "dt": DT}
    laws = compare(made, [SlotineLi()], ["equal pole"], **options)
    parts = side_by_side(taken_apart(made), **options)
    assert len(laws.verdict) >= 2
    fair_section(laws, parts, folder / "fair")


def saved(name: str, folder: Path) -> None:
    loaded = Result.load(run(name).save(folder / "run.npz"))
    assert loaded == run(name)
    assert row_names(loaded, "sync_error") == row_names(run(name), "sync_error")
    assert sync_errors(loaded).axes
    lyapunov(loaded, experiment(name))
    planar_scene(loaded, experiment(name)).page()
    assert scene_of(loaded).page() == scene_of(run(name)).page()
    assert [*loaded.plot("torque", "path", "estimates", width=3.5)] == ["torque", "path", "estimates"]


def written(name: str, folder: Path) -> None:
    ours, theirs = run(name), independent(name)
    claims = sync_error_is_much_smaller(ours, theirs, "nowhere"), errors_converge(ours, "nowhere")
    certificate = certify(ours)
    draw_certificate(name, certificate, folder)
    sections = [
        Section("A run", (Text("Words."), *metrics_tables(ours, theirs), Verdicts(claims))),
        certificate_section({name: certificate}, folder),
        identification_section({name: identify(ours)}),
    ]
    page = write_page(folder / "page.html", name, sections).read_text(encoding="utf-8")
    assert ">nan<" not in page


def swept(name: str, folder: Path) -> None:
    found = measures(run(name), settling_bands(run(name)))
    assert len(found) == len(MEASURES) == len(definitions(experiment(name).cell))
    json.dumps(describe_base(Setup(experiment(name), DURATION, DT, "pinocchio", None)))
    scaled = with_scaled_weights(experiment(name), 2.0)
    np.testing.assert_allclose(scaled.simulate(dt=DT).sync_error[0], 2 * run(name).sync_error[0], atol=1e-15)
    prepared = Prepared(experiment(name), dt=DT, engine="pinocchio")
    assert prepared.simulate(experiment(name)) == run(name)


def run_otherwise(name: str, folder: Path) -> None:
    made = experiment(name)
    made.simulate(dt=DT, control_period=2 * DT)
    made.simulate(dt=DT, integrator="LSODA")
    paper = replace(made, reference_acceleration="paper", k_r_space="task")
    assert compare_runs(run(name), paper.simulate(dt=DT)).sync.shape == run(name).t.shape


def stopped(name: str, folder: Path) -> None:
    loop = experiment(name).closed_loop()
    for k in range(4):
        y = loop.initial_state()
        loop.split(y)[k][...] = np.nan
        error = stopped_by(loop, 0.1, y, np.ones((loop.cell.n, loop.cell.nv)), Alarm("state"))
        assert isinstance(error, NonFiniteError) and error.robot in range(loop.cell.n)


CONSUMERS = [
    measured, drawn, shown, certified, conditioned, replayed, identified, compared, saved, written, swept,
    run_otherwise, stopped,
]  # fmt: skip


@pytest.mark.parametrize("consumer", CONSUMERS, ids=lambda consumer: consumer.__name__)
@pytest.mark.parametrize("name", COUPLINGS)
def test_every_coupling_is(name: str, consumer: Callable[[str, Path], None], tmp_path: Path) -> None:
    consumer(name, tmp_path)


@needs_casadi
@pytest.mark.parametrize("name", COUPLINGS)
def test_every_coupling_is_compiled(name: str) -> None:
    compiled = experiment(name).simulate(dt=DT, engine="compiled")
    for array in ("q", "sync_error", "tau", "theta_hat"):
        expected = getattr(run(name), array)
        scale = np.abs(expected).max() + 1e-12
        np.testing.assert_allclose(getattr(compiled, array), expected, rtol=0, atol=1e-9 * scale)


def formation(coupling: Coupling) -> Experiment:
    """Arms that move their tips in all three directions."""
    arm, members = load_robot("a460"), []
    for i in range(coupling.robots):
        q0 = np.array([0.2, 1.2, -1.5])
        placed = arm.placed((0.0, 1.5 * i, 0.0), name=f"arm {i + 1}")
        start = placed.tip_position(q0)
        path = Cubic(start, start + np.array([0.02, 0.0, 0.02]), 1.0)
        members.append(Member(placed, path, q0, theta_hat0=placed.inertial_parameters))
    gains = SMALL_GAINS.replace(K_r=50.0)
    return Experiment(Cell(members, coupling, CartesianSpace("xyz")), gains, DURATION)


@pytest.mark.parametrize("name", ["pair", "sum of 2", "sum of 3", "ring of 4", "star of 4", "complete of 3"])
def test_every_coupling_is_shown_in_formation(name: str) -> None:
    result = formation(COUPLINGS[name]()).simulate(dt=DT)
    names = {node.name for node in formation_scene(result, fps=100).nodes}
    bars = [text for text in names if "pair" in text]
    expected = sum(1 if len(row) == 2 else len(row) for row in result.info["pairs"])
    assert len(bars) == expected


def test_robots_that_are_compared_all_at_once_are_named_so() -> None:
    assert row_names(run("sum of 3"), "sync_error") == ["1: all 3 robots"]
    assert row_names(run("sum of 2"), "sync_error") == ["1: robot 1, robot 2"]
