"""How well: metrics, the Lyapunov proof, certificates, laws side by side."""

from .certify import Certificate, certify
from .comparison import Comparison, compare, side_by_side
from .decay import Decay, simulated_decay
from .delay_map import DelayMap, delay_map
from .delay_margin import DelayMargin, delay_margin
from .exponential_rate import ExponentialRate, RatesOverGamma, exponential_rate, rates_over_gamma
from .period_margin import period_margin
from .resolution import resolution_error

__all__ = [
    "Certificate",
    "Comparison",
    "Decay",
    "DelayMap",
    "DelayMargin",
    "ExponentialRate",
    "RatesOverGamma",
    "certify",
    "compare",
    "delay_map",
    "delay_margin",
    "exponential_rate",
    "period_margin",
    "rates_over_gamma",
    "resolution_error",
    "side_by_side",
    "simulated_decay",
]
