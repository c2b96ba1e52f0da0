"""What a digital controller is given by the world, its parts and a file, and what it gives back: checked.

A state has known arrays of known sizes, so nothing in a file is believed: it is no longer than it may be, and
the header of every array has to be the one that numpy writes for that array. There is no pickle in it.
"""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, instance, numbers, shaped
from ..coupling.cell import Cell
from ..coupling.desired import rows_of
from ..errors import (
    InputError,
    NonFiniteError,
    OrientationError,
    ResultError,
    SimulationError,
    SingularJacobianError,
)
from ..files import reported, whole_file
from ..tasks.measurement import first_beyond
from .controller import Controller, Signals
from .network import Messages

#: bytes of an archive beside its arrays, per array: names, sizes and numpy's header
OVERHEAD = 1024
#: periods up to which samples can be told from each other
LONGEST = 2.0**50
#: instants of messages in one of them
PER_SAMPLE = 1000
#: what the package's spaces watch: the kind of error, and what it is about
_ENDS = {
    "condition": (SingularJacobianError, "condition number of the Jacobian"),
    "orientation": (OrientationError, "orientation error"),
}


def measurement(q: ArrayLike, v: ArrayLike, shape: tuple[int, int]) -> np.ndarray:
    """q and v as one new array, (2, n, nv); whether they are finite is asked later.

    Raises:
        InputError: not numbers, or another shape.
    """
    motion = np.empty((2, *shape))
    for row, name, value in zip(motion, "qv", (q, v), strict=True):
        row[...] = numbers(name, value, shape)
    return motion


def desired_motion(controller: Controller, desired: ArrayLike) -> np.ndarray:
    """A caller's own desired motion, as an array.

    Raises:
        InputError: another shape, or an adaptation that sets the pace of the cell's own.
    """
    if hasattr(controller.adaptation, "pace"):
        raise InputError("expected none, for the adaptation sets its pace, found one", subject="desired")
    cell = controller.cell
    return finite_array("desired", desired, (rows_of(cell.space), cell.n, cell.m))


def not_finite(cell: Cell, t: float, motion: np.ndarray) -> InputError | None:
    """What is wrong with a measurement, (2, n, nv), if a number of it is not finite."""
    if np.isfinite(motion).all():
        return None
    part, robot, joint = np.argwhere(~np.isfinite(motion))[0]
    found, where = float(motion[part, robot, joint]), f"joint {joint + 1} of {cell.names[robot]}"
    message = f"expected finite numbers, found {found} for {where} at t = {t:g} s"
    failure = InputError(message, subject="qv"[part], found=found)
    return failure.about(failure.subject, robot=int(robot), time=t)


def check_signals(cell: Cell, t: float, signals: Signals) -> None:
    """Refuse what no robot may be given of what the law computed at t, s; see `DiscreteController.step`.

    NonFiniteError stands for a torque, or a rate of an estimate or integral, that is not finite.
    """
    beyond = first_beyond(cell.task, signals.task)
    if beyond is not None:
        name, i, value, limit = beyond
        kind, what = _ENDS.get(name, (SimulationError, name))
        raise kind(
            f"the {what} of {cell.names[i]} is {value:.3g} at t = {t:g} s, where {cell.space!r} expects it "
            f"below {limit:g}; stop the robots and reset the controller",
            time=t,
            robot=i,
        ).about(name, found=value)
    for what, rows in (("torque", signals.tau), ("rate of the estimates", signals.z_dot)):
        bad = np.flatnonzero(~np.isfinite(rows).all(axis=1))
        if bad.size:
            raise _undefined(cell, t, what, int(bad[0]))
    if not np.isfinite(signals.epsilon).all():
        pair = int(np.argmin(np.isfinite(signals.epsilon).all(axis=1)))
        raise _undefined(cell, t, "synchronization error", int(cell.coupling.edges[pair].min()))


def gravity_torque(cell: Cell, q: np.ndarray) -> np.ndarray:
    """Torque of gravity as the robots' descriptions have it, (n, nv), N·m, at joint positions q, (n, nv)."""
    g = np.zeros(q.shape)
    for row, robot, q_i in zip(g, cell.robots, q, strict=True):
        row[: robot.nv] = robot.gravity(q_i[: robot.nv])
    return g


def _undefined(cell: Cell, t: float, what: str, robot: int) -> NonFiniteError:
    return NonFiniteError(
        f"the law has no finite {what} for {cell.names[robot]} at t = {t:g} s: its Jacobian may be singular, "
        "or the loop unstable; stop the robots and reset the controller",
        time=t,
        robot=robot,
    )


