"""How well: metrics, the Lyapunov proof, certificates."""

from .certify import Certificate, certify

__all__ = ["Certificate", "certify"]
