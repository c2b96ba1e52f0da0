"""From what a user says of the law, a law or options of the paper's law, to the law that a controller has.

`Controller` and `Experiment` take `law=`. Beside it they take `reference_acceleration=` and `k_r_space=`, so
that the paper's law with one option changed needs no `SunMills(...)`. Here both are brought together, and a
contradiction between them is refused.
"""

from __future__ import annotations

from typing import NamedTuple

from ...checks import choice
from ...errors import InputError
from .protocol import Law
from .sun_mills import K_R_SPACES, SunMills


class Options(NamedTuple):
    """A law, and what a controller has to know of it.

    Attributes:
        law: the law.
        reference_acceleration: "paper" where xref'' is that of (13), else "exact".
        k_r_space: "joint" or "task", where the damping K_r acts.
    """

    law: Law
    reference_acceleration: str
    k_r_space: str


def chosen(law: Law | None, reference_acceleration: str | None, k_r_space: str | None) -> Options:
    """The law given, or the paper's with the options given.

    Args:
        law: a law, or None for `SunMills`.
        reference_acceleration, k_r_space: options of `SunMills`, or None where they are not given. Where the
            damping acts may be said beside any law.

    Raises:
        InputError: something that is no law, an unknown word, or an option that the law contradicts.
    """
    if law is None:
        law = SunMills(reference_acceleration or "exact", k_r_space or "joint")
    elif not hasattr(law, "bind") or isinstance(law, type):
        raise InputError(
            f"expected, for example, SunMills() or ChungSlotine(0.3), found {law!r}", subject="law", found=law
        )
    acceleration = _agreed("reference_acceleration", reference_acceleration, law, "exact")
    space = getattr(law, "k_r_space", k_r_space or "joint")
    _agreed("k_r_space", k_r_space, law, space)
    return Options(law, acceleration, choice("k_r_space", space, K_R_SPACES))


def _agreed(name: str, given: str | None, law: Law, otherwise: str) -> str:
    """An option of a law, which the one given beside it must not contradict."""
    own = getattr(law, name, otherwise)
    if given not in (None, own):
        raise InputError.expected(
            f"{own!r}, which is what the law {type(law).__name__} has, or nothing beside it", given, name
        )
    return own
