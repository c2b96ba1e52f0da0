"""Write docs/cell_keys.md: every table of a cell file, its keys, what they mean, and their defaults."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from synctrl.cells import controls, couplings, holding, motions, plants, robots, schema

PAGE = Path(__file__).parents[1] / "docs" / "cell_keys.md"
HEAD = """\
# Keys of cell files

Every table of a [cell file](cell_files.md), with its keys; `scripts/cell_keys.py` makes this page from the
schema. In italics is what a value is where no default is said. `(n,)` is a list of n numbers, `(n, m)` a list
of n such lists, with n robots, m task coordinates, nv joints and P parameters. An angle is a number in rad,
or a text such as `"90 deg"`.
"""
#: tables by what they are for; the first have names that are not those of kinds
GROUPS: dict[str, Sequence[Any]] = {
    "Robots": (
        "Robot", *(each for each in robots.KINDS if each is not robots.ARM), holding.HOLDS, robots.ARM,
    ),
    "Motions": motions.MOTIONS,
    "Orientations": motions.ORIENTATIONS,
    "Paths and edges": (motions.PATH, motions.EDGE),
    "Spaces": (*plants.SPACES, plants.REDUNDANCY, plants.DAMPING),
    "Couplings": (*couplings.COUPLINGS, couplings.PATH_WEIGHTS, couplings.GATE),
    "Gains": (controls.GAINS,),
    "Laws": controls.LAWS,
    "Adaptations": (*controls.ALONE, *controls.AROUND, *controls.RATES, controls.OVERRIDE),
    "Networks": controls.NETWORKS,
    "Sensors and actuators": (*controls.SENSORS, *controls.ACTUATORS),
    "Giving way": (controls.ADMITTANCE,),
    "Disturbances and loads": (plants.DISTURBANCE, plants.LOAD),
    "Plants": (
        *plants.PLANTS.values(), plants.OBJECT, plants.OUTLINE, plants.GRASP, *plants.FIXTURES, plants.AT,
        plants.PID,
    ),
    "Runs": ("Run",),
}  # fmt: skip
#: kinds that are listed one by one where one of them may stand
LISTED = 11
NUMBER = {"type": "number"}
VALUES = {"number": "number", "string": "text", "boolean": "`true` or `false`", "integer": "whole number"}
#: lists of these
MANY = {
    "number": "numbers", "numbers": "rows of numbers", "rows of numbers": "matrices", "angle": "angles",
    "angles": "rows of angles", "text": "texts",
}  # fmt: skip


class Page:
    """The page, made from a schema."""

    def __init__(self, made: dict[str, Any]):
        self._tables = made["$defs"]
        self._file = made
        self._home = {_name(each): group for group, tables in GROUPS.items() for each in tables}

    def text(self) -> str:
        """The whole page."""
        blocks = [HEAD, "## The file\n", *self._table(self._file)]
        for group, tables in GROUPS.items():
            blocks.append(f"## {group}\n")
            for each in tables:
                blocks += [f"### {self._title(_name(each))}\n", *self._table(self._tables[_name(each)])]
        return "\n".join(blocks)

    def missing(self) -> set[str]:
        """Tables of the schema that the page does not have."""
        return {*self._tables} - {*self._home}

    def _title(self, name: str) -> str:
        kind = self._kind(name)
        return f'kind = "{kind}"' if kind else name

    def _kind(self, name: str) -> str | None:
        return self._tables[name]["properties"].get("kind", {}).get("const")

    def _table(self, table: dict[str, Any]) -> Iterator[str]:
        yield f"{_line(table['description'])}\n"
        keys = {key: about for key, about in table["properties"].items() if key != "kind"}
        if keys:
            yield "| key | meaning | default, or *value* |\n|---|---|---|"
            needed = table.get("required", ())
            yield "\n".join(self._row(key, about, key in needed) for key, about in keys.items()) + "\n"

    def _row(self, key: str, about: dict[str, Any], needed: bool) -> str:
        default = about.get("default")
        shown = f"`{json.dumps(default)}`" if default not in (None, [], {}) else f"*{self._value(about)}*"
        return f"| `{key}`{', needed' if needed else ''} | {_line(about['description'])} | {shown} |"

    def _value(self, about: dict[str, Any]) -> str:
        """What a value is, in words."""
        choices = about.get("oneOf") or about.get("anyOf")
        if choices:
            return self._one_of(choices)
        if "$ref" in about:
            return f"table {self._named(about)}"
        if "enum" in about:
            return " or ".join(f"`{json.dumps(word)}`" for word in about["enum"])
        if about.get("type") == "array":
            return self._list_of(about)
        if about.get("type") == "object":
            return f"{self._value(about['additionalProperties'])}, by name"
        return VALUES.get(str(about.get("type")), "number, text or `true` or `false`")

    def _list_of(self, about: dict[str, Any]) -> str:
        if "items" not in about:
            return "matrix or three angles"
        inner = self._value(about["items"])
        return MANY.get(inner, f"list: {inner}")

    def _one_of(self, choices: list[dict[str, Any]]) -> str:
        if choices[0] == NUMBER and "pattern" in choices[-1]:
            return "angle"
        tables = [each for each in choices if "$ref" in each]
        kinds = {self._kind(each["$ref"].rpartition("/")[2]) for each in tables}
        words = [self._named(each) for each in tables]
        if len(words) > LISTED:
            home = self._home[tables[0]["$ref"].rpartition("/")[2]]
            words = [f"one of the [{home.lower()}](#{home.lower().replace(' ', '-')})"]
        others = [each for each in choices if "$ref" not in each and not {*each.get("enum", "-")} <= kinds]
        return " or ".join(dict.fromkeys([*words, *map(self._value, others)]))

    def _named(self, about: dict[str, Any]) -> str:
        name = about["$ref"].rpartition("/")[2]
        return f"`{self._kind(name) or name}`"


def _name(each: Any) -> str:
    return each if isinstance(each, str) else each.model.__name__


def _line(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("*", "\\*")


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__).parse_args()
    PAGE.write_text(Page(schema()).text(), "utf-8")
