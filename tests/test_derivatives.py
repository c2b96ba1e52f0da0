"""Derivatives are held against differences: wrong ones are found, and right ones pass, however hard."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import seeds
from motions import HARD, random_sines

from synctrl.tasks.derivatives import spread_windows


@settings(max_examples=150)
@given(seeds, st.sampled_from([4, 10, 24]))
def test_a_right_derivative_passes_whatever_its_size_rate_and_offset(seed: int, count: int) -> None:
    assert random_sines(seed).misfit(count) is None


@pytest.mark.parametrize("name", HARD)
@pytest.mark.parametrize("count", [4, 24])
def test_a_right_derivative_passes_where_it_is_hard_to_see(name: str, count: int) -> None:
    assert HARD[name].misfit(count) is None


@settings(max_examples=150)
@given(seeds, st.sampled_from([1.05, 0.5, -1.0, 0.0, 2 * np.pi, 180 / np.pi]))
def test_a_wrong_derivative_is_found_and_told(seed: int, factor: float) -> None:
    case = random_sines(seed, least=1e-4)
    wrong = seed % case.size
    factors = np.where(np.arange(case.size) == wrong, factor, 1.0)
    found = case.spoilt(lambda t, derivative: factors * derivative).misfit()
    assert found is not None
    assert found.coordinate == wrong and 0 <= found.time <= case.duration
    assert found.found == pytest.approx(factor * found.expected, rel=0.05)


@pytest.mark.parametrize(
    "name", ["a line", "stiff", "kinks with breaks", "kinks without breaks", "single precision", "a chirp"]
)
def test_a_wrong_derivative_is_found_where_the_right_one_is_hard_to_see(name: str) -> None:
    assert HARD[name].spoilt(lambda t, derivative: 1.1 * derivative).misfit() is not None


def test_a_derivative_that_is_wrong_for_a_while_is_found() -> None:
    case = random_sines(3, least=1e-2)
    late = 0.8 * case.duration

    def spoil(t: np.ndarray, derivative: np.ndarray) -> np.ndarray:
        return np.where(t[:, None] > late, -derivative, derivative)

    found = case.spoilt(spoil).misfit()
    assert found is not None and found.time > 0.7 * case.duration


def test_a_term_that_is_left_out_is_found() -> None:
    from motions import scalar

    f = scalar(lambda t: np.sin(t) + 1e-3 * np.sin(200 * t), lambda t: np.cos(t))
    assert f.misfit() is not None


@given(
    st.lists(st.floats(-1.0, 4.0), max_size=6),
    st.floats(0.01, 3.0),
    st.integers(2, 30),
)
def test_no_window_reaches_across_a_break_or_out_of_the_run(breaks, stop, count) -> None:
    windows = spread_windows(0.0, stop, breaks, count)
    ends = windows.start + windows.room
    assert (windows.start >= 0).all() and (ends <= stop).all() and (windows.room > 0).all()
    for b in breaks:
        assert not ((windows.start <= b) & (b <= ends) & (b > 0) & (b < stop)).any()
