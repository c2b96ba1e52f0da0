"""Laws: from errors, and what the neighbours said, to reference motion and force."""

from .chung_slotine import ChungSlotine
from .options import Options, chosen
from .protocol import Along, Asked, BoundLaw, Errors, Law, Proof, completed, no_errors
from .sun_mills import SunMills

__all__ = [
    "Along",
    "Asked",
    "BoundLaw",
    "ChungSlotine",
    "Errors",
    "Law",
    "Options",
    "Proof",
    "SunMills",
    "chosen",
    "completed",
    "no_errors",
]
