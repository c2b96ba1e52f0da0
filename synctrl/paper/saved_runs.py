"""Runs in a folder, each read when it is asked for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from ..simulation.result import Result


class SavedRuns(Mapping[str, Result]):
    """Runs that were saved, by name. To another process their names travel, and not what is in them.

    Args:
        folder: where the `.npz` files are.
        names: of the runs, and after `prefix` of their files.
        prefix: what the names of the files begin with.
    """

    def __init__(self, folder: Path, names: Iterable[str], prefix: str = ""):
        self.folder, self.prefix = folder, prefix
        self._read: dict[str, Result | None] = dict.fromkeys(names)

    def __getitem__(self, name: str) -> Result:
        found = self._read[name]
        if found is None:
            found = self._read[name] = Result.load(self.folder / f"{self.prefix}{name}.npz")
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(self._read)

    def __len__(self) -> int:
        return len(self._read)

    def named(self, *names: str) -> SavedRuns:
        """Some of them."""
        return SavedRuns(self.folder, [name for name in self if name in names], self.prefix)

    def under(self, prefix: str) -> SavedRuns:
        """Those whose names begin with a word, without it."""
        found = [name.removeprefix(prefix) for name in self if name.startswith(prefix)]
        return SavedRuns(self.folder, found, self.prefix + prefix)

    def __reduce__(self) -> tuple:
        return type(self), (self.folder, tuple(self), self.prefix)
