"""The gallery: every script runs, writes pictures that show something, and has its place and its page."""

from __future__ import annotations

import ast
import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "scripts" / "examples"
#: what scripts share is none
NAMES = sorted(path.stem for path in EXAMPLES.glob("*.py") if path.stem != "example")
#: what scripts need of the extras, beside `compiled`
EXTRAS = {
    **dict.fromkeys(("mujoco_plant", "mujoco_loop"), "mujoco"),
    **{"sweep": "pandas", "tuning_front": "optuna", "by_name": "h5netcdf", "for_foxglove": "mcap_protobuf"},
}
COMPILED = {"compiled_engine", "sweep", "tuning_front"}
#: of code and comments in a script, docstring and blank lines left out
MOST_LINES = 40


@pytest.fixture(scope="module")
def gallery():
    spec = importlib.util.spec_from_file_location("gallery_script", ROOT / "scripts" / "gallery.py")
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def pixels(path: Path) -> np.ndarray:
    from matplotlib.image import imread

    return imread(path)


@pytest.mark.filterwarnings("error::synctrl.errors.RobotWarning", "ignore::synctrl.errors.StepWarning")
@pytest.mark.parametrize("name", NAMES)
def test_a_script_writes_a_picture_that_shows_something(name, gallery, tmp_path):
    if name in EXTRAS:
        pytest.importorskip(EXTRAS[name])
    if name in COMPILED:
        pytest.importorskip("casadi")
    assert gallery.run(name, tmp_path, short=True) == ""
    picture = pixels(tmp_path / f"{name}.png")
    assert picture.std(axis=(0, 1)).max() > 0.02, "a picture of one colour"
    for animation in tmp_path.glob("*.html"):
        assert animation.stem == name and "viewer" in animation.read_text("utf-8")


@pytest.mark.parametrize("name", NAMES)
def test_a_script_has_one_idea_in_forty_lines_and_says_it_first(name, gallery):
    example = gallery.Example.read(name)
    assert sum(bool(line.strip()) for line in example.code.splitlines()) <= MOST_LINES
    assert example.title and example.words
    ast.parse(example.code)


def test_every_script_has_its_place_in_the_gallery_and_every_place_its_script(gallery):
    shown = [example.name for _, examples in gallery.sections() for example in examples]
    assert len(shown) >= 32 and sorted(shown) == NAMES


def test_a_script_that_fails_is_complained_of_by_name(gallery, tmp_path, monkeypatch):
    (tmp_path / "wrong.py").write_text('"""Wrong."""\n1 / 0\n')
    monkeypatch.setattr(gallery, "EXAMPLES", tmp_path)
    arguments = [*sys.argv]
    said = gallery.run("wrong", tmp_path, short=True)
    assert said.startswith("wrong: ") and "ZeroDivisionError" in said
    assert sys.argv == arguments and str(tmp_path) not in sys.path


def test_pages_link_to_what_is_there(gallery, tmp_path):
    folder = tmp_path / "gallery"
    (folder / "thumbs").mkdir(parents=True)
    shown = [*gallery.sections(["base_parameters"])]
    assert gallery.run("base_parameters", folder, short=True) == ""
    gallery.thumbnail(folder, "base_parameters")
    assert pixels(folder / "thumbs" / "base_parameters.png").shape[1::-1] == gallery.THUMBNAIL
    index, page = gallery.index(shown), gallery.page(shown[0][1][0], folder)
    assert "(gallery/thumbs/base_parameters.png)" in index and "\ngallery/base_parameters\n" in index
    assert "(base_parameters.png)" in page and "animations/" not in page
    assert page.count("```") == 2 and "BaseParameters(robot)" in page


def test_the_page_of_the_repository_lists_all_scripts(gallery):
    assert (ROOT / "docs" / "gallery.md").read_text("utf-8") == gallery.listing()
