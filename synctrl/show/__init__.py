"""Let me see: figures, animations, pages."""

from .cell_scene import scene_of
from .side_by_side import side_by_side

__all__ = ["scene_of", "side_by_side"]
