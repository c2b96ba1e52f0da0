"""Broken robot descriptions: each is `good.urdf` with one change that has a name.

A case is (what to replace, by what, words that the error has to say). What is replaced occurs once.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

GOOD = (Path(__file__).parent / "good.urdf").read_text(encoding="utf-8")
TRIANGLE = bytes(80) + (1).to_bytes(4, "little") + bytes(50)
"""A binary STL with one triangle."""


class Case(NamedTuple):
    """One defect."""

    old: str
    new: str
    words: tuple[str, ...]

    @property
    def text(self) -> str:
        """The broken description."""
        assert GOOD.count(self.old) == 1, f"{self.old!r} occurs {GOOD.count(self.old)} times"
        return GOOD.replace(self.old, self.new)


def write(folder: Path, content: str | bytes) -> Path:
    """A description in a folder, with the mesh it names."""
    (folder / "meshes").mkdir(parents=True, exist_ok=True)
    (folder / "meshes" / "fore.stl").write_bytes(TRIANGLE)
    file = folder / "robot.urdf"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


def _mesh(filename: str, *words: str) -> Case:
    return Case("meshes/fore.stl", filename, ("link 'fore'", "mesh", *words))


def _deep(levels: int) -> str:
    return "<gazebo>" * levels + "</gazebo>" * levels


MASS = '<mass value="2.5"/>'
INERTIA = '<inertia ixx="0.01" ixy="0.001" ixz="0" iyy="0.04" iyz="0" izz="0.045"/>'
AXIS = '<axis xyz="0 0 1"/>'
LIMIT = '<limit lower="-2" upper="2.5" effort="50" velocity="3"/>'
BOX = '<box size="0.4 0.06 0.05"/>'
UPPER = '<link name="upper">'
FORE_INERTIA = '<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.005" iyz="0" izz="0.021"/>'

CORPUS: dict[str, Case] = {
    # XML
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
    "another encoding": Case('encoding="utf-8"', 'encoding="iso-8859-1"', ("UTF-8", "iso-8859-1")),
    "a zero character": Case("</robot>", "\0</robot>", ("well-formed",)),
    "nested without end": Case("</robot>", _deep(60) + "</robot>", ("nested at most 50",)),
    # the robot
    "another root": Case(GOOD[GOOD.index("<robot") :], "<sdf><model/></sdf>", ("<robot>", "found <sdf>")),
    "xacro": Case("</robot>", '<xacro:include filename="a.xacro"/></robot>', ("xacro first",)),
    "robot without name": Case('<robot name="good">', "<robot>", ("attribute 'name'",)),
    "robot name with markup": Case(
        '<robot name="good">', '<robot name="&lt;script&gt;alert(1)&lt;/script&gt;">', ("letters",)
    ),
    "misspelt link": Case('<link name="tool"/>', '<lnk name="tool"/>', ("<lnk>", "did you mean 'link'")),
    "no links": Case(
        GOOD[GOOD.index("<material") : GOOD.index("</robot>")], "", ("1 to 1000 links", "found 0")
    ),
    "no moving joint": Case(
        GOOD[GOOD.index("<material") : GOOD.index("</robot>")],
        '<link name="a"/>',
        ("joints that move", "found 0"),
    ),
    "too many links": Case(
        "</robot>", "".join(f'<link name="x{k}"/>' for k in range(1200)) + "</robot>", ("1 to 1000 links",)
    ),
    # links
    "link without name": Case('<link name="tool"/>', "<link/>", ("attribute 'name'",)),
    "link twice": Case('<link name="tool"/>', '<link name="fore"/>', ("link 'fore'", "unique", "in line 25")),
    "link named universe": Case('<link name="tool"/>', '<link name="universe"/>', ("'universe'",)),
    "link name empty": Case('<link name="tool"/>', '<link name=""/>', ("a name of",)),
    "link name with a quote": Case('<link name="tool"/>', "<link name='a\"onload'/>", ("letters", "onload")),
    "link name with a path": Case('<link name="tool"/>', '<link name="../tool"/>', ("letters",)),
    "link name with a line break": Case(
        '<link name="tool"/>', '<link name="to&#10;ol"/>', ("letters", "\\n")
    ),
    "link name not ASCII": Case('<link name="tool"/>', '<link name="töol"/>', ("letters",)),
    "link name without end": Case('<link name="tool"/>', f'<link name="{"t" * 500}"/>', ("128",)),
    "link that hangs from nothing": Case(
        '<link name="tool"/>', '<link name="tool"/><link name="lost"/>', ("one root", "'base', 'lost'")
    ),
    # inertials
    "no inertial": Case(
        GOOD[GOOD.index("<inertial>") : GOOD.index("</inertial>") + 11],
        "",
        ("joint 'shoulder'", "link 'upper'", "mass above 0", "<inertial>"),
    ),
    "two inertials": Case(
        "<inertial>\n      <origin", "<inertial/><inertial>\n      <origin", ("one <inertial>",)
    ),
    "misspelt inertial": Case(
        "<inertial>\n      <origin", "<inertail/><inertial>\n      <origin", ("did you mean 'inertial'",)
    ),
    "no mass": Case(MASS, "", ("link 'upper', inertial", "a <mass>")),
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
    "mass zero": Case(MASS, '<mass value="0"/>', ("without a mass",)),
    "mass empty": Case(MASS, '<mass value=""/>', ("1 finite number", "found 0")),
    "mass twice in one": Case(MASS, '<mass value="1 2"/>', ("1 finite number", "found 2")),
    "mass and inertia zero": Case(
        MASS + "\n      " + INERTIA,
        '<mass value="0"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>',
        ("joint 'shoulder'", "mass above 0"),
    ),
    "no inertia": Case(INERTIA, "", ("link 'upper', inertial", "a <inertia>")),
    "inertia without ixx": Case('ixx="0.01" ', "", ("attribute 'ixx'",)),
    "inertia without iyz": Case('iyy="0.04" iyz="0"', 'iyy="0.04"', ("attribute 'iyz'",)),
    "inertia not a number": Case('ixx="0.01"', 'ixx="NaN"', ("ixx", "finite number", "'NaN'")),
    "inertia negative": Case('ixx="0.01"', 'ixx="-0.01"', ("link 'upper'", "positive definite")),
    "inertia indefinite": Case('ixy="0.001"', 'ixy="0.1"', ("positive definite", "principal moments")),
    "inertia against the triangle": Case('izz="0.045"', 'izz="0.9"', ("sum of the others", "0.9")),
    "inertia of a point": Case(
        FORE_INERTIA,
        '<inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>',
        ("joint 'elbow'", "link 'fore'", "positive definite"),
    ),
    "centre of mass infinite": Case('<origin xyz="0.2 0 0"', '<origin xyz="0.2 inf 0"', ("xyz", "'inf'")),
    "centre of mass in the plane": Case(
        '<origin xyz="0.2 0 0"', '<origin xyz="0.2 0"', ("3 finite", "found 2")
    ),
    "inertial turned by nothing": Case('rpy="0.1 0.2 0.3"', 'rpy="0.1 0.2 x"', ("rpy", "'x'")),
    # joints
    "joint without name": Case('<joint name="mount" type', "<joint type", ("attribute 'name'",)),
    "joint twice": Case('<joint name="mount"', '<joint name="rail"', ("joint 'rail'", "unique")),
    "joint named universe": Case('<joint name="elbow"', '<joint name="universe"', ("'universe'",)),
    "joint named as a link": Case('<joint name="elbow"', '<joint name="tool"', ("joint 'tool'", "same name")),
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
    "a cycle through all": Case('<parent link="base"/>', '<parent link="tool"/>', ("root", "found")),
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
    "no limit": Case(LIMIT, "", ("joint 'shoulder'", "a <limit>")),
    "limit misspelt": Case(LIMIT, LIMIT.replace("limit", "limits"), ("did you mean 'limit'",)),
    "no lower limit": Case(LIMIT, '<limit upper="2" effort="5" velocity="3"/>', ("attribute 'lower'",)),
    "no effort limit": Case(LIMIT, '<limit lower="-2" upper="2" velocity="3"/>', ("attribute 'effort'",)),
    "limits inverted": Case(
        'lower="-2" upper="2.5"', 'lower="2" upper="-2.5"', ("lower below upper", "2 and -2.5")
    ),
    "limits equal": Case('lower="-2" upper="2.5"', 'lower="0" upper="0"', ("lower below upper",)),
    "limits infinite": Case('upper="2.5"', 'upper="inf"', ("upper", "'inf'")),
    "effort zero": Case('effort="50"', 'effort="0"', ("joint 'shoulder', limit", "effort above 0")),
    "effort negative": Case('effort="50"', 'effort="-50"', ("effort above 0", "-50")),
    "velocity zero": Case('velocity="3"', 'velocity="0"', ("velocity above 0",)),
    "effort of a continuous joint zero": Case(
        'effort="30"', 'effort="0"', ("joint 'elbow', limit", "above 0")
    ),
    "damping negative": Case('damping="0.1"', 'damping="-0.1"', ("damping of at least 0",)),
    "friction not a number": Case('friction="0.2"', 'friction="nan"', ("friction", "'nan'")),
    "mimic joint": Case(
        '<limit effort="30"',
        '<mimic joint="shoulder"/><limit effort="30"',
        ("joint 'elbow'", "mimics 'shoulder'"),
    ),
    "placement not a number": Case(
        '<origin xyz="0.4 0 0"/>', '<origin xyz="0.4 0 nan"/>', ("origin", "'nan'")
    ),
    "placement far beyond": Case('<origin xyz="0.4 0 0"/>', '<origin xyz="1e300 0 0"/>', ("at most 1e+16",)),
    "two placements": Case('<origin xyz="0.4 0 0"/>', '<origin xyz="0.4 0 0"/><origin/>', ("one <origin>",)),
    # shapes
    "visual without geometry": Case(
        f"<geometry>{BOX}</geometry>", "", ("link 'upper', visual", "<geometry>")
    ),
    "geometry empty": Case(BOX, "", ("one shape of box", "found 0")),
    "geometry with two shapes": Case(BOX, BOX + '<sphere radius="1"/>', ("one shape", "found 2")),
    "geometry unknown": Case(BOX, '<bxo size="1 1 1"/>', ("did you mean 'box'",)),
    "box of two sides": Case(BOX, '<box size="0.4 0.06"/>', ("size of 3", "found 2")),
    "box with a negative side": Case(BOX, '<box size="0.4 -0.06 0.05"/>', ("above 0", "-0.06")),
    "cylinder without length": Case('radius="0.1" length="0.1"', 'radius="0.1"', ("attribute 'length'",)),
    "cylinder flat": Case('radius="0.1" length="0.1"', 'radius="0.1" length="0"', ("length above 0",)),
    "sphere negative": Case('<sphere radius="0.04"/>', '<sphere radius="-1"/>', ("radius above 0",)),
    "collision shape negative": Case(
        '<capsule radius="0.03"', '<capsule radius="-1"', ("collision", "above 0")
    ),
    "colour of three": Case('rgba="0.9 0.5 0.1 1"', 'rgba="0.9 0.5 0.1"', ("rgba of 4", "found 3")),
    "colour beyond one": Case('rgba="0.9 0.5 0.1 1"', 'rgba="255 128 0 1"', ("from 0 to 1", "255")),
    # meshes
    "mesh without file name": Case('filename="meshes/fore.stl" ', "", ("attribute 'filename'",)),
    "mesh scaled to nothing": Case('scale="1 1 1"', 'scale="1 0 1"', ("scale other than 0",)),
    "mesh scaled by a word": Case('scale="1 1 1"', 'scale="1 a 1"', ("scale", "'a'")),
    "mesh with an absolute path": _mesh("/etc/passwd", "below this folder", "/etc/passwd"),
    "mesh by a file address": _mesh("file:///etc/fore.stl", "below this folder"),
    "mesh from the network": _mesh("http://example.org/fore.stl", "below this folder"),
    "mesh in the folder above": _mesh("../fore.stl", "without '..'"),
    "mesh that climbs out": _mesh("meshes/../../fore.stl", "without '..'"),
    "mesh that climbs out of a package": _mesh("package://example-robot-data/../x.stl", "without '..'"),
    "mesh in a package that is a climb": _mesh("package://../x.stl", "without '..'"),
    "mesh in an absolute package": _mesh("package:///etc/x.stl", "below this folder"),
    "mesh with a backslash": _mesh("..\\fore.stl", "below this folder"),
    "mesh from a drive": _mesh("C:/fore.stl", "below this folder"),
    "mesh that is a package alone": _mesh("package://fore.stl", "a mesh file in its package"),
    "mesh with coded dots": _mesh("%2e%2e/fore.stl", "below this folder"),
    "mesh in a hidden folder": _mesh(".ssh/fore.stl", "below this folder"),
    "mesh name with markup": _mesh("&lt;script&gt;.stl", "below this folder"),
    "mesh in another format": _mesh("meshes/fore.html", ".stl, .dae, .obj"),
}
