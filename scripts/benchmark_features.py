"""What a run may have beside robots, a task and a coupling, each with the cell that is the same without it.

Versions of the package that do not have a feature fail to make it, and say so by their error; so everything
that not all of them have is imported where it is made.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np

from synctrl import CartesianSpace, Cell, Coupling, Damping, Disturbance, Experiment, Friction, Payload
from synctrl.experiments import a460_pair, panda_four, planar_four, ur5_payload

ARMS, A460, HANDS, PANDAS = "four planar arms", "two A460 without friction", "ur5_payload", "panda_four"
#: period of sampled control with which devices are measured, s
PERIOD = 1e-3


class Feature(NamedTuple):
    """A feature: the cell without it, the experiment that has it, and options of both runs and of its own."""

    cell: str
    make: Callable[[], Experiment]
    options: Mapping[str, float] = {}
    own: Mapping[str, float] = {}


def of(kind: str, name: str, *settings: Any, **named: Any) -> Callable[[], Any]:
    """Makes a part of the controller, an `adaptation`, a `law` or a `network`, by its class."""
    module = {"adaptation": "adaptation", "law": "laws", "network": "network"}[kind]
    return lambda: getattr(import_module(f"synctrl.control.{module}"), name)(*settings, **named)


def adapted(make: Callable[[], Any], cell: Callable[..., Experiment] = planar_four) -> Callable:
    """A cell with another way to learn."""
    return lambda: cell(adaptation=make())


def composite(**settings: float) -> Callable[[], Any]:
    """Composite adaptation."""
    return of("adaptation", "Composite", 0.1, 0.3, 20.0, **settings)


def rated(name: str, *settings: float) -> Callable[[], Any]:
    """Leakage at a rate of some kind."""
    return lambda: of("adaptation", "Leakage", 0.1, of("adaptation", name, *settings)())()


def boxed() -> Experiment:
    """Estimates in a box around what is true and what is thought at first."""
    cell = planar_four().cell
    low, high = (
        pick(cell.theta.min(), cell.theta_hat0.min())
        for pick in (lambda *a: min(a) - 1, lambda *a: max(a) + 1)
    )
    return planar_four(adaptation=of("adaptation", "Box", 0.1, low, high)())


def under(make: Callable[[], Any]) -> Callable[[], Experiment]:
    """The four arms under another law."""

    def made() -> Experiment:
        under_law = import_module("synctrl.analysis.free_gain").under
        return under_law(planar_four(), make())

    return made


def keeping_shape() -> Experiment:
    """The four arms under a law that has a place for beta, but not for K_eps."""
    made = planar_four()
    return replace(made, law=of("law", "ShapeKeeping")(), gains=made.gains.replace(K_eps=0.0))


def networked(**settings: Any) -> Callable[[], Experiment]:
    """The four arms with a network."""
    return lambda: planar_four(network=of("network", "Network", **settings)())


def with_cell(experiment: Experiment, coupling: Coupling | None = None, **changes: Any) -> Experiment:
    """An experiment whose members or coupling are changed."""
    cell = experiment.cell
    members = [replace(member, **changes) for member in cell.members]
    return replace(experiment, cell=Cell(members, coupling or cell.coupling, cell.space, cell.name))


def moving(t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Weights of the four arms that swing by a tenth, (4, 2, 2), and their two derivatives."""
    base = np.array([6.0, -5.0, 5.0, -6.0])[:, None, None] * np.eye(2)
    return base * (1 + 0.1 * np.sin(t)), base * 0.1 * np.cos(t), -base * 0.1 * np.sin(t)


def loaded() -> Experiment:
    """The four arms, each with a load that it takes after half a second."""
    return replace(planar_four(), payloads=[Payload(i, 0.1, start=0.5) for i in range(4)])


def damped() -> Experiment:
    """The four Pandas with the inverse damped near singular configurations."""
    made = panda_four()
    cell = made.cell
    space = CartesianSpace("xyz", singularity=Damping(), redundancy=cell.space.redundancy)
    return replace(made, cell=Cell(cell.members, cell.coupling, space, cell.name))


def carrying(**options: Any) -> Callable[[], Experiment]:
    """Two UR5 that carry an object in fixtures that give."""
    return lambda: import_module("synctrl.experiments").carry_ur5(**options)


