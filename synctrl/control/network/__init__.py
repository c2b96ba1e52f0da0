"""What the robots of a cell know of each other: everything at once, or what a real network brings."""

from .delayed import BoundDelayed
from .ideal import BoundIdeal, Ideal
from .links import Links
from .messages import Messages
from .network import Network
from .posted import BoundPosted
from .protocol import BoundNetwork, Communication, Received, check_leak, connected
from .w_form import WForm

__all__ = [
    "BoundDelayed",
    "BoundIdeal",
    "BoundNetwork",
    "BoundPosted",
    "Communication",
    "Ideal",
    "Links",
    "Messages",
    "Network",
    "Received",
    "WForm",
    "check_leak",
    "connected",
]
