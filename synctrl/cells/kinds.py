"""Kinds of parts: which class a table of a cell file stands for, and which keys it has.

The keys are the arguments of the class, whose signature says which of them have a default and whose docstring
says what they mean; so there is one place that says so.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from inspect import Parameter, getdoc, signature
from typing import Annotated, Any, Literal, Union

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, create_model

from .values import PLAIN, checked_choice, kept, misfit, plain

#: of what stands in the place of a table
NAMED, TABLE = "a name", "a table"


class Table(BaseModel):
    """A table of a cell file, with no keys beside those that it says."""

    model_config = ConfigDict(extra="forbid", arbitrary_types_allowed=True)


@dataclass(frozen=True)
class Kind:
    """One kind of part.

    Attributes:
        name: value of the key `kind`.
        target: the class of the part, by which it is found when it is written; None for one that is written
            as another kind.
        fields: types of the keys, by name.
        make: from keys and values to the part; by default the target.
        read: from the part to keys and values; by default its attributes of the same names.
        model: the table as pydantic checks it.
    """

    name: str
    target: type | None
    fields: Mapping[str, Any]
    make: Callable[..., Any]
    read: Callable[[Any], Mapping[str, Any]]
    model: Any

    def told(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """The keys and values that a file has to say: those that are not what they are by default."""
        known = self.model.model_fields
        given = {name: plain(value) for name, value in values.items() if value is not None}
        return {name: value for name, value in given.items() if not _is_default(known[name].default, value)}


def kind(
    name: str,
    target: type | None,
    /,
    make: Callable[..., Any] | None = None,
    read: Callable[[Any], Mapping[str, Any]] | None = None,
    **fields: Any,
) -> Kind:
    """A kind of part, see `Kind`, with defaults and descriptions of the function that makes it.

    Without a name it is the only kind in its place, and its table has no key `kind`.
    """
    maker: Any = target if make is None else make
    tag = {"kind": (Literal[name], ...)} if name else {}
    text = getdoc(maker if target is None else target) or ""
    model = table(name if target is None else target.__name__, maker, fields, text, **tag)
    return Kind(name, target, fields, maker, read or _attributes(tuple(fields)), model)


def table(name: str, maker: Callable[..., Any], fields: Mapping[str, Any], text: str, **further: Any) -> Any:
    """A table whose keys are arguments of a function.

    Args:
        name: of the table, for the schema.
        maker: the function.
        fields: types of the keys.
        text: docstring that says what they mean.
        further: keys that are no arguments, with type and default.
    """
    meant, known = meanings(text), signature(maker).parameters
    keys = {key: (each, _field(known[key], meant.get(key))) for key, each in fields.items()}
    return make_table(name or maker.__name__, text.partition("\n")[0], {**further, **keys})


def make_table(name: str, text: str, keys: Mapping[str, Any], base: type[Table] = Table) -> Any:
    """A table of these keys, each with its type and what pydantic's `Field` says of it."""
    make: Any = create_model
    return make(name, __base__=base, __doc__=text, **keys)


def one_of(*kinds: Kind, named: Any = None) -> Any:
    """One of some kinds, which the key `kind` says; or its name alone, if all else has a default.

    Args:
        kinds: the kinds.
        named: the type of a text in the place of a table, which then is a name of something else.
    """
    choices: list[Any] = [Annotated[each.model, Tag(each.name)] for each in kinds]
    choices.append(Annotated[_alone(kinds) if named is None else named, Tag(NAMED)])
    return Annotated[Union[tuple(choices)], Discriminator(_tag_or_name)]  # noqa: UP007


def table_or(whole: Kind, other: Any) -> Any:
    """The table of one kind, or something of another type that is no table."""
    choices: Any = (Annotated[whole.model, Tag(TABLE)], Annotated[other, Tag(NAMED)])
    return Annotated[Union[choices], Discriminator(_table_or_other)]  # noqa: UP007


def meanings(text: str) -> dict[str, str]:
    """What the arguments in a docstring mean, by name."""
    found = re.search(r"^Args:\n((?:[ ]{4}.*\n?|\n)*)", text, flags=re.MULTILINE)
    return dict(_meanings(found.group(1))) if found else {}


def _meanings(lines: str) -> Iterator[tuple[str, str]]:
    for entry in re.split(r"\n(?=[ ]{4}\S)", lines.rstrip()):
        names, _, words = entry.strip().partition(":")
        for name in names.split(","):
            yield name.strip(), " ".join(words.split())


def _field(argument: Parameter, meaning: str | None) -> Any:
    if argument.default is Parameter.empty:
        return Field(description=meaning)
    default = plain(argument.default)
    shown = isinstance(default, (*PLAIN, list))
    return Field(default=default if shown else None, description=meaning)


def _is_default(default: Any, value: Any) -> bool:
    """Whether a value is the default to the last bit, zeros with their signs."""
    return type(default) in (*PLAIN, list) and repr(default) == repr(value)


def _attributes(names: tuple[str, ...]) -> Callable[[Any], Mapping[str, Any]]:
    return lambda part: {name: getattr(part, name) for name in names}


def _alone(kinds: tuple[Kind, ...]) -> Any:
    """A kind by its name alone: one that has to be told nothing."""
    free = {each.name: each.model for each in kinds if not _needed(each)}

    def read(name: str) -> Table:
        needed = next((_needed(each) for each in kinds if each.name == name), ())
        if needed:
            raise misfit(f"a table, for {name!r} has to be told {', '.join(needed)}", f"{name!r} alone")
        return free[checked_choice(tuple(each.name for each in kinds), name)](kind=name)

    return kept(read, {"enum": list(free)})


def _needed(whole: Kind) -> list[str]:
    fields = whole.model.model_fields
    return [name for name in whole.fields if fields[name].is_required()]


def _tag_or_name(value: Any) -> Any:
    if isinstance(value, str):
        return NAMED
    return value.get("kind") if isinstance(value, dict) else getattr(value, "kind", None)


def _table_or_other(value: Any) -> str:
    return TABLE if isinstance(value, (dict, Table)) else NAMED
