"""The examples of docs/elements.md run and give what they say."""

from __future__ import annotations

from tests.pages import assert_examples_run


def test_examples() -> None:
    assert_examples_run("elements.md", 7)
