"""From an experiment to a cell file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from ..checks import instance
from ..coupling.cell import Cell, Member
from ..errors import SynctrlError
from ..files import write_whole
from ..robots.base_parameters import BaseParameters
from ..robots.parameters import FrictionParameters, FullParameters, LinearParameters
from ..robots.robot import Robot
from ..simulation.plant import Plant
from ..simulation.simulate import Experiment
from ..tasks.spaces import JointSpace
from . import toml
from .couplings import coupling_keys
from .file import BY_PART, FORM, RunTable
from .folders import from_folder
from .plants import PLANTS
from .problems import CellFileError, Misfit, Place, key_of
from .robots import CHANGES
from .sharing import with_names
from .values import PLAIN, plain


def write_cell(experiment: Experiment, path: str | Path, run: Mapping[str, Any] | None = None) -> Path:
    """Write an experiment as a cell file, which reads back to the same bits.

    Args:
        experiment: whose parts all have names in cell files.
        path: of the file; robots that come from files have to lie below its folder.
        run: how it is run unless told otherwise: arguments of `Experiment.simulate`.

    Returns:
        The path.

    Raises:
        InputError: no experiment, or no path.
        CellFileError: a part of one's own, a function for example, which no file can say; something in `run`
            that [run] does not have; or a file that cannot be written.
    """
    instance("experiment", experiment, Experiment, "an Experiment")
    instance("path", path, (str, Path), "a path")
    path = Path(path)
    try:
        data = Writer(path.parent).experiment(experiment)
        data |= {"run": _run(run)} if run else {}
        write_whole(path, toml.document(data))
    except Misfit as misfit:
        key = key_of(misfit.place) or None
        raise CellFileError(misfit.problem, subject=key, found=misfit.found, file=path) from misfit.__cause__
    except OSError as error:
        raise CellFileError(f"cannot be written: {error.strerror}", file=path) from error
    return path


def _run(run: Mapping[str, Any]) -> dict[str, Any]:
    """The table of how a cell is run, as it can be read again."""
    instance("run", run, Mapping, "arguments of `Experiment.simulate`")
    said = {name: plain(value) for name, value in run.items() if value is not None}
    try:
        RunTable.model_validate(said)
    except ValidationError as error:
        *_, name = ("run", *error.errors(include_url=False)[0]["loc"])
        words = f"expected arguments that [run] can have, found {name} = {said.get(str(name))!r}"
        raise Misfit.at(("run", name), words, name) from None
    return said


class Writer:
    """What writes the parts of one experiment as plain data.

    Args:
        folder: of the file.
    """

    def __init__(self, folder: Path):
        self._folder = folder

    def experiment(self, made: Experiment) -> dict[str, Any]:
        """The whole file.

        Raises:
            Misfit: something that has no name in cell files.
        """
        cell = made.cell
        motions = [member.trajectory for member in cell.members]
        with _placed(("coupling",)):
            coupling = coupling_keys(cell.coupling, motions)
        said = {
            "form": FORM,
            **self._values(made),
            "robots": [self._member(member, ("robots", i)) for i, member in enumerate(cell.members)],
            "coupling": coupling,
            **self._parts(made),
            **self._plant(made.plant_type),
        }
        return with_names(said)

    def part(self, part: Any, place: Place) -> Any:
        """Plain data of a part.

        Raises:
            Misfit: it has no name in cell files.
        """
        value = plain(part)
        if isinstance(value, list):
            return [self.part(each, (*place, k)) for k, each in enumerate(value)]
        if value is None or type(value) in PLAIN:
            return value
        if hasattr(value, "rows") and type(value).__name__ == "RaggedGain":
            return plain(value.rows)
        if isinstance(value, Mapping):
            return {name: self.part(each, (*place, name)) for name, each in value.items()}
        kind = BY_PART.get(type(value))
        if kind is None:
            name = getattr(value, "__qualname__", type(value).__qualname__)
            words = f"expected a part that has a name in cell files, found {name}, which has none"
            raise Misfit.at(place, words, name)
        keys = {name: self.part(each, (*place, name)) for name, each in kind.told(kind.read(value)).items()}
        return {"kind": kind.name, **keys} if kind.name else keys

    # -- internals ----------------------------------------------------------------------------------------

    def _values(self, made: Experiment) -> dict[str, Any]:
        cell = made.cell
        values = {
            "name": cell.name if cell.name != "cell" else None,
            "title": made.title,
            "duration": float(made.duration),
            "space": None if type(cell.space) is JointSpace else self._space(cell),
            "clocks": cell.clocks.tolist() if cell.clocks.any() else None,
            "saturate": True if made.saturate else None,
            "reference_acceleration": made.reference_acceleration,
            "k_r_space": made.k_r_space,
        }
        return {name: value for name, value in values.items() if value is not None}

    def _space(self, cell: Cell) -> Any:
        written = self.part(cell.space, ("space",))
        return written["kind"] if written.keys() == {"kind"} else written

    def _parts(self, made: Experiment) -> dict[str, Any]:
        parts: dict[str, Any] = {
            "gains": made.gains,
            "law": made.law,
            "adaptation": made.adaptation,
            "network": made.network,
            "admittance": made.admittance,
            "sensors": list(made.sensors),
            "actuators": list(made.actuators),
            "disturbances": list(made.disturbances),
            "loads": list(made.payloads),
        }
        written = {name: self.part(part, (name,)) for name, part in parts.items()}
        return {name: value for name, value in written.items() if value is not None and value != []}

    def _member(self, member: Member, place: Place) -> dict[str, Any]:
        keys = {
            "name": member.name,
            **self.arm(member.robot, place, member.name),
            "q0": plain(member.q0) if member.q0 is None else np.asarray(member.q0, float).tolist(),
            "v0": member.v0 if isinstance(member.v0, str | None) else np.asarray(member.v0, float).tolist(),
            "parameters": self._parameters(member, (*place, "parameters")),
            **_estimate(member),
            "friction": self._friction(member, (*place, "friction")),
            "motion": self.part(member.trajectory, (*place, "motion")),
        }
        return {name: value for name, value in keys.items() if value is not None}

    def arm(self, robot: Robot, place: Place, called: str | None = None) -> dict[str, Any]:
        """Keys of a robot.

        Args:
            robot: the robot.
            place: in the file.
            called: what it is called unless something else is said.
        """
        if not robot.origin:
            words = "expected a robot of load_robot, and what its methods made of it, found one of a model"
            raise Misfit.at((*place, "robot"), f"{words}: '{robot.name}'", robot.name)
        loaded, *steps = robot.origin
        keys = self._loaded(loaded.given, (*place, "robot"))
        if steps and steps[0].kind == "weightless":
            keys["gravity"] = False
            del steps[0]
        if steps and steps[0].kind == "placed":
            keys["base"] = _base(steps.pop(0).given, called)
        changes = [self._change(step.kind, step.given, place) for step in steps]
        return {**keys, **({"changes": changes} if changes else {})}

    def _loaded(self, given: Mapping[str, Any], place: Place) -> dict[str, Any]:
        names = {"xacro_args": "xacro", "package_dirs": "packages", "source": "robot"}
        keys = {names.get(name, name): value for name, value in given.items()}
        keys["packages"] = [self._file(Path(folder), place) for folder in keys.pop("packages", ())]
        source = keys["robot"]
        keys["robot"] = self._file(source, place) if isinstance(source, Path) else source
        return {
            name: self.part(value, place) for name, value in keys.items() if value not in (None, False, [])
        }

    def _file(self, path: Path, place: Place) -> str:
        name = from_folder(self._folder, path)
        if name is None:
            words = f"expected a file below the folder of the cell file, found {path}"
            raise Misfit.at(place, f"{words}; write the cell file beside it, or copy it there", str(path))
        return name if "/" in name or Path(name).suffix else f"./{name}"

    def _change(self, kind: str, given: Mapping[str, Any], place: Place) -> dict[str, Any]:
        keys = {name: plain(value) for name, value in given.items() if value is not None}
        return {"kind": CHANGES[kind].name, **keys}

    def _parameters(self, member: Member, place: Place) -> Any:
        given: Any = member.parameters
        if given is None or isinstance(given, str):
            return given
        if isinstance(given, FrictionParameters) and member.friction_from == "urdf":
            return None if type(given.base) is FullParameters else self._adapted(given.base, place)
        return self._adapted(given, place)

    def _adapted(self, given: Any, place: Place) -> Any:
        if type(given) in (FullParameters, BaseParameters):
            return "full" if type(given) is FullParameters else "base"
        if type(given) is LinearParameters:
            return {
                "kind": "linear",
                "matrix": given.matrix.tolist(),
                "theta": given.theta.tolist(),
                "names": list(given.names),
            }
        if type(given) is FrictionParameters:
            base = {} if type(given.base) is FullParameters else {"base": self._adapted(given.base, place)}
            return {"kind": "friction", **base, **({"armature": True} if given.armature else {})}
        return self.part(given, place)

    def _friction(self, member: Member, place: Place) -> Any:
        if member.friction_from == "nobody":
            return None
        if member.friction_from == "urdf":
            return "urdf"
        return self.part(member.friction, place) or "none"

    def _plant(self, plant: Any) -> dict[str, Any]:
        if plant is Plant:
            return {}
        place, given = ("plant",), dict(plant.keywords) if isinstance(plant, partial) else {}
        kind = PLANTS.get(plant.func) if isinstance(plant, partial) and not plant.args else None
        if kind is None:
            name = getattr(plant, "__qualname__", repr(plant))
            raise Misfit.at(place, f"expected a plant that has a name in cell files, found {name}", name)
        keys = {name: self._of_plant(name, value, (*place, name)) for name, value in given.items()}
        return {"plant": {"kind": kind.name, **kind.told(keys)}}

    def _of_plant(self, name: str, value: Any, place: Place) -> Any:
        if name == "robots" and value is not None:
            return [self.arm(robot, (*place, i)) for i, robot in enumerate(value)]
        if name == "at" and isinstance(value, tuple) and len(value) == 2 and np.ndim(value[1]) == 2:
            return {"xyz": plain(np.asarray(value[0], float)), "rotation": plain(np.asarray(value[1], float))}
        return self.part(list(value) if isinstance(value, tuple) else value, place)


def _base(given: Mapping[str, Any], called: str | None) -> dict[str, Any]:
    """Keys of a base, but for those that are what they are by default."""
    keys = {"xyz": plain(given["xyz"]), "rpy": plain(given["rpy"]), "name": given["name"]}
    keys["name"] = None if keys["name"] == called else keys["name"]
    return {
        name: value for name, value in keys.items() if value is not None and repr(value) != "[0.0, 0.0, 0.0]"
    }


def _estimate(member: Member) -> dict[str, Any]:
    """The estimate, as a share of the true values where it is one to the last bit."""
    if member.theta_hat0 is None:
        return {}
    estimate, theta = np.asarray(member.theta_hat0, float), member.theta
    at = int(np.argmax(np.abs(theta)))
    if estimate.shape == theta.shape and theta[at]:
        known = round(float(estimate[at] / theta[at]), 9)
        if (known * theta).tobytes() == estimate.tobytes():
            return {"known": known}
    return {"estimate": estimate.tolist()}


@contextmanager
def _placed(place: Place) -> Iterator[None]:
    try:
        yield
    except SynctrlError as error:
        raise Misfit.at(place, error.problem, error.found) from error
