"""The examples of docs/rotations.md run and give what they say; its tables name all that is offered."""

from __future__ import annotations

import doctest
import re
from pathlib import Path

from flyball import rotations

PAGE = (Path(__file__).parents[2] / "docs" / "rotations.md").read_text(encoding="utf-8")


def test_examples():
    code = re.sub(r"^```\w*$", "", PAGE, flags=re.M)
    test = doctest.DocTestParser().get_doctest(code, {}, "rotations.md", None, 0)
    assert len(test.examples) > 20
    said = []
    options = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    failed, _ = doctest.DocTestRunner(optionflags=options, verbose=False).run(test, out=said.append)
    assert failed == 0, "".join(said)


def test_every_function_is_named():
    named = set(re.findall(r"`(\w+)", PAGE))
    missing = {n for n in rotations.__all__ if n not in named}
    # those that the page names by a pattern: "..._inverse", "rotation_vector_..."
    derived = {n for n in missing if n.endswith(("_inverse", "_rate", "_accelerations", "_angular_acceleration"))}
    assert missing == derived
