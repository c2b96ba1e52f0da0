"""What becomes of one robot description: here, and in Pinocchio, yourdfpy and MuJoCo as they are."""

from __future__ import annotations

import io
import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import pinocchio as pin
from survey_dynamics import differences, followers_in, loop_difference, parse

from synctrl import Robot, load_robot
from synctrl.errors import SynctrlError
from synctrl.robots.urdf.xacro import expand_xacro

MOVING = ("revolute", "continuous", "prismatic")
LONGEST_CHAIN_OF_WHEELS = 2
MOST_JOINTS = 14
"""More than the joints of two arms are a humanoid, a hand or a train of wheels."""


@dataclass
class Row:
    """One file.

    Attributes:
        file: the file, below the folder of its collection.
        what: "arm", or why it is none.
        refusal: why it is refused; empty if it loads.
        notes: what was said of it, as (kind, text).
        others: by library, why it refuses the same; empty if it takes it.
        errors: largest relative difference of M, C, g and the regressor from plain Pinocchio, by name.
        loop: largest difference between the two engines in a short closed loop, rad or m.
        stopped: why there was no such loop.
    """

    file: str
    what: str = "arm"
    refusal: str = ""
    notes: list[tuple[str, str]] = field(default_factory=list)
    others: dict[str, str] = field(default_factory=dict)
    errors: dict[str, float] = field(default_factory=dict)
    loop: float = math.nan
    stopped: str = ""


@dataclass(frozen=True)
class Task:
    """A file in the folder of its collection, and values of its arguments if it is a xacro file."""

    path: Path
    folder: Path
    args: Mapping[str, str] | None = None

    @property
    def name(self) -> str:
        words = [
            str(self.path.relative_to(self.folder)),
            *(f"{k}:={v}" for k, v in (self.args or {}).items()),
        ]
        return " ".join(words)

    def text(self) -> str:
        """The URDF, expanded if it is xacro."""
        if self.path.suffix == ".xacro":
            return expand_xacro(self.path, self.args, [self.folder])
        return self.path.read_text(encoding="utf-8", errors="replace")

    def load(self, tip: str | None = None) -> Robot:
        return load_robot(self.path, tip, package_dirs=[self.folder], xacro_args=self.args)


def survey(task: Task, compare: bool) -> Row:
    """Try one file; packages are looked for in its collection too."""
    row, path = Row(task.name), task.path
    text = _text(task, row)
    if text is not None:
        row.what = what_it_is(text)
    if row.what != "arm":
        return row
    assert text is not None
    row.others = {name: _reason(lambda read=read: read(text, path)) for name, read in LIBRARIES.items()}
    robot = _load(task, row)
    if compare and robot is not None:
        _compare(robot, text, row)
        _run(task, robot.tip, row)
    return row


def _text(task: Task, row: Row) -> str | None:
    """Its URDF; None, and the reason in `row.what`, if there is none."""
    try:
        return task.text()
    except SynctrlError as error:
        row.what = "does not expand: " + str(error).partition("found: ")[2]
    except OSError as error:
        row.what = f"cannot be read: {error.strerror}"
    return None


def _load(task: Task, row: Row) -> Robot | None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            robot = task.load()
        except SynctrlError as error:
            row.refusal = str(error).removeprefix(f"{task.path}:")
            return None
        except Exception as error:  # a fault of ours
            row.refusal = f"CRASH {type(error).__name__}: {error}"
            return None
    row.notes = [(note.kind, note.text) for note in robot.report]
    return robot


# -- what it is --------------------------------------------------------------------------------------------


