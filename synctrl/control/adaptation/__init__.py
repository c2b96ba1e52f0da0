"""Ways to learn: from velocity errors to estimates of the robots' parameters."""

from .composite import Composite
from .gradient import Gradient, chosen
from .guarded import Guarded, bounded
from .hedged import Hedged
from .leakage import EModification, Leakage, Sigma, Switching
from .natural import Natural
from .paced import Override, Paced
from .projection import Ball, Box
from .protocol import Adaptation, BoundAdaptation, Seen, after_sample, pace_of, shift_of

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
    "Override",
    "Paced",
    "Seen",
    "Sigma",
    "Switching",
    "after_sample",
    "bounded",
    "chosen",
    "pace_of",
    "shift_of",
]
