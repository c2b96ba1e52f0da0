"""Laws: from errors, and what the neighbours said, to reference motion and force."""

from .chung_slotine import ChungSlotine
from .classic import ComputedTorque, PDGravity, SlotineLi
from .master_slave import MasterSlave
from .options import Options, chosen
from .protocol import DIFFUSION, Along, Asked, BoundLaw, Errors, Law, Proof, completed, no_errors
from .shape_keeping import ShapeKeeping
from .sun_mills import SunMills

__all__ = [
    "DIFFUSION",
    "Along",
    "Asked",
    "BoundLaw",
    "ChungSlotine",
    "ComputedTorque",
    "Errors",
    "Law",
    "MasterSlave",
    "Options",
    "PDGravity",
    "Proof",
    "ShapeKeeping",
    "SlotineLi",
    "SunMills",
    "chosen",
    "completed",
    "no_errors",
]
