"""Sensitivities and optimisation as commands and pictures."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from flyball.cli import app
from tests.analyses.test_sensitivity import slider_crank


def said(*words: object) -> tuple[int, str, str]:
    ended = CliRunner().invoke(app, [str(w) for w in words])
    if ended.exception is not None and not isinstance(ended.exception, SystemExit):
        raise ended.exception
    return ended.exit_code, ended.stdout, ended.stderr


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    slider_crank().save("crank.toml")
    return tmp_path


def test_derivatives_of_an_instant(here: Path) -> None:
    code, out, err = said(
        "sensitivity", "crank.toml", "--of", "slider.x", "--t", "130 ms", "--verify", "--plot", "bars.png"
    )
    assert code == 0, err
    assert "differences" in out
    assert (here / "bars.png").stat().st_size > 5_000
    code, out, _ = said("sensitivity", "crank.toml", "--of", "slider.x", "--to", "l", "--t", 0.13, "--json")
    data = json.loads(out)
    r, l, s = 0.2, 0.5, np.sin(1.3)
    wanted = l / np.sqrt(l * l - (r * s) ** 2)
    assert data["quantities"]["slider.x"]["derivatives"]["l"] == pytest.approx([wanted])


def test_derivatives_of_a_motion_and_of_eigenvalues_are_drawn(here: Path) -> None:
    s = slider_crank().sensitivity(["slider.x", "B.fx"], analysis="motion", t_end=0.6, outputs=5)
    s.plot(here / "motion.svg")
    assert (here / "motion.svg").read_text().count("one percent") == 2
    assert s.plot() is not None


def test_wrong_names_end_with_a_message(here: Path) -> None:
    code, _, err = said("sensitivity", "crank.toml", "--of", "slider.x", "--to", "L")
    assert (code, "no parameter 'L'" in err) == (2, True)


def test_optimising_from_the_command_line(here: Path) -> None:
    code, out, err = said(
        "optimize", "crank.toml", "--of", "slider.x", "--to", "l=0.3:1", "--target", 0.7, "--t", 0, "--json"
    )
    assert code == 0, err
    assert json.loads(out)["parameters"]["l"] == pytest.approx(0.5)
    times = np.linspace(0, 0.6, 7)
    r, l = 0.15, 0.55
    x = r * np.cos(10 * times) + np.sqrt(l * l - (r * np.sin(10 * times)) ** 2)
    np.savetxt("wanted.csv", x, header="slider.x", comments="", delimiter=",")
    code, out, err = said(
        "optimize", "crank.toml", "--of", "slider.x", "--to", "l", "--to", "r", "--target", "wanted.csv", "--analysis",
        "motion", "--t-end", "600 ms",
    )  # fmt: skip
    assert code == 0, err
    assert "r: 0.2 -> 0.15" in out
    code, _, err = said("optimize", "crank.toml", "--of", "slider.x", "--to", "l=3", "--target", 1)
    assert (code, "name=low:high" in err) == (2, True)
    code, _, err = said("optimize", "crank.toml", "--of", "slider.x", "--to", "l", "--target", "wide.csv")
    assert (code, "cannot read 'wide.csv'" in err) == (2, True)
