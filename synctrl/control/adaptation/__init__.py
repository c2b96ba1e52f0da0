"""Ways to learn: from velocity errors to estimates of the robots' parameters."""

from .composite import Composite
from .gradient import Gradient, chosen
from .guarded import Guarded, bounded
from .hedged import Hedged
from .leakage import EModification, Leakage, Sigma, Switching
from .natural import Natural
from .projection import Ball, Box
from .protocol import Adaptation, BoundAdaptation, Seen, after_sample, shift_of

__all__ = [
    "Adaptation",
    "Ball",
    "BoundAdaptation",
    "Box",
    "Composite",
    "EModification",
    "Gradient",
    "Guarded",
    "Hedged",
    "Leakage",
    "Natural",
    "Seen",
    "Sigma",
    "Switching",
    "after_sample",
    "bounded",
    "chosen",
    "shift_of",
]
