"""Panels with margins known beforehand: all that is written in them has its place."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.text import Text

from synctrl.experiments import a460_pair, planar_four
from synctrl.show.panels import BOTTOM, LEFT, RIGHT, WIDTH, power_of_ten, stacked_panels
from synctrl.show.plots import joint_trajectories, save, style, sync_errors, tracking_errors

SUPERSCRIPT = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻−", "0123456789--")


@pytest.fixture(scope="module")
def disturbed():
    return planar_four(disturbance="torque").simulate(0.8, dt=2e-3)


@pytest.fixture(scope="module")
def pair():
    return a460_pair().simulate(0.2, dt=2e-3)


def written(figure):
    """Boxes of all words of a figure that can be seen, in dots."""
    with style():
        figure.canvas.draw()
        own = (panel.get_legend() for panel in figure.axes)
        every = [*figure.legends, *(legend for legend in own if legend is not None)]
        texts = [text for legend in every for text in legend.get_texts()]
        for panel in figure.axes:
            texts += [panel.xaxis.label, panel.yaxis.label, panel.yaxis.get_offset_text()]
            texts += [text for text in panel.findobj(Text) if text.get_text() == panel.get_title(loc="left")]
            texts += [text for axis in (panel.xaxis, panel.yaxis) for text in tick_labels(axis)]
        return {text: text.get_window_extent() for text in texts if text.get_visible() and text.get_text()}


def tick_labels(axis):
    """Labels of the ticks within the limits: the others are there, but not drawn."""
    low, high = sorted(axis.get_view_interval())
    places = axis.get_majorticklocs()
    return [
        tick.label1
        for place, tick in zip(places, axis.get_major_ticks(), strict=True)
        if low <= place <= high
    ]


def check_places(figure):
    """Nothing that is written leaves the figure, reaches into a panel or covers other words."""
    boxes = written(figure)
    for text, box in boxes.items():
        assert box.x0 >= 0, text
        assert box.y0 >= 0, text
        assert box.x1 <= figure.bbox.x1 + 1e-6, text
        assert box.y1 <= figure.bbox.y1 + 1e-6, text
        assert not any(box.overlaps(panel.bbox) for panel in figure.axes), text
    for (one, a), (other, b) in combinations(boxes.items(), 2):
        assert not a.overlaps(b), (one, other)


@pytest.mark.parametrize("size", [1e-6, 1e-3, 0.021, 1.0, 47.0, 1e5])
def test_all_words_have_their_place_whatever_the_size_of_the_errors(disturbed, size):
    scale = size / np.abs(disturbed.sync_error).max()
    run = replace(disturbed, sync_error=scale * disturbed.sync_error)
    low = 1.1 * run.sync_error.min()
    for limits in (None, (10 * low, -10 * low)):
        check_places(sync_errors(run, limits))


def test_all_words_have_their_place_in_the_figures_of_the_paper(disturbed, pair):
    for figure in (tracking_errors(disturbed, (-1, 1)), *(joint_trajectories(pair, k) for k in range(2))):
        check_places(figure)


@given(st.lists(st.tuples(st.floats(0.5, 3), st.floats(0, 1)), min_size=1, max_size=5))
def test_panels_have_the_heights_and_the_room_that_were_asked_for(sizes):
    heights, above = zip(*sizes, strict=True)
    with style():
        figure, panels = stacked_panels(heights, above)
    width, height = figure.get_size_inches()
    boxes = [panel.get_position() for panel in panels]
    np.testing.assert_allclose([box.height * height for box in boxes], heights)
    np.testing.assert_allclose([box.x0 * width for box in boxes], LEFT)
    np.testing.assert_allclose([box.x1 * width for box in boxes], WIDTH - RIGHT)
    tops, bottoms = [1, *(box.y0 for box in boxes)], [*(box.y1 for box in boxes), BOTTOM / height]
    np.testing.assert_allclose(height * np.subtract(tops, bottoms), [*above, 0], atol=1e-9)
    for upper, lower in pairwise(panels):
        assert upper.get_shared_x_axes().joined(upper, lower)


@given(st.integers(-300, 300), st.sampled_from((-1, 1)))
def test_a_power_of_ten_reads_as_what_it_is(exponent, sign):
    base, power = power_of_ten(sign * float(f"1e{exponent}")).split("10", 1)
    assert (base == "−", base == "") == (sign < 0, sign > 0)
    assert int(power.translate(SUPERSCRIPT)) == exponent


def test_zero_is_no_power_of_ten():
    assert power_of_ten(0.0) == "0"


def test_a_figure_can_be_saved_again_with_the_same_bytes(disturbed, tmp_path):
    figure = tracking_errors(disturbed)
    first = [path.read_bytes() for path in save(figure, tmp_path / "figure")]
    assert [path.read_bytes() for path in save(figure, tmp_path / "figure")] == first


@pytest.mark.parametrize("value", [3e-3, -20.0, 1.5])
def test_what_is_no_power_of_ten_is_not_shown_as_one(value):
    assert float(power_of_ten(value)) == value
