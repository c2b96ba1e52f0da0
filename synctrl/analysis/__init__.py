"""How well: metrics, the Lyapunov proof, certificates, laws side by side."""

from .certify import Certificate, certify
from .comparison import Comparison, compare

__all__ = ["Certificate", "Comparison", "certify", "compare"]
