"""The examples of docs/prepared.md, stepper.md and sensitivity.md run and give what they say."""

from __future__ import annotations

from tests.pages import assert_examples_run


def test_examples() -> None:
    assert_examples_run("prepared.md", 20)
    assert_examples_run("stepper.md", 8)
    assert_examples_run("sensitivity.md", 8)
