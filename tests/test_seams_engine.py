"""An engine of one's own in a file of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from seams.heun_engine import Heun

from synctrl.analysis.certify import certify
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, planar_four


def error(dt: float) -> float:
    """Distance of Heun's method from the reference, at the end of a short run."""
    experiment = planar_four()
    fine = experiment.simulate(0.05, dt=2.5e-4)
    return float(np.abs(experiment.simulate(0.05, dt=dt, engine=Heun()).q[-1] - fine.q[-1]).max())


def test_an_engine_of_ones_own_converges_with_its_order():
    assert error(1e-3) / error(5e-4) == pytest.approx(4.0, rel=0.25)


def test_its_runs_are_logged_saved_and_certified_as_others(tmp_path):
    result = a460_pair(friction=False).simulate(0.05, dt=5e-4, engine=Heun())
    assert result.info["engine"] == "Heun"
    assert result == type(result).load(result.save(tmp_path / "run.npz"))
    assert certify(result).growth is None


def test_it_refuses_what_it_does_not_have_by_name():
    with refused(InputError, "engine"):
        planar_four().simulate(0.05, engine=Heun(), control_period=2e-3)


@pytest.mark.parametrize("wrong", ["fast", 3, None, Heun])
def test_what_is_no_engine_is_refused(wrong):
    with refused(InputError, "engine"):
        planar_four().simulate(0.05, engine=wrong)


@pytest.mark.parametrize("file", sorted(Path(__file__).with_name("seams").glob("*.py")), ids=lambda f: f.stem)
def test_a_part_of_ones_own_takes_at_most_forty_lines(file):
    assert len(file.read_text("utf-8").splitlines()) <= 40
