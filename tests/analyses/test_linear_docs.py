"""The examples of docs/linear.md run and give what they say."""

from __future__ import annotations

import doctest
import re
from pathlib import Path

import pytest

from flyball.cli import app

PAGE = (Path(__file__).parents[2] / "docs" / "linear.md").read_text(encoding="utf-8")


def test_examples(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    code = re.sub(r"^```\w*$", "", PAGE, flags=re.M)
    code = re.sub(r"^>>> (\w+\.add\()", r">>> _ = \1", code, flags=re.M)  # it returns the last element
    test = doctest.DocTestParser().get_doctest(code, {}, "linear.md", None, 0)
    assert len(test.examples) > 25
    said: list[str] = []
    failed, _ = doctest.DocTestRunner(verbose=False).run(test, out=said.append)
    assert failed == 0, "".join(said)
    written = ["bode.png", "eigenvalues.png", "locus.png", "modes.html", "over_k.png", "pendulum.png"]
    assert sorted(p.name for p in tmp_path.iterdir()) == written


def test_commands_exist() -> None:
    named = set(re.findall(r"flyball (\w+) FILE", PAGE))
    assert named == {"equilibrium", "linearize", "modes"}
    assert named <= {(c.name or c.callback.__name__) for c in app.registered_commands}
