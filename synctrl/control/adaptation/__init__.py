"""Ways to learn: from velocity errors to estimates of the robots' parameters."""

from .gradient import Gradient, chosen
from .natural import Natural
from .protocol import Adaptation, BoundAdaptation, Seen

__all__ = ["Adaptation", "BoundAdaptation", "Gradient", "Natural", "Seen", "chosen"]
