"""The example of docs/long_motions.md runs."""

from __future__ import annotations

import doctest
import re
from pathlib import Path

PAGE = (Path(__file__).parents[2] / "docs" / "long_motions.md").read_text(encoding="utf-8")


def test_example() -> None:
    code = re.sub(r"^```\w*$", "", PAGE, flags=re.M)
    code = re.sub(r"^>>> (\w+\.add\()", r">>> _ = \1", code, flags=re.M)  # it returns the last element
    test = doctest.DocTestParser().get_doctest(code, {}, "long_motions.md", None, 0)
    assert len(test.examples) > 5
    said: list[str] = []
    failed, _ = doctest.DocTestRunner(verbose=False).run(test, out=said.append)
    assert failed == 0, "".join(said)
