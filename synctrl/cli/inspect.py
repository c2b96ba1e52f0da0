"""`synctrl inspect`: what was read in a robot's file, read once more by others, and a picture."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import InputError, RobotWarning
from ..robots.robot import Robot
from . import codes
from .answer import Answer, answering
from .names import robot_names
from .options import Json

Source = Annotated[
    str,
    typer.Argument(
        metavar="ROBOT",
        help="A URDF, xacro or MJCF file, or a name of the catalogue.",
        autocompletion=robot_names,
    ),
]
Pictures = Annotated[
    Path | None,
    typer.Option("--out", "-o", metavar="FOLDER", help="Write a picture (PNG) and a scene to turn (HTML)."),
]
Tip = Annotated[str | None, typer.Option(metavar="LINK", help="The frame to control.")]
Packages = Annotated[
    list[Path],
    typer.Option("--package-dir", metavar="FOLDER", help="Where packages of meshes are looked for."),
]
Held = Annotated[list[str], typer.Option("--lock", metavar="JOINT=POSITION", help="Hold a joint, rad or m.")]
Arguments = Annotated[
    list[str], typer.Option("--arg", metavar="NAME=VALUE", help="An argument of a xacro file.")
]
Again = Annotated[bool, typer.Option(help="Let yourdfpy and MuJoCo read the file as well.")]


def inspect(
    robot: Source,
    out: Pictures = None,
    tip: Tip = None,
    package_dir: Packages = [],  # noqa: B006
    lock: Held = [],  # noqa: B006
    arg: Arguments = [],  # noqa: B006
    second: Again = True,
    as_json: Json = False,
) -> None:
    """Show what is read in the file of a robot: tree, masses, limits, units, and what is suspicious.

    yourdfpy and, where it is installed, MuJoCo read the same file, and what they read is compared. Ends with
    4 if one of them reads something else.
    """
    with answering(as_json) as answer:
        from ..robots.catalog import load_robot

        args = _named("--arg", arg) if arg else None
        held = {name: _position(text) for name, text in _named("--lock", lock).items()}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RobotWarning)  # all of it is shown below
            options: dict[str, Any] = {"package_dirs": package_dir, "locked": held, "xacro_args": args}
            found = load_robot(_source(robot), tip, **options)
        _tell(answer, found)
        if second:
            _read_again(answer, found, args)
        if out is not None:
            _draw(answer, found, out)


def _source(text: str) -> str | Path:
    """A file if there is one of this name, else what the catalogue may know."""
    return Path(text) if Path(text).is_file() else text


def _tell(answer: Answer, robot: Robot) -> None:
    from .robot_table import about, joint_table, remarks, tree

    data = about(robot)
    answer.data |= data
    file = f", {data['file']}" if data["file"] else ""
    head = f"{robot.name}: {robot.nv} joints that move, {data['moving_mass']:.4g} kg, tip {robot.tip}{file}"
    answer.show(head, "", tree(robot), "", joint_table(robot))
    if any(joint[name] for joint in data["joints"] for name in ("viscous", "coulomb", "rotor")):
        answer.show("Friction in N·m·s/rad and N·m, rotors in kg·m² (N·s/m, N and kg where a joint slides).")
    answer.show("", remarks(robot))


def _read_again(answer: Answer, robot: Robot, args: dict[str, str] | None) -> None:
    from ..robots.second_reading import second_readings
    from .robot_table import reading_table

    readings = second_readings(robot, args)
    answer.data["readings"] = [
        {
            "library": each.library,
            "refusal": each.refusal,
            "agrees": each.agrees,
            "differences": {difference.what: difference.size for difference in each.differences},
        }
        for each in readings
    ]
    words = reading_table(readings) if readings else "Nobody else reads it: it is no URDF and no xacro file."
    answer.show("", words)
    if any(not each.agrees and not each.refusal for each in readings):
        answer.code = codes.FOUND_WANTING


def _draw(answer: Answer, robot: Robot, folder: Path) -> None:
    from ..files import reported, whole_file
    from ..show.robot_view import robot_picture, robot_scene

    stem = "".join(c if c.isalnum() or c in "-_." else "_" for c in robot.name)
    png = folder / f"{stem}.png"
    with reported("write the picture", png), whole_file(png) as file:
        robot_picture(robot).savefig(file, format="png", metadata={"Software": None})
    html = robot_scene(robot).write(folder / f"{stem}.html")
    answer.data["written"] = [png, html]
    answer.show("", f"Written: {png}, {html}")


def _named(option: str, texts: list[str]) -> dict[str, str]:
    """Values by name, of texts such as `name=value`."""
    pairs = [text.partition("=") for text in texts]
    for name, sign, _ in pairs:
        if not name or not sign:
            raise InputError.expected("NAME=VALUE", f"{name}{sign}", option)
    return {name: value for name, _, value in pairs}


def _position(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError.expected("a position, rad or m", text, "--lock") from None
