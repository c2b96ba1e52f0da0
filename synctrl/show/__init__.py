"""Let me see: figures, animations, pages."""

from .cell_scene import scene_of

__all__ = ["scene_of"]
