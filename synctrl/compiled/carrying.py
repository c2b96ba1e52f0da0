"""An object that hands hold, traced with symbols: what a fixture does to its hand, and how the object moves.

The first is a function of every robot that holds something; what the fixtures do to the object is added up by
the driver, so a robot costs the same however many hold it. The second belongs to the object. The lines are
those of `assembly/grasp.py` and `assembly/body.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..assembly.body import Inertia, body_rate, place_of
from ..assembly.forces import internal_wrenches
from ..assembly.grasp import fixture_wrenches, grasp_matrix, places_on
from ..assembly.handling import LOOSE, HandlingPlant
from ..assembly.plant import CarryingPlant
from ..robots.mechanism import mechanism
from ..robots.robot import Robot
from ..simulation.closed_loop import ClosedLoop
from ..tasks.measurement import Kinematics
from .algebra import array_of, balancing, column_of, function_of
from .quantities import FUNCTIONS, columns


def fixture_on(
    tip: Kinematics, q: np.ndarray, v: np.ndarray, body: np.ndarray, grasp: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Torque on the joints of one robot, (nv,), and wrench on the object about its origin, (6,).

    Args:
        tip: the true tip.
        q, v: joint positions and velocities, (nv,).
        body: pose and twist of the object, (13,).
        grasp: where the hand holds it and how, see `_grasps`, (24,).
    """
    moved, R, J, _ = tip.poses(q, v)
    arm, turned, K, D = np.split(grasp[None], (3, 12, 18), axis=1)
    *places, lever = places_on(body, arm, turned.reshape(1, 3, 3))
    hand = moved[:1], R[None], (J @ v)[None]
    on_object, on_hand = fixture_wrenches(hand, places, K, D)
    return J.T @ on_hand[0], grasp_matrix(lever)[0] @ on_object[0]


def felt_at_origin(wrench: np.ndarray, share: np.ndarray, lift: np.ndarray, body: np.ndarray) -> np.ndarray:
    """Internal wrench of one hand about the object's origin in world axes, (6,).

    Args:
        wrench: of the fixture on the object about its origin, (6,).
        share: the part of the load that belongs to the hand, in the object's axes, (36,), see `_shares`.
        lift: wrenches of all fixtures together, (6,).
        body: pose and twist of the object, (13,).
    """
    R = place_of(body[:7])[1]
    load = np.matvec(share.reshape(6, 6), (lift.reshape(2, 3) @ R).ravel())
    return wrench - (load.reshape(2, 3) @ R.T).ravel()


def object_function(name: str) -> Any:
    """The CasADi function of an object: rates of its pose and twist."""
    import casadi as ca

    signature = FUNCTIONS["object"]
    given = {key: ca.SX.sym(key, columns(key, {})) for key in signature.inputs}
    body, lift, row = (array_of(given[key], -1) for key in signature.inputs)
    mass, com, inertia, gravity, loose = np.split(row, (1, 4, 13, 16))
    of = Inertia(mass, com, inertia.reshape(3, 3))
    rate = loose * body_rate(of, body, lift, gravity, _solve)
    return function_of(name, signature, given, {"body_dot": rate})


def carrying_constants(loop: ClosedLoop) -> dict[str, np.ndarray]:
    """Quantities of an object that is carried, at the start; rows without entries where none is."""
    plant, giving = loop.plant, loop.controller.admittance
    if not isinstance(plant, CarryingPlant):
        none = {name: np.zeros((plant.cell.n, 0)) for name in ("tool", "true_tool", "grasp", "share")}
        return {**none, "inertia": np.zeros((0, columns("inertia", {}))), "giving": np.zeros((1, 0))}
    return {
        "tool": _tools(plant.cell.robots),
        "true_tool": _tools(plant.schedule.free),
        "giving": np.zeros((1, 0)) if giving is None else np.concatenate(giving.giving)[None],
        **held_constants(loop, plant.hidden0),
    }


def held_constants(loop: ClosedLoop, hidden: np.ndarray) -> dict[str, np.ndarray]:
    """Those that change when hands close or open, in a state of the plant's own."""
    plant: Any = loop.plant
    held, loose = plant, 1.0
    if isinstance(plant, HandlingPlant):
        held, loose = plant._held_now(hidden), hidden[LOOSE]
    share = _shares(held) if loop.controller.admittance else np.zeros((plant.cell.n, 0))
    return {"grasp": _grasps(held), "inertia": _inertia(plant, loose), "share": share}


def _tools(robots: Sequence[Robot]) -> np.ndarray:
    """Rotation by rows and translation of the tips on their links, (n, 12)."""
    fixed = [mechanism(robot)[0] for robot in robots]
    return np.array([np.append(x.tip_rotation, x.tip_translation) for x in fixed])


def _grasps(plant: CarryingPlant) -> np.ndarray:
    """Places and axes of the hands on the object, K and D, (n, 24); no K and D for hands that are open."""
    rows = np.zeros((plant.cell.n, columns("grasp", {"hand": 1})))
    rows[:, 3:12] = np.eye(3).ravel()
    parts = plant.arms, plant.turned.reshape(-1, 9), plant.K, plant.D
    rows[[grasp.robot for grasp in plant.grasps]] = np.concatenate(parts, axis=1)
    return rows


def _shares(plant: CarryingPlant) -> np.ndarray:
    """What part of a load about the object's origin belongs to each hand, in its axes, (n, 36).

    The split is linear and the same in all directions, so it turns with the object: it is asked here what
    it makes of six unit loads in the first hand.
    """
    rows = np.zeros((plant.cell.n, 36))
    if not plant.grasps:
        return rows
    G = grasp_matrix(plant.arms)
    h = np.zeros((6, *plant.arms.shape[:1], 6))
    h[:, 0] = np.linalg.inv(G[0]).T
    loads = np.matvec(G, h - internal_wrenches(h, np.broadcast_to(plant.arms, (6, *plant.arms.shape))))
    rows[[grasp.robot for grasp in plant.grasps]] = loads.transpose(1, 2, 0).reshape(-1, 36)
    return rows


def _inertia(plant: CarryingPlant, loose: float) -> np.ndarray:
    """Mass, centre of mass and inertia of the object, gravity, and whether it is loose, (1, 17)."""
    body, gravity = plant.body, plant.robots[0].gravity_vector
    return np.concatenate(([body.mass], body.com, body.inertia.ravel(), gravity, [loose]))[None]


def _solve(M: np.ndarray, b: np.ndarray) -> np.ndarray:
    import casadi as ca

    rows = len(M)
    return array_of(balancing(ca.reshape(column_of(M.T), rows, rows), -column_of(b)), -1)
