"""The page about loops of one's own works as it stands there."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="MuJoCo is an extra: pip install 'synctrl[mujoco]'")

PAGE = (Path(__file__).parents[1] / "docs" / "own_loop.md").read_text("utf-8")


def test_the_page_runs_from_its_first_block_to_its_last(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    blocks = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    assert len(blocks) >= 8
    for number, block in enumerate(blocks, start=1):
        exec(compile(block, f"block {number} of docs/own_loop.md", "exec"), names)
    assert (tmp_path / "controller.npz").is_file()
    # both loops follow the desired motion, and the last controller has kept what was learnt
    at = names["data"].time - 1e-3
    moved = names["joints"].read(names["data"])[0]
    assert np.isfinite(moved).all() and at > 0 and np.abs(moved - names["cell"].q0).max() > 1e-2
    assert np.isfinite(names["desk"].q).all()
    np.testing.assert_array_equal(names["another"].z, names["learnt"])
    assert not names["another"].sync_integral.any()