def what_it_is(text: str) -> str:
    """ "arm": a tree with masses whose moving joints are in series, at most two chains of them; or why not.

    Told from the XML alone, so that no loader has a say in it. A chain of one or two joints is a wheel or a
    finger unless there is nothing else.
    """
    try:
        root = parse(text)
    except (ElementTree.ParseError, ValueError):
        return "not XML"
    if root.tag != "robot":
        return "not a robot"
    joints = [joint for joint in root.findall("joint") if joint.find("child") is not None]
    types = [joint.get("type") for joint in joints]
    if {"floating", "planar", "spherical"} & {*types}:
        return "a joint of several degrees of freedom"
    count = sum(kind in MOVING for kind in types)
    if not count:
        return "nothing moves"
    if not any(_mass(link) > 0 for link in root.findall("link")):
        return "no masses"
    links = {link.get("name") for link in root.findall("link")}
    if any(joint.find("parent") is None or joint.find("parent").get("link") not in links for joint in joints):
        return "a part, to be fixed to a link that it lacks"
    return _shape(_chains(joints))


def _mass(link: ElementTree.Element) -> float:
    mass = link.find("inertial/mass")
    try:
        return float(mass.get("value", 0)) if mass is not None else 0.0
    except ValueError:
        return 0.0


def _chains(joints: Sequence[ElementTree.Element]) -> list[tuple[str, ...]]:
    """The moving joints from the root to each end of the tree."""
    below: dict[str, list[ElementTree.Element]] = {}
    for joint in joints:
        parent = joint.find("parent")
        below.setdefault("" if parent is None else parent.get("link", ""), []).append(joint)
    children = {joint.find("child").get("link", "") for joint in joints}

    def ends(link: str, chain: tuple[str, ...], seen: frozenset[str]) -> Iterator[tuple[str, ...]]:
        if not below.get(link):
            yield chain
        for joint in below.get(link, ()):
            moves = joint.get("type") in MOVING and joint.find("mimic") is None
            child = joint.find("child").get("link", "")
            if child not in seen:
                yield from ends(child, (*chain, joint.get("name", "")) if moves else chain, seen | {child})

    roots = [link for link in below if link not in children]
    return [chain for root in roots for chain in ends(root, (), frozenset({root}))]


def _shape(chains: Sequence[tuple[str, ...]]) -> str:
    """Whether chains of moving joints are those of an arm, or of two."""
    longest = max(map(len, chains), default=0)
    joints = {name for chain in chains for name in chain}
    if longest <= LONGEST_CHAIN_OF_WHEELS:
        return "arm" if len(joints) == longest else "wheels or fingers"
    limbs = {chain[: LONGEST_CHAIN_OF_WHEELS + 1] for chain in chains if len(chain) > LONGEST_CHAIN_OF_WHEELS}
    if len(limbs) > 2:
        return "more than two limbs"
    return "arm" if longest <= MOST_JOINTS else "a chain, too long for an arm"


# -- other libraries ---------------------------------------------------------------------------------------


def _reason(read: Callable[[], object]) -> str:
    """Why `read` fails, in one line; empty if it does not."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            read()
    except Exception as error:
        return f"{type(error).__name__}: {' '.join(str(error).split())}"[:200]
    return ""


def _pinocchio(text: str, path: Path) -> pin.Model:
    return pin.buildModelFromXML(text) if path.suffix == ".xacro" else pin.buildModelFromUrdf(str(path))


def _yourdfpy(text: str, path: Path) -> object:
    import yourdfpy

    source = io.StringIO(text) if path.suffix == ".xacro" else str(path)
    return yourdfpy.URDF.load(source, load_meshes=False)


def _mujoco(text: str, path: Path) -> object:
    import mujoco

    if path.suffix == ".xacro":
        return mujoco.MjModel.from_xml_string(text)
    return mujoco.MjModel.from_xml_path(str(path))


LIBRARIES = {"Pinocchio": _pinocchio, "yourdfpy": _yourdfpy, "MuJoCo": _mujoco}


# -- comparing ---------------------------------------------------------------------------------------------


def _compare(robot: Robot, text: str, row: Row) -> None:
    try:
        row.errors = differences(robot, pin.buildModelFromXML(text), followers_in(text))
    except ValueError as error:
        row.stopped = f"not compared: {error}"


def _run(task: Task, tip: str, row: Row) -> None:
    """Run it in both engines; of a branched robot the arm that carries the tip."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            row.loop = loop_difference(task.load(tip))
        except SynctrlError as error:
            row.stopped = str(error)
