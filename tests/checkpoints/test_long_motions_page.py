"""The example of docs/long_motions.md runs."""

from __future__ import annotations

from tests.pages import assert_examples_run


def test_example() -> None:
    assert_examples_run("long_motions.md", 6)
