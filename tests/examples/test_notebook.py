"""The student's sheet: from the model to equations, transfer function, Bode plot and motion, run as a notebook."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

SHEET = Path(__file__).parents[2] / "examples" / "pendulum_on_a_cart.ipynb"


def lines() -> list[str]:
    cells = json.loads(SHEET.read_text(encoding="utf-8"))["cells"]
    text = "\n".join("".join(c["source"]) for c in cells if c["cell_type"] == "code")
    return [x for x in text.splitlines() if x.strip()]


def test_it_is_short_and_holds_no_output():
    assert len(lines()) < 25
    cells = json.loads(SHEET.read_text(encoding="utf-8"))["cells"]
    assert not any(c.get("outputs") for c in cells)


def test_it_runs():
    nbformat = pytest.importorskip("nbformat", reason="the sheet needs nbformat, nbclient and ipykernel: extra dev")
    nbclient = pytest.importorskip("nbclient", reason="the sheet needs nbformat, nbclient and ipykernel: extra dev")
    pytest.importorskip("ipykernel", reason="the sheet needs nbformat, nbclient and ipykernel: extra dev")
    book = nbformat.read(SHEET, as_version=4)
    nbclient.NotebookClient(book, timeout=240, kernel_name="python3").execute()
    shown = [c.outputs[-1].data for c in book.cells if c.cell_type == "code" and c.outputs]
    _, equations, transfer, bode, motion, stable = shown
    assert "cos" in str(equations)
    assert r"G(s) = \frac{- l m}{" in transfer["text/latex"]
    assert "cancelled: s**2" in transfer["text/plain"]
    assert "image/png" in bode
    assert "image/png" in motion
    assert "stable if: k > g*l*m" in stable["text/plain"]
    assert r"k > g l m" in stable["text/latex"]
