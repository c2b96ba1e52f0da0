"""The JSON schema of cell files, for editors, and the keys of their tables."""

from __future__ import annotations

from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import Tag

from .file import CellTable
from .kinds import Table

#: draft that the schema follows
DRAFT = "https://json-schema.org/draft/2020-12/schema"


def schema() -> dict[str, Any]:
    """The JSON schema of cell files, draft 2020-12, as plain data."""
    made = CellTable.model_json_schema()
    return {"$schema": DRAFT, **made, "title": "Cell file of synctrl"}


def keys_at(loc: tuple[str | int, ...]) -> list[str]:
    """The keys that a table may have.

    Args:
        loc: where it is, in pydantic's words: keys, indices, and the kinds of the tables on the way.
    """
    kept: Any = CellTable
    for step in loc:
        kept = _inside(kept, step)
    return list(kept.model_fields) if isinstance(kept, type) and issubclass(kept, Table) else []


def _inside(kept: Any, step: str | int) -> Any:
    """The type of what lies in a value of some type."""
    origin, arguments = get_origin(kept), get_args(kept)
    if origin is Annotated:
        return _inside(arguments[0], step)
    if origin in (Union, UnionType):
        return next((get_args(each)[0] for each in arguments if Tag(str(step)) in _tags(each)), None)
    if origin in (list, dict):
        return arguments[-1]
    return kept.model_fields[step].annotation if hasattr(kept, "model_fields") else None


def _tags(kept: Any) -> list[Any]:
    return [each for each in get_args(kept)[1:] if isinstance(each, Tag)]