def equipped() -> Experiment:
    """The four arms with encoders, motors and a dead time."""
    parts = import_module("synctrl.simulation.devices")
    sensors = [parts.Noise(q=1e-6), parts.Quantisation(2 * np.pi / 2**20), parts.DifferencedVelocity(500.0)]
    return planar_four(sensors=sensors, actuators=[parts.DeadTime(0.5e-3), parts.Lag(0.5e-3)])


SAMPLED = {"control_period": PERIOD}
FEATURES: dict[str, Feature] = {
    "friction": Feature(ARMS, lambda: with_cell(planar_four(), friction=Friction(0.2, 0.1))),
    "a disturbance": Feature(ARMS, lambda: planar_four(disturbance=Disturbance(0, (1.0, 1.0), 0.1, 60.0))),
    "moving weights": Feature(ARMS, lambda: with_cell(planar_four(), Coupling.ring(4, c=moving))),
    "payloads": Feature(ARMS, loaded),
    "saturation": Feature(ARMS, lambda: replace(planar_four(), saturate=True)),
    "damping in task space": Feature(ARMS, lambda: planar_four(k_r_space="task")),
    "xref'' of the paper": Feature(ARMS, lambda: planar_four(reference_acceleration="paper")),
    "poses instead of joints": Feature("two UR5", ur5_payload),
    "damped inverse of seven joints": Feature(PANDAS, damped),
    "an object carried, compliant": Feature(HANDS, carrying()),
    "an object carried, with friction": Feature(HANDS, carrying(friction=True)),
    "an object carried, rigid": Feature(HANDS, carrying(grasp="rigid")),
    "an object carried, admittance": Feature(HANDS, carrying(admittance=True)),
    "friction of two A460": Feature(A460, a460_pair),
    "Leakage": Feature(ARMS, adapted(of("adaptation", "Leakage", 0.1, 0.2))),
    "Leakage, switching": Feature(ARMS, adapted(rated("Switching", 0.2, 3.0))),
    "Leakage, e-modification": Feature(ARMS, adapted(rated("EModification", 0.2))),
    "Box": Feature(ARMS, boxed),
    "Ball": Feature(ARMS, adapted(of("adaptation", "Ball", 0.1, 50.0))),
    "Guarded": Feature(ARMS, lambda: planar_four(adaptation=guarded())),
    "Composite": Feature(ARMS, adapted(composite())),
    "Composite, with memory": Feature(ARMS, adapted(composite(memory=0.1))),
    "Natural": Feature(A460, adapted(of("adaptation", "Natural", 0.1), partial(a460_pair, friction=False))),
    "Hedged": Feature(
        ARMS,
        lambda: replace(planar_four(adaptation=of("adaptation", "Hedged", guarded(), 2.0)()), saturate=True),
    ),
    "SunMills, injection": Feature(ARMS, under(of("law", "SunMills", injection=True))),
    "ChungSlotine": Feature(ARMS, under(of("law", "ChungSlotine", 0.5))),
    "SlotineLi": Feature(ARMS, under(of("law", "SlotineLi"))),
    "ComputedTorque": Feature(ARMS, under(of("law", "ComputedTorque"))),
    "PDGravity": Feature(ARMS, under(of("law", "PDGravity", 50.0))),
    "MasterSlave": Feature(ARMS, under(of("law", "MasterSlave"))),
    "ShapeKeeping": Feature(ARMS, keeping_shape),
    "a network without delay": Feature(ARMS, networked()),
    "a network with delay": Feature(ARMS, networked(delay=5e-3)),
    "messages, hold": Feature(ARMS, networked(period=4e-3, receiver="hold")),
    "messages, filter, delay and loss": Feature(ARMS, networked(period=4e-3, delay=3e-3, loss=0.1)),
    "sampled control": Feature(ARMS, planar_four, {}, SAMPLED),
    "sensors and actuators": Feature(ARMS, equipped, SAMPLED),
    "a log of every tenth step": Feature(ARMS, planar_four, {}, {"log_dt": 1e-2}),
}  # fmt: skip


def guarded() -> Any:
    """A ball around the first estimates, with a guard."""
    return of("adaptation", "Guarded", of("adaptation", "Ball", 0.1, 50.0)())()