def check_network(network: Any, messages: Messages, period: float) -> None:
    """Refuse a network with delays but no messages: what acts at samples knows nothing in between.

    So are far more messages than samples: all of one period, s, tell what was true at one sample.

    Raises:
        InputError: it is one of these.
    """
    if getattr(network, "continuous", False):
        raise InputError(
            "expected one of messages with sampled control, for example Network(period=control_period, delay="
            "...), found one of exchange in continuous time, period=None",
            subject="network",
            found=None,
        )
    if (found := len(messages.between(0.0, period))) > PER_SAMPLE:
        wanted = f"at most {PER_SAMPLE} messages in a period of {period:g} s"
        raise InputError.expected(wanted, found, "network, messages")


def check_adaptation(controller: Controller) -> None:
    """Refuse an adaptation whose arrays do not fit; a rate that fails is left to the run, which says so.

    Args:
        controller: whose adaptation it is.

    Raises:
        InputError: a start that is no array of finite numbers, (n, Z), or something of another shape.
    """
    adaptation, cell = controller.adaptation, controller.cell
    where = f"adaptation {type(adaptation).__qualname__}"
    z: Any = adaptation.start()
    instance(f"{where}, start", z, np.ndarray, "an array")
    finite_array(f"{where}, start", z, (cell.n, None))
    shaped(f"{where}, estimate", adaptation.estimate(z), cell.theta.shape)
    shaped(f"{where}, settle", adaptation.settle(z), z.shape)
    rate = z
    reference, motion = cell.references(np.zeros(1))[0], np.stack((cell.q0, cell.v0))
    with suppress(Exception), np.errstate(all="ignore"):
        rate = controller.unchecked(reference, motion, z, controller.network.start()).z_dot
    shaped(f"{where}, rate", rate, z.shape)


def whole_number(name: str, value: float) -> int:
    """A number of a controller's state that counts something.

    Raises:
        InputError: none that does.
    """
    if not 0 <= value < LONGEST or value != int(value):
        raise InputError.expected("a whole number of at least 0", value, f"state, {name}")
    return int(value)


def write_state(path: str | Path, state: Mapping[str, np.ndarray]) -> Path:
    """Write arrays of floats by name to an .npz file; see `DiscreteController.save`."""
    instance("path", path, (str, Path), "a path")
    with reported("write the controller's state to", path), whole_file(path) as file:
        np.savez(file, **state)  # type: ignore[arg-type]
    return Path(path)


def read_state(path: str | Path, like: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Arrays with the names and sizes of others, from a file that `write_state` made.

    Raises:
        InputError, ResultError: see `DiscreteController.load`.
    """
    instance("path", path, (str, Path), "a path")
    limit = sum(array.nbytes + OVERHEAD for array in like.values()) + OVERHEAD
    try:
        with Path(path).open("rb") as file:
            data = file.read(limit + 1)
        if len(data) > limit:
            raise ResultError(f"expected at most {limit} bytes, found more")
        with zipfile.ZipFile(BytesIO(data)) as archive:
            return _arrays(archive, like)
    except Exception as error:  # whatever a damaged archive makes its readers raise
        raise ResultError(f"'{path}' has no state of this controller: {error}", file=path) from error


def _arrays(archive: zipfile.ZipFile, like: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    expected, found = sorted(f"{name}.npy" for name in like), sorted(archive.namelist())
    if found != expected:
        raise ResultError.expected(
            f"the arrays {', '.join(expected)}", tuple(found), shown=", ".join(found) or "none"
        )
    return {name: _array(archive, name, array) for name, array in like.items()}


def _array(archive: zipfile.ZipFile, name: str, like: np.ndarray) -> np.ndarray:
    header = _header(like)
    entry = archive.getinfo(f"{name}.npy")
    size = len(header) + like.nbytes
    if entry.compress_type != zipfile.ZIP_STORED or entry.file_size != size:
        raise ResultError(
            f"{name}: expected {size} bytes as they are, found {entry.file_size}", found=entry.file_size
        )
    data = archive.read(entry)
    if not data.startswith(header):
        raise ResultError(f"{name}: expected an array of floats of shape {like.shape}")
    return np.frombuffer(data, dtype=float, offset=len(header)).reshape(like.shape).copy()


def _header(like: np.ndarray) -> bytes:
    """What numpy writes before the numbers of an array of floats."""
    file = BytesIO()
    np.save(file, np.zeros(like.shape))
    return file.getvalue()[: file.tell() - like.nbytes]
