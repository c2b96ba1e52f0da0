"""The gallery: every script of scripts/examples is run, and pages show its picture and its code.

python scripts/gallery.py [--out out/gallery] [--short] [--workers 2] [--only NAME ...]

Into the folder go `gallery.md`, a page of thumbnails, and in `gallery/` a page for each script, its pictures,
and animations in `gallery/animations/`. Pictures of animations need Chromium and the extra `test`.
"""

from __future__ import annotations

import argparse
import ast
import runpy
import sys
import traceback
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "scripts" / "examples"
#: which scripts there are, in the order in which they are shown
SECTIONS = {
    "First steps": "first_robot two_arms_in_sync own_urdf cell_from_file",
    "Who is compared with whom": "couplings any_graph synchronization_function weights_that_move",
    "Spaces and desired motion": "desired_motions circle_in_space full_pose redundant_panda mixed_cell",
    "What acts on robots": "friction push payload_picked_up torque_limits",
    "Gains, laws and adaptations": "advice laws_side_by_side adaptations_side_by_side",
    "Parameters": "bodies_that_exist base_parameters",
    "Parts of your own": "own_law own_adaptation own_space",
    "Robots that touch": "carrying leak handing_over bead_on_edge beads_that_meet",
    "Networks": "network_delay lost_messages delay_map agents",
    "Clocks, sensors and loops": "sampled_control noisy_sensors own_loop mujoco_loop",
    "Plants, integrators and engines": "mujoco_plant integrators compiled_engine",
    "What is proved": "certify dissipation modal_bounds tube rate_over_gamma",
    "Many runs": "overlay_of_runs sweep tuning_front",
    "Papers and other tools": "for_a_paper by_name for_foxglove",
}
#: size of a thumbnail, and of the page that an animation is photographed in, pixels
THUMBNAIL, SCREEN = (360, 240), (960, 640)
#: in a row of thumbnails
COLUMNS = 3
#: share of an animation after which it is photographed
SHARE = 0.6


class Example(NamedTuple):
    """A script of the gallery.

    Attributes:
        name: of the file, without its ending.
        title: the first line of its docstring.
        words: what else the docstring says.
        code: what follows.
    """

    name: str
    title: str
    words: str
    code: str

    @classmethod
    def read(cls, name: str) -> Example:
        """The script of that name."""
        source = (EXAMPLES / f"{name}.py").read_text("utf-8")
        title, _, words = (ast.get_docstring(ast.parse(source)) or "").partition("\n")
        return cls(name, title.rstrip("."), words.strip(), source.split('"""', 2)[2].strip())


def sections(only: Sequence[str] = ()) -> Iterator[tuple[str, list[Example]]]:
    """Scripts by what they are about; with names only these."""
    for heading, names in SECTIONS.items():
        found = [Example.read(name) for name in names.split() if not only or name in only]
        if found:
            yield heading, found


# -- what scripts write -----------------------------------------------------------------------------------


def run(name: str, folder: Path, short: bool) -> str:
    """Run a script as `python` would; returns what it ends with if it fails, else ""."""
    argv, path = sys.argv, sys.path
    file = str(EXAMPLES / f"{name}.py")
    sys.argv, sys.path = [file, "--out", str(folder), *["--short"] * short], [str(EXAMPLES), *path]
    try:
        runpy.run_path(file, run_name="__main__")
    except Exception:
        return f"{name}: {traceback.format_exc()}"
    finally:
        sys.argv, sys.path = argv, path
    return ""


def photograph(folder: Path) -> None:
    """Move animations to a folder of their own, with a picture of each where there is a browser."""
    animations = folder / "animations"
    animations.mkdir(exist_ok=True)
    moved = [path.replace(animations / path.name) for path in sorted(folder.glob("*.html"))]
    sys.path[:0] = [str(ROOT / "scripts"), str(ROOT / "tests")]
    try:
        from browser import browser, open_page
        from scene_pictures import freeze_short, joined, seen
    except ImportError:
        print("no pictures of animations: they need the extra `test`", file=sys.stderr)
        return
    if browser() is None:
        print("no pictures of animations: there is no Chromium", file=sys.stderr)
        return
    for path in moved:
        try:
            with open_page(path, SCREEN) as page:
                picture = joined(seen(page, SHARE * freeze_short(page)))
        except AssertionError as error:  # its thumbnail is the figure then
            print(f"no picture of {path.name}: {error}", file=sys.stderr)
            continue
        picture.save(folder / f"{path.stem}_scene.png", optimize=True)


