"""What figures show, in a sentence each, for pages and lists."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

#: by the name of the figure
CAPTIONS: Mapping[str, str] = MappingProxyType(
    {
        "tracking_error": "Tracking errors e of all robots; colour is the robot, line style the coordinate.",
        "sync_error": "Synchronization errors ε of all pairs, each pair in a colour of its own.",
        "torque": "What the controller asks for; limits are dashed where a torque comes near them.",
        "path": "Actual coordinates over time, and desired ones as dark dash-dot lines.",
        "estimates": "The estimates that move most; dashed are the true values that are not far off.",
        "traffic": "Messages that robots sent and links brought, and how old what is known is.",
        "internal_force": "Size of the internal force at each hand, and of the moment.",
        "object_error": "Desired less actual pose of what is carried.",
        "bead_error": "By how much adhesive is laid beside its place.",
        "normal_angle": "By how much the nozzle is off its tilt.",
        "bead_speed": "How fast the nozzle goes along the edge.",
        "gap_error": "By how much the gap between two robots on one path is off.",
        "phase": "How far along the desired motion is, where the feed gives way.",
        "feed": "How fast it goes, as a share of the speed that is planned.",
        "tip_path": "Paths of the tips, and where they should go, dash-dot; all panels have the same scale.",
        "phase_portrait": "Errors and their rates; along the dashed line errors vanish as Λ says.",
        "spectrum": "Amplitudes of errors and torques by frequency.",
        "consistency": "Below zero, the dashed line, an estimate is that of no body that can exist.",
        "lyapunov": "V and V' with their terms; dashed is what acts outside the theorem.",
    }
)
