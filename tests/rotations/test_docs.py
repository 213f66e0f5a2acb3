"""The tables of docs/rotations.md name all that is offered."""

from __future__ import annotations

import re

from flyball import rotations
from tests.pages import page

PAGE = page("rotations.md")


def test_every_function_is_named():
    named = set(re.findall(r"`(\w+)", PAGE))
    missing = {n for n in rotations.__all__ if n not in named}
    # those that the page names by a pattern: "..._inverse", "rotation_vector_..."
    derived = {n for n in missing if n.endswith(("_inverse", "_rate", "_accelerations", "_angular_acceleration"))}
    assert missing == derived
