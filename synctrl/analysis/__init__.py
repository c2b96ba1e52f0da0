"""How well: metrics, the Lyapunov proof, certificates, laws side by side."""

from .certify import Certificate, certify
from .comparison import Comparison, compare, side_by_side
from .delay_map import DelayMap, delay_map
from .delay_margin import DelayMargin, delay_margin
from .dissipation import Dissipation, dissipation
from .period_margin import period_margin
from .resolution import resolution_error

__all__ = [
    "Certificate",
    "Comparison",
    "DelayMap",
    "DelayMargin",
    "Dissipation",
    "certify",
    "compare",
    "delay_map",
    "delay_margin",
    "dissipation",
    "period_margin",
    "resolution_error",
    "side_by_side",
]
