"""Quantities as protobuf messages: one type for each, with a field for every number."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from .identifiers import identifiers
from .needed import needed
from .quantities import Entry, Quantity

#: numbers of fields from this one on, as many, belong to protobuf
OWN, COUNT = 19000, 1000


class Signal:
    """The messages of one quantity.

    Its fields are rows, such as robots, and the fields of these are columns, such as joints; where there are
    no columns rows are numbers, and where there are no rows the one field is `value`. Numbers are doubles.

    Args:
        quantity: what it is made of.
        name: of its type.

    Attributes:
        topic: where its messages belong.
        paths: where the entries of the quantity are in a message, such as `robot_1.joint2`.

    Raises:
        MissingDependencyError: protobuf is not installed.
    """

    def __init__(self, quantity: Quantity, name: str):
        self.quantity, self.topic = quantity, f"/{name}"
        rows: dict[str, list[Entry]] = {}
        for entry in quantity.entries:
            rows.setdefault(entry.row, []).append(entry)
        self._rows = dict(zip(identifiers(row or "value" for row in rows), rows.values(), strict=True))
        self._columns = {
            row: identifiers(entry.column for entry in entries) if entries[0].column else None
            for row, entries in self._rows.items()
        }
        self.paths = [path for row in self._rows for path in self._paths(row)]
        self._type = _message_type(name, self._columns)

    def _paths(self, row: str) -> list[str]:
        columns = self._columns[row]
        return [row] if columns is None else [f"{row}.{column}" for column in columns]

    def message(self, numbers: Sequence[float]) -> Any:
        """The message of the entries' numbers at one instant."""
        parts: dict[str, Any] = {}
        start = 0
        for row, columns in self._columns.items():
            if columns is None:
                parts[row], start = numbers[start], start + 1
            else:
                stop = start + len(columns)
                parts[row] = dict(zip(columns, numbers[start:stop], strict=True))
                start = stop
        return self._type(**parts)

    def about(self) -> str:
        """What it means, as JSON: what of `Quantity` is words, and row, column and unit of every field."""
        fields = {path: entry[1:] for path, entry in zip(self.paths, self.quantity.entries, strict=True)}
        names = ("name", "long_name", "unit", "equation")
        return json.dumps({**{name: getattr(self.quantity, name) for name in names}, "fields": fields})


def signals(found: Sequence[Quantity]) -> list[Signal]:
    """Signals of quantities that have numbers."""
    some = [each for each in found if each.entries]
    names = identifiers(each.name for each in some)
    return [Signal(each, name) for each, name in zip(some, names, strict=True)]


def _message_type(name: str, rows: dict[str, list[str] | None]) -> Any:
    """A protobuf class with a field of doubles, or a double, for each row."""
    pb2, pools, factory = needed(
        "an MCAP recording",
        *(f"google.protobuf.{each}" for each in ("descriptor_pb2", "descriptor_pool", "message_factory")),
    )
    file = pb2.FileDescriptorProto(name=f"synctrl/{name}.proto", package="synctrl", syntax="proto3")
    message = file.message_type.add(name=name)
    kinds: dict[tuple[str, ...], str] = {}
    for number, (row, columns) in enumerate(rows.items()):
        if columns is None:
            _add_field(message, row, number, type=pb2.FieldDescriptorProto.TYPE_DOUBLE)
            continue
        if tuple(columns) not in kinds:
            kinds[tuple(columns)] = kind = f"{name}Row{len(kinds) + 1}"
            nested = file.message_type.add(name=kind)
            for k, column in enumerate(columns):
                _add_field(nested, column, k, type=pb2.FieldDescriptorProto.TYPE_DOUBLE)
        kind = f".synctrl.{kinds[tuple(columns)]}"
        _add_field(message, row, number, type=pb2.FieldDescriptorProto.TYPE_MESSAGE, type_name=kind)
    pool = pools.DescriptorPool()
    pool.AddSerializedFile(file.SerializeToString())
    return factory.GetMessageClass(pool.FindMessageTypeByName(f"synctrl.{name}"))


def _add_field(message: Any, name: str, k: int, **kind: Any) -> None:
    """Field k of a message, counted from 0."""
    number = k + 1 if k + 1 < OWN else k + 1 + COUNT
    message.field.add(name=name, json_name=name, number=number, label=1, **kind)


def numbers_of(found: Sequence[Signal], rows: slice) -> list[list[list[float]]]:
    """For each signal the numbers of its entries over some instants."""
    return [each.quantity.flat(rows).astype(np.float64, copy=False).tolist() for each in found]