def thumbnail(folder: Path, name: str) -> None:
    """A small picture of a script's scene, or else of its figure, in the middle of a white card."""
    from PIL import Image, ImageOps

    scene = folder / f"{name}_scene.png"
    with Image.open(scene if scene.exists() else folder / f"{name}.png") as picture:
        plain = picture.convert("RGB")
        fit = ImageOps.fit if scene.exists() else ImageOps.pad
        card = fit(
            plain, THUMBNAIL, Image.Resampling.LANCZOS, **({} if scene.exists() else {"color": "white"})
        )
        card.save(folder / "thumbs" / f"{name}.png", optimize=True)


# -- pages ------------------------------------------------------------------------------------------------


def index(shown: Sequence[tuple[str, list[Example]]]) -> str:
    """The page of thumbnails, which links to a page for each script."""
    lines = [
        "# Gallery",
        "",
        "Small scripts, one idea each. They are in `scripts/examples/`: run one with",
        "`python scripts/examples/NAME.py`, and find its picture in `out/gallery/`.",
    ]
    for heading, examples in shown:
        lines += ["", f"## {heading}", "", "| " * COLUMNS + "|", "|:---:" * COLUMNS + "|"]
        cards = [
            f"[![{e.title}](gallery/thumbs/{e.name}.png)](gallery/{e.name}.md)<br>"
            f"[{e.title.partition(':')[0]}](gallery/{e.name}.md)"
            for e in examples
        ]
        cards += [""] * (-len(cards) % COLUMNS)
        lines += [f"| {' | '.join(cards[k : k + COLUMNS])} |" for k in range(0, len(cards), COLUMNS)]
    names = [f"gallery/{e.name}" for _, examples in shown for e in examples]
    return "\n".join([*lines, "", "```{toctree}", ":hidden:", "", *names, "```", ""])


def listing() -> str:
    """The page of the repository, where there are no pictures: titles, each with a link to its script."""
    lines = [
        "# Gallery",
        "",
        "Small scripts, one idea each; `python scripts/examples/NAME.py` writes its picture to",
        "`out/gallery/`, and `python scripts/gallery.py` runs them all. The site that `make docs` builds",
        "has this page with all pictures.",
    ]
    for heading, examples in sections():
        lines += ["", f"## {heading}", ""]
        lines += [f"- [{e.title}](../scripts/examples/{e.name}.py)" for e in examples]
    return "\n".join([*lines, ""])


def page(example: Example, folder: Path) -> str:
    """What a script says of itself, its pictures, and its code."""
    name, lines = example.name, [f"# {example.title}", ""]
    if example.words:
        lines += [example.words, ""]
    if (folder / f"{name}_scene.png").exists():
        lines += [f'<a href="animations/{name}.html">![The scene]({name}_scene.png)</a>', ""]
    if (folder / "animations" / f"{name}.html").exists():
        lines += [f'<a href="animations/{name}.html">Play the animation</a>', ""]
    lines += [f"![{example.title}]({name}.png)", "", f"`scripts/examples/{name}.py`:", ""]
    return "\n".join([*lines, "```python", example.code, "```", ""])


def write(out: Path, shown: Sequence[tuple[str, list[Example]]], short: bool, workers: int) -> list[str]:
    """Run all scripts and write all pages; returns complaints of scripts that failed."""
    folder = out / "gallery"
    (folder / "thumbs").mkdir(parents=True, exist_ok=True)
    examples = [e for _, some in shown for e in some]
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        said = [*pool.map(partial(run, folder=folder, short=short), [e.name for e in examples])]
    if any(said):
        return [each for each in said if each]
    photograph(folder)
    for example in examples:
        thumbnail(folder, example.name)
        (folder / f"{example.name}.md").write_text(page(example, folder), "utf-8")
    (out / "gallery.md").write_text(index(shown), "utf-8")
    return []


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/gallery"), help="folder for everything")
    parser.add_argument("--short", action="store_true", help="short runs, to see that all works")
    parser.add_argument("--workers", type=int, default=2, help="scripts that run at a time")
    parser.add_argument("--list", type=Path, help="write docs/gallery.md, say, and run nothing")
    parser.add_argument("--only", nargs="+", default=[], help="names of the scripts to run")
    options = parser.parse_args()
    if options.list:
        options.list.write_text(listing(), "utf-8")
        return 0
    complaints = write(options.out, [*sections(options.only)], options.short, options.workers)
    print(*complaints, sep="\n", file=sys.stderr)
    if not complaints:
        print(options.out / "gallery.md")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
