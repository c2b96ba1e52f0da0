"""Pictures without a graphics card: what is in front, how large it is, and that nothing is cut off."""

from __future__ import annotations

import io

import numpy as np
import pytest
from browser import open_page, require_browser
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from refusals import refused

from synctrl import load_robot
from synctrl.errors import InputError
from synctrl.robots.mechanism import joint_limits
from synctrl.show import shapes
from synctrl.show.raster import picture, triangles_of
from synctrl.show.robot_view import middle, robot_picture, robot_scene

RED, BLUE = np.array([[1.0, 0, 0]]), np.array([[0, 0, 1.0]])
pixels = st.floats(5, 95)


def triangle(*corners, depth=0.0):
    return np.array([[(x, y, depth) for x, y in corners]])


def area_of(made) -> float:
    return float(made[..., 3].sum())


@settings(max_examples=40)
@given(pixels, pixels, pixels, pixels, pixels, pixels)
def test_a_triangle_covers_its_area_whichever_way_it_turns(ax, ay, bx, by, cx, cy):
    corners = np.array([(ax, ay), (bx, by), (cx, cy)])
    area = abs(np.linalg.det([corners[1] - corners[0], corners[2] - corners[0]])) / 2
    around = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).sum()
    for order in (corners, corners[::-1]):
        assert abs(area_of(picture(triangle(*order), RED, 100, 100)) - area) <= 0.75 * around + 1


def test_what_is_nearer_hides_what_is_behind_in_whatever_order_it_is_drawn():
    square = ((10, 10), (90, 10), (10, 90))
    near, far = triangle(*square, depth=1.0), triangle(*square, depth=0.0)
    for parts, colors in (((near, far), (RED, BLUE)), ((far, near), (BLUE, RED))):
        made = picture(np.concatenate(parts), np.concatenate(colors), 100, 100)
        seen = made[70, 25]  # rows count from above
        assert seen[0] > 0 and seen[2] == 0 and seen[3] == 1


def test_what_is_outside_the_picture_is_cut_and_up_is_up():
    made = picture(triangle((-50, 60), (150, 60), (50, 300)), RED, 100, 100)
    assert made[:35, :, 3].min() == 1 and made[45:, :, 3].max() == 0


@pytest.mark.parametrize(
    ("shape", "volume"),
    [
        (shapes.box(np.array([1.0, 2.0, 3.0])), 6.0),
        (shapes.ellipsoid(np.array([1.0, 2.0, 0.5])), 4 / 3 * np.pi),
        (shapes.cylinder(0.5, 2.0), np.pi / 2),
        (shapes.cylinder(0.5, 2.0, top=0.0), np.pi / 6),
        (shapes.capsule(0.5, 2.0), np.pi / 2 + np.pi / 6),
        (shapes.mesh(np.eye(4)[:, :3], np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]])), 1 / 6),
    ],
    ids=["box", "ellipsoid", "cylinder", "cone", "capsule", "mesh"],
)
def test_the_triangles_of_a_shape_enclose_its_volume_within_its_bounds(shape, volume):
    corners = triangles_of(shape)
    a, b, c = corners.transpose(1, 0, 2)
    assert abs(np.einsum("ij,ij->", a, np.cross(b, c)) / 6) == pytest.approx(volume, rel=0.03)
    box = shapes.corners(shape)
    flat = corners.reshape(-1, 3)
    assert np.allclose(flat.min(axis=0), box.min(axis=0), atol=0.02)
    assert np.allclose(flat.max(axis=0), box.max(axis=0), atol=0.02)


@pytest.mark.parametrize("name", ["planar2r", "a460_full", "wheel"])
def test_a_robot_is_in_the_picture_whole(name):
    file = io.BytesIO()
    robot_picture(load_robot(name)).savefig(file, format="png")
    image = np.asarray(Image.open(file).convert("L"), float)
    ink = image < 250
    assert ink.mean() > 0.01
    border = np.concatenate([ink[:2].ravel(), ink[-2:].ravel(), ink[:, :2].ravel(), ink[:, -2:].ravel()])
    assert not border.any()


def test_joints_stand_in_the_middle_of_their_ranges():
    robot = load_robot("panda")
    limits = joint_limits(robot)
    q = middle(robot)
    assert np.allclose(q - limits.lower, limits.upper - q)
    assert not middle(load_robot("kinova"))[~np.isfinite(joint_limits(load_robot("kinova")).lower)].any()


def test_positions_of_another_size_are_refused():
    for draw in (robot_picture, robot_scene):
        with refused(InputError, "q"):
            draw(load_robot("planar2r"), [0.0])


def test_the_scene_of_a_robot_opens_in_a_browser_without_asking_for_anything(tmp_path):
    require_browser()
    page_file = robot_scene(load_robot("a460_full")).write(tmp_path / "robot.html")
    with open_page(page_file) as page:
        assert page.requests == [] and page.errors == []
        assert "tip: wrist" in page.evaluate("document.body.innerText")
