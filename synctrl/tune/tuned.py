"""What tuning has found: the front of several goals, one run of it, and all runs that were made."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..checks import choice, count
from ..control.gains import Gains
from ..errors import InputError, MissingDependencyError
from ..files import reported, write_whole
from ..simulation.simulate import Experiment
from ..sweep.factors import Factor
from ..sweep.measures import Measure
from .goals import Goal, Judge, knee

#: the table of the front in a search's folder
FRONT = "front.csv"


@dataclass(frozen=True, eq=False, repr=False)
class Tuned:
    """What tuning has found.

    Rows are those of a sweep's table, as dictionaries. Of one goal the front is the best run, or those that
    are equally good; of several it is all runs to which no other one is preferable, being as good in every
    goal and better in one. Only runs that went to their end, kept all limits and have a number for every
    goal can be on it.

    Attributes:
        judge: the goals and limits of the search.
        history: every run that was made, in order.
        front: rows of the front, the best in the first goal first.
        run: number of the run that was chosen; `best` and `chosen` choose another one.
        definitions: what the measures mean, and their units, by name.
        base, factors: what was searched.
    """

    judge: Judge
    history: list[dict[str, Any]]
    front: list[dict[str, Any]]
    run: int
    definitions: dict[str, Measure]
    base: Experiment
    factors: Sequence[Factor]

    @property
    def goals(self) -> tuple[Goal, ...]:
        """The goals of the search, in the order in which they were given."""
        return self.judge.goals

    @property
    def values(self) -> dict[str, float]:
        """The value of each factor in the chosen run."""
        return {factor.name: self.history[self.run][factor.name] for factor in self.factors}

    @property
    def measures(self) -> dict[str, float | None]:
        """The measures of the chosen run, under the names of a sweep's table."""
        return {name: self.history[self.run][name] for name in self.definitions}

    @property
    def experiment(self) -> Experiment:
        """The experiment of the chosen run."""
        experiment = self.base
        for factor in self.factors:
            experiment = factor.change(experiment, self.values[factor.name])
        return experiment

    @property
    def gains(self) -> Gains:
        """The gains of the chosen run."""
        return self.experiment.gains

    def best(self, goal: str | None = None) -> Tuned:
        """The same with another run of the front chosen.

        Args:
            goal: the best one in this goal; by default the one that is nearest to the best of all goals, as
                shares of what the front spans, which is what is chosen to begin with.

        Raises:
            InputError: no goal of this search.
        """
        names = tuple(each.name for each in self.goals)
        values = self.judge.values(self.front)
        if goal is not None:
            values = values[:, [names.index(choice("goal", goal, names))]]
        return replace(self, run=self.front[knee(values)]["run"])

    def chosen(self, run: int) -> Tuned:
        """The same with a run of the front chosen by its number.

        Raises:
            InputError: it is not on the front.
        """
        runs = [row["run"] for row in self.front]
        if count("run", run, least=0) not in runs:
            raise InputError.expected("a run of the front", run, "run")
        return replace(self, run=int(run))

    def to_pandas(self) -> Any:
        """All runs as a pandas DataFrame, by number; its column "front" says which are on the front.

        Raises:
            MissingDependencyError: pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError as error:
            raise MissingDependencyError("a table needs pandas: pip install 'synctrl[sweep]'") from error
        runs = {row["run"] for row in self.front}
        rows = [{**row, "front": row["run"] in runs} for row in self.history]
        return pd.DataFrame(rows).set_index("run")

    def save_front(self, path: str | Path) -> Path:
        """Write the rows of the front as a table of comma-separated values; floats have all their digits.

        Raises:
            ResultError: it cannot be written.
        """
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.history[0])
        for row in self.front:
            writer.writerow("" if value is None else value for value in row.values())
        with reported("write the front", path):
            write_whole(path, text.getvalue())
        return Path(path)

    def __repr__(self) -> str:
        values, measured = (
            ", ".join(f"{name} = {value:.4g}" for name, value in numbers.items() if value is not None)
            for numbers in (self.values, self.measures)
        )
        of = f" of {len(self.front)} on the front" if len(self.goals) > 1 else ""
        what = f"run {self.run}{of}" if of else "the best"
        return f"Tuned: {what} of {len(self.history)} runs\n  values: {values}\n  measures: {measured}"
