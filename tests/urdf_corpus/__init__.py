"""Broken and odd robot descriptions: each is `good.urdf` with one change that has a name.

What makes the mechanism wrong is in `REFUSED`; what does not, in `TAKEN`. What is replaced occurs once.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

GOOD = (Path(__file__).parent / "good.urdf").read_text(encoding="utf-8")
TRIANGLE = bytes(80) + (1).to_bytes(4, "little") + bytes(50)
"""A binary STL with one triangle."""


def _changed(old: str, new: str) -> str:
    assert GOOD.count(old) == 1, f"{old!r} occurs {GOOD.count(old)} times"
    return GOOD.replace(old, new)


class Case(NamedTuple):
    """One defect for which a description is refused, and words that the error has to say."""

    old: str
    new: str
    words: tuple[str, ...]

    @property
    def text(self) -> str:
        """The broken description."""
        return _changed(self.old, self.new)


class Taken(NamedTuple):
    """One oddity with which a description is taken: the kind of the note, and how its place begins."""

    old: str
    new: str
    kind: str
    where: str

    @property
    def text(self) -> str:
        """The odd description."""
        return _changed(self.old, self.new)


def write(folder: Path, content: str | bytes) -> Path:
    """A description in a folder, with the mesh it names."""
    (folder / "meshes").mkdir(parents=True, exist_ok=True)
    (folder / "meshes" / "fore.stl").write_bytes(TRIANGLE)
    file = folder / "robot.urdf"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


def _mesh(filename: str) -> Taken:
    return Taken("meshes/fore.stl", filename, "left out", "link 'fore'")


def _deep(levels: int) -> str:
    return "<gazebo>" * levels + "</gazebo>" * levels


MASS = '<mass value="2.5"/>'
INERTIA = '<inertia ixx="0.01" ixy="0.001" ixz="0" iyy="0.04" iyz="0" izz="0.045"/>'
AXIS = '<axis xyz="0 0 1"/>'
LIMIT = '<limit lower="-2" upper="2.5" effort="50" velocity="3"/>'
BOX = '<box size="0.4 0.06 0.05"/>'
UPPER = '<link name="upper">'
FORE_INERTIA = '<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.005" iyz="0" izz="0.021"/>'

REFUSED: dict[str, Case] = {
    "truncated": Case(GOOD[GOOD.index('<joint name="rail"') :], "", ("well-formed",)),
    "unclosed tag": Case("</robot>", "", ("well-formed",)),
    "tags crossed": Case("</visual>\n    <collision>", "<collision>\n    </visual>", ("well-formed", ":21")),
    "attribute twice": Case('radius="0.1"', 'radius="0.1" radius="0.2"', ("duplicate attribute",)),
    "attribute without quotes": Case('value="2.5"', "value=2.5", ("well-formed",)),
    "two roots": Case("</robot>", '</robot><robot name="b"/>', ("junk after document element",)),
    "document type": Case("<robot", "<!DOCTYPE robot><robot", ("<!DOCTYPE>", ":3")),
    "entity": Case(
        "<robot", '<!DOCTYPE r [<!ENTITY e SYSTEM "file:///etc/passwd">]><robot', ("<!DOCTYPE>", "entities")
    ),
    "entities that multiply": Case(
        "<robot", '<!DOCTYPE r [<!ENTITY a "aa"><!ENTITY b "&a;&a;">]><robot', ("<!DOCTYPE>",)
    ),
    "undefined entity": Case('value="2.5"', 'value="&mass;"', ("undefined entity",)),
    "another encoding": Case('encoding="utf-8"', 'encoding="utf-7"', ("UTF-8", "utf-7")),
    "a zero character": Case("</robot>", "\0</robot>", ("zero character",)),
    "nested without end": Case("</robot>", _deep(60) + "</robot>", ("nested at most 50",)),
    "another root": Case(GOOD[GOOD.index("<robot") :], "<sdf><model/></sdf>", ("<robot>", "found <sdf>")),
    "xacro": Case("</robot>", '<xacro:include filename="a.xacro"/></robot>', ("xacro first",)),
    "misspelt link": Case(
        '<link name="tool"/>', '<lnk name="tool"/>', ("joint 'mount'", "a child among the links", "'tool'")
    ),
    "no links": Case(GOOD[GOOD.index("<material") : GOOD.index("</robot>")], "", ("no link with a mass",)),
    "no moving joint": Case(
        GOOD[GOOD.index("<material") : GOOD.index("</robot>")], '<link name="a"/>', ("no link with a mass",)
    ),
    "too many links": Case(
        "</robot>", "".join(f'<link name="x{k}"/>' for k in range(1200)) + "</robot>", ("1 to 1000 links",)
    ),
    "link without name": Case('<link name="tool"/>', "<link/>", ("attribute 'name'",)),
    "link twice": Case('<link name="tool"/>', '<link name="fore"/>', ("link 'fore'", "unique", "in line 25")),
    "link name empty": Case('<link name="tool"/>', '<link name=""/>', ("a name of",)),
    "link name without end": Case(
        '<link name="tool"/>', f'<link name="{"t" * 50000}"/>', ("1 to 900 characters", "of 5000")
    ),
    "link that hangs from nothing": Case(
        '<link name="tool"/>', '<link name="tool"/><link name="lost"/>', ("one root", "'base', 'lost'")
    ),
    "no inertial": Case(
        GOOD[GOOD.index("<inertial>") : GOOD.index("</inertial>") + 11],
        "",
        ("joint 'shoulder'", "link 'upper'", "mass above 0", "<inertial>"),
    ),
    "two inertials": Case(
        "<inertial>\n      <origin", "<inertial/><inertial>\n      <origin", ("one <inertial>",)
    ),
    "no mass": Case(MASS, "", ("joint 'shoulder'", "mass above 0")),
    "two masses": Case(MASS, MASS + MASS, ("one <mass>", "line 15")),
    "mass without value": Case(MASS, "<mass/>", ("attribute 'value'",)),
    "mass value misspelt": Case(MASS, '<mass valeu="2.5"/>', ("did you mean 'value'",)),
    "mass that is a word": Case(
        MASS, '<mass value="abc"/>', ("inertial, mass", "finite number", "'abc'", ":15")
    ),
    "mass with a comma": Case(MASS, '<mass value="2,5"/>', ("finite number", "'2,5'")),
    "mass with underscores": Case(MASS, '<mass value="2_5"/>', ("finite number",)),
    "mass in hexadecimal": Case(MASS, '<mass value="0x10"/>', ("finite number",)),
    "mass in other digits": Case(MASS, '<mass value="٢"/>', ("finite number",)),
    "mass not a number": Case(MASS, '<mass value="nan"/>', ("finite number", "'nan'")),
    "mass infinite": Case(MASS, '<mass value="inf"/>', ("finite number", "'inf'")),
    "mass that overflows": Case(MASS, '<mass value="1e999"/>', ("finite number", "1e999")),
    "mass beyond measure": Case(MASS, '<mass value="1e20"/>', ("at most 1e+16",)),
    "mass negative": Case(MASS, '<mass value="-2.5"/>', ("link 'upper', inertial", "at least 0 kg", "-2.5")),
    "mass zero": Case(MASS, '<mass value="0"/>', ("joint 'shoulder'", "mass above 0")),
    "mass empty": Case(MASS, '<mass value=""/>', ("1 finite number", "found 0")),
    "mass twice in one": Case(MASS, '<mass value="1 2"/>', ("1 finite number", "found 2")),
    "mass and inertia zero": Case(
        MASS + "\n      " + INERTIA,
        '<mass value="0"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>',
        ("joint 'shoulder'", "mass above 0"),
    ),
    "no inertia": Case(INERTIA, "", ("link 'upper', inertial", "an inertia")),
    "inertia without ixx": Case('ixx="0.01" ', "", ("attribute 'ixx'",)),
    "inertia without iyz": Case('iyy="0.04" iyz="0"', 'iyy="0.04"', ("attribute 'iyz'",)),
    "inertia not a number": Case('ixx="0.01"', 'ixx="NaN"', ("ixx", "finite number", "'NaN'")),
    "inertia negative": Case('ixx="0.01"', 'ixx="-0.01"', ("link 'upper'", "positive definite")),
    "inertia indefinite": Case('ixy="0.001"', 'ixy="0.1"', ("positive definite", "principal moments")),
    "inertia of a point": Case(
        FORE_INERTIA,
        '<inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>',
        ("link 'fore', inertial", "an inertia"),
    ),
    "centre of mass infinite": Case('<origin xyz="0.2 0 0"', '<origin xyz="0.2 inf 0"', ("xyz", "'inf'")),
    "centre of mass in the plane": Case(
        '<origin xyz="0.2 0 0"', '<origin xyz="0.2 0"', ("3 finite", "found 2")
    ),
    "inertial turned by nothing": Case('rpy="0.1 0.2 0.3"', 'rpy="0.1 0.2 x"', ("rpy", "'x'")),
    "joint without name": Case('<joint name="mount" type', "<joint type", ("attribute 'name'",)),
    "joint twice": Case('<joint name="mount"', '<joint name="rail"', ("joint 'rail'", "unique")),
    "joint without type": Case('"elbow" type="continuous"', '"elbow"', ("attribute 'type'",)),
    "joint of unknown type": Case('type="continuous"', 'type="continous"', ("did you mean 'continuous'",)),
    "floating joint": Case(
        'type="continuous"', 'type="floating"', ("joint 'elbow'", "revolute", "'floating'")
    ),
    "planar joint": Case('type="continuous"', 'type="planar"', ("'planar'",)),
    "joint without parent": Case('<parent link="upper"/>', "", ("joint 'elbow'", "a <parent>")),
    "joint without child": Case('<child link="tool"/>', "", ("joint 'mount'", "a <child>")),
    "two parents in a joint": Case(
        '<parent link="upper"/>', '<parent link="upper"/><parent link="base"/>', ("one <parent>",)
    ),
    "unknown parent": Case(
        '<parent link="upper"/>', '<parent link="uper"/>', ("'uper'", "did you mean 'upper'")
    ),
    "unknown child": Case('<child link="tool"/>', '<child link="gripper"/>', ("a child", "'gripper'")),
    "a link with two parents": Case(
        '<child link="tool"/>', '<child link="upper"/>', ("joint 'mount'", "'upper' has one", "'shoulder'")
    ),
    "joint from a link to itself": Case('<child link="tool"/>', '<child link="slide"/>', ("both",)),
    "a cycle through all": Case(
        '<parent link="base"/>', '<parent link="tool"/>', ("a cycle of links", "'upper'")
    ),
    "a cycle beside the tree": Case(
        '<link name="tool"/>',
        '<link name="tool"/><link name="a"/><link name="b"/>'
        '<joint name="ab" type="fixed"><parent link="a"/><child link="b"/></joint>'
        '<joint name="ba" type="fixed"><parent link="b"/><child link="a"/></joint>',
        ("a cycle of links: 'a', 'b'",),
    ),
    "axis zero": Case(AXIS, '<axis xyz="0 0 0"/>', ("joint 'shoulder', axis", "direction", "0 0 0")),
    "axis not a number": Case(AXIS, '<axis xyz="0 0 nan"/>', ("axis", "'nan'")),
    "axis of two numbers": Case(AXIS, '<axis xyz="0 1"/>', ("3 finite numbers", "found 2")),
    "axis misspelt": Case(AXIS, '<axis xzy="0 0 1"/>', ("did you mean 'xyz'",)),
    "two axes": Case(AXIS, AXIS + AXIS, ("one <axis>",)),
    "limits inverted": Case(
        'lower="-2" upper="2.5"', 'lower="2" upper="-2.5"', ("lower below upper", "2 and -2.5")
    ),
    "friction not a number": Case('friction="0.2"', 'friction="nan"', ("friction", "'nan'")),
    "placement not a number": Case(
        '<origin xyz="0.4 0 0"/>', '<origin xyz="0.4 0 nan"/>', ("origin", "'nan'")
    ),
    "placement far beyond": Case('<origin xyz="0.4 0 0"/>', '<origin xyz="1e300 0 0"/>', ("at most 1e+16",)),
    "placement by a quaternion of another order": Case(
        '<origin xyz="0.4 0 0"/>',
        '<origin xyz="0.4 0 0" quat_wxyz="1 0 0 0"/>',
        ("'quat_wxyz'", "did you mean 'quat_xyzw'"),
    ),
    "two placements": Case('<origin xyz="0.4 0 0"/>', '<origin xyz="0.4 0 0"/><origin/>', ("one <origin>",)),
}

TAKEN: dict[str, Taken] = {
    "robot without name": Taken('<robot name="good">', "<robot>", "assumed", "robot"),
    "robot name with markup": Taken(
        '<robot name="good">',
        '<robot name="&lt;script&gt;alert(1)&lt;/script&gt;">',
        "assumed",
        "robot '<script>alert(1)</script>'",
    ),
    "misspelt inertial": Taken(
        "<inertial>\n      <origin",
        "<inertail/><inertial>\n      <origin",
        "left out",
        "link 'upper', inertail",
    ),
    "inertia against the triangle": Taken('izz="0.045"', 'izz="0.9"', "suspicious", "link 'upper', inertial"),
    "joint named universe": Taken('<joint name="elbow"', '<joint name="universe"', "assumed", "robot 'good'"),
    "joint named as a link": Taken('<joint name="elbow"', '<joint name="tool"', "assumed", "robot 'good'"),
    "no limit": Taken(LIMIT, "", "assumed", "joint 'shoulder'"),
    "limit misspelt": Taken(LIMIT, LIMIT.replace("limit", "limits"), "assumed", "joint 'shoulder'"),
    "no lower limit": Taken(
        LIMIT, '<limit upper="2" effort="5" velocity="3"/>', "assumed", "joint 'shoulder', limit"
    ),
    "no effort limit": Taken(
        LIMIT, '<limit lower="-2" upper="2" velocity="3"/>', "assumed", "joint 'shoulder', limit"
    ),
    "limits equal": Taken('lower="-2" upper="2.5"', 'lower="0" upper="0"', "locked", "joint 'shoulder'"),
    "limits infinite": Taken('upper="2.5"', 'upper="inf"', "assumed", "joint 'shoulder', limit"),
    "effort zero": Taken('effort="50"', 'effort="0"', "assumed", "joint 'shoulder', limit"),
    "effort negative": Taken('effort="50"', 'effort="-50"', "assumed", "joint 'shoulder', limit"),
    "effort not a number": Taken('effort="50"', 'effort="NaN"', "assumed", "joint 'shoulder', limit"),
    "velocity empty": Taken('velocity="3"', 'velocity=""', "assumed", "joint 'shoulder', limit"),
    "upper limit with a comma": Taken('upper="2.5"', 'upper="2,5"', "assumed", "joint 'shoulder', limit"),
    "velocity zero": Taken('velocity="3"', 'velocity="0"', "assumed", "joint 'shoulder', limit"),
    "effort of a continuous joint zero": Taken(
        'effort="30"', 'effort="0"', "assumed", "joint 'elbow', limit"
    ),
    "damping negative": Taken('damping="0.1"', 'damping="-0.1"', "left out", "joint 'shoulder', dynamics"),
    "mimic joint": Taken(
        '<limit effort="30"', '<mimic joint="shoulder"/><limit effort="30"', "locked", "joint 'elbow'"
    ),
    "visual without geometry": Taken(f"<geometry>{BOX}</geometry>", "", "left out", "link 'upper'"),
    "geometry empty": Taken(BOX, "", "left out", "link 'upper'"),
    "geometry with two shapes": Taken(BOX, BOX + '<sphere radius="1"/>', "left out", "link 'upper'"),
    "geometry unknown": Taken(BOX, '<bxo size="1 1 1"/>', "left out", "link 'upper'"),
    "box of two sides": Taken(BOX, '<box size="0.4 0.06"/>', "left out", "link 'upper'"),
    "box with a negative side": Taken(BOX, '<box size="0.4 -0.06 0.05"/>', "left out", "link 'upper'"),
    "cylinder without length": Taken('radius="0.1" length="0.1"', 'radius="0.1"', "left out", "link 'base'"),
    "cylinder flat": Taken('radius="0.1" length="0.1"', 'radius="0.1" length="0"', "left out", "link 'base'"),
    "sphere negative": Taken('<sphere radius="0.04"/>', '<sphere radius="-1"/>', "left out", "link 'slide'"),
    "collision shape negative": Taken(
        '<capsule radius="0.03"', '<capsule radius="-1"', "left out", "link 'upper'"
    ),
    "colour of three": Taken('rgba="0.9 0.5 0.1 1"', 'rgba="0.9 0.5 0.1"', "left out", "link 'fore'"),
    "colour beyond one": Taken('rgba="0.9 0.5 0.1 1"', 'rgba="255 128 0 1"', "left out", "link 'fore'"),
    "mesh without file name": Taken('filename="meshes/fore.stl" ', "", "left out", "link 'fore'"),
    "mesh scaled to nothing": Taken('scale="1 1 1"', 'scale="1 0 1"', "left out", "link 'fore'"),
    "mesh scaled by a word": Taken('scale="1 1 1"', 'scale="1 a 1"', "left out", "link 'fore'"),
    "mesh with an absolute path": _mesh("/etc/passwd"),
    "mesh by a file address": _mesh("file:///etc/fore.stl"),
    "mesh from the network": _mesh("http://example.org/fore.stl"),
    "mesh in the folder above": _mesh("../fore.stl"),
    "mesh that climbs out": _mesh("meshes/../../fore.stl"),
    "mesh that climbs out of a package": _mesh("package://example-robot-data/../x.stl"),
    "mesh in a package that is a climb": _mesh("package://../x.stl"),
    "mesh in an absolute package": _mesh("package:///etc/x.stl"),
    "mesh with a backslash": _mesh("..\\fore.stl"),
    "mesh from a drive": _mesh("C:/fore.stl"),
    "mesh that is a package alone": _mesh("package://fore.stl"),
    "mesh with coded dots": _mesh("%2e%2e/fore.stl"),
    "mesh in a hidden folder": _mesh(".ssh/fore.stl"),
    "mesh name with markup": _mesh("&lt;script&gt;.stl"),
    "mesh in another format": _mesh("meshes/fore.html"),
}
