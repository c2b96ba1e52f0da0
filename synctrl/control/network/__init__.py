"""What the robots of a cell know of each other: everything at once, or what a real network brings."""

from .delayed import BoundDelayed
from .ideal import BoundIdeal, Ideal
from .links import Links
from .mailbox import BoundMailbox, Mailbox
from .messages import Messages
from .network import Network
from .posted import BoundPosted
from .protocol import BoundNetwork, Communication, Received, check_leak, connected, connected_with_slips
from .w_form import WForm
from .wire import Message

__all__ = [
    "BoundDelayed",
    "BoundIdeal",
    "BoundMailbox",
    "BoundNetwork",
    "BoundPosted",
    "Communication",
    "Ideal",
    "Links",
    "Mailbox",
    "Message",
    "Messages",
    "Network",
    "Received",
    "WForm",
    "check_leak",
    "connected",
    "connected_with_slips",
]
