"""A process that does jobs of `benchmark_jobs` for the package that it finds: lines of JSON there and back.

What is found is the package on PYTHONPATH. Whatever else is printed goes to the error stream.
"""

from __future__ import annotations

import json
import os
import sys
import warnings
from typing import Any


def main() -> None:
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    warnings.simplefilter("ignore")
    from benchmark_jobs import Bench  # imports the package

    bench = Bench()
    for line in sys.stdin:
        answers.write(json.dumps(answer(bench, json.loads(line))) + "\n")
        answers.flush()


def answer(bench: Any, job: dict[str, Any]) -> dict[str, Any]:
    """The result of a job, or the error that it ended with."""
    name = job.pop("do")
    try:
        return getattr(bench, name)(**job)
    except Exception as error:  # a version without what is asked for, whatever it raises
        return {"error": f"{type(error).__name__}: {error}"}


if __name__ == "__main__":
    main()
