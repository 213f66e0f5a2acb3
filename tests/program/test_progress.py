"""How far an analysis is: told to a function, drawn on a terminal or in a notebook, else not a word."""

from __future__ import annotations

import io
import os
import subprocess
import sys
import types
from pathlib import Path

import pytest

import flyball as fb
from flyball import progress


def pendulum() -> fb.Mechanism:
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -9.81), parameters={"k": 50.0})
    m.add(fb.Body("rod", mass=1.0, inertia=0.1, position=(0.3, -0.4)))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.CoordinateSpring("spring", coordinate="A.angle", stiffness="k"))
    return m


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def at_once(monkeypatch):
    """A bar from the first word on."""
    monkeypatch.setattr(progress, "AFTER", 0.0)
    monkeypatch.setattr(progress, "EVERY", 0.0)


ASKED = {
    "simulating": lambda m, **o: m.simulate(20.0, rtol=1e-12, **o),
    "equilibria over k": lambda m, **o: m.equilibria("k", [40, 50, 60], **o),
    "eigenvalues over k": lambda m, **o: m.root_locus("k", [40, 50, 60], equilibrium=True, **o),
    "comparing": lambda m, **o: m.compare(0.5, repeats=1, formulations=["projection", "none"], **o),
    "optimizing": lambda m, **o: m.optimize(["A.angle_acceleration"], ["k"], target=[0.0], evaluations=5, **o),
}


@pytest.mark.parametrize("what", ASKED)
def test_a_function_hears_of_it_and_ends_near_the_end(what):
    heard: list[float] = []
    ASKED[what](pendulum(), progress=heard.append)
    assert heard
    assert heard == sorted(heard)
    assert all(0.0 <= x <= 1.0 for x in heard)
    assert what == "optimizing" or heard[-1] == 1.0


@pytest.mark.parametrize("what", ["equilibria over k", "eigenvalues over k"])
def test_a_terminal_shows_a_bar_and_then_none(what, at_once, monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    ASKED[what](pendulum())
    said = sys.stderr.getvalue()
    assert what in said
    assert "33 %" in said
    assert said.endswith(("\x1b[2K", "\x1b[?25h"))  # the line is erased, the cursor is back


def test_nothing_is_said_elsewhere_or_if_not_wanted(at_once, monkeypatch, capsys):
    ASKED["equilibria over k"](pendulum())
    out = capsys.readouterr()
    assert (out.out, out.err) == ("", "")
    monkeypatch.setattr(sys, "stderr", Terminal())
    ASKED["equilibria over k"](pendulum(), progress=False)
    assert sys.stderr.getvalue() == ""


def test_short_analyses_have_no_bar(monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.delitem(sys.modules, "rich.progress", raising=False)
    pendulum().simulate(0.1)
    assert sys.stderr.getvalue() == ""
    assert "rich.progress" not in sys.modules


def test_a_notebook_shows_a_bar_without_widgets(at_once, monkeypatch):
    shown: list[str] = []

    class Handle:
        def update(self, html: str) -> None:
            shown.append(html)

    display = types.SimpleNamespace(HTML=str, display=lambda html, display_id: shown.append(html) or Handle())
    shell = types.SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: shell, display=display))
    ASKED["equilibria over k"](pendulum())
    assert shown[0] == ""
    assert '<progress max="1" value="0.333">' in shown[1]
    assert shown[-1] == ""


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_the_bar_is_gone_after_an_interrupt_and_the_motion_up_to_then_is_kept(error, at_once, monkeypatch):
    """Ctrl-C may come while the bar is drawn."""
    monkeypatch.setattr(sys, "stderr", Terminal())
    drawn = progress._Terminal.draw

    def draw(self, fraction: float, note: str) -> None:
        drawn(self, fraction, note)
        raise error

    monkeypatch.setattr(progress._Terminal, "draw", draw)
    if error is KeyboardInterrupt:
        with pytest.raises(fb.Interrupted) as ended:
            pendulum().simulate(50.0, rtol=1e-12, max_step=1e-4)
        r = ended.value.result
        assert not r.health.success
        assert 0.0 < r.final[0] < 50.0
        assert "interrupted" in r.health.message
    else:
        with pytest.raises(ValueError):
            pendulum().simulate(50.0, rtol=1e-12, max_step=1e-4)
    assert sys.stderr.getvalue().endswith(("\x1b[2K", "\x1b[?25h"))


ROOT = Path(__file__).parents[2]
SCRIPT = """
import sys
from flyball import progress
progress.AFTER = 0.05
from tests.program.test_progress import pendulum
pendulum().simulate(10.0, rtol=1e-12, max_step=1e-4)
print("done")
"""


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs a pseudo-terminal")
def test_a_script_shows_it_on_a_terminal_only():
    """Standard error of a process: a pseudo-terminal gets the bar, a pipe nothing; standard output never anything."""
    plain = subprocess.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, timeout=240, check=True, cwd=ROOT
    )
    assert (plain.stdout, plain.stderr) == ("done\n", "")
    ours, theirs = os.openpty()
    try:
        with subprocess.Popen(
            [sys.executable, "-c", SCRIPT], stdout=subprocess.PIPE, stderr=theirs, text=True, cwd=ROOT
        ) as run:
            os.close(theirs)
            said = b""
            while chunk := _read(ours):
                said += chunk
            assert run.stdout is not None
            assert run.stdout.read() == "done\n"
    finally:
        os.close(ours)
    assert b"simulating" in said


def _read(terminal: int) -> bytes:
    try:
        return os.read(terminal, 4096)
    except OSError:  # the other end is closed
        return b""
