"""The figure of a tube shows its radius, the run and the singular circles, of cells in a plane."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import same_color
from matplotlib.patches import Circle
from refusals import refused

from synctrl.analysis import tube
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, rigid_object
from synctrl.show.style import ACCENT
from synctrl.show.tube_figures import TUBE, tube_figure


def test_it_shows_the_radius_the_run_and_where_the_arm_is_singular() -> None:
    one = rigid_object(disturbed=False)
    result = one.simulate(0.02, 2e-3)
    found = tube(one.cell, one.gains, duration=6.0, times=np.linspace(0, 6, 13))
    plane, over_time = tube_figure(found, one.cell, result, 1).axes
    circles = [patch for patch in plane.patches if isinstance(patch, Circle)]
    sizes = {
        name: [circle.radius for circle in circles if same_color(circle.get_edgecolor(), name)]
        for name in (TUBE, ACCENT)
    }
    assert sizes[TUBE] == pytest.approx(found.radius[:, 1, 0])
    assert sorted(sizes[ACCENT]) == pytest.approx([0.0, 0.6])
    np.testing.assert_array_equal(plane.lines[1].get_xydata(), result.x[:, 1])
    shown = over_time.lines[0].get_ydata()
    assert shown == pytest.approx(1e3 * np.linalg.norm(result.tracking_error[:, 1], axis=-1))


def test_outside_a_plane_it_has_the_errors_of_every_part_below_their_radii() -> None:
    one = a460_pair(friction=False)
    result = one.simulate(4e-3, 1e-3)
    found = tube(one.cell, one.gains, duration=4e-3, times=result.t)
    panels = tube_figure(found, one.cell, result, 1).axes
    assert [panel.get_ylabel() for panel in panels] == [f"|e({part.name})|, deg" for part in found.parts]
    for k, panel in enumerate(panels):
        error, (band,) = panel.lines[0].get_ydata(), panel.collections
        np.testing.assert_allclose(error, np.rad2deg(np.abs(result.tracking_error[:, 1, k])))
        assert error.max() < band.get_paths()[0].vertices[:, 1].max()


def test_a_tube_of_another_cell_or_robot_is_refused() -> None:
    one, flat = a460_pair(), rigid_object(disturbed=False)
    result = one.simulate(2e-3, 1e-3)
    found = tube(one.cell, one.gains, times=[0.0])
    with refused(InputError, "tube"):
        tube_figure(found, flat.cell, result)
    with refused(InputError, "robot"):
        tube_figure(found, one.cell, result, 2)
