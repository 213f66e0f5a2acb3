"""The commands that docs/linear.md names exist."""

from __future__ import annotations

import re

from flyball.cli import app
from tests.pages import page

PAGE = page("linear.md")


def test_commands_exist() -> None:
    named = set(re.findall(r"flyball (\w+) FILE", PAGE))
    assert named == {"equilibrium", "linearize", "modes"}
    assert named <= {(c.name or c.callback.__name__) for c in app.registered_commands}
