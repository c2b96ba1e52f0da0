"""What generated functions read and write, by name: the one table that everything about them follows from.

The symbols of `trace.py`, the structures of `structs.py` with the text that stands before `driver.c`, and the
arrays of `program.py` and `engine.py` are all made from the tables below. Every quantity
is one array with a row per robot or pair; rows are as long as the largest robot needs.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import prod
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ..errors import CompilationError


class Quantity(NamedTuple):
    """An array.

    Attributes:
        owner: where it is: "state" and "rate" in y and y', "cell" for constants, "instant" for what is
            desired at a stage of a step, "load" and "disturbance" for what is constant between edges of
            these, "work" for what generated functions and the driver hand on.
        rows: "n" for one per robot, "p" for one per pair, "o" for one per object that is carried, "r" and
            "h" for one per number that the network and the plant remember, "one" for one that all robots
            share.
        columns: length of a row, a product of numbers and of the names in `SIZES`.
        meaning: what it is.
    """

    owner: str
    rows: str
    columns: str
    meaning: str


#: what lengths of rows are made of; a robot has its own, a cell the largest of its robots
SIZES: Mapping[str, str] = MappingProxyType(
    {
        "m": "coordinates of the task",
        "nv": "joints",
        "P": "adapted parameters",
        "Z": "entries of the state of the adaptation",
        "K": "columns of K_r",
        "bodies": "lumped inertial parameters of all bodies",
        "slides": "1 if errors may count at a point that slides, else 0",
        "tip": "1 for tasks of the tip, 0 for tasks of the joints",
        "spare": "1 if the way to the joints is a pseudo-inverse, else 0",
        "damped": "1 if singular configurations are damped, else 0",
        "watches": "numbers that the guard watches",
        "weighs": "numbers that weights are made of",
        "hand": "1 for robots whose tip holds an object, else 0",
        "gives": "1 if robots give way to forces inside the object, else 0",
    }
)

QUANTITIES: Mapping[str, Quantity] = MappingProxyType(
    {
        "q": Quantity("state", "n", "nv", "positions of the joints"),
        "v": Quantity("state", "n", "nv", "velocities of the joints"),
        "z": Quantity("state", "n", "Z", "state of the adaptation; with (14) it is theta_hat"),
        "memory": Quantity("state", "r", "1", "what the network remembers"),
        "body": Quantity("state", "o", "13", "pose and twist of what is carried"),
        "q_dot": Quantity("rate", "n", "nv", "q'"),
        "v_dot": Quantity("rate", "n", "nv", "v'"),
        "z_dot": Quantity("rate", "n", "Z", "z'"),
        "memory_dot": Quantity("rate", "r", "1", "its rate"),
        "body_dot": Quantity("rate", "o", "13", "their rates"),
        "base": Quantity("cell", "n", "12", "placement of the first joint: rotation by rows, translation"),
        "true_base": Quantity("cell", "n", "12", "the same of what really stands there"),
        "Lambda": Quantity("cell", "one", "m", "gain"),
        "beta": Quantity("cell", "one", "m", "gain"),
        "K_eps": Quantity("cell", "one", "m", "gain"),
        "leak": Quantity("cell", "one", "m", "rate at which integrals of epsilon are forgotten"),
        "K_r": Quantity("cell", "n", "K", "gain"),
        "Gamma": Quantity("cell", "n", "P", "gain of (14)"),
        "W_inv": Quantity("cell", "n", "nv", "inverse of the weights of the joints"),
        "posture": Quantity("cell", "n", "nv", "preferred positions of the joints"),
        "gain": Quantity("cell", "n", "nv", "rate at which they are sought"),
        "viscous": Quantity("cell", "n", "nv", "coefficients of friction"),
        "coulomb": Quantity("cell", "n", "nv", "coefficients of friction"),
        "smoothing": Quantity("cell", "n", "nv", "velocity at which Coulomb friction reaches tanh(1)"),
        "limits": Quantity("cell", "n", "nv", "at which torque is cut off"),
        "bounds": Quantity("cell", "one", "watches", "of what the guard watches, in its order"),
        "tool": Quantity("cell", "n", "hand*12", "place of a hand on its link, as the controller knows it"),
        "true_tool": Quantity("cell", "n", "hand*12", "the same as it is"),
        "grasp": Quantity("cell", "n", "hand*24", "where a hand holds the object, K and D of its fixture"),
        "share": Quantity("cell", "n", "gives*36", "part of the load at each hand, in the object's axes"),
        "giving": Quantity("cell", "one", "gives*18", "D_a, 1 / M_a, and whether there is a mass"),
        "inertia": Quantity("cell", "o", "17", "mass, centre, inertia, gravity, and whether it is loose"),
        "pi": Quantity("load", "n", "bodies", "true inertial parameters, lumped, with what is carried"),
        "disturbance": Quantity("disturbance", "n", "nv", "torque from outside"),
        "desired": Quantity("instant", "n", "m", "desired coordinates"),
        "desired_dot": Quantity("instant", "n", "m", "their velocity"),
        "desired_ddot": Quantity("instant", "n", "m", "their acceleration"),
        "slide": Quantity("instant", "n", "slides*m", "place of a point on what is carried"),
        "slide_dot": Quantity("instant", "n", "slides*m", "its velocity there"),
        "slide_ddot": Quantity("instant", "n", "slides*m", "its acceleration there"),
        "weights": Quantity(
            "instant", "n", "weighs", "what of c, c', c'' and c^-1 is no constant of the code"
        ),
        "x": Quantity("work", "n", "m", "coordinates of the task"),
        "e": Quantity("work", "n", "m", "error"),
        "e_dot": Quantity("work", "n", "m", "its rate"),
        "x_dot": Quantity("work", "n", "m", "velocity of the task"),
        "xd_dot": Quantity("work", "n", "m", "desired velocity, as errors are counted"),
        "xd_ddot": Quantity("work", "n", "m", "desired acceleration, as errors are counted"),
        "w": Quantity("work", "n", "m", "c e"),
        "w_dot": Quantity("work", "n", "m", "its rate"),
        "sine": Quantity("work", "n", "nv", "sin q"),
        "cosine": Quantity("work", "n", "nv", "cos q"),
        "J": Quantity("work", "n", "tip*m*nv", "Jacobian"),
        "J_dot": Quantity("work", "n", "tip*m*nv", "its rate"),
        "J_inv": Quantity("work", "n", "tip*m*nv", "its inverse, or W^-1 J^T G"),
        "G": Quantity("work", "n", "spare*m*m", "(J W^-1 J^T + lambda^2)^-1"),
        "zeta": Quantity("work", "n", "spare*nv", "preferred velocity of the joints"),
        "zeta_dot": Quantity("work", "n", "spare*nv", "its rate"),
        "damping": Quantity("work", "n", "damped", "lambda"),
        "damping_rate": Quantity("work", "n", "damped", "rate of lambda^2"),
        "velocity_lost": Quantity("work", "n", "damped", "|xref' - J v_ref|"),
        "watched": Quantity("work", "n", "watches", "what may make a run end"),
        "side": Quantity("work", "n", "tip", "of which the sign says the side of a singular configuration"),
        "epsilon": Quantity("work", "p", "m", "synchronization errors"),
        "epsilon_dot": Quantity("work", "p", "m", "their rates"),
        "integral": Quantity("work", "p", "m", "integrals of epsilon"),
        "E": Quantity("work", "n", "m", "a robot's share of the integrals of epsilon"),
        "sigma": Quantity("work", "n", "m", "its share of epsilon"),
        "sigma_dot": Quantity("work", "n", "m", "its share of the rates of epsilon"),
        "tau": Quantity("work", "n", "nv", "torque that the controller asks for"),
        "acting": Quantity("work", "n", "nv", "torque that it asked for when it was last sampled"),
        "goal": Quantity("work", "n", "nv", "torque that motors are to give, as their actuators pass it on"),
        "owed": Quantity("work", "n", "nv", "what they were short of when they got it"),
        "switched": Quantity("work", "one", "1", "when they got it, s"),
        "lag": Quantity("work", "n", "nv", "rate at which they make up for it"),
        "ripple": Quantity("work", "n", "nv", "share of torque that changes with the joint"),
        "ripple_wave": Quantity("work", "one", "2", "order and phase of that"),
        "driven": Quantity("work", "n", "nv", "torque that motors with actuators give"),
        "measured_q": Quantity("work", "n", "nv", "what sensors said of positions at the last sample"),
        "measured_v": Quantity("work", "n", "nv", "and of velocities"),
        "moving": Quantity("work", "n", "nv", "torque that moves the rigid bodies"),
        "pull": Quantity("work", "n", "hand*nv", "torque of the fixture on the joints"),
        "wrench": Quantity("work", "n", "hand*6", "what the fixture does to the object, about its origin"),
        "lift": Quantity("work", "o", "6", "what all fixtures together do to it"),
        "felt": Quantity("work", "n", "gives*6", "force inside at the object's origin, in the desired axes"),
        "hidden": Quantity("work", "h", "1", "all that the plant remembers, in y"),
        "e_star": Quantity("work", "n", "m", "coupled error"),
        "s_q": Quantity("work", "n", "nv", "error in velocity of the joints"),
        "theta_hat": Quantity("work", "n", "P", "estimates"),
        "z_sampled": Quantity("work", "n", "Z", "state of the adaptation at the last sample"),
        "z_dot_sampled": Quantity("work", "n", "Z", "its rate there"),
        "since": Quantity("work", "one", "1", "how long a sample lasts, s; 0 before the first"),
        "leapt": Quantity("work", "n", "Z", "state of the adaptation after a sample, along a curve"),
        "settled": Quantity("work", "n", "Z", "state of the adaptation after a step, for example projected"),
    }
)


class Signature(NamedTuple):
    """Names of what a generated function reads and writes, in the order of its arguments and results."""

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


#: what is desired at an instant: position, velocity and acceleration
DESIRED = "desired", "desired_dot", "desired_ddot"
#: further rows of it, where a point slides on what is carried
SLIDE = "slide", "slide_dot", "slide_ddot"
#: what a robot hears of the others, see `Errors`
HEARD = "E", "sigma", "sigma_dot"

FUNCTIONS: Mapping[str, Signature] = MappingProxyType(
    {
        "hand": Signature(
            ("q", "v", "sine", "cosine", "true_base", "true_tool", "body", "grasp"), ("pull", "wrench")
        ),
        "measure": Signature(
            (
                "q", "v", "sine", "cosine", "tool", "base", *DESIRED, *SLIDE, "weights", "W_inv", "posture",
                "gain", "z", "body", "wrench", "lift", "share", "giving",
            ),
            (
                "x", "e", "e_dot", "x_dot", "xd_dot", "xd_ddot", "w", "w_dot", "J", "J_dot",
                "J_inv", "G", "zeta", "zeta_dot", "damping", "damping_rate", "felt",
            ),
        ),
        "control": Signature(
            (
                "q", "v", "sine", "cosine", "z", *HEARD, "e", "e_dot", "x_dot", "xd_dot", "xd_ddot",
                "w", "w_dot", "J", "J_dot", "J_inv", "G", "zeta", "zeta_dot", "damping_rate", "weights",
                "Lambda", "beta", "K_eps", "leak", "K_r", "Gamma", "limits", "W_inv", "base",
                "felt", "giving",
            ),
            ("tau", "z_dot", "e_star", "s_q", "velocity_lost"),
        ),
        "plant": Signature(("q", "v", "sine", "cosine", "moving", "pi", "true_base"), ("v_dot",)),
        "object": Signature(("body", "lift", "inertia"), ("body_dot",)),
        "guard": Signature(("e", "J", "J_inv"), ("watched", "side")),
        "estimate": Signature(("z",), ("theta_hat",)),
        "settle": Signature(("z",), ("settled",)),
        "leap": Signature(("z_sampled", "z_dot_sampled", "since"), ("leapt",)),
    }
)  # fmt: skip

#: logged arrays, all of `LAYOUT` but t and those that a result may have beside, and what each is a copy of
LOGS: Mapping[str, str] = MappingProxyType(
    {
        "x": "x",
        "x_desired": "desired",
        "tracking_error": "e",
        "sync_error": "epsilon",
        "sync_integral": "integral",
        "coupled_error": "e_star",
        "q": "q",
        "v": "v",
        "v_error": "s_q",
        "tau": "acting",
        "disturbance": "disturbance",
        "theta_hat": "theta_hat",
        "adaptation_state": "z",
        "damping": "damping",
        "velocity_lost": "velocity_lost",
        "plant_state": "hidden",
        "network_state": "memory",
        "measured_q": "measured_q",
        "measured_v": "measured_v",
        "actuator_torque": "driven",
    }
)


def owned_by(*owners: str) -> list[str]:
    """Names of the quantities that are in one of these places, in the order of the table."""
    return [name for name, quantity in QUANTITIES.items() if quantity.owner in owners]


def columns(name: str, sizes: Mapping[str, int]) -> int:
    """Length of a row of a quantity."""
    factors = QUANTITIES[name].columns.split("*")
    return prod(int(factor) if factor.isdigit() else sizes[factor] for factor in factors)


def shape(name: str, sizes: Mapping[str, int]) -> tuple[int, int]:
    """Shape of the array of a quantity; `sizes` has n, p, o, r and h too, see `Quantity.rows`."""
    return {"one": 1, **sizes}[QUANTITIES[name].rows], columns(name, sizes)


def checked(name: str, array: np.ndarray, sizes: Mapping[str, int]) -> np.ndarray:
    """An array as generated code reads it: numbers one after another, of the shape that the table says.

    Args:
        name: of the quantity.
        array: (rows, columns), or several of these, one after another.
        sizes: of the cell.

    Raises:
        CompilationError: it has another shape.
    """
    expected = shape(name, sizes)
    if np.shape(array)[-2:] != expected:
        raise CompilationError(
            f"compiled engine, {QUANTITIES[name].meaning}: expected rows and columns {expected}, found an "
            f"array of shape {np.shape(array)}",
            subject=name,
            found=np.shape(array),
        )
    return np.ascontiguousarray(array, dtype=float)
