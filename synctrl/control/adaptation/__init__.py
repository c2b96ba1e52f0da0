"""Ways to learn: from velocity errors to estimates of the robots' parameters."""

from .gradient import Gradient, chosen
from .guarded import Guarded, bounded
from .leakage import EModification, Leakage, Sigma, Switching
from .natural import Natural
from .projection import Ball, Box
from .protocol import Adaptation, BoundAdaptation, Seen, after_sample

__all__ = [
    "Adaptation",
    "Ball",
    "BoundAdaptation",
    "Box",
    "EModification",
    "Gradient",
    "Guarded",
    "Leakage",
    "Natural",
    "Seen",
    "Sigma",
    "Switching",
    "after_sample",
    "bounded",
    "chosen",
]
