"""Hundreds of cells that nobody chose, by both engines and in any number of lanes."""

from __future__ import annotations

from collections import Counter

import pytest
from test_random_cells import cache, check

pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")

__all__ = ["cache"]
#: tests, so that they may be spread over processes, and cells in each
TESTS, CELLS = 4, 50


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("part", range(TESTS))
def test_both_engines_make_the_same_runs(part, record_property):
    found = Counter(check(1000 + part * CELLS + k) for k in range(CELLS))
    told = ", ".join(f"{count} {word}" for word, count in sorted(found.items()))
    record_property("figure", f"{CELLS} cells: {told}")
    assert found["agreed"] > 0.8 * CELLS
