"""Ready cells: the paper's two, and its examples 1 to 3."""

from .a460_pair import a460_pair
from .mobile_robot import mobile_robot
from .planar_four import planar_four
from .quadratic import quadratic_analysis
from .rigid_object import rigid_object

__all__ = ["a460_pair", "mobile_robot", "planar_four", "quadratic_analysis", "rigid_object"]
