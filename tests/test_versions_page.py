"""The page about versions says what is done with old names."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

from synctrl import renamed

PAGE = (Path(__file__).parents[1] / "docs" / "versions.md").read_text("utf-8")


def test_the_old_name_of_the_page_warns_as_it_says():
    code, said = re.search(r"```python\n(.*?)```\n\n```text\n(.*?)\n```", PAGE, re.DOTALL).groups()
    with warnings.catch_warnings(record=True) as found:
        exec(code, {})
    assert [f"{each.category.__name__}: {each.message}" for each in found] == [said]


def test_no_old_name_has_gone():
    assert len(renamed.MOVED) > 40 and "Until version 1.0 none\ngoes." in PAGE
