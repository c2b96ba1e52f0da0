"""How well: metrics, the Lyapunov proof, certificates, laws side by side."""

from .certify import Certificate, certify
from .comparison import Comparison, compare, side_by_side

__all__ = ["Certificate", "Comparison", "certify", "compare", "side_by_side"]
