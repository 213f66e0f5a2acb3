"""``--without`` on the command line: what an analysis does not know is left out by name or kind, and refused messages say so."""

from __future__ import annotations

from pathlib import Path

import pytest

import flyball as fb
from tests.program.test_cli import Said


@pytest.fixture
def hung(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> fb.Mechanism:
    """A pendulum with two events, a file in the present folder."""
    monkeypatch.chdir(tmp_path)
    m = fb.Mechanism("hung", planar=True, gravity=(0, -10))
    m.add(fb.Body("rod", mass=1, inertia=0.1, position=(0, -1)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.Event("it's up", "A.angle > 1", do=fb.Stop()), fb.Event("down", "A.angle < -1"))
    m.save("hung.toml")
    return m


@pytest.mark.parametrize("words", [("equilibrium",), ("modes",), ("linearize",), ("compare", "--t-end", 0.1)])
def test_events_are_refused_with_what_to_write(hung: fb.Mechanism, words: tuple) -> None:
    hung.replace(fb.Event("it's up", "A.angle > 1", do=fb.Lock("A")))  # others are left out at rest
    hung.replace(fb.Event("down", "A.angle < -1", do=fb.Release("A")))
    hung.save("hung.toml")
    said = Said(words[0], "hung.toml", *words[1:])
    assert said.code == 2
    assert "--without \"it's up\" --without 'down'" in said.err
    assert "m.changed" not in said.err
    assert "compiling" not in said.err  # refused before that


def test_left_out_by_name_and_by_kind(hung: fb.Mechanism) -> None:
    for words in (("--without", "events"), ("--without", "it's up", "--without", "down")):
        said = Said("equilibrium", "hung.toml", *words)
        assert (said.code, "stable" in said.out) == (0, True), said.out + said.err
    wrong = Said("equilibrium", "hung.toml", "--without", "don")
    assert wrong.code == 2
    assert "has no such part (did you mean 'down'?); kinds: bodies, joints, events" in wrong.err
    hangs = Said("run", "hung.toml", "--without", "A", "--t-end", 0.1)
    assert hangs.code == 2
    assert 'Event "it\'s up"' in hangs.err
    assert "'A'" in hangs.err


def test_a_run_lists_what_happened(hung: fb.Mechanism) -> None:
    hung.add(fb.Initial("A.angle", rate=-8))
    hung.save("swung.toml")
    lines = Said("run", "swung.toml", "--t-end", 1, "--no-plots", "--no-animation").out.splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("t [s]"))
    assert lines[head].split() == ["t", "[s]", "name", "kind", "done", "lost", "[J]"]
    assert lines[head + 1].split()[1:] == ["down", "event"]
