"""The JSON schema of cell files, for editors, and the keys of their tables."""

from __future__ import annotations

from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import Tag

from .file import CellTable
from .kinds import NAMED

#: where something is, in pydantic's words
Loc = tuple[str | int, ...]
#: draft that the schema follows
DRAFT = "https://json-schema.org/draft/2020-12/schema"


def schema() -> dict[str, Any]:
    """The JSON schema of cell files, draft 2020-12, as plain data."""
    made = CellTable.model_json_schema()
    return {"$schema": DRAFT, **made, "title": "Cell file of synctrl"}


def keys_at(loc: Loc) -> list[str]:
    """The keys that a table may have, in pydantic's words of where it is: kinds are among the steps."""
    return list(getattr(_at(loc), "model_fields", ()))


def kinds_at(loc: Loc) -> list[str]:
    """The kinds that there are of what is at some place."""
    return [tag.tag for each in get_args(_bare(_at(loc))) for tag in _tags(each) if tag.tag != NAMED]


def meaning_at(loc: Loc) -> str:
    """What a key means."""
    fields = getattr(_at(loc[:-1]), "model_fields", {})
    return getattr(fields.get(str(loc[-1])), "description", None) or ""


def _at(loc: Loc) -> Any:
    kept: Any = CellTable
    for step in loc:
        kept = _inside(kept, step)
    return kept


def _bare(kept: Any) -> Any:
    """A type without what is annotated."""
    return _bare(get_args(kept)[0]) if get_origin(kept) is Annotated else kept


def _inside(kept: Any, step: str | int) -> Any:
    """The type of what lies in a value of some type."""
    kept = _bare(kept)
    origin, arguments = get_origin(kept), get_args(kept)
    if origin in (Union, UnionType):
        return next((get_args(each)[0] for each in arguments if Tag(str(step)) in _tags(each)), None)
    if origin in (list, dict):
        return arguments[-1]
    fields = getattr(kept, "model_fields", {})
    return fields[step].annotation if step in fields else None


def _tags(kept: Any) -> list[Any]:
    return [each for each in get_args(kept)[1:] if isinstance(each, Tag)]
