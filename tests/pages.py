"""Pages of the documentation whose examples are run."""

from __future__ import annotations

import doctest
import re
from pathlib import Path

DOCS = Path(__file__).parents[1] / "docs"


def page(name: str) -> str:
    """The text of a page."""
    return (DOCS / name).read_text(encoding="utf-8")


def assert_examples_run(name: str, least: int, options: int = 0) -> None:
    """There are at least so many examples on a page, and they give what they say."""
    code = re.sub(r"^```\w*$", "", page(name), flags=re.M)
    code = re.sub(r"^>>> (\w+\.add\()", r">>> _ = \1", code, flags=re.M)  # it returns the last element
    test = doctest.DocTestParser().get_doctest(code, {}, name, None, 0)
    assert len(test.examples) >= least
    said: list[str] = []
    failed, _ = doctest.DocTestRunner(optionflags=options, verbose=False).run(test, out=said.append)
    assert failed == 0, "".join(said)
