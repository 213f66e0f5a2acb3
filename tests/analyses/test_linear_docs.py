"""The examples of docs/linear.md run and give what they say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from flyball.cli import app
from tests.pages import assert_examples_run, page

PAGE = page("linear.md")


def test_examples(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert_examples_run("linear.md", 26)
    written = ["bode.png", "eigenvalues.png", "locus.png", "modes.html", "over_k.png", "pendulum.png"]
    assert sorted(p.name for p in tmp_path.iterdir()) == written


def test_commands_exist() -> None:
    named = set(re.findall(r"flyball (\w+) FILE", PAGE))
    assert named == {"equilibrium", "linearize", "modes"}
    assert named <= {(c.name or c.callback.__name__) for c in app.registered_commands}
