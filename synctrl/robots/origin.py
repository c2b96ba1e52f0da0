"""Where a robot comes from: how it was loaded, and what was done to it since, step by step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Self


class Step(NamedTuple):
    """One step: what was done, and with which arguments."""

    kind: str
    given: Mapping[str, Any]


class Origin(tuple[Step, ...]):
    """Steps from a description to a robot, the first of which loads it; empty where that is not known."""

    __slots__ = ()

    @classmethod
    def loaded(cls, source: Any, **options: Any) -> Self:
        """The origin of a robot that `load_robot` made; `source` is a name, or a `Path` from the root."""
        return cls((Step("loaded", {"source": source, **options}),))

    def then(self, kind: str, **given: Any) -> Self:
        """This origin with one more step; still empty if it is."""
        return type(self)((*self, Step(kind, given))) if self else self


#: of a robot that was made of a model by hand
UNKNOWN = Origin()
