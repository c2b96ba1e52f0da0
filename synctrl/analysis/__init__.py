"""How well: metrics, the Lyapunov proof, certificates, bounds and rates, laws side by side."""

from .advice import Advice
from .advise import advise, advise_run
from .certify import Certificate, certify
from .comparison import Comparison, compare, side_by_side
from .decay import Decay, simulated_decay
from .delay_map import DelayMap, delay_map
from .delay_margin import DelayMargin, delay_margin
from .dissipation import Dissipation, dissipation
from .exponential_rate import ExponentialRate, RatesOverGamma, exponential_rate, rates_over_gamma
from .modal import ModalBounds, modal_bounds
from .period_margin import period_margin
from .resolution import resolution_error
from .tube import Tube, tube

__all__ = [
    "Advice",
    "Certificate",
    "Comparison",
    "Decay",
    "DelayMap",
    "DelayMargin",
    "Dissipation",
    "ExponentialRate",
    "ModalBounds",
    "RatesOverGamma",
    "Tube",
    "advise",
    "advise_run",
    "certify",
    "compare",
    "delay_map",
    "delay_margin",
    "dissipation",
    "exponential_rate",
    "modal_bounds",
    "period_margin",
    "rates_over_gamma",
    "resolution_error",
    "side_by_side",
    "simulated_decay",
    "tube",
]
