"""What law and network say of their part in V, and what is done about those that say nothing.

A law may have a method `proof`, which gives its terms of V and V'. The power of the force of a law without
one is kept under the name "law"; what a network that is not ideal adds to V' under the name "network". So the
balance of V closes with any parts, and a certificate can name those for which no proof is known.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

import numpy as np

from ..control.laws import Along, BoundLaw, Proof
from ..control.network import BoundNetwork
from .replay import Replay


def proof_of(run: Replay) -> Proof:
    """The law's part in V and V'; nothing of a law that has no proof."""
    x, law = run.rows, cast(Any, run.loop.controller.law)
    if not has_proof(law):
        return Proof({}, {}, {})
    return law.proof(Along(x.epsilon, x.epsilon_dot, x.E, x.sigma, x.sigma_dot, x.e_star, x.r, x.c))


def has_proof(law: BoundLaw) -> bool:
    """Whether a law says what its part in V is."""
    return hasattr(law, "proof")


def unproven_powers(run: Replay, proof: Proof, pushed: np.ndarray) -> dict[str, np.ndarray]:
    """Powers by which law and network differ from what the theorem knows.

    Args:
        run: the run.
        proof: the law's.
        pushed: sum_i r_i^T c_i^-T f_i, (R,), which is the rates of the proof less its powers where it holds.
    """
    controller = run.loop.controller
    if not has_proof(controller.law):
        return {"law": -pushed}
    if outside(controller.network) is None:
        return {}
    rates, powers = (_total(terms, pushed) for terms in (proof.rates, proof.powers))
    return {"network": rates - powers - pushed}


def _total(terms: Mapping[str, np.ndarray], like: np.ndarray) -> np.ndarray:
    """Sum over all terms, rows and axes, (T,)."""
    return sum((term.sum(axis=(1, 2)) for term in terms.values()), np.zeros_like(like))


def outside(network: BoundNetwork) -> str | None:
    """What the theorem does not know of a network, in words; None if there is nothing."""
    ask = getattr(network, "outside", None)
    return "no proof is known" if ask is None else ask()


def unproven_parts(run: Replay) -> list[str]:
    """Parts of the controller for which no proof is known, by name."""
    controller, found = run.loop.controller, []
    if not has_proof(controller.law):
        found.append(f"the law {controller.law_settings['name']}: it has no energies, and no proof is known")
    words = outside(controller.network)
    if words is not None:
        found.append(f"the network {controller.network_settings['name']}: {words}")
    return found
