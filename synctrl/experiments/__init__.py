"""Ready cells: the paper's two, and its examples 1 to 3."""

from .a460_pair import a460_full_pair, a460_pair
from .bead_on_edge import bead_on_edge
from .bead_on_path import bead_on_path
from .carry import carry_ur5
from .carry_planar import carry_planar
from .mixed_four import mixed_four
from .mobile_robot import mobile_robot
from .panda_four import panda_four
from .planar_four import planar_four
from .quadratic import quadratic_analysis
from .rigid_object import rigid_object
from .ur5_payload import ur5_payload

__all__ = [
    "a460_full_pair",
    "a460_pair",
    "bead_on_edge",
    "bead_on_path",
    "carry_planar",
    "carry_ur5",
    "mixed_four",
    "mobile_robot",
    "panda_four",
    "planar_four",
    "quadratic_analysis",
    "rigid_object",
    "ur5_payload",
]
