"""The script that sweeps the gains of the four arms, with a few short runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from synctrl.sweep import load

pytest.importorskip("pandas", reason="tables are read with pandas: pip install 'synctrl[sweep]'")


def test_the_script_draws_its_figure(tmp_path, monkeypatch):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    monkeypatch.setenv("SYNCTRL_CACHE", str(tmp_path / "cache"))
    monkeypatch.syspath_prepend(Path(__file__).parent.parent / "scripts")
    import sweep_gains

    monkeypatch.setattr(sweep_gains, "DURATION", 0.2)
    monkeypatch.setattr(sweep_gains, "HELD_SHARE", 0.25)
    sweep_gains.sweep_gains(tmp_path, 40, 1, 0)
    assert (tmp_path / "sweep_gains.png").stat().st_size > 10_000
    assert len(load(tmp_path / "continuous")) == len(load(tmp_path / "held_6ms")) == 10
    first = load(tmp_path / "held_8ms")[["beta", "K_eps", "Lambda", "model_error"]]
    assert first.equals(load(tmp_path / "continuous")[list(first)])
