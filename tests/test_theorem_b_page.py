"""The example of the page about Theorem B prints what stands there."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import pytest

from synctrl.errors import StepWarning

PAGE = (Path(__file__).parents[1] / "docs" / "theorem_b.md").read_text("utf-8")


def test_the_example_prints_what_the_page_says(capsys):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    (said,) = re.findall(r"```text\n(.*?)```", PAGE, flags=re.DOTALL)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StepWarning)
        exec(compile(block, "docs/theorem_b.md", "exec"), {})
    printed = capsys.readouterr().out
    number = r"\d+\.\d+"
    assert re.sub(number, "", printed) == re.sub(number, "", said)
    found, expected = (list(map(float, re.findall(number, text))) for text in (printed, said))
    assert found == pytest.approx(expected, abs=2e-3)  # two of the last digits of |r|
