"""Small arms with sliding joints, as URDF text: a gantry of three slides, and an arm that turns and lifts."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from synctrl import Cell, Coupling, Cubic, Experiment, Gains, Member, Robot, load_robot

GANTRY = (("rail", "prismatic", "1 0 0"), ("bridge", "prismatic", "0 1 0"), ("lift", "prismatic", "0 0 1"))
SCARA = (
    ("shoulder", "revolute", "0 0 1"),
    ("elbow", "revolute", "0 0 1"),
    ("lift", "prismatic", "0 0 -1"),
    ("wrist", "revolute", "0 0 1"),
)
#: names and types of the joints of an arm, with their axes
Joints = tuple[tuple[str, str, str], ...]


def urdf(name: str, joints: Joints, effort: float = 200.0, shapes: bool = True) -> str:
    """A chain of boxes of 0.3 m, each 2 kg."""
    visual = '<visual><origin xyz="0.15 0 0"/><geometry><box size="0.3 0.06 0.06"/></geometry></visual>'
    parts = ['<link name="base"/>']
    for k, (joint, kind, axis) in enumerate(joints):
        parent = f"link{k}" if k else "base"
        parts.append(
            f'<link name="link{k + 1}"><inertial><origin xyz="0.15 0 0"/><mass value="2"/>'
            '<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>'
            f"{visual if shapes else ''}</link>"
            f'<joint name="{joint}" type="{kind}"><parent link="{parent}"/><child link="link{k + 1}"/>'
            f'<origin xyz="{0.3 if k else 0} 0 0"/><axis xyz="{axis}"/>'
            f'<limit effort="{effort:g}" velocity="3" lower="-2" upper="2"/></joint>'
        )
    return f'<robot name="{name}">{"".join(parts)}</robot>'


def load(folder: Path, name: str, joints: Joints, effort: float = 200.0, shapes: bool = True) -> Robot:
    """The arm that `urdf` describes."""
    file = folder / f"{name}.urdf"
    file.write_text(urdf(name, joints, effort, shapes), encoding="utf-8")
    return load_robot(file)


def pair(robots: tuple[Robot, Robot], way: float = 0.1, gain: float = 8.0) -> Experiment:
    """Two such arms side by side that move all joints, in joint space."""
    members = []
    for i, robot in enumerate(robots):
        start = np.full(robot.nv, 0.2)
        members.append(
            Member(
                robot.placed((0.0, i, 0.0)),
                Cubic(start, start + way, 0.2),
                theta_hat0=0.8 * robot.inertial_parameters,
                q0=start + 0.01 * i,
            )
        )
    gains = Gains(Lambda=5.0, beta=5.0, K_r=gain, K_eps=5.0, Gamma=0.1)
    return Experiment(Cell(members, Coupling.pair(), name="slides"), gains, 0.2)
