"""What is in a URDF besides the robot: extensions of other programs, and text that was never expanded.

Elements of other programs are left alone, unless they add to the mechanism: without them it would be another.
"""

from __future__ import annotations

from collections.abc import Iterator

from .xml import Element, quoted, shown_tag

EXTENSIONS = ("gazebo", "transmission", "ros2_control", "sensor", "mujoco", "group_state")
LINK_EXTENSIONS = ("contact", "surface", "gravity", "kinematic", "self_filter", "collision_checking")
"""Elements of other programs, which say nothing about the mechanism."""

_DEFINITIONS = ("xacro:property", "xacro:arg")
_EXPANDS = "a plain URDF"
_ADVICE = "unexpanded xacro; expand the file with xacro first, or load the .xacro file itself"
_CLOSES = ("loop_joint", "closed_loop", "loop_closure", "ball_constraint", "linear_bushing_rpy", "equality")


def everything(element: Element) -> Iterator[Element]:
    """An element and all in it."""
    yield element
    for child in element.children:
        yield from everything(child)


def refuse_xacro(root: Element) -> None:
    """Refuse macros, and expressions in the robot itself, wherever they stand.

    Definitions that no expression uses say nothing.

    Raises:
        RobotError: with the advice to expand the file.
    """
    unused = [child for child in root.children if child.tag in _DEFINITIONS and not child.children]
    for element in everything(root):
        if element.tag.startswith("xacro:") and element not in unused:
            element.refuse(_EXPANDS, f"<{shown_tag(element.tag)}>: {_ADVICE}")
    robot = (part for child in root.children if child.tag not in EXTENSIONS for part in everything(child))
    for element in (root, *robot):
        for key, value in element.attributes.items():
            if "${" in value or "$(" in value:
                element.refuse(_EXPANDS, f"{quoted(key)} of {quoted(value)}: {_ADVICE}")


def refuse_loops(root: Element) -> None:
    """Refuse elements of other programs that add a joint or close a loop, which would be cut without a word.

    Raises:
        RobotError: with the element.
    """
    for element in everything(root):
        name = element.tag.rpartition(":")[2]
        if name in _CLOSES or (":" in element.tag and name == "joint"):
            element.refuse("a tree of links and joints", f"<{shown_tag(element.tag)}>, which closes a loop")
    carried = {end.attributes.get("link", "") for joint in root.all("joint") for end in joint.all("child")}
    for extension in (child for child in root.children if child.tag in EXTENSIONS):
        for element in everything(extension):
            if element.tag == "joint" and _joins(element, carried):
                element.refuse("a tree of links and joints", "a joint for a simulator, which closes a loop")


def _joins(joint: Element, carried: set[str]) -> bool:
    """Whether a joint of a simulator connects two links, other than the world with the base."""
    ends = [part.content.strip() for tag in ("parent", "child") for part in joint.all(tag)]
    return len(ends) == 2 and not ("world" in ends and carried.isdisjoint(ends))
