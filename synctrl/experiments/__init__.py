"""Ready cells: the paper's two."""

from .a460_pair import a460_pair
from .planar_four import planar_four

__all__ = ["a460_pair", "planar_four"]
